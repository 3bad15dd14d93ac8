"""Depth ranges: given values are used, derived ones clip nothing, and -1..1 depth resolves what it shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glshadow.core.cameras import OrthographicCamera, PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.geometry.fitting import frustum_of, visible_corners
from glshadow.geometry.ranges import (
    COARSE_STEP,
    MOST_CUT,
    NEAREST_SHARE,
    USUAL_SHARE,
    DepthRange,
    depth_range,
    view_depth,
)
from glshadow.scene.box import box_corners

SIZE = (1280, 720)
PIXEL = 2.0 * np.tan(np.radians(25.0)) / 720  # tangent of a pixel of an image 720 high with fov_y 50
EYE = PerspectiveCamera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
PLAN = OrthographicCamera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


def boxes(*spans: tuple[float, float], half: float = 1.0) -> tuple[tuple[Array, Array], Array]:
    """Square boxes between two depths each in front of EYE, and their corners."""
    bounds = np.array([[(-half, -half, -far), (half, half, -near)] for near, far in spans])
    placed = np.broadcast_to(np.eye(4), (len(spans), 4, 4)).copy()
    return (bounds, placed), box_corners(bounds, placed)


def test_fine_depth_encloses_everything() -> None:
    assert depth_range(EYE, SIZE, *boxes((2, 3), (40, 50)), True) == DepthRange(0.999 * 2, 1.001 * 50)
    # around the eye: the box's content is unknown
    around = depth_range(EYE, SIZE, *boxes((-5, 50)), True)
    assert (around.near, around.far) == (NEAREST_SHARE * around.far, 1.001 * 50)


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
@pytest.mark.parametrize("half", [1e3, 1e4, 1e6, 1e7])
def test_fine_depth_starts_at_the_visible_part_of_a_large_ground(half: float, scale: float) -> None:
    """A quarter of the distance to a ground below the eye, height / tan of the angle to the image's lower side; or at USUAL_SHARE."""
    height = 1.7
    eye = PerspectiveCamera((0.0, scale * height, 0.0), (0.0, scale * height, -scale), fov_y=50.0)
    bounds = scale * np.array([[(-half, 0.0, -half), (half, 0.0, half)]])
    placed = np.eye(4)[None]
    found = depth_range(eye, SIZE, (bounds, placed), box_corners(bounds, placed), True)
    assert found.far == pytest.approx(1.001 * scale * half)
    expected = min(0.25 * height / np.tan(np.radians(25.0)), USUAL_SHARE * 1.001 * half)
    assert found.near == pytest.approx(scale * expected, rel=2e-2)  # the box is taken a little larger
    assert found.fallbacks == ()


@pytest.mark.parametrize("clip_control", [True, False])
def test_given_range_is_used(clip_control: bool) -> None:
    for camera in (EYE, PLAN):
        found = depth_range(replace(camera, near=0.5, far=9.0), SIZE, *boxes((2, 3), (40, 50)), clip_control)
        assert (found.near, found.far, found.fallbacks) == (0.5, 9.0, ())


def test_coarse_depth_starts_at_the_visible_boxes() -> None:
    # the first box is outside the image: it does not affect the near plane
    (bounds, placed), _ = boxes((0.1, 1.0), (20, 50))
    placed[0, 0, 3] = 100.0
    found = depth_range(EYE, SIZE, (bounds, placed), box_corners(bounds, placed), False)
    # boxes are slightly enlarged, so that flat ones are found
    assert found.near == pytest.approx(0.999 * 20, rel=1e-6)
    assert found.fallbacks == ()


def test_coarse_depth_clips_only_what_it_cannot_resolve_and_reports_it() -> None:
    found = depth_range(EYE, SIZE, *boxes((-5, 50), half=30.0), False)
    assert found.near == pytest.approx(COARSE_STEP / PIXEL * 50, rel=1e-6)
    assert f"nearer than {found.near:g}" in found.fallbacks[0]
    assert "glClipControl" in found.fallbacks[0]
    narrow = depth_range(replace(EYE, fov_y=1e-4), SIZE, *boxes((-5, 50), half=30.0), False)
    assert narrow.near == pytest.approx(MOST_CUT * 50, rel=1e-6)
    near = depth_range(replace(EYE, near=1e-3), SIZE, *boxes((2, 50)), False)
    assert near.near == 1e-3
    assert "leave near out, or give at least" in near.fallbacks[0]


def test_coarse_depth_keeps_known_near_surfaces_and_reports_the_cost() -> None:
    """A flat ground of 1e6 under the eye: its nearest pixel is known, so depth at the horizon loses precision."""
    eye = PerspectiveCamera((0.0, 1.7, 0.0), (0.0, 1.7, -1.0), fov_y=50.0)
    bounds, placed = np.array([[(-1e6, 0.0, -1e6), (1e6, 0.0, 1e6)]]), np.eye(4)[None]
    found = depth_range(eye, SIZE, (bounds, placed), box_corners(bounds, placed), False)
    assert found.near == pytest.approx(1.7 / np.tan(np.radians(25.0)), rel=1e-2)
    (said,) = found.fallbacks
    assert "glClipControl" in said
    assert "a depth of 1e+06 is off by up to 3.3e+04" in said


