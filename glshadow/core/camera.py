"""The base of all cameras: a pose, a window and a depth range.

A ray goes through every pixel. It meets the window at (x, y), in view axes::

    perspective, intrinsics    from the eye, through (x, y, -1)           window edges are tangents: coordinates at distance 1
    orthographic               from (x, y, 0), along (0, 0, -1)           window edges are world units
"""

from __future__ import annotations

from dataclasses import Field, fields
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.calibration import intrinsic_matrix, opencv_pose
from glshadow.core.setting import Settings, as_floats, refuse, several, vector, whole
from glshadow.core.spaces import FARTHEST, Array, Triple, look_at, unit
from glshadow.errors import SettingsError

Window = tuple[float, float, float, float]

PLACE = vector(3, -FARTHEST, FARTHEST)
_SIZE = several(whole(1, 1 << 30), "pixels", 2)


class Camera(Settings):
    """Base of all cameras.

    Attributes
    ----------
    is_perspective : bool
        Whether all rays start at one eye point; otherwise they are parallel.
    position, target, up, near, far
        As of PerspectiveCamera.
    """

    is_perspective: ClassVar[bool] = True
    _lens: ClassVar[tuple[str, ...]] = ()
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]  # every subclass is a frozen dataclass

    position: Triple
    target: Triple
    up: Triple
    near: float | None
    far: float | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.near is not None and self.far is not None and not self.near < self.far:
            raise SettingsError(f"near must be less than far, got near={self.near}, far={self.far}")
        _ = self.view_from_world  # position == target or a zero up fails here, when built

    @cached_property
    def view_from_world(self) -> Array:
        """(4, 4) float64, read-only."""
        matrix = look_at(self.position, self.target, self.up)
        matrix.flags.writeable = False
        return matrix

    def window(self, size: tuple[int, int]) -> Window:
        """Edges left, right, bottom, top of the image for a size in pixels: tangents, or world units if orthographic."""
        raise NotImplementedError

    def rays(self, size: tuple[int, int], offset: tuple[float, float] = (0.5, 0.5)) -> tuple[Array, Array]:
        """World rays through every pixel: origin + direction * depth is the world point at that view depth.

        Parameters
        ----------
        size : (2,) ints
            Width and height.
        offset : (2,) floats
            Where in the pixel, from its top left corner; (0.5, 0.5) is the centre.

        Returns
        -------
        origins, directions : (H, W, 3) float64
            Row 0 at the top; read-only if all entries share one value. Directions have the component 1 along the view.
        """
        left, right, bottom, top = self.window(size)
        x = left + (np.arange(size[0]) + offset[0]) / size[0] * (right - left)
        y = top - (np.arange(size[1]) + offset[1]) / size[1] * (top - bottom)
        axes = self.view_from_world[:3, :3]
        across: Array = x[None, :, None] * axes[0] + y[:, None, None] * axes[1]
        eye = np.asarray(self.position)
        if self.is_perspective:
            return np.broadcast_to(eye, across.shape), across - axes[2]
        return eye + across, np.broadcast_to(-axes[2], across.shape)

    def K(self, size: tuple[int, int], center: float = 0.0) -> Array:
        """Intrinsic matrix (3, 3) for a size in pixels: (u, v, 1) ~ K (x, y, z) with x right, y down, z forward, as in OpenCV.

        Parameters
        ----------
        size : (2,) ints
            Width and height.
        center : float
            Coordinates of the first pixel's centre: 0.0 as in OpenCV; 0.5 as in COLMAP, where (0, 0) is the image's corner.

        Raises
        ------
        SettingsError
            If the camera is not perspective, or the size is not two integers of at least 1.
        """
        if not self.is_perspective:
            raise SettingsError(f"{type(self).__name__} has no intrinsic matrix: its rays are parallel")
        given = _SIZE("size", size)
        if len(given) != 2:
            raise refuse("size", "two integers (width, height in pixels)", size)
        return intrinsic_matrix(self.window(given), given, center)

    def opencv(self) -> tuple[Array, Array]:
        """Pose as OpenCV and COLMAP write it: R (3, 3) and t (3,) with R @ point + t in camera axes, x right, y down, z forward."""
        return opencv_pose(self.view_from_world)

    @property
    def lens(self) -> dict[str, float]:
        """Lens settings, without the pose: fov_y, height, or the intrinsics; for reports. Settings of None are left out."""
        lens = {name: getattr(self, name) for name in self._lens}
        return {name: value for name, value in lens.items() if value is not None}

    def __str__(self) -> str:
        """Pose and lens, for messages."""
        eye, target = ("(" + ", ".join(f"{x:.6g}" for x in point) + ")" for point in (self.position, self.target))
        return f"at {eye} looks at {target} with {', '.join(f'{name} {value:g}' for name, value in self.lens.items())}"

    def through(self, kind: type[Camera], **lens: float | None) -> Camera:
        """The same view with another lens: a `kind` of camera with `lens`, and all other settings that both kinds have."""
        common = {each.name for each in fields(kind)} & {each.name for each in fields(self)}
        return kind(**{**{name: getattr(self, name) for name in common}, **lens})


def window_of(height: float, principal: tuple[float, float], pixel_aspect: float, size: tuple[int, int]) -> Window:
    """Edges of a window of a height, for a principal point as a fraction of the image, a pixel's aspect and a size in pixels."""
    width = height * size[0] / size[1] * pixel_aspect
    left, top = -principal[0] * width, principal[1] * height
    return (float(left), float(left + width), float(top - height), float(top))


def placed(pose: ArrayLike) -> tuple[Triple, Triple, Triple]:
    """Position, target and up of a world_from_view matrix (4, 4); its scale is ignored."""
    matrix = as_floats(pose, (4, 4))
    if matrix is None or not np.isfinite(matrix).all():
        raise refuse("pose", "a finite (4, 4) matrix", pose)
    position = np.array(PLACE("pose position", matrix[:3, 3]))
    forward, up = -unit("pose z axis", matrix[:3, 2]), unit("pose y axis", matrix[:3, 1])
    target = position + forward * max(1.0, float(np.abs(position).max()) * 1e-3)  # far enough to survive float64
    return tuple(position.tolist()), tuple(target.tolist()), tuple(up.tolist())
