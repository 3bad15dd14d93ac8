"""Clusters contain every triangle once, and culling drops only clusters of which nothing would be drawn."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from glshadow.core.spaces import CLIP_SPACES, Array, ClipSpace, orthographic, rigid_inverse, view_axes
from glshadow.derive.occlusion import BLOCK, behind, farthest
from glshadow.geometry.clusters import LEAST, SIZE, Placed, make_clusters, place
from glshadow.geometry.frustum import extents, in_frustum
from glshadow.gl.scene.runs import runs_of
from glshadow.scenes import shapes
from glshadow.shadows.view import FACES, ShadowView


def soup(rng: np.random.Generator, count: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Triangles of all sizes with shared vertices, in random order."""
    positions = (rng.normal(size=(count + 2, 3)) * rng.uniform(1e-3, 1.0, (count + 2, 1))).astype(np.float32)
    return positions, rng.integers(0, len(positions), (count, 3), dtype=np.int32)


def members(order: NDArray[np.uint32], count: int) -> list[NDArray[np.uint32]]:
    return [order] if count <= LEAST else [order[k : k + SIZE] for k in range(0, count, SIZE)]


@pytest.mark.parametrize("count", [1, 2, SIZE, LEAST, LEAST + 1, 3 * SIZE, 5000])
def test_every_triangle_is_in_one_cluster_and_inside_its_box(rng: np.random.Generator, count: int) -> None:
    positions, triangles = soup(rng, count)
    clusters = make_clusters(positions, triangles)
    np.testing.assert_array_equal(np.sort(clusters.order), np.arange(count))
    groups = members(clusters.order, count)
    assert clusters.count == len(groups)
    for k, group in enumerate(groups):
        assert (np.diff(group.astype(np.int64)) > 0).all()
        points = positions[triangles[group]].astype(np.float64).reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        np.testing.assert_allclose(clusters.centre[k] - clusters.half[k], low, rtol=0, atol=1e-15)
        np.testing.assert_allclose(clusters.centre[k] + clusters.half[k], high, rtol=0, atol=1e-15)


def test_sphere_is_split_into_small_clusters() -> None:
    """Area 4 pi in C pieces of side about sqrt(4 pi / C). A view of one half needs half of them and those on the border, a band two
    sides wide, which (Archimedes) is that width / 2 of the ball."""
    positions, triangles = shapes.icosphere(5, 1.0)
    clusters = make_clusters(positions.astype(np.float32), triangles.astype(np.int32))
    side = np.sqrt(4.0 * np.pi / clusters.count)
    assert np.median(2.0 * clusters.half.max(axis=1)) < 2.0 * side
    placed = at(clusters, [np.eye(4)])
    clip = orthographic(0.0, 2.0, -1.0, 1.0, -2.0, 2.0)
    seen = in_frustum(placed, clip, extents(placed, clip, clip[None]))
    assert 0.5 <= seen.mean() < 0.5 + side


def test_triangles_in_one_cell_keep_the_file_order() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
    triangles = np.tile(np.arange(3, dtype=np.int32), (1000, 1))
    np.testing.assert_array_equal(make_clusters(positions, triangles).order, np.arange(1000))


def at(clusters: object, matrices: list[Array]) -> Placed:
    return place([clusters], [0] * len(matrices), np.stack(matrices), np.stack([m[:3, :3] for m in matrices]))  # type: ignore[list-item]


def hostile(rng: np.random.Generator) -> Array:
    """Rotated, stretched, mirrored, flattened, tiny or far away."""
    matrix = np.eye(4)
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix[:3, :3] = turned * rng.choice([1.0, -1.0, 1e-6, 10.0, 0.0], size=3, p=[0.4, 0.3, 0.1, 0.15, 0.05])
    matrix[:3, 3] = rng.normal(size=3) * rng.choice([0.0, 1.0, 1e4])
    return matrix * np.array([[rng.choice([1.0, 1e-6])]] * 3 + [[1.0]])


def random_view(rng: np.random.Generator, clip: ClipSpace, resolution: int = 64) -> ShadowView:
    kind = rng.choice(["orthographic", "perspective", "cube"])
    axes = view_axes(rng.normal(size=3)) if kind != "cube" else FACES[rng.integers(6)]
    window = (-1.0, 1.0, -1.0, 1.0) if kind == "cube" else tuple(np.array([-1.0, 1.0, -1.0, 1.0]) * rng.uniform(0.1, 2))
    near, far = (-3.0, 5.0) if kind == "orthographic" else (0.05, 9.0)
    return ShadowView(kind, 0, rigid_inverse(axes, rng.normal(size=3)), window, near, far, clip, resolution)


