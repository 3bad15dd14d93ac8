"""The camera: a pose, a window of tangents and a depth range."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import FARTHEST, NEAREST, Array, finite_vector, look_at, unit
from glshadow.errors import SettingsError

Triple = tuple[float, float, float]

# No lens goes so far; beyond, the window's edges could not be told apart in float32.
LEAST_FOV, MOST_ASPECT, MOST_SHIFT = 1e-6, 1e3, 1e6


@dataclass(frozen=True)
class PerspectiveCamera:
    """A pinhole camera.

    Parameters
    ----------
    position, target, up : (3,) floats
        The eye, the point it looks at, and the direction that is up in the image; world units.
    fov_y : float
        Vertical field of view, degrees, in [1e-6, 180).
    near, far : float, optional
        Depth range, distances along the view; None derives it from the scene, so that nothing is cut away.
    principal : (2,) floats
        Where the optical axis meets the image, as a fraction of its width and height from the top left: (0.5, 0.5) is the centre.
    pixel_aspect : float
        Width of a pixel divided by its height (fy / fx of an intrinsic matrix).
    """

    position: Triple = (0.0, 0.0, 1.0)
    target: Triple = (0.0, 0.0, 0.0)
    up: Triple = (0.0, 1.0, 0.0)
    fov_y: float = 50.0
    near: float | None = None
    far: float | None = None
    principal: tuple[float, float] = (0.5, 0.5)
    pixel_aspect: float = 1.0

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            vector = finite_vector(name, getattr(self, name), largest=np.inf if name == "up" else FARTHEST)
            object.__setattr__(self, name, (float(vector[0]), float(vector[1]), float(vector[2])))
        if not LEAST_FOV <= self.fov_y < 180.0:
            raise SettingsError(f"fov_y must be in [{LEAST_FOV:g}, 180) degrees, got {self.fov_y!r}")
        if not 1.0 / MOST_ASPECT <= self.pixel_aspect <= MOST_ASPECT:
            raise SettingsError(
                f"pixel_aspect must be in [{1.0 / MOST_ASPECT:g}, {MOST_ASPECT:g}], got {self.pixel_aspect!r}"
            )
        finite_vector("principal", self.principal, 2, largest=MOST_SHIFT)
        for name, plane in (("near", self.near), ("far", self.far)):
            if plane is not None and not NEAREST <= plane <= FARTHEST:
                raise SettingsError(
                    f"{name} must be in [{NEAREST:g}, {FARTHEST:g}] or None (derived from the scene), got {plane!r}"
                )
        if self.near is not None and self.far is not None and not self.near < self.far:
            raise SettingsError(f"near must be less than far, got near={self.near}, far={self.far}")
        _ = self.view_from_world  # position == target or a zero up fails here, when built

    @classmethod
    def from_pose(
        cls, pose: ArrayLike, fov_y: float = 50.0, near: float | None = None, far: float | None = None
    ) -> PerspectiveCamera:
        """Camera from its world_from_view matrix (4, 4), as trimesh, pyrender and glTF store it (looks along -z)."""
        position, forward, up = _pose_axes(pose)
        target = position + forward * max(1.0, float(np.abs(position).max()) * 1e-3)  # far enough to survive float64
        return cls(tuple(position), tuple(target), tuple(up), fov_y, near, far)

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
    ) -> PerspectiveCamera:
        """Camera of an intrinsic matrix.

        Parameters
        ----------
        fx, fy, cx, cy : float
            Focal lengths and principal point, pixels; cy counts from the top edge, (0, 0) is the corner of the first pixel.
        size : (2,) ints
            Width and height in pixels of the image that the intrinsics belong to.
        pose : (4, 4) array_like, optional
            world_from_view; the identity if None.
        """
        for name, value in (("fx", fx), ("fy", fy), ("width", size[0]), ("height", size[1])):
            if not (np.isfinite(value) and value > 0):
                raise SettingsError(f"{name} must be positive, got {value!r}")
        fov_y = float(np.degrees(2.0 * np.arctan2(0.5 * size[1], fy)))
        camera = cls.from_pose(np.eye(4) if pose is None else pose, fov_y, near, far)
        return cls(
            camera.position, camera.target, camera.up, fov_y, near, far, (cx / size[0], cy / size[1]), float(fy / fx)
        )

    @cached_property
    def view_from_world(self) -> Array:
        """(4, 4) float64, read-only."""
        matrix = look_at(self.position, self.target, self.up)
        matrix.flags.writeable = False
        return matrix

    def window(self, size: tuple[int, int]) -> tuple[float, float, float, float]:
        """Edges left, right, bottom, top of the image as tangents (coordinates at distance 1) for a size in pixels."""
        height = 2.0 * np.tan(np.radians(self.fov_y) / 2.0)
        width = height * size[0] / size[1] * self.pixel_aspect
        left, top = -self.principal[0] * width, self.principal[1] * height
        return (float(left), float(left + width), float(top - height), float(top))


def _pose_axes(pose: ArrayLike) -> tuple[Array, Array, Array]:
    matrix = np.asarray(pose, dtype=np.float64)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise SettingsError(f"pose must be a finite (4, 4) matrix, got shape {matrix.shape}")
    return matrix[:3, 3], -unit("pose z axis", matrix[:3, 2]), unit("pose y axis", matrix[:3, 1])


def pixel_rays(camera: PerspectiveCamera, size: tuple[int, int], offset: tuple[float, float] = (0.5, 0.5)) -> Array:
    """World directions through every pixel, scaled so that their component along the view is 1.

    Parameters
    ----------
    size : (2,) ints
        Width and height.
    offset : (2,) floats
        Where in the pixel, from its top left corner; (0.5, 0.5) is the centre.

    Returns
    -------
    (H, W, 3) float64
        Row 0 at the top. position + ray * depth is the world point at that view depth.
    """
    left, right, bottom, top = camera.window(size)
    x = left + (np.arange(size[0]) + offset[0]) / size[0] * (right - left)
    y = top - (np.arange(size[1]) + offset[1]) / size[1] * (top - bottom)
    axes = camera.view_from_world[:3, :3]
    plane: Array = x[None, :, None] * axes[0] + y[:, None, None] * axes[1] - axes[2]
    return plane
