"""Cameras: poses, intrinsics, windows and rays."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.spaces import CLIP_SPACES, look_at, perspective, project
from glshadow.errors import SettingsError

SIZE = (16, 9)
POSE = np.linalg.inv(look_at((9.0, 6.0, 11.0), (0.0, 1.0, 0.0), (0.1, 1.0, 0.0)))


@pytest.mark.parametrize("offset", [0.0, 1e4, 1e8])
def test_from_pose_round_trip(offset: float) -> None:
    pose = POSE.copy()
    pose[:3, 3] += offset
    camera = PerspectiveCamera.from_pose(pose, 35.0, 0.1, 500.0)
    assert (camera.fov_y, camera.near, camera.far) == (35.0, 0.1, 500.0)
    np.testing.assert_array_equal(camera.position, pose[:3, 3])
    # The target is kept as a point: the direction to it loses position * eps / distance, 1e3 eps.
    np.testing.assert_allclose(camera.view_from_world[:3, :3], pose[:3, :3].T, atol=1e-12)


def test_from_pose_ignores_scale() -> None:
    scaled = POSE @ np.diag([2.0, 2.0, 2.0, 1.0])
    np.testing.assert_allclose(
        PerspectiveCamera.from_pose(scaled).view_from_world,
        PerspectiveCamera.from_pose(POSE).view_from_world,
        atol=1e-12,
    )


@pytest.mark.parametrize("pose", [np.eye(3), np.full((4, 4), np.nan), np.zeros((4, 4))])
def test_from_pose_refuses(pose: np.ndarray) -> None:
    with pytest.raises(SettingsError, match="pose"):
        PerspectiveCamera.from_pose(pose)


def test_from_intrinsics_projects_like_the_matrix() -> None:
    """u = fx x / z + cx, v = fy y / z + cy with y down: pixel_rays must give exactly those points back."""
    fx, fy, cx, cy, size = 900.0, 850.0, 310.0, 250.5, (640, 480)
    camera = PerspectiveCamera.from_intrinsics(fx, fy, cx, cy, size, POSE)
    rays = pixel_rays(camera, size)
    depth = 3.7
    in_view = (rays * depth) @ camera.view_from_world[:3, :3].T  # x right, y up, z backward
    u = fx * in_view[..., 0] / -in_view[..., 2] + cx
    v = fy * -in_view[..., 1] / -in_view[..., 2] + cy
    np.testing.assert_allclose(u, np.broadcast_to(np.arange(640) + 0.5, (480, 640)), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(v, np.broadcast_to((np.arange(480) + 0.5)[:, None], (480, 640)), rtol=1e-10, atol=1e-10)


def test_from_intrinsics_of_a_plain_camera() -> None:
    f = 0.5 * 720 / np.tan(np.radians(25.0))
    camera = PerspectiveCamera.from_intrinsics(f, f, 640.0, 360.0, (1280, 720))
    assert camera.fov_y == pytest.approx(50.0, rel=1e-12)
    assert camera.principal == (0.5, 0.5)
    assert camera.pixel_aspect == 1.0
    np.testing.assert_allclose(camera.view_from_world, np.eye(4), atol=1e-15)


@pytest.mark.parametrize("change", [{"fx": 0.0}, {"fy": -1.0}, {"fx": np.nan}, {"cx": np.inf}, {"size": (0, 480)}])
def test_from_intrinsics_refuses(change: dict[str, object]) -> None:
    arguments = {"fx": 900.0, "fy": 900.0, "cx": 320.0, "cy": 240.0, "size": (640, 480), **change}
    with pytest.raises(SettingsError, match=r"fx|fy|cx|size"):
        PerspectiveCamera.from_intrinsics(**arguments)  # type: ignore[arg-type]


def test_window_is_symmetric_and_has_the_field_of_view() -> None:
    left, right, bottom, top = PerspectiveCamera(fov_y=90.0).window((200, 100))
    np.testing.assert_allclose([left, right, bottom, top], [-2.0, 2.0, -1.0, 1.0], rtol=1e-14)
    wide = PerspectiveCamera(fov_y=90.0, pixel_aspect=1.5).window((200, 100))
    np.testing.assert_allclose(wide, [-3.0, 3.0, -1.0, 1.0], rtol=1e-14)
    # principal counts from the top left: to the right of the centre, and above it
    shifted = PerspectiveCamera(fov_y=90.0, principal=(0.75, 0.25)).window((200, 100))
    np.testing.assert_allclose(shifted, [-3.0, 1.0, -1.5, 0.5], rtol=1e-14)


@pytest.mark.parametrize("principal", [(0.5, 0.5), (0.3, 0.8)])
@pytest.mark.parametrize("clip", CLIP_SPACES, ids=str)
def test_pixel_rays_meet_their_pixels_again(clip: object, principal: tuple[float, float]) -> None:
    camera = PerspectiveCamera((9, 6, 11), (0, 1, 0), fov_y=40.0, principal=principal, pixel_aspect=1.25)
    matrix = perspective(*camera.window(SIZE), 0.1, 100.0, clip) @ camera.view_from_world  # type: ignore[arg-type]
    for offset in [(0.5, 0.5), (0.0, 0.0), (0.25, 0.9)]:
        points = np.asarray(camera.position) + pixel_rays(camera, SIZE, offset) * 12.5
        clip_position = project(matrix, points)
        ndc = clip_position[..., :2] / clip_position[..., 3:]
        x = (ndc[..., 0] * 0.5 + 0.5) * SIZE[0]
        y_down = (0.5 - ndc[..., 1] * 0.5) * SIZE[1]
        rows, columns = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
        np.testing.assert_allclose(x, columns + offset[0], atol=1e-11)
        np.testing.assert_allclose(y_down, rows + offset[1], atol=1e-11)
        np.testing.assert_allclose(clip_position[..., 3], 12.5, rtol=1e-12)  # component along the view is 1


def test_rays_of_row_zero_point_up() -> None:
    rays = pixel_rays(PerspectiveCamera(), SIZE)
    assert rays.shape == (9, 16, 3)
    assert rays[0, 0, 1] > 0 > rays[-1, 0, 1]
    assert rays[0, 0, 0] < 0 < rays[0, -1, 0]
    np.testing.assert_allclose(rays[..., 2], -1.0, rtol=1e-15)


REFUSED = [
    ({"fov_y": 0.0}, r"fov_y must be a finite number in \[1e-06, 180\) degrees, got 0.0"),
    ({"fov_y": 180.0}, r"fov_y must be a finite number in \[1e-06, 180\) degrees, got 180.0"),
    ({"fov_y": np.nan}, "fov_y must be a finite number in"),
    ({"pixel_aspect": 0.0}, r"pixel_aspect must be a finite number in \[0.001, 1000\], got 0.0"),
    ({"pixel_aspect": np.inf}, "pixel_aspect must be a finite number in"),
    ({"near": 0.0}, r"near must be a finite number in \[1e-20, 1e\+20\] or None .*got 0.0"),
    ({"far": np.inf}, r"far must be a finite number in \[1e-20, 1e\+20\] or None .*got inf"),
    ({"near": 2.0, "far": 1.0}, "near must be less than far, got near=2.0, far=1.0"),
    ({"position": (0, 0, 0), "target": (0, 0, 0)}, "target - position must not be the zero vector"),
    ({"up": (0, 0, 0)}, "up must not be the zero vector"),
    ({"position": (0, np.nan, 0)}, "position must be 3 finite numbers"),
    (
        {"position": (0, 0, 2e20)},
        r"position must be 3 finite numbers, each in \[-1e\+20, 1e\+20\], got \(0, 0, 2e\+20\)",
    ),
    ({"target": (0, 1)}, "target must be 3 finite numbers"),
    ({"principal": (0.5,)}, "principal must be 2 finite numbers"),
]


@pytest.mark.parametrize(("arguments", "message"), REFUSED)
def test_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        PerspectiveCamera(**arguments)  # type: ignore[arg-type]


def test_cameras_are_values() -> None:
    camera = PerspectiveCamera(np.array([1, 2, 3]), [0, 0, 0])  # type: ignore[arg-type]
    assert camera == PerspectiveCamera((1, 2, 3), (0, 0, 0))
    assert hash(camera) == hash(PerspectiveCamera((1, 2, 3), (0, 0, 0)))
