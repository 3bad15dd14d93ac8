"""Per-cell triangle lists built on the CPU: conservative, of the expected length, culled and masked correctly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from glshadow.core.spaces import Array, transform
from glshadow.derive.cells import CASTS, CULL_BACK, CULL_FRONT, CellLists, cell_lists
from glshadow.derive.lists import LEAST_CELLS, MOST, RATIO, ListGrid, facets, list_grid
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight

from ..cell_lists import held, receiver_cells, walked

ENOUGH = 1 << 24
COUNT = 3000


@dataclass(frozen=True, eq=False)
class Built:
    """Triangles (T, 3, 3) in the light's frame, float32, with their lists."""

    grid: ListGrid
    corners: NDArray[np.float32]
    lists: CellLists


def built(light: Light, triangles: Array, flags: int = CASTS, halvings: int = 0) -> Built:
    grid = list_grid(light, triangles.reshape(-1, 3), halvings)
    vertices = transform(grid.view_from_world, triangles.reshape(-1, 3)).astype(np.float32)
    numbers = np.arange(len(vertices)).reshape(-1, 3)
    count = len(numbers)
    none = np.zeros(count, dtype=np.uint32)
    lists = cell_lists(grid, vertices, vertices, np.eye(3), numbers, np.full(count, flags), none, ENOUGH)
    return Built(grid, vertices[numbers], lists)


def scattered(rng: np.random.Generator, count: int, spread: float = 2.0) -> Array:
    """Triangles (T, 3, 3) from a ten-thousandth of the scene to larger than it, compact and slivers."""
    middle = rng.uniform(-spread, spread, (count, 1, 3))
    size = 10.0 ** rng.uniform(-4.0, 1.0, (count, 1, 1))
    shape = rng.normal(size=(count, 3, 3))
    thin = rng.random(count) < 0.3
    along = shape[thin, 0] + rng.uniform(0.0, 1.0, (thin.sum(), 1)) * (shape[thin, 1] - shape[thin, 0])
    shape[thin, 2] = along + 1e-3 * shape[thin, 2]
    return middle + size * shape


LIGHTS: dict[str, Light] = {
    "sun": DirectionalLight(direction=(-0.5, -0.8, 0.3)),
    "low sun": DirectionalLight(direction=(1.0, -0.02, 0.3)),
    "spot": SpotLight(position=(1.0, 60.0, 1.0), direction=(0.0, -1.0, 0.1), outer_angle=40.0),
    "wide spot among them": SpotLight(position=(0.1, 0.2, 0.1), direction=(0.3, -1.0, 0.2), outer_angle=80.0),
    "point": PointLight(position=(0.2, -0.3, 0.1)),
    "point far away": PointLight(position=(90.0, 200.0, 50.0)),
}


@pytest.mark.parametrize("halvings", [0, 4])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_every_triangle_hit_by_a_ray_is_in_its_cell(rng: np.random.Generator, name: str, halvings: int) -> None:
    """Receivers behind points of the triangles, vertices and edges included, find them with the shader's own float32 arithmetic."""
    triangles = scattered(rng, COUNT)
    triangles[0] = [[-40.0, 0.3, -40.0], [40.0, 0.3, -40.0], [0.0, 0.3, 40.0]]  # larger than the scene
    if isinstance(light := LIGHTS[name], PointLight | SpotLight):
        near = np.arange(1, 300)  # some that cross the light's plane beside it
        triangles[near] = np.asarray(light.position) + rng.normal(size=(len(near), 3, 3)) * 10.0 ** rng.uniform(
            -3.0, 0.5, (len(near), 1, 1)
        )
    made = built(light, triangles, halvings=halvings)
    grid, lists = made.grid, walked(made.grid, made.lists.heads, made.lists.links)
    weights = rng.dirichlet((0.4, 0.4, 0.4), (COUNT, 40))
    weights[:, :3] = np.eye(3)
    weights[:, 3:9, 2] = 0.0
    weights /= weights.sum(axis=2, keepdims=True)
    points = np.einsum("tkc,tci->tki", weights, made.corners.astype(np.float64))
    behind = rng.choice([1.0, 1.001, 1.5, 4.0], (COUNT, 40, 1))
    points = points - [0.0, 0.0, 1.0] * (behind - 1.0) if grid.projection == "orthographic" else points * behind
    receivers = points.reshape(-1, 3).astype(np.float32)
    triangle = np.repeat(np.arange(COUNT), 40)
    inside, face, x, y, depth = receiver_cells(grid, receivers)
    tested = inside & made.lists.facets[triangle, :, 3].any(axis=1)
    assert tested.sum() > 10 * COUNT
    missed = ~held(lists, grid, face, x, y, triangle) & tested
    assert not missed.any(), f"{missed.sum()} of {tested.sum()}, triangles {np.unique(triangle[missed])[:5]}"
    least = np.array([lists.depth[f, t] for f, t in zip(face[tested], triangle[tested], strict=True)])
    assert (least <= depth[tested]).all()
    assert len(lists.fine) > 0
    assert len(lists.coarse) > 0


