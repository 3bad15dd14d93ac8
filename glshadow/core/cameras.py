"""Cameras: a pose, a window and a depth range.

A ray goes through every pixel. It meets the window at (x, y), in view axes::

    perspective, intrinsics    from the eye, through (x, y, -1)           window edges are tangents: coordinates at distance 1
    orthographic               from (x, y, 0), along (0, 0, -1)           window edges are world units
"""

from __future__ import annotations

from dataclasses import Field, dataclass, fields
from functools import cached_property
from typing import Any, ClassVar, overload

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import Settings, as_floats, number, optional, refuse, setting, vector
from glshadow.core.spaces import FARTHEST, NEAREST, Array, Triple, look_at, unit
from glshadow.errors import SettingsError

Window = tuple[float, float, float, float]

# Beyond this, the window's edges could not be told apart in float32.
LEAST_FOV, MOST_ASPECT, MOST_SHIFT = 1e-6, 1e3, 1e6
LEAST_HEIGHT = 1e-16  # 2 / height times the farthest coordinate stays inside float32's 1e38
LEAST_FOCAL, MOST_PIXELS = 1e-6, 1e12

_PLACE = vector(3, -FARTHEST, FARTHEST)
_AHEAD = optional(number(NEAREST, FARTHEST), "derived from the scene")
_ALONG = optional(number(-FARTHEST, FARTHEST), "derived from the scene")
_PRINCIPAL = vector(2, -MOST_SHIFT, MOST_SHIFT)
_PIXEL_ASPECT = number(1.0 / MOST_ASPECT, MOST_ASPECT)


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

    @property
    def lens(self) -> dict[str, float]:
        """Lens settings, without the pose: fov_y, height, or the intrinsics; for reports."""
        return {name: getattr(self, name) for name in self._lens}

    def __str__(self) -> str:
        """Pose and lens, for messages."""
        eye, target = ("(" + ", ".join(f"{x:.6g}" for x in point) + ")" for point in (self.position, self.target))
        return f"at {eye} looks at {target} with {', '.join(f'{name} {value:g}' for name, value in self.lens.items())}"

    def through(self, kind: type[Camera], **lens: float) -> Camera:
        """The same view with another lens: a `kind` of camera with `lens`, and all other settings that both kinds have."""
        common = {each.name for each in fields(kind)} & {each.name for each in fields(self)}
        return kind(**{**{name: getattr(self, name) for name in common}, **lens})


@dataclass(frozen=True)
class PerspectiveCamera(Camera):
    """A pinhole camera.

    Parameters
    ----------
    position, target, up : (3,) floats
        The eye, the point it looks at, and the direction that is up in the image; world units.
    fov_y : float
        Vertical field of view, degrees, in [1e-6, 180).
    near, far : float, optional
        Depth range, distances along the view; None derives it from the scene, so that nothing is clipped.
    principal : (2,) floats
        Where the optical axis meets the image, as a fraction of its width and height from the top left: (0.5, 0.5) is the centre.
    pixel_aspect : float
        Width of a pixel divided by its height (fy / fx of an intrinsic matrix).
    """

    _lens: ClassVar[tuple[str, ...]] = ("fov_y",)

    position: Triple = setting(_PLACE, (0.0, 0.0, 1.0))
    target: Triple = setting(_PLACE, (0.0, 0.0, 0.0))
    up: Triple = setting(vector(3), (0.0, 1.0, 0.0))
    fov_y: float = setting(number(LEAST_FOV, 180.0, below=True, unit="degrees"), 50.0)
    near: float | None = setting(_AHEAD, None)
    far: float | None = setting(_AHEAD, None)
    principal: tuple[float, float] = setting(_PRINCIPAL, (0.5, 0.5))
    pixel_aspect: float = setting(_PIXEL_ASPECT, 1.0)

    @classmethod
    def from_pose(
        cls, pose: ArrayLike, fov_y: float = 50.0, near: float | None = None, far: float | None = None
    ) -> PerspectiveCamera:
        """Camera from its world_from_view matrix (4, 4), as trimesh, pyrender and glTF store it (looks along -z)."""
        return cls(*_placed(pose), fov_y, near, far)

    @overload
    @classmethod
    def from_intrinsics(
        cls,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        size: tuple[int, int],
        pose: ArrayLike | None = None,
        near: float | None = None,
        far: float | None = None,
    ) -> PerspectiveCamera: ...

    @overload
    @classmethod
    def from_intrinsics(
        cls,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        size: None = None,
        pose: ArrayLike | None = None,
        near: float | None = None,
        far: float | None = None,
    ) -> IntrinsicsCamera: ...

    @classmethod
    def from_intrinsics(
        cls,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        size: tuple[int, int] | None = None,
        pose: ArrayLike | None = None,
        near: float | None = None,
        far: float | None = None,
    ) -> PerspectiveCamera | IntrinsicsCamera:
        """Camera of an intrinsic matrix.

        Parameters
        ----------
        fx, fy, cx, cy : float
            Focal lengths and principal point, pixels; cy counts from the top edge, (0, 0) is the corner of the first pixel.
        size : (2,) ints, optional
            Width and height in pixels of the image that the intrinsics belong to: an image of another size shows the same view.
            None: pixels are those of whatever size is rendered, which is an IntrinsicsCamera.
        pose : (4, 4) array_like, optional
            world_from_view; the identity if None.
        """
        pose = np.eye(4) if pose is None else pose
        if size is None:
            return IntrinsicsCamera.from_pose(pose, fx, fy, cx, cy, near, far)
        width, height = vector(2, 1.0)("size", size)
        given = IntrinsicsCamera(fx, fy, cx, cy)
        return cls(
            *_placed(pose),
            float(np.degrees(2.0 * np.arctan2(0.5 * height, given.fy))),
            near,
            far,
            (given.cx / width, given.cy / height),
            given.fy / given.fx,
        )

    def window(self, size: tuple[int, int]) -> Window:
        """Edges left, right, bottom, top of the image as tangents (coordinates at distance 1) for a size in pixels."""
        return _window(2.0 * np.tan(np.radians(self.fov_y) / 2.0), self.principal, self.pixel_aspect, size)


