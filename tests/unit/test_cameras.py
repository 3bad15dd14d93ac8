"""Cameras: poses, intrinsics, windows, rays, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera, pixel_rays
from glshadow.core.spaces import CLIP_SPACES, look_at, perspective, project, transform
from glshadow.core.view import camera_view
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
    # principal counts from the top left: to the right of the middle, and above it
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
    ({"fov_y": 0.0}, r"PerspectiveCamera fov_y must be a finite number in \[1e-06, 180\) degrees, got 0.0"),
    ({"fov_y": 180.0}, r"fov_y must be a finite number in \[1e-06, 180\) degrees, got 180.0"),
    ({"fov_y": np.nan}, "fov_y must be a finite number in"),
    ({"pixel_aspect": 0.0}, r"pixel_aspect must be a finite number in \[0.001, 1000\], got 0.0"),
    ({"pixel_aspect": np.inf}, "pixel_aspect must be a finite number in"),
    ({"near": 0.0}, r"near must be a finite number in \[1e-20, 1e\+20\] or None .*got 0.0"),
    ({"far": np.inf}, r"far must be a finite number in \[1e-20, 1e\+20\] or None \(derived from the scene\), got inf"),
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


# -- orthographic


ORTHO = OrthographicCamera((9, 6, 11), (0, 1, 0), height=4.0)


def test_orthographic_window_is_in_world_units() -> None:
    np.testing.assert_allclose(ORTHO.window((200, 100)), (-4.0, 4.0, -2.0, 2.0), rtol=1e-14)
    np.testing.assert_allclose(replace(ORTHO, pixel_aspect=1.5).window((200, 100)), (-6.0, 6.0, -2.0, 2.0), rtol=1e-14)
    shifted = replace(ORTHO, principal=(0.75, 0.25)).window((200, 100))
    np.testing.assert_allclose(shifted, (-6.0, 2.0, -3.0, 1.0), rtol=1e-14)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=str)
@pytest.mark.parametrize(
    "camera",
    [
        replace(ORTHO, principal=(0.3, 0.8), pixel_aspect=1.25),
        IntrinsicsCamera(20.0, 25.0, 3.0, 7.5, (9, 6, 11), (0, 1, 0)),
        PerspectiveCamera((9, 6, 11), (0, 1, 0), principal=(0.3, 0.8), pixel_aspect=1.25),
    ],
    ids=["orthographic", "intrinsics", "perspective"],
)
def test_rays_meet_their_pixels_again(camera: Camera, clip: Any) -> None:
    """Points along a pixel's ray are projected to that pixel, at that depth along the view."""
    matrix = camera_view(camera, SIZE, 0.1, 100.0, clip).clip_from_world
    rows, columns = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    for offset in [(0.5, 0.5), (0.0, 0.0), (0.25, 0.9)]:
        origins, directions = camera.rays(SIZE, offset)
        assert origins.shape == directions.shape == (SIZE[1], SIZE[0], 3)
        points = origins + directions * 12.5
        clip_position = project(matrix, points)
        ndc = clip_position[..., :2] / clip_position[..., 3:]
        np.testing.assert_allclose((ndc[..., 0] * 0.5 + 0.5) * SIZE[0], columns + offset[0], atol=1e-11)
        np.testing.assert_allclose((0.5 - ndc[..., 1] * 0.5) * SIZE[1], rows + offset[1], atol=1e-11)
        np.testing.assert_allclose(-transform(camera.view_from_world, points)[..., 2], 12.5, rtol=1e-12)


def test_orthographic_rays_run_side_by_side() -> None:
    origins, directions = ORTHO.rays(SIZE)
    assert (directions == directions[0, 0]).all()
    np.testing.assert_allclose(np.linalg.norm(directions[0, 0]), 1.0, rtol=1e-14)
    pixel = 4.0 / SIZE[1]
    np.testing.assert_allclose(np.linalg.norm(np.diff(origins, axis=0), axis=-1), pixel, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(np.diff(origins, axis=1), axis=-1), pixel, rtol=1e-12)


def test_orthographic_from_pose() -> None:
    camera = OrthographicCamera.from_pose(POSE, 3.0, -2.0, 5.0)
    assert (camera.height, camera.near, camera.far) == (3.0, -2.0, 5.0)
    np.testing.assert_allclose(np.linalg.inv(camera.view_from_world), POSE, atol=1e-12)


def test_orthographic_near_may_lie_behind() -> None:
    assert replace(ORTHO, near=-5.0, far=-1.0).near == -5.0
    with pytest.raises(SettingsError, match=r"near must be less than far, got near=1.0, far=-1.0"):
        replace(ORTHO, near=1.0, far=-1.0)


# -- calibrated


def test_intrinsics_are_pixels_of_whatever_size_is_rendered() -> None:
    camera = IntrinsicsCamera(900.0, 850.0, 310.0, 250.5)
    for size in [(640, 480), (320, 240), (64, 1000)]:
        _, rays = camera.rays(size)
        u = 900.0 * rays[..., 0] / -rays[..., 2] + 310.0
        v = 850.0 * -rays[..., 1] / -rays[..., 2] + 250.5
        rows, columns = np.mgrid[0 : size[1], 0 : size[0]]
        np.testing.assert_allclose(u, columns + 0.5, atol=1e-10)
        np.testing.assert_allclose(v, rows + 0.5, atol=1e-10)