@pytest.mark.parametrize("kind", ["sun", "point"])
def test_list_lengths_match_the_covered_cells(rng: np.random.Generator, kind: str) -> None:
    """Of shapes anywhere in a grid of squares of side s: area + s (width + height) + s^2 of each, by Minkowski's sum."""
    count, size = 20_000, 0.02
    middle = rng.uniform(-0.9, 0.9, (count, 1, 3))
    shape = rng.uniform(-size, size, (count, 3, 3))
    if kind == "sun":
        made = built(DirectionalLight(direction=(0.0, 0.0, -1.0)), middle + shape)
        place = made.corners[..., :2].astype(np.float64)
    else:  # in one face of the six, in a plane at depth 2, away from the face's border
        middle[..., 2], shape[..., 2] = -2.0, 0.0
        around = np.array([[[-9.0, 0.0, 9.0], [0.0, 9.0, 9.0], [9.0, 0.0, 9.0]]])
        made = built(PointLight(position=(0.0, 0.0, 0.0)), np.concatenate([middle + shape, around]))
        assert made.grid.projection == "cube"
        place = made.corners[:-1, :, :2].astype(np.float64) / 2.0
    place = place * np.array(made.grid.cells_from_window[:2])
    side = 1.0 + 2.0 / 64.0  # a cell and its margin
    a, b = place[:, 1] - place[:, 0], place[:, 2] - place[:, 0]
    area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    expected = (area + side * np.ptp(place, axis=1).sum(axis=1) + side**2).sum()
    lists = walked(made.grid, made.lists.heads, made.lists.links)
    found = (lists.fine & np.uint64(0xFFFFFFFF) < count).sum()
    # the count of one shape differs by half of itself from place to place: three deviations of the mean of 20,000. Without the margin
    # it would be off by .03
    assert abs(found / expected - 1.0) < 3.0 * 0.5 / np.sqrt(count)