def drawn(view: ShadowView, matrix: Array, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Clip coordinates (..., 4) as float32 computes them."""
    clip = (view.clip_from_world @ matrix).astype(np.float32)
    return points @ clip[:, :3].T + clip[:, 3]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_culled_clusters_lie_beyond_one_frustum_plane(seed: int) -> None:
    """By the float32 corners of every triangle: all beyond one side of the view, so that clipping leaves nothing."""
    rng = np.random.default_rng(seed)
    positions, triangles = soup(rng, 600)
    clusters = make_clusters(positions, triangles)
    matrix, view = hostile(rng), random_view(rng, CLIP_SPACES[rng.integers(4)])
    placed = at(clusters, [matrix])
    seen = in_frustum(
        placed, view.clip_from_world, extents(placed, view.clip_from_world, (view.clip_from_world @ matrix)[None])
    )
    corners = drawn(view, matrix, positions[triangles])
    x, y, w = corners[..., 0], corners[..., 1], corners[..., 3]
    for k, group in enumerate(members(clusters.order, 600)):
        if not seen[k]:
            beyond = [(side[group] > w[group]).all() for side in (x, -x, y, -y)]
            assert any(beyond) or (w[group] < 0.0).all()


def test_farthest_depth_of_tiles(rng: np.random.Generator) -> None:
    for side, reversed_depth in ((3 * BLOCK, False), (3 * BLOCK + 5, True), (4, False)):
        depth = rng.uniform(size=(side, side)).astype(np.float32)
        found = farthest(depth, reversed_depth)
        sign = -1.0 if reversed_depth else 1.0
        blocks = -(-side // BLOCK)
        for level, (start, width) in enumerate(zip(found.start, found.side, strict=True)):
            size = BLOCK << level
            for y in range(-(-blocks >> level)):
                for x in range(-(-blocks >> level)):
                    part = depth[y * size : (y + 1) * size, x * size : (x + 1) * size]
                    if part.size:
                        assert found.values[start + y * width + x] == (sign * part).max()
        assert found.side[-1] == 1


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_occluded_clusters_lie_behind_every_texel_they_touch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions, triangles = soup(rng, 600)
    clusters = make_clusters(positions, triangles)
    view = random_view(rng, CLIP_SPACES[rng.integers(4)])
    matrix = np.eye(4)
    matrix[:3, :3] *= 0.3
    placed = at(clusters, [matrix])
    bounds = extents(placed, view.clip_from_world, (view.clip_from_world @ matrix)[None])
    # depth of a wall somewhere among the triangles, with holes
    corners = drawn(view, matrix, positions[triangles]).astype(np.float64)
    ahead = corners[corners[..., 3] > 1e-3]
    window = np.quantile(ahead[:, 2] / ahead[:, 3], rng.uniform(0.1, 0.9)) if len(ahead) else 0.5
    if not view.clip.zero_to_one:
        window = 0.5 * window + 0.5
    depth = np.full((64, 64), np.clip(window, 0.0, 1.0), dtype=np.float32)
    depth[rng.uniform(size=depth.shape) < 0.01] = view.clip.clear_depth
    gone = behind(view, bounds, farthest(depth, view.clip.reversed), 0.0)
    sign = view.clip.sign
    for k, group in enumerate(members(clusters.order, 600)):
        if not gone[k]:
            continue
        mine = corners[group].reshape(-1, 4)
        assert (mine[:, 3] > 0.0).all()
        texel = np.clip((0.5 * mine[:, :2] / mine[:, 3:] + 0.5) * 64.0, 0.0, 63.0).astype(int)
        low, high = texel.min(axis=0), texel.max(axis=0)
        stored = mine[:, 2] / mine[:, 3]
        stored = np.clip(stored if view.clip.zero_to_one else 0.5 * stored + 0.5, 0.0, 1.0)
        assert (sign * stored).min() > (sign * depth[low[1] : high[1] + 1, low[0] : high[0] + 1]).max()


def test_wall_occludes_half_of_a_ball() -> None:
    """All clusters behind the wall, except a layer of clusters two sides deep: see above."""
    positions, triangles = shapes.icosphere(5, 1.0)
    placed = at(make_clusters(positions.astype(np.float32), triangles.astype(np.int32)), [np.eye(4)])
    view = ShadowView("orthographic", 0, np.eye(4), (-1.5, 1.5, -1.5, 1.5), -2.0, 2.0, ClipSpace(True, False), 256)
    bounds = extents(placed, view.clip_from_world, view.clip_from_world[None])
    wall = np.full((256, 256), 0.5, dtype=np.float32)
    side = np.sqrt(4.0 * np.pi / placed.count)
    assert 0.5 - side < behind(view, bounds, farthest(wall, False), 0.0).mean() < 0.5
    assert not behind(view, bounds, farthest(np.ones_like(wall), False), 0.0).any()


def test_runs_end_with_their_body(rng: np.random.Generator) -> None:
    first = np.array([0, 3, 4, 9])
    for drawn_ in (np.ones(9, dtype=bool), np.zeros(9, dtype=bool), rng.uniform(size=9) < 0.6):
        starts, ends = runs_of(drawn_, first)
        inside = np.zeros(9, dtype=int)
        for start, end in zip(starts, ends, strict=True):
            inside[start:end] += 1
            assert np.searchsorted(first, start, side="right") == np.searchsorted(first, end - 1, side="right")
        np.testing.assert_array_equal(inside, drawn_)
    assert len(runs_of(np.ones(9, dtype=bool), first)[0]) == 3
