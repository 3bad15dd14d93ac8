"""K and OpenCV poses of cameras: round trips, and the projection of cv2.projectPoints."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.calibration import rodrigues, rotation_of_quaternion
from glshadow.errors import SettingsError

SIZE = (640, 480)
K = np.array([[900.0, 0.0, 310.0], [0.0, 850.0, 700.5], [0.0, 0.0, 1.0]])  # the principal point is outside the image
RVEC = np.array([0.3, -1.1, 0.7])
R, T = rodrigues(RVEC), np.array([0.4, -2.0, 7.0])
POINTS = np.random.default_rng(3).uniform(-2.0, 2.0, (50, 3))


def projected(points: np.ndarray, K: np.ndarray, R: np.ndarray, t: np.ndarray) -> np.ndarray:
    """cv2.projectPoints without distortion: s (u, v, 1) = K (R X + t)."""
    seen = points @ R.T + t
    uvw = seen @ K.T
    return uvw[:, :2] / uvw[:, 2:]


def pixel_of(camera: gs.Camera, points: np.ndarray) -> np.ndarray:
    """Pixels with (0, 0) at the image's corner, by the view and the window that are rendered."""
    view = points @ camera.view_from_world[:3, :3].T + camera.view_from_world[:3, 3]
    left, right, bottom, top = camera.window(SIZE)
    x, y = view[:, 0] / -view[:, 2], view[:, 1] / -view[:, 2]
    return np.stack([(x - left) / (right - left) * SIZE[0], (top - y) / (top - bottom) * SIZE[1]], axis=1)


@pytest.mark.parametrize("center", [0.0, 0.5])
def test_from_opencv_projects_as_opencv(center: float) -> None:
    """OpenCV's pixel (0, 0) is a centre, half a pixel from the corner."""
    expected = projected(POINTS, K, R, T) + 0.5 - center
    fixed = gs.PerspectiveCamera.from_opencv(K, R, T, SIZE, center=center)
    free = gs.IntrinsicsCamera.from_opencv(K, R, T, center=center)
    for camera in (fixed, free):
        np.testing.assert_allclose(pixel_of(camera, POINTS), expected, rtol=0.0, atol=1e-9)  # pixels: 1e-12 of 1e3


@pytest.mark.parametrize("center", [0.0, 0.5])
def test_round_trip(center: float) -> None:
    for camera in (
        gs.PerspectiveCamera.from_opencv(K, R, T, SIZE, center),
        gs.IntrinsicsCamera.from_opencv(K, R, T, center),
    ):
        rotation, offset = camera.opencv()
        np.testing.assert_allclose(rotation, R, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(offset, T, rtol=0.0, atol=1e-12 * np.linalg.norm(T))
        np.testing.assert_allclose(camera.K(SIZE, center), K, rtol=1e-12, atol=1e-12 * K.max())


def test_round_trip_from_a_camera() -> None:
    """The other way: any pinhole camera, also with square pixels and a small field of view."""
    for given in (
        gs.PerspectiveCamera((3.0, 2.0, 5.0), (0.0, 1.0, 0.0), fov_y=35.0),
        gs.PerspectiveCamera(
            (300.0, 2.0, 5.0), (0.0, 1.0, 0.0), (0.2, 1.0, 0.1), 2.0, principal=(0.3, 0.8), pixel_aspect=1.3
        ),
    ):
        camera = gs.PerspectiveCamera.from_opencv(given.K(SIZE), *given.opencv(), SIZE)
        np.testing.assert_allclose(camera.window(SIZE), given.window(SIZE), rtol=1e-12)
        np.testing.assert_allclose(camera.position, given.position, rtol=1e-12)
        np.testing.assert_allclose(camera.view_from_world[:3, :3], given.view_from_world[:3, :3], rtol=0.0, atol=1e-12)


def test_another_size_of_the_same_view() -> None:
    """Twice the pixels: fx doubles, and the corner, not the first centre, stays in place."""
    camera = gs.PerspectiveCamera.from_opencv(K, R, T, SIZE, center=0.5)
    np.testing.assert_allclose(camera.K((1280, 960), 0.5)[:2], 2.0 * K[:2], rtol=1e-12)


def test_a_rodrigues_vector_is_a_rotation() -> None:
    by_vector = gs.PerspectiveCamera.from_opencv(K, RVEC.reshape(3, 1), T.reshape(3, 1), SIZE)
    np.testing.assert_array_equal(by_vector.opencv()[0], gs.PerspectiveCamera.from_opencv(K, R, T, SIZE).opencv()[0])
    # a quarter turn about z takes x to y
    np.testing.assert_allclose(
        rodrigues(np.array([0.0, 0.0, np.pi / 2])) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15
    )
    np.testing.assert_array_equal(rodrigues(np.zeros(3)), np.eye(3))


def test_quaternion_equals_its_rodrigues_vector() -> None:
    angle_rad = np.linalg.norm(RVEC)
    axis = RVEC / angle_rad
    quaternion = 2.5 * np.array([np.cos(angle_rad / 2), *(np.sin(angle_rad / 2) * axis)])  # not a unit one
    np.testing.assert_allclose(rotation_of_quaternion(*quaternion), R, atol=1e-15)


def test_identity_looks_along_z_with_y_down() -> None:
    camera = gs.PerspectiveCamera.from_opencv(K, np.eye(3), np.zeros(3), SIZE)
    np.testing.assert_allclose(-camera.view_from_world[2, :3], [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(camera.view_from_world[1, :3], [0.0, -1.0, 0.0], atol=1e-15)


SKEWED = K + np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"K": SKEWED}, "skew"),
        ({"K": np.eye(4)}, "K must be"),
        ({"K": -K}, "K must be"),
        ({"K": np.full((3, 3), np.nan)}, "K must be"),
        ({"R": -np.eye(3)}, "R must be a rotation"),
        ({"R": 2.0 * np.eye(3)}, "R must be a rotation"),
        ({"R": "up"}, "R must be a rotation"),
        ({"t": (1.0, np.inf, 0.0)}, "t must be"),
        ({"t": (1.0, 0.0)}, "t must be"),
        ({"center": np.nan}, "center"),
        ({"size": (0, 3)}, "size"),
    ],
)
def test_from_opencv_refuses(change: dict[str, object], named: str) -> None:
    with pytest.raises(SettingsError, match=named):
        gs.PerspectiveCamera.from_opencv(**{"K": K, "R": R, "t": T, "size": SIZE, **change})  # type: ignore[arg-type]


def test_an_orthographic_camera_has_no_matrix() -> None:
    with pytest.raises(SettingsError, match="parallel"):
        gs.OrthographicCamera().K(SIZE)