def test_lists_have_the_documented_layout(rng: np.random.Generator) -> None:
    made = built(LIGHTS["point"], scattered(rng, 500))
    grid, lists = made.grid, made.lists
    assert lists.heads.shape == (6 * (grid.cells + grid.cells // RATIO), grid.cells)
    assert lists.count == len(lists.links)
    # the entries of a list are contiguous in memory
    following = lists.links[:, 1] != 0
    np.testing.assert_array_equal(lists.links[following, 1], np.flatnonzero(following) + 2)
    assert (lists.heads > 0).sum() == (~following).sum()
    seen = walked(grid, lists.heads, lists.links)
    assert len(seen.fine) + len(seen.coarse) == lists.count
    np.testing.assert_array_equal(
        lists.facets, facets(*[made.corners.astype(np.float64)] * 2, np.eye(3)).astype(np.float32)
    )


def test_large_triangles_go_to_coarse_cells(rng: np.random.Generator) -> None:
    """No triangle has many more entries than MOST fine cells, or than all coarse cells."""
    made = built(LIGHTS["sun"], scattered(rng, 2000))
    triangles, entries = np.unique(made.lists.links[:, 0], return_counts=True)
    assert len(triangles) > 1900
    assert entries.max() <= max((made.grid.cells // RATIO) ** 2, 1.5 * MOST)


def test_count_beyond_the_limit_is_returned_without_entries(rng: np.random.Generator) -> None:
    triangles = scattered(rng, 500)
    made = built(LIGHTS["sun"], triangles)
    numbers, none = np.arange(1500).reshape(-1, 3), np.zeros(500, dtype=np.uint32)
    few = cell_lists(
        made.grid,
        *[made.corners.reshape(-1, 3)] * 2,
        np.eye(3),
        numbers,
        np.full(500, CASTS),
        none,
        made.lists.count - 1,
    )
    assert few.count == made.lists.count
    assert len(few.links) == 0


# -- casters

UP = np.array([[[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])  # its front is seen from above
FRAME = np.array([[[-2.0, -3.0, 2.0], [2.0, -3.0, 2.0], [0.0, -3.0, -2.0]]])


@pytest.mark.parametrize("light", [DirectionalLight(direction=(0.1, -1.0, 0.0)), PointLight(position=(0.1, 1.0, 0.0))])
@pytest.mark.parametrize(
    ("flags", "front", "back"),
    [(CASTS, 1, 1), (CASTS | CULL_BACK, 1, 0), (CASTS | CULL_FRONT, 0, 1), (0, 0, 0), (CULL_BACK, 0, 0)],
)
def test_culled_sides_and_non_casters_are_omitted(light: Light, flags: int, front: int, back: int) -> None:
    for triangles, expected in ((UP, front), (UP[:, ::-1], back)):
        made = built(light, np.concatenate([triangles, FRAME]), flags)
        assert (made.lists.links[:, 0] == 0).any() == bool(expected)


def test_edge_on_triangles_are_kept() -> None:
    """Rounding decides which side faces the light."""
    upright = np.array([[[0.0, -1.0, -1.0], [0.0, -1.0, 1.0], [0.0, 1.0, 0.0]]])
    for flags in (CASTS | CULL_BACK, CASTS | CULL_FRONT):
        made = built(DirectionalLight(direction=(0.0, -1.0, 0.0)), np.concatenate([upright, FRAME]), flags)
        assert (made.lists.links[:, 0] == 0).any()


def test_triangles_without_area_are_in_no_list() -> None:
    line = np.array([[[0.0, 0.0, 0.0], [0.25, 0.5, 1.0], [0.25, 0.5, 1.0]]])
    made = built(LIGHTS["sun"], np.concatenate([line, FRAME, np.zeros((1, 3, 3))]))
    assert set(made.lists.links[:, 0].tolist()) == {1}


def test_masks_go_with_their_triangles(rng: np.random.Generator) -> None:
    made = built(LIGHTS["spot"], scattered(rng, 300))
    numbers, masks = np.arange(900).reshape(-1, 3), rng.integers(0, 99, 300).astype(np.uint32)
    lists = cell_lists(
        made.grid, *[made.corners.reshape(-1, 3)] * 2, np.eye(3), numbers, np.full(300, CASTS), masks, ENOUGH
    )
    np.testing.assert_array_equal(lists.links[:, 3], masks[lists.links[:, 0]])


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e9])
@pytest.mark.parametrize("name", ["sun", "wide spot among them", "point"])
def test_lists_are_invariant_to_scale(rng: np.random.Generator, name: str, scale: float) -> None:
    """To the bit, if the scale is a power of two."""
    light = LIGHTS[name]
    triangles = scattered(rng, 500)
    power = 2.0 ** np.round(np.log2(scale))
    usual = built(light, triangles)
    if not isinstance(light, DirectionalLight):
        light = replace(light, position=tuple(power * np.asarray(light.position)))
    scaled = built(light, power * triangles)
    np.testing.assert_array_equal(scaled.lists.links[:, :2], usual.lists.links[:, :2])
    np.testing.assert_array_equal(scaled.lists.heads, usual.lists.heads)


def test_no_casters_give_empty_lists() -> None:
    made = built(LIGHTS["point"], UP, 0)
    assert made.lists.count == 0
    assert not made.lists.heads.any()
    assert made.grid.cells >= LEAST_CELLS
