"""Rays to a sky against what is near a receiver, beside its maps: hollow boxes, thin walls, sheets, an object far away, and the lists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.derive.near_casters import near_casters
from glshadow.scenes import shapes

FINE = (320, 240)
SMALL = (96, 72)
INSIDE = gs.PerspectiveCamera((3.5, 3.0, 3.5), (-1.0, 1.0, -1.0), fov_y=80.0)
ALL = ("visibility", "triangle")


def slab(low: tuple[float, float, float], high: tuple[float, float, float]) -> gs.Node:
    a, b = np.array(low), np.array(high)
    middle, size = 0.5 * (a + b), b - a
    return gs.Node(gs.Mesh(*shapes.box((size[0], size[1], size[2]), (middle[0], middle[1], middle[2]))))


def hollow_box(wall: float, window: float = 0.0) -> gs.Scene:
    """8 x 4 x 8, closed but for a window in the roof."""
    t, w = 4.0 + wall, window
    nodes = [
        slab((-t, -wall, -t), (t, 0.0, t)),
        slab((-t, 0.0, -t), (-4.0, 4.0, t)),
        slab((4.0, 0.0, -t), (t, 4.0, t)),
        slab((-4.0, 0.0, -t), (4.0, 4.0, -4.0)),
        slab((-4.0, 0.0, 4.0), (4.0, 4.0, t)),
    ]
    if not window:
        return gs.Scene([*nodes, slab((-t, 4.0, -t), (t, t, t))])
    top = 4.0 + wall
    roof = [
        slab((-t, 4.0, -t), (-w, top, t)),
        slab((w, 4.0, -t), (t, top, t)),
        slab((-w, 4.0, -t), (w, top, -w)),
        slab((-w, 4.0, w), (w, top, t)),
    ]
    return gs.Scene([*nodes, *roof])


def errors(scene: gs.Scene, camera: gs.Camera, frame: gs.Frame, share: float) -> Array:
    """At a random share of the pixels that face the light, against 1,024 rays."""
    chosen = np.random.default_rng(3).uniform(size=frame.triangle.shape) < share
    surface = np.where(chosen, frame.triangle, -1)
    light = gs.SkyLight()
    truth = gs.trace(scene, camera, [light], frame.triangle.shape[::-1], surface=surface, light_samples=1024, samples=1)
    gap = frame.visibility[0] - truth.visibility[0]
    return np.asarray(gap[np.isfinite(gap)])


@pytest.mark.parametrize("size", [SMALL, FINE])
@pytest.mark.parametrize("scene", [gs.Scene([gs.Node(gs.Mesh(*shapes.box((8.0, 4.0, 8.0), (0.0, 2.0, 0.0))))]), hollow_box(0.05),
    hollow_box(0.5)],
                         ids=["sheets", "thin", "thick"])  # fmt: skip
def test_closed_box_is_dark(renderer: gs.Renderer, scene: gs.Scene, size: tuple[int, int]) -> None:
    """What is left comes through walls farther than four texels at grazing angles: .004 at 640 x 480. Maps alone: up to .7."""
    frame = renderer.render(scene, INSIDE, [gs.SkyLight()], size, samples=1, outputs=ALL)
    assert (frame.triangle >= 0).all()
    assert frame.visibility[0].max() < 0.01


@pytest.mark.parametrize(("scale", "shift"), [(1e-6, 0.0), (1.0, 1e7)])
def test_closed_box_is_dark_at_any_scale_and_place(renderer: gs.Renderer, scale: float, shift: float) -> None:
    mesh = gs.Mesh(*shapes.box((8.0, 4.0, 8.0), (0.0, 2.0, 0.0)))
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = shift
    eye, target = ((np.array(at) * scale + shift).tolist() for at in (INSIDE.position, INSIDE.target))
    camera = gs.PerspectiveCamera(tuple(eye), tuple(target), fov_y=80.0)
    frame = renderer.render(gs.Scene([gs.Node(mesh, matrix)]), camera, [gs.SkyLight()], SMALL, samples=4)
    assert frame.visibility[0].max() < 0.01


def test_hollow_box_with_a_window_has_no_steps(renderer: gs.Renderer) -> None:
    """A direction is 1/1024 of the light, twice that on a floor. Of 256 directions: mean .003, steps of .012."""
    scene, camera = hollow_box(0.3, 0.6), gs.PerspectiveCamera((0.0, 2.5, 3.8), (0.0, 1.2, -2.0), fov_y=75.0)
    frame = renderer.render(scene, camera, [gs.SkyLight()], FINE, samples=1, outputs=ALL)
    assert frame.used[0].filter == gs.DirectionMaps(1024)
    assert np.abs(errors(scene, camera, frame, 0.02)).mean() < 0.0022
    floor = frame.visibility[0][170:, 20:-20]
    assert floor.mean() > 0.01
    assert np.percentile(np.abs(np.diff(floor, axis=1)), 99.5) < 3.0 / 1024


def test_corner_of_two_sheets_is_darkest_in_the_corner(renderer: gs.Renderer) -> None:
    """Maps alone: .25 too bright within a texel of the corner. Steps of 1/1024 aside, error is that of a texel at the sheets' far edges."""
    sides = [
        ((-10.0, 0.0, 10.0), (20.0, 0.0, 0.0), (0.0, 0.0, -20.0)),
        ((-10.0, 0.0, -3.0), (20.0, 0.0, 0.0), (0.0, 8.0, 0.0)),
        ((-3.0, 0.0, 10.0), (0.0, 0.0, -20.0), (0.0, 8.0, 0.0)),
    ]
    scene = gs.Scene([gs.Node(gs.Mesh(*shapes.rectangle(*side))) for side in sides])
    camera = gs.PerspectiveCamera((4.0, 5.0, 6.0), (-2.0, 1.0, -2.0))
    frame = renderer.render(scene, camera, [gs.SkyLight()], FINE, samples=1, outputs=ALL)
    gap = errors(scene, camera, frame, 0.02)
    assert np.abs(gap).mean() < 0.007  # 1,024 random rays: .006 of a pixel
    assert np.abs(gap).max() < 0.06