@dataclass(frozen=True)
class IntrinsicsCamera(Camera):
    """A calibrated pinhole camera whose intrinsics are pixels of whatever size is rendered: a larger image shows more.

    Parameters
    ----------
    fx, fy : float
        Focal lengths, pixels.
    cx, cy : float
        Principal point, pixels from the image's left and top edge: (0, 0) is the corner of the first pixel.
    position, target, up, near, far
        As of PerspectiveCamera.
    """

    _lens: ClassVar[tuple[str, ...]] = ("fx", "fy", "cx", "cy")

    fx: float = setting(number(LEAST_FOCAL, MOST_PIXELS, unit="pixels"))
    fy: float = setting(number(LEAST_FOCAL, MOST_PIXELS, unit="pixels"))
    cx: float = setting(number(-MOST_PIXELS, MOST_PIXELS, unit="pixels"))
    cy: float = setting(number(-MOST_PIXELS, MOST_PIXELS, unit="pixels"))
    position: Triple = setting(_PLACE, (0.0, 0.0, 1.0))
    target: Triple = setting(_PLACE, (0.0, 0.0, 0.0))
    up: Triple = setting(vector(3), (0.0, 1.0, 0.0))
    near: float | None = setting(_AHEAD, None)
    far: float | None = setting(_AHEAD, None)

    @classmethod
    def from_pose(
        cls,
        pose: ArrayLike,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        near: float | None = None,
        far: float | None = None,
    ) -> IntrinsicsCamera:
        """Camera from its world_from_view matrix (4, 4) and its intrinsics."""
        return cls(fx, fy, cx, cy, *_placed(pose), near, far)

    def window(self, size: tuple[int, int]) -> Window:
        """Edges left, right, bottom, top of the image as tangents (coordinates at distance 1) for a size in pixels."""
        return (-self.cx / self.fx, (size[0] - self.cx) / self.fx, (self.cy - size[1]) / self.fy, self.cy / self.fy)


@dataclass(frozen=True)
class OrthographicCamera(Camera):
    """A camera with parallel rays: distant objects do not look smaller. For maps, plans and elevations.

    Parameters
    ----------
    position, target, up : (3,) floats
        The centre of the plane where its rays begin, a point straight ahead, and the direction that is up in the image; world units.
    height : float
        World units from the lower to the upper edge of the image; its width follows from the image's size.
    near, far : float, optional
        Depth range, distances along the view, negative behind the position. None: from the position to the end of the scene.
    principal : (2,) floats
        Where `position` is in the image, as a fraction of its width and height from the top left: (0.5, 0.5) is the centre.
    pixel_aspect : float
        Width of a pixel divided by its height, in world units.
    """

    is_perspective: ClassVar[bool] = False
    _lens: ClassVar[tuple[str, ...]] = ("height",)

    position: Triple = setting(_PLACE, (0.0, 0.0, 1.0))
    target: Triple = setting(_PLACE, (0.0, 0.0, 0.0))
    up: Triple = setting(vector(3), (0.0, 1.0, 0.0))
    height: float = setting(number(LEAST_HEIGHT, FARTHEST), 2.0)
    near: float | None = setting(_ALONG, None)
    far: float | None = setting(_ALONG, None)
    principal: tuple[float, float] = setting(_PRINCIPAL, (0.5, 0.5))
    pixel_aspect: float = setting(_PIXEL_ASPECT, 1.0)

    @classmethod
    def from_pose(
        cls, pose: ArrayLike, height: float = 2.0, near: float | None = None, far: float | None = None
    ) -> OrthographicCamera:
        """Camera from its world_from_view matrix (4, 4); `height` is twice glTF's and pyrender's ymag."""
        return cls(*_placed(pose), height, near, far)

    def window(self, size: tuple[int, int]) -> Window:
        """Edges left, right, bottom, top of the image in world units for a size in pixels."""
        return _window(self.height, self.principal, self.pixel_aspect, size)


def _window(height: float, principal: tuple[float, float], pixel_aspect: float, size: tuple[int, int]) -> Window:
    width = height * size[0] / size[1] * pixel_aspect
    left, top = -principal[0] * width, principal[1] * height
    return (float(left), float(left + width), float(top - height), float(top))


def _placed(pose: ArrayLike) -> tuple[Triple, Triple, Triple]:
    """Position, target and up of a world_from_view matrix (4, 4); its scale is ignored."""
    matrix = as_floats(pose, (4, 4))
    if matrix is None or not np.isfinite(matrix).all():
        raise refuse("pose", "a finite (4, 4) matrix", pose)
    position = np.array(_PLACE("pose position", matrix[:3, 3]))
    forward, up = -unit("pose z axis", matrix[:3, 2]), unit("pose y axis", matrix[:3, 1])
    target = position + forward * max(1.0, float(np.abs(position).max()) * 1e-3)  # far enough to survive float64
    return tuple(position.tolist()), tuple(target.tolist()), tuple(up.tolist())


def pixel_rays(camera: Camera, size: tuple[int, int], offset: tuple[float, float] = (0.5, 0.5)) -> Array:
    """Directions (H, W, 3) of a camera's rays, without origins: see `Camera.rays`."""
    return camera.rays(size, offset)[1]
