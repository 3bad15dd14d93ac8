"""Conventions in one place: spaces, matrices and the four clip conventions.

Right-handed, y up, column vectors, matrices read right to left::

    world --view--> view (x right, y up, looks along -z) --projection--> clip --/w--> NDC --bias matrix--> (u, v, window depth)

            y |   / -z (forward)
              |  /
              | /
              +-------- x          row 0 of an image is its top; GL's rows are flipped once, at read-back

Near and far are positive distances along -z. All functions are float64.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.setting import Settings, flag, setting, vector
from glshadow.errors import SettingsError

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class ClipSpace(Settings):
    """Range and direction of NDC z.

    Parameters
    ----------
    zero_to_one : bool
        NDC z in 0..1 (``glClipControl`` with ``GL_ZERO_TO_ONE``) instead of OpenGL's -1..1.
    reversed : bool
        Near and far exchanged in the projection: clear to 0, compare with ``>=``, offsets negated.
    """

    zero_to_one: bool = setting(flag(), True, help="NDC z in 0..1 instead of -1..1")
    reversed: bool = setting(flag(), False, help="the near plane has the larger value")

    @property
    def sign(self) -> float:
        """+1 where depth grows away from the light, -1 where it is reversed."""
        return -1.0 if self.reversed else 1.0

    @property
    def clear_depth(self) -> float:
        """Window depth of the background: the far plane."""
        return 0.0 if self.reversed else 1.0

    def __str__(self) -> str:
        return ("0..1" if self.zero_to_one else "-1..1") + (",reversed" if self.reversed else "")


CLIP_SPACES = tuple(ClipSpace(z, r) for z in (False, True) for r in (False, True))


# World units, distances and coordinates alike: times what a matrix of a narrow view multiplies by, they stay inside float32's 1e38.
NEAREST, FARTHEST = 1e-20, 1e20


def finite_vector(name: str, value: ArrayLike, size: int = 3, largest: float = np.inf) -> Array:
    """`value` as a float64 vector of `size` finite numbers up to `largest`; SettingsError names `name` otherwise."""
    return np.array(vector(size, -largest, largest)(name, value))


def direction(name: str, value: ArrayLike) -> tuple[float, ...]:
    """Rule of a direction: any vector but zero, stored with length 1."""
    return tuple(unit(name, value).tolist())


def unit(name: str, value: ArrayLike) -> Array:
    """`value` scaled to length 1, for any length that float64 can hold; a zero vector raises a SettingsError."""
    given = finite_vector(name, value)
    largest = np.abs(given).max()
    if largest == 0.0:
        raise SettingsError(f"{name} must not be the zero vector")
    scaled = given / largest  # first, so that lengths of 1e-200 or 1e200 neither underflow nor overflow
    scaled /= np.linalg.norm(scaled)
    # A unit vector stays bit-identical: a light that is copied with another shadow still equals the original.
    return given if np.abs(scaled - given).max() <= 2.0**-51 else scaled


def cross(a: Array, b: Array) -> Array:
    """Cross product over the first axis of (3, ...) arrays; numpy's own takes ten times as long for single vectors."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def view_axes(forward: Array, up: ArrayLike = (0.0, 1.0, 0.0)) -> Array:
    """Rows x (right), y (up), z (backward) of a view that looks along `forward`.

    Parameters
    ----------
    forward : (3,) float64
        Unit vector.
    up : (3,) array_like
        Up vector; if it is parallel to `forward`, the world axis least parallel to it is used.

    Returns
    -------
    (3, 3) float64
        Orthonormal, determinant +1.
    """
    right = cross(forward, np.asarray(up, dtype=np.float64))
    if right @ right < 1e-12:  # sine of the angle below 1e-6: the rounded up vector would decide the roll
        right = cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
    right = right / np.sqrt(right @ right)
    return np.array([right, cross(right, forward), -forward])


def perpendicular(directions: Array) -> tuple[Array, Array]:
    """Two unit vectors (N, 3) that span the plane perpendicular to unit vectors (N, 3)."""
    axis = np.eye(3)[np.abs(directions).argmin(axis=1)]
    u = np.cross(axis, directions)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(directions, u)


def look_at(position: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 1.0, 0.0)) -> Array:
    """View matrix (4, 4), view_from_world, of an eye at `position` that looks at `target`."""
    eye = finite_vector("position", position)
    forward = unit("target - position", finite_vector("target", target) - eye)
    return rigid_inverse(view_axes(forward, unit("up", up)), eye)