def small_box(far: list[gs.Node]) -> gs.Scene:
    floor = gs.Node(gs.Mesh(*shapes.rectangle((-30.0, 0.0, 30.0), (60.0, 0.0, 0.0), (0.0, 0.0, -60.0))))
    return gs.Scene([floor, slab((-0.5, 0.0, -0.5), (0.5, 1.0, 0.5)), *far])


def test_object_far_away_leaves_the_contact_shadow(renderer: gs.Renderer) -> None:
    """A texel is then 11 units wide."""
    camera = gs.PerspectiveCamera((2.0, 1.5, 3.0), (0.0, 0.3, 0.0))
    near = renderer.render(small_box([]), camera, [gs.SkyLight()], FINE, samples=1)
    far = renderer.render(
        small_box([slab((900.0, 0.0, 900.0), (901.0, 1.0, 901.0))]), camera, [gs.SkyLight()], FINE, samples=1
    )
    gap = np.abs(far.visibility[0] - near.visibility[0])
    assert np.nanmin(near.visibility[0]) < 0.6
    assert np.nanmean(gap) < 0.004
    assert np.nanpercentile(gap, 99.0) < 0.04
    assert far.used[0].fallbacks == ()


def test_fine_object_far_away_is_reported(renderer: gs.Renderer) -> None:
    ball = gs.Node(gs.Mesh(*shapes.icosphere(4, 0.5)))
    alone = renderer.render(
        gs.Scene([slab((-1.0, -1.0, -1.0), (1.0, -0.5, 1.0)), ball]), None, [gs.SkyLight()], SMALL, samples=1
    )
    far = renderer.render(
        small_box([ball, slab((900.0, 0.0, 900.0), (901.0, 1.0, 901.0))]), None, [gs.SkyLight()], SMALL, samples=1
    )
    assert alone.used[0].fallbacks == ()
    (text,) = far.used[0].fallbacks
    assert "casting nodes are smaller than 4 texels of the maps, which are 1" in text
    assert "give a larger Shadow.resolution" in text


def test_image_does_not_depend_on_the_one_before(renderer: gs.Renderer) -> None:
    scene, camera = hollow_box(0.3, 0.6), gs.PerspectiveCamera((0.0, 2.5, 3.8), (0.0, 1.2, -2.0), fov_y=75.0)
    light = gs.SkyLight()
    renderer.render(scene, INSIDE, [light], SMALL, samples=4)
    after = renderer.render(scene, camera, [light], FINE, samples=4)
    with gs.Renderer() as fresh:
        alone = fresh.render(scene, camera, [replace(light)], FINE, samples=4)
    np.testing.assert_array_equal(after.image, alone.image)
    np.testing.assert_array_equal(after.visibility, alone.visibility)


def distances(point: Array, corners: Array) -> Array:
    """Least distances from a point to many points of each triangle (T, 3, 3), a little too large."""
    steps = np.linspace(0.0, 1.0, 40)
    u, v = np.meshgrid(steps, steps)
    inside = u + v <= 1.0
    weights = np.stack([1.0 - u[inside] - v[inside], u[inside], v[inside]], axis=-1)
    return np.asarray(np.linalg.norm(weights @ corners - point, axis=-1).min(axis=1))


def test_cells_list_all_that_is_near() -> None:
    random = np.random.default_rng(5)
    corners = random.uniform(-1.0, 1.0, (30, 1, 3)) + random.uniform(-1.0, 1.0, (30, 3, 3)) * random.choice(
        [0.05, 1.0], (30, 1, 1)
    )
    near = near_casters(corners, 0.05, True)
    assert near is not None
    assert near.complete
    for point in random.uniform(-1.0, 1.0, (200, 3)):
        x, y, z = np.clip(np.floor((point - near.low) / near.cell), 0, np.array(near.shape) - 1).astype(int)
        first, count = near.heads[(z * near.shape[1] + y) * near.shape[0] + x].astype(np.int64)
        assert count >> 31 == 1
        listed = near.links[first : first + (count & 0x7FFFFFFF)]
        assert set(np.flatnonzero(distances(point, near.corners) <= near.reach)) <= set(listed.tolist())


def test_large_scenes_list_their_large_triangles_only() -> None:
    corners = np.random.default_rng(5).uniform(-1.0, 1.0, (50, 3, 3)) * np.repeat([0.01, 1.0], 25)[:, None, None]
    near = near_casters(corners, 0.05, False)
    assert near is not None
    assert not near.complete
    assert len(near.corners) == 25
    assert near_casters(corners[:25], 0.05, False) is None


def test_other_casters_make_lists_incomplete() -> None:
    corners = np.random.default_rng(5).uniform(-1.0, 1.0, (5, 3, 3))
    near = near_casters(corners, 0.05, True, alone=False)
    assert near is not None
    assert not near.complete
