"""The kinds of cameras: perspective, calibrated in pixels, and orthographic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, overload

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.calibration import intrinsics, pose_from_opencv
from glshadow.core.camera import PLACE, Camera, Window, placed, window_of
from glshadow.core.setting import number, optional, setting, vector
from glshadow.core.spaces import FARTHEST, NEAREST, Array, Triple

__all__ = ["Camera", "IntrinsicsCamera", "OrthographicCamera", "PerspectiveCamera", "Window", "pixel_rays"]

# Beyond this, the window's edges could not be told apart in float32.
LEAST_FOV, MOST_ASPECT, MOST_SHIFT = 1e-6, 1e3, 1e6
LEAST_HEIGHT = 1e-16  # 2 / height times the farthest coordinate stays inside float32's 1e38
LEAST_FOCAL, MOST_PIXELS = 1e-6, 1e12

_AHEAD = optional(number(NEAREST, FARTHEST), "derived from the scene")
_ALONG = optional(number(-FARTHEST, FARTHEST), "derived from the scene")
_PRINCIPAL = vector(2, -MOST_SHIFT, MOST_SHIFT)
_PIXEL_ASPECT = number(1.0 / MOST_ASPECT, MOST_ASPECT)


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
    aspect : float, optional
        Width over height of the narrowest image that `fov_y` holds for: in a narrower one the field of view is as wide as in that, and
        taller than `fov_y`. None: `fov_y` holds for every image.
    """

    _lens: ClassVar[tuple[str, ...]] = ("fov_y", "aspect")

    position: Triple = setting(PLACE, (0.0, 0.0, 1.0))
    target: Triple = setting(PLACE, (0.0, 0.0, 0.0))
    up: Triple = setting(vector(3), (0.0, 1.0, 0.0))
    fov_y: float = setting(number(LEAST_FOV, 180.0, below=True, unit="degrees"), 50.0)
    near: float | None = setting(_AHEAD, None)
    far: float | None = setting(_AHEAD, None)
    principal: tuple[float, float] = setting(_PRINCIPAL, (0.5, 0.5))
    pixel_aspect: float = setting(_PIXEL_ASPECT, 1.0)
    aspect: float | None = setting(optional(_PIXEL_ASPECT, "fov_y holds for every image"), None)

    @classmethod
    def from_pose(
        cls, pose: ArrayLike, fov_y: float = 50.0, near: float | None = None, far: float | None = None
    ) -> PerspectiveCamera:
        """Camera from its world_from_view matrix (4, 4), as trimesh, pyrender and glTF store it (looks along -z)."""
        return cls(*placed(pose), fov_y, near, far)

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
            *placed(pose),
            float(np.degrees(2.0 * np.arctan2(0.5 * height, given.fy))),
            near,
            far,
            (given.cx / width, given.cy / height),
            given.fy / given.fx,
        )

    @classmethod
    def from_opencv(
        cls,
        K: ArrayLike,
        R: ArrayLike,
        t: ArrayLike,
        size: tuple[int, int],
        center: float = 0.0,
        near: float | None = None,
        far: float | None = None,
    ) -> PerspectiveCamera:
        """Camera of an intrinsic matrix and a pose as OpenCV and COLMAP write them; `K(size, center)` and `opencv()` give them back.

        Parameters
        ----------
        K : (3, 3) array_like
            [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], pixels; cy counts downwards.
        R : (3, 3) array_like, or a Rodrigues vector (3,)
        t : (3,) array_like
            R @ point + t is a world point in camera axes: x right, y down, z forward.
        size : (2,) ints
            Width and height in pixels of the image that K belongs to: an image of another size shows the same view.
        center : float
            Coordinates of the first pixel's centre in K: 0.0 as in OpenCV; 0.5 as in COLMAP, where (0, 0) is the image's corner.

        Raises
        ------
        SettingsError
            If K is no intrinsic matrix or has a skew, R is not a rotation, or another argument is not allowed.
        """
        return cls.from_intrinsics(*intrinsics(K, center), size, pose_from_opencv(R, t), near, far)

    def window(self, size: tuple[int, int]) -> Window:
        """Edges left, right, bottom, top of the image as tangents (coordinates at distance 1) for a size in pixels."""
        height = 2.0 * np.tan(np.radians(self.fov_y) / 2.0)
        if self.aspect is not None:
            height *= max(1.0, self.aspect / (size[0] / size[1] * self.pixel_aspect))
        return window_of(height, self.principal, self.pixel_aspect, size)


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
    position: Triple = setting(PLACE, (0.0, 0.0, 1.0))
    target: Triple = setting(PLACE, (0.0, 0.0, 0.0))
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
        return cls(fx, fy, cx, cy, *placed(pose), near, far)

    @classmethod
    def from_opencv(
        cls,
        K: ArrayLike,
        R: ArrayLike,
        t: ArrayLike,
        center: float = 0.0,
        near: float | None = None,
        far: float | None = None,
    ) -> IntrinsicsCamera:
        """Camera of an intrinsic matrix and a pose as OpenCV and COLMAP write them: see `PerspectiveCamera.from_opencv`."""
        return cls.from_pose(pose_from_opencv(R, t), *intrinsics(K, center), near, far)

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

    position: Triple = setting(PLACE, (0.0, 0.0, 1.0))
    target: Triple = setting(PLACE, (0.0, 0.0, 0.0))
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
        return cls(*placed(pose), height, near, far)

    def window(self, size: tuple[int, int]) -> Window:
        """Edges left, right, bottom, top of the image in world units for a size in pixels."""
        return window_of(self.height, self.principal, self.pixel_aspect, size)


def pixel_rays(camera: Camera, size: tuple[int, int], offset: tuple[float, float] = (0.5, 0.5)) -> Array:
    """Directions (H, W, 3) of a camera's rays, without origins: see `Camera.rays`."""
    return camera.rays(size, offset)[1]