def rigid_inverse(axes: Array, origin: Array) -> Array:
    """(4, 4) matrix into the frame with rows `axes` (3, 3) and origin `origin` (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3] = axes
    matrix[:3, 3] = -axes @ origin
    return matrix


def translation(offset: ArrayLike) -> Array:
    """(4, 4) matrix that moves points by `offset` (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def orthographic(
    left: float, right: float, bottom: float, top: float, near: float, far: float, clip: ClipSpace = CLIP_SPACES[0]
) -> Array:
    """clip_from_view of a box; `near` may be negative (behind the origin), but not equal to `far`."""
    matrix = np.diag([2.0 / (right - left), 2.0 / (top - bottom), 0.0, 1.0])
    matrix[0, 3] = -(right + left) / (right - left)
    matrix[1, 3] = -(top + bottom) / (top - bottom)
    if clip.reversed:
        near, far = far, near
    # z' = a (-z) + b with z' = lowest at near and 1 at far
    matrix[2, 2] = -(1.0 if clip.zero_to_one else 2.0) / (far - near)
    matrix[2, 3] = -(near if clip.zero_to_one else far + near) / (far - near)
    return matrix


def perspective(
    left: float, right: float, bottom: float, top: float, near: float, far: float, clip: ClipSpace = CLIP_SPACES[0]
) -> Array:
    """clip_from_view of a pyramid whose window edges are **tangents** (coordinates at distance 1).

    Raises
    ------
    SettingsError
        Unless 0 < near < far, both finite.
    """
    if not 0.0 < near < far < np.inf:
        raise SettingsError(f"a perspective view needs 0 < near < far, both finite, got near={near}, far={far}")
    matrix = np.zeros((4, 4))
    matrix[0, 0] = 2.0 / (right - left)
    matrix[0, 2] = (right + left) / (right - left)
    matrix[1, 1] = 2.0 / (top - bottom)
    matrix[1, 2] = (top + bottom) / (top - bottom)
    if clip.reversed:
        near, far = far, near
    matrix[2, 2] = -(far if clip.zero_to_one else far + near) / (far - near)
    matrix[2, 3] = -(1.0 if clip.zero_to_one else 2.0) * far * near / (far - near)
    matrix[3, 2] = -1.0
    return matrix


def bias_matrix(clip: ClipSpace) -> Array:
    """(4, 4) matrix from NDC to (u, v, window depth): u and v in 0..1, v up as GL stores rows.

    References
    ----------
    The texture matrix of projective texturing (Luna 2016, section 20.2), for GL's row order and either range of z.
    """
    matrix = np.diag([0.5, 0.5, 1.0, 1.0])
    matrix[:2, 3] = 0.5
    if not clip.zero_to_one:
        matrix[2, 2] = matrix[2, 3] = 0.5
    return matrix


def cofactors(linear: Array) -> Array:
    """Matrices (..., 3, 3) that transform normals and areas as `linear` transforms edges: det * inverse transpose, also if det is zero."""
    x, y, z = linear[..., 0], linear[..., 1], linear[..., 2]
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)


def transform(matrix: Array, points: ArrayLike) -> Array:
    """`points` (..., 3) transformed by an affine (4, 4) matrix; (..., 3)."""
    return np.asarray(points, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def world_positions(positions: Array, world_from_mesh: Array, origin: Array) -> Array:
    """Mesh positions (V, 3) in the world, relative to `origin`; with many matrices (..., 4, 4), of (..., V, 3).

    Sums in a fixed order instead of a matrix product: equal vertices must stay bit-identical, or edges open.
    """
    x, y, z = positions.T
    rows = world_from_mesh[..., :3, :3, None]
    offset = (world_from_mesh[..., :3, 3] - origin)[..., None]
    return np.stack(
        [
            rows[..., i, 0, :] * x + rows[..., i, 1, :] * y + rows[..., i, 2, :] * z + offset[..., i, :]
            for i in range(3)
        ],
        axis=-1,
    )


def project(matrix: Array, points: ArrayLike) -> Array:
    """`points` (..., 3) by any (4, 4) matrix, homogeneous result (..., 4): divide by w where w > 0 means in front."""
    return np.asarray(points, dtype=np.float64) @ matrix[:, :3].T + matrix[:, 3]
