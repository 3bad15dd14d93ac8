"""Intrinsic matrices and poses in the axes of computer vision: x right, y down, z forward, as OpenCV and COLMAP use them.

References
----------
OpenCV, "Camera Calibration and 3D Reconstruction" (calib3d): pinhole model, Rodrigues vectors. Pixel centres have integer coordinates
there; COLMAP and `IntrinsicsCamera` count from the image's corner, half a pixel before the first centre.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import as_floats, number, refuse
from glshadow.core.spaces import Array

VIEW_FROM_CAMERA = np.diag([1.0, -1.0, -1.0])
"""From x right, y down, z forward to x right, y up, looking along -z; its own inverse."""

# R times its transpose may differ so much from the identity: matrices written with six digits are rotations
ROUNDED = 1e-5
SKEW = 1e-9  # share of the focal length: rounding of a computed matrix; more would shear the image
MOST_TURN = 1e6  # radians of a Rodrigues vector: beyond it the angle loses its digits
_CENTER = number(-1e3, 1e3)


def intrinsic_matrix(window: tuple[float, float, float, float], size: tuple[float, float], center: float) -> Array:
    """K (3, 3) of a window (left, right, bottom, top, as tangents); `center`: coordinates of the first pixel's centre."""
    left, right, bottom, top = window
    fx, fy = size[0] / (right - left), size[1] / (top - bottom)
    shift = _CENTER("center", center) - 0.5
    return np.array([[fx, 0.0, shift - left * fx], [0.0, fy, shift + top * fy], [0.0, 0.0, 1.0]])


def opencv_pose(view_from_world: Array) -> tuple[Array, Array]:
    """R (3, 3) and t (3,) of a view matrix."""
    return VIEW_FROM_CAMERA @ view_from_world[:3, :3], VIEW_FROM_CAMERA @ view_from_world[:3, 3]


def intrinsics(K: ArrayLike, center: float) -> tuple[float, float, float, float]:
    """fx, fy, cx, cy of an intrinsic matrix, cx and cy from the image's corner.

    Raises
    ------
    SettingsError
        If it is not an intrinsic matrix, or has a skew, which no camera here has.
    """
    matrix = as_floats(K, (3, 3))
    shift = 0.5 - _CENTER("center", center)
    if (
        matrix is None
        or not np.isfinite(matrix).all()
        or min(matrix[0, 0], matrix[1, 1]) <= 0.0
        or matrix[1, 0] != 0.0
        or matrix[2].tolist() != [0.0, 0.0, 1.0]
    ):
        raise refuse("K", "an intrinsic matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy", K)
    if abs(matrix[0, 1]) > SKEW * matrix[0, 0]:
        raise refuse("K", "without skew (K[0, 1] = 0): rows of the image are at right angles to its columns", K)
    return float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2] + shift), float(matrix[1, 2] + shift)


def pose_from_opencv(R: ArrayLike, t: ArrayLike) -> Array:
    """world_from_view (4, 4) of R (3, 3), or a Rodrigues vector (3,), and t (3,).

    Raises
    ------
    SettingsError
        If R is not a rotation or t not three numbers.
    """
    rotation, offset = _rotation(R), _three(t)
    if offset is None:
        raise refuse("t", "three finite numbers", t)
    pose = np.eye(4)
    pose[:3, :3] = rotation.T @ VIEW_FROM_CAMERA
    pose[:3, 3] = -rotation.T @ offset
    return pose


def _rotation(R: ArrayLike) -> Array:
    turn = _three(R)
    if turn is not None and np.abs(turn).max() <= MOST_TURN:
        return rodrigues(turn)
    given = as_floats(R, (3, 3))
    if (
        given is None
        or not np.isfinite(given).all()
        or np.abs(given @ given.T - np.eye(3)).max() > ROUNDED
        or np.linalg.det(given) < 0.0
    ):
        raise refuse("R", "a rotation (3, 3), or a Rodrigues vector (3,)", R)
    return given


def _three(value: ArrayLike) -> Array | None:
    """Three finite numbers in a row or a column."""
    for shape in ((3,), (3, 1), (1, 3)):
        given = as_floats(value, shape)
        if given is not None and np.isfinite(given).all():
            return given.ravel()
    return None


def rodrigues(vector: Array) -> Array:
    """Rotation (3, 3) about a vector (3,), by its length in radians."""
    angle_rad = float(np.linalg.norm(vector))
    if angle_rad == 0.0:
        return np.eye(3)
    x, y, z = vector / angle_rad
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle_rad) * across + (1.0 - np.cos(angle_rad)) * (across @ across))


def rotation_of_quaternion(w: float, x: float, y: float, z: float) -> Array:
    """Rotation (3, 3) of a quaternion, which need not be a unit one."""
    n = w * w + x * x + y * y + z * z
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z) / n, 2.0 * (x * y - w * z) / n, 2.0 * (x * z + w * y) / n],
            [2.0 * (x * y + w * z) / n, 1.0 - 2.0 * (x * x + z * z) / n, 2.0 * (y * z - w * x) / n],
            [2.0 * (x * z - w * y) / n, 2.0 * (y * z + w * x) / n, 1.0 - 2.0 * (x * x + y * y) / n],
        ]
    )