def test_coarse_depth_resolves_an_eighth_of_a_pixel() -> None:
    """Two steps of 2^-24 in the window, along the view, at the deepest point: (depth^2 / near) d(window)."""
    found = depth_range(EYE, SIZE, *boxes((-5, 50), half=30.0), False)
    scale, depth = (found.far - found.near) / (found.far * found.near), 50.0
    assert 2.0 * 2.0**-24 * depth**2 * scale == pytest.approx(PIXEL * depth / 8.0, rel=2e-3)


def test_empty_view_has_a_valid_range() -> None:
    (bounds, placed), _ = boxes((2, 3))
    placed[0, 0, 3] = 100.0
    assert depth_range(EYE, SIZE, (bounds, placed), box_corners(bounds, placed), False).fallbacks == ()
    behind = depth_range(EYE, SIZE, *boxes((-9, -3)), False)
    assert 0.0 < behind.near < behind.far


@pytest.mark.parametrize("clip_control", [True, False])
@pytest.mark.parametrize(
    ("near", "far"), [(2.0, 50.0), (-5.0, 50.0), (-9.0, -3.0), (3.0, 3.0), (0.0, 0.0), (1e6, 1e6 + 1)]
)
def test_orthographic_range_encloses_what_is_ahead(near: float, far: float, clip_control: bool) -> None:
    found = depth_range(PLAN, SIZE, *boxes((near, far)), clip_control)
    assert found.near < found.far
    if far > 0.0:
        assert 0.0 <= found.near < max(near, 1e-300)
        assert found.far > far
    behind = depth_range(replace(PLAN, near=-20.0), SIZE, *boxes((near, far)), clip_control)
    assert behind.near == -20.0
    assert behind.far > far
    for given in (replace(PLAN, near=1e7), replace(PLAN, far=-1e7)):
        found = depth_range(given, SIZE, *boxes((near, far)), clip_control)
        assert found.near < found.far
        assert given.near in (None, found.near)
        assert given.far in (None, found.far)


def test_orthographic_frustum_is_a_box() -> None:
    camera = OrthographicCamera((3.0, 4.0, 5.0), (1.0, 0.5, -2.0), height=2.0, principal=(0.2, 0.7))
    window = camera.window(SIZE)
    frustum = frustum_of(window, -1.0, 6.0, camera.view_from_world, False)
    local = frustum.corners @ camera.view_from_world[:3, :3].T + camera.view_from_world[:3, 3]
    np.testing.assert_allclose(local.min(axis=0), (window[0], window[2], -6.0), rtol=1e-12)
    np.testing.assert_allclose(local.max(axis=0), (window[1], window[3], 1.0), rtol=1e-12)
    # every corner lies on three faces, and inside the others
    beyond = frustum.corners @ frustum.normals.T - frustum.limits
    np.testing.assert_array_equal((np.abs(beyond) < 1e-12).sum(axis=1), 3)
    assert (beyond > -1e-12).all()


def test_visible_part_of_a_box_in_an_orthographic_view() -> None:
    """A window of 2 x 2 on a slab of 20 x 20 x 1, 5 away: a cuboid of 2 x 2 x 1."""
    camera = replace(PLAN, near=0.0, far=20.0)
    (bounds, placed), _ = boxes((5, 6), half=10.0)
    points = visible_corners(
        bounds, placed, frustum_of(camera.window((9, 9)), 0.0, 20.0, camera.view_from_world, False)
    )[0]
    np.testing.assert_allclose(points.min(axis=0), (-1.0, -1.0, -6.0), atol=1e-7)
    np.testing.assert_allclose(points.max(axis=0), (1.0, 1.0, -5.0), atol=1e-7)
    np.testing.assert_allclose(np.sort(np.unique(view_depth(camera, points).round(6))), (5.0, 6.0))


def test_loss_of_depth_precision_is_reported() -> None:
    """An eye inside a huge box, and an orthographic camera whose linear depth spans all of one."""
    half = 1e7
    bounds = np.array([[[-half, -0.3 * half, -half], [half, 0.3 * half, half]], [[-0.1, 0.0, -3.0], [0.1, 0.2, -2.8]]])
    matrices = np.tile(np.eye(4), (2, 1, 1))
    corners = box_corners(bounds, matrices)
    inside = PerspectiveCamera(position=(0.0, 0.5, 0.0), target=(0.0, 0.0, -1.0))
    found = depth_range(inside, (64, 48), (bounds, matrices), corners, True)
    assert found.fallbacks[0].endswith(f"nothing nearer than {found.near:.2g} is drawn")
    plan = OrthographicCamera(position=(0.0, 0.5, 0.0), target=(0.0, 0.0, -1.0), height=3.0)
    found = depth_range(plan, (64, 48), (bounds, matrices), corners, True)
    assert "orthographic" in found.fallbacks[0]
    scaled = np.concatenate([bounds[:1] / half, bounds[1:]])
    for camera in (inside, plan):
        assert depth_range(camera, (64, 48), (scaled, matrices), box_corners(scaled, matrices), True).fallbacks == ()