def test_from_intrinsics_without_a_size_leaves_pixels_pixels() -> None:
    camera = PerspectiveCamera.from_intrinsics(600.0, 610.0, 330.0, 225.0, pose=POSE, near=0.1, far=9.0)
    assert camera == IntrinsicsCamera.from_pose(POSE, 600.0, 610.0, 330.0, 225.0, 0.1, 9.0)
    sized = PerspectiveCamera.from_intrinsics(600.0, 610.0, 330.0, 225.0, (640, 480), POSE)
    np.testing.assert_allclose(camera.window((640, 480)), sized.window((640, 480)), rtol=1e-13)
    # of half the size: a quarter of the view, against all of it
    assert camera.window((320, 240))[0] == sized.window((320, 240))[0]
    np.testing.assert_allclose(sized.window((320, 240)), sized.window((640, 480)), rtol=1e-14)
    assert camera.window((320, 240))[1] < 0.0


# -- the same for all


def test_through_keeps_what_both_have() -> None:
    camera = PerspectiveCamera((9, 6, 11), (0, 1, 0), (0, 0, 1), 40.0, 0.5, 50.0, (0.3, 0.8), 1.25)
    seen = camera.through(OrthographicCamera, height=3.0)
    assert seen == OrthographicCamera((9, 6, 11), (0, 1, 0), (0, 0, 1), 3.0, 0.5, 50.0, (0.3, 0.8), 1.25)
    assert seen.through(PerspectiveCamera, fov_y=40.0) == camera
    assert camera.through(PerspectiveCamera, fov_y=20.0) == replace(camera, fov_y=20.0)


def test_text_says_where_it_is_and_what_it_shows() -> None:
    assert str(PerspectiveCamera((9, 6, 11), (0, 1, 0))) == "at (9, 6, 11) looks at (0, 1, 0) with fov_y 50"
    assert str(ORTHO).endswith("with height 4")
    assert str(IntrinsicsCamera(600, 601.5, 330, 225)).endswith("with fx 600, fy 601.5, cx 330, cy 225")
    assert IntrinsicsCamera(600, 601.5, 330, 225).lens == {"fx": 600.0, "fy": 601.5, "cx": 330.0, "cy": 225.0}


class Rude:
    """An object whose every answer is an error."""

    def __array__(self, *_: object, **__: object) -> Any:
        raise RuntimeError("no")

    def __repr__(self) -> str:
        raise RuntimeError("no")


ODD: list[Any] = [
    "1", b"1", "", 1j, True, np.bool_(False), 10**400, -(10**400), np.nan, np.inf, -np.inf, np.complex64(1), [], {}, set(), object(),
    Rude(), Rude, iter((1, 2, 3)), (x for x in (1, 2, 3)), range(0), np.ma.masked, np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]),
    np.array(["a", "b", "c"]), np.array([1j, 0, 0]), np.array([None, 1, 2]), np.zeros((3, 3)), np.zeros((4, 3)), np.zeros(0),
    np.array([[1.0, 2.0], [3.0]], dtype=object), [[1, 2], [3]], np.datetime64("2020-01-01"), [10**400, 0, 0], (1, "2", 3),
]  # fmt: skip
"""What is neither a number, nor a few numbers, nor a pose."""


@pytest.mark.parametrize("value", ODD, ids=[f"{i}-{type(value).__name__}" for i, value in enumerate(ODD)])
def test_odd_values_are_settings_errors(value: Any) -> None:
    names = {
        PerspectiveCamera: ["position", "target", "up", "fov_y", "near", "far", "principal", "pixel_aspect"],
        OrthographicCamera: ["position", "target", "up", "height", "near", "far", "principal", "pixel_aspect"],
        IntrinsicsCamera: ["position", "target", "up", "fx", "fy", "cx", "cy", "near", "far"],
    }
    for kind, fields in names.items():
        given = {"fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0} if kind is IntrinsicsCamera else {}
        for name in fields:
            with pytest.raises(SettingsError, match=f"{kind.__name__} {name} must be"):
                kind(**{**given, name: value})
    for call in (
        lambda: PerspectiveCamera.from_pose(value),
        lambda: OrthographicCamera.from_pose(value),
        lambda: IntrinsicsCamera.from_pose(value, 1.0, 1.0, 0.0, 0.0),
        lambda: PerspectiveCamera.from_pose(np.eye(4), value),
        lambda: OrthographicCamera.from_pose(np.eye(4), value),
        lambda: PerspectiveCamera.from_intrinsics(value, 1.0, 0.0, 0.0),
        lambda: PerspectiveCamera.from_intrinsics(1.0, 1.0, value, 0.0, (64, 48)),
        lambda: PerspectiveCamera.from_intrinsics(1.0, 1.0, 0.0, 0.0, value),
        lambda: PerspectiveCamera.from_intrinsics(1.0, 1.0, 0.0, 0.0, None, value),
    ):
        with pytest.raises(SettingsError):
            call()


def test_numbers_of_all_kinds_become_floats() -> None:
    camera = PerspectiveCamera([np.float32(1), Fraction(1, 2), 3], fov_y=np.int64(40), near=np.float32(0.5))  # type: ignore[list-item]
    assert camera.position == (1.0, 0.5, 3.0)
    assert [type(value) for value in (*camera.position, camera.fov_y, camera.near)] == [float] * 5
    huge = np.eye(4)
    huge[:3, 3] = 1.7e308
    with pytest.raises(SettingsError, match="pose position must be"):
        PerspectiveCamera.from_pose(huge)
