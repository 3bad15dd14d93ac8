"""Frame: what a render gives back, as plain numpy that outlives its renderer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.lights import Light
from glshadow.core.used import Used
from glshadow.errors import SettingsError
from glshadow.scene.mesh import Scene

OUTPUTS = ("image", "visibility", "linear", "depth", "depth_metric", "triangle", "shadow_maps", "timings")


@dataclass(frozen=True, eq=False)
class Frame:
    """One rendered picture and what is known about it. Row 0 is the top. Outputs that were not asked for are None.

    Parameters
    ----------
    image : (H, W, 3) uint8
        sRGB.
    visibility : (lights, H, W) float32
        1 = lit, 0 = occluded or N.L <= 0, NaN where there is no surface. Cone and range are intensity, not visibility.
    linear : (H, W, 3) float32
        Linear light before it is clamped and encoded; the background is `background`, decoded.
    depth : (H, W) float32
        Distance along the camera's view, infinite where there is no surface.
    depth_metric : (H, W) float32
        The camera's own depth as (s z + min_z) / (min_z + max_z), 1 where there is no surface.
    triangle : (H, W) int32
        Number of the drawn triangle, counted over the scene's nodes in their order as in `Truth.triangle`; -1: no surface.
    shadow_maps : tuple of (V, R, R) float32
        Per light its views as they are stored (window depth, or metric), row 0 at v = 1.
    timings : mapping
        Seconds of wall clock per pass.
    used : tuple of Used
        Per light.
    scene, camera, lights, size
        What was rendered.
    near, far : float
        Depth range of the camera.
    """

    scene: Scene
    camera: Camera
    lights: tuple[Light, ...]
    size: tuple[int, int]
    near: float
    far: float
    used: tuple[Used, ...]
    image: NDArray[np.uint8] | None = None
    visibility: NDArray[np.float32] | None = None
    linear: NDArray[np.float32] | None = None
    depth: NDArray[np.float32] | None = None
    depth_metric: NDArray[np.float32] | None = None
    triangle: NDArray[np.int32] | None = None
    shadow_maps: tuple[NDArray[np.float32], ...] | None = None
    timings: Mapping[str, float] | None = None

    def save(self, path: str | PathLike[str]) -> None:
        """Write the picture: .png .jpg .tif the image; .exr all float outputs as named channels.

        Raises
        ------
        SettingsError
            For another ending, or if the output that the format needs was not rendered.
        """
        from glshadow import image

        name = str(path)
        if name.lower().endswith(".exr"):
            image.write(name, self._channels())
            return
        if self.image is None:
            raise SettingsError(f'cannot save {name}: the frame was rendered without the output "image"')
        image.write(name, self.image)

    def _channels(self) -> dict[str, NDArray[np.float32]]:
        channels: dict[str, NDArray[np.float32]] = {}
        if self.linear is not None:
            channels["linear"] = self.linear
        elif self.image is not None:
            channels["linear"] = decoded(self.image)
        for i in range(0 if self.visibility is None else len(self.visibility)):
            assert self.visibility is not None
            channels[f"visibility.{i}"] = self.visibility[i]
        for name in ("depth", "depth_metric"):
            value = getattr(self, name)
            if value is not None:
                channels[name] = value
        return channels

    def _repr_png_(self) -> bytes | None:
        """The picture in a notebook; without one, the visibility of every light, one below the other."""
        from glshadow.inline import png, visibility_picture

        if self.image is not None:
            return png(self.image)
        if self.visibility is None or len(self.visibility) == 0:
            return None
        return png(np.concatenate([visibility_picture(one) for one in self.visibility]))


def decoded(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """sRGB bytes to linear light, float32, same shape."""
    value = np.arange(256, dtype=np.float64) / 255.0
    table = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4).astype(np.float32)
    return np.asarray(table[image])
