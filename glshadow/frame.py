"""Frame: the result of a render as plain numpy arrays, which stay valid after the renderer is released."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from os import PathLike
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.distortion import Distortion
from glshadow.core.outputs import NAMES, OUTPUTS
from glshadow.core.setting import as_path
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb
from glshadow.derive.used import Used
from glshadow.errors import GlshadowError, MissingOutput
from glshadow.lights import Light
from glshadow.scene.nodes import Scene

D = TypeVar("D", bound=np.generic)


class ShadowMaps(tuple[NDArray[np.float32], ...]):
    """For each light its views (V, R, R) as stored."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """In a notebook: every view in grey, stretched to the range of its values."""
        from glshadow.inline import figure

        return "".join(
            figure(_grey(view), f"light {number}, view {face}: {view.shape[1]} x {view.shape[0]}, {_span(view)}")
            for number, views in enumerate(self)
            for face, view in enumerate(views)
        )


_PREVIEW = 256  # largest side of a preview


def _span(view: NDArray[np.float32]) -> str:
    return f"{view.min():.4g} to {view.max():.4g}"


def _grey(view: NDArray[np.float32]) -> NDArray[np.uint8]:
    """A preview (R, R, 3): the smallest value black, the largest white."""
    step = max(view.shape[0] // _PREVIEW, 1)
    values = view[::step, ::step].astype(np.float64)
    low, high = values.min(), values.max()
    grey = np.rint(255.0 * (values - low) / ((high - low) or 1.0)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=-1)


@dataclass(frozen=True)
class LeftBehind:
    """Replaces the scene in a pickled frame; keeps only its name."""

    name: str

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        raise GlshadowError(f"a pickled frame does not contain its scene: keep scene {self.name!r} separately")


@dataclass(frozen=True, eq=False, repr=False)
class Frame:
    """One rendered image with its outputs. Row 0 is the top.

    Each output is a property; an output that was not rendered raises `MissingOutput`, which shows how to render it. numpy and matplotlib
    take a frame as its image: `np.asarray(frame)`, `plt.imshow(frame)`. A pickled frame does not contain its scene.

    Parameters
    ----------
    scene, camera, lights, size
        The inputs of the render.
    near, far : float
        Depth range of the camera.
    used : tuple of Used
        What was used, per light.
    outputs : mapping
        Name -> output, for those that were rendered: `"depth" in frame.outputs`.
    samples : int
        Samples per pixel: image, linear, alpha and visibility are means over them; all other outputs are those of the pixel's centre.
    exposure : float
        Stops by which the light was scaled for `image`: the argument that gives the same exposure again.
    tone : str
        Tone map of `image`.
    distortion : Distortion, optional
        That of the lens, of a frame by `render_distorted`.
    """

    scene: Scene
    camera: Camera
    lights: tuple[Light, ...]
    size: tuple[int, int]
    near: float
    far: float
    used: tuple[Used, ...]
    outputs: Mapping[str, Any]
    samples: int = 1
    exposure: float = 0.0
    tone: str = "none"
    distortion: Distortion | None = None

    @property
    def image(self) -> NDArray[np.uint8]:
        """(H, W, 3) sRGB, exposed and tone mapped; with a transparent background (H, W, 4), straight alpha."""
        return self._array("image", np.uint8)

    @property
    def visibility(self) -> NDArray[np.float32]:
        """(lights, H, W): 1 = lit, 0 = occluded or N.L <= 0, NaN where there is no surface. Cone and range affect intensity only."""
        return self._array("visibility", np.float32)

    @property
    def transmittance(self) -> NDArray[np.float32]:
        """(lights, H, W, 3) what translucent casters let through of each light's red, green and blue, at the opaque surface; 1 where there
        are none, NaN where there is no surface. `visibility` does not know them."""
        return self._array("transmittance", np.float32)

    @property
    def linear(self) -> NDArray[np.float32]:
        """(H, W, 3) linear light without exposure and tone map, not clamped; the background is `background`, decoded. With a transparent
        background (H, W, 4), premultiplied."""
        return self._array("linear", np.float32)

    @property
    def alpha(self) -> NDArray[np.float32]:
        """(H, W) share of the samples that see a surface; for a shadow catcher, the share of light that its shadow removes."""
        return self._array("alpha", np.float32)

    @property
    def depth(self) -> NDArray[np.float32]:
        """(H, W) distance along the camera's view direction, infinite where there is no surface."""
        return self._array("depth", np.float32)

    @property
    def depth_metric(self) -> NDArray[np.float32]:
        """(H, W) the camera's own depth as (s z + min_z) / (min_z + max_z), 1 where there is no surface."""
        return self._array("depth_metric", np.float32)

    @property
    def triangle(self) -> NDArray[np.int32]:
        """(H, W) index of the triangle, counted over the scene's nodes in order as in `Truth.triangle`; -1: no surface."""
        return self._array("triangle", np.int32)

    @property
    def node(self) -> NDArray[np.int32]:
        """(H, W) index of the node: `scene.nodes[i].name`; -1: no surface."""
        return self._array("node", np.int32)

    @property
    def normal(self) -> NDArray[np.float32]:
        """(H, W, 3) unit normal of the triangle's visible side, world space; NaN where there is no surface."""
        return self._array("normal", np.float32)

    @property
    def position(self) -> Array:
        """(H, W, 3) float64 world point; NaN where there is no surface."""
        return self._array("position", np.float64)

    @property
    def blocker(self) -> NDArray[np.int32]:
        """(lights, H, W) node that keeps each light's centre from the pixel's centre: the one nearest to the surface, -1: lit, or no
        surface. A surface that faces away from the light has its own node. By rays on the CPU, see `blockers`."""
        return self._array("blocker", np.int32)

    @property
    def blocker_distance(self) -> NDArray[np.float32]:
        """(lights, H, W) world units from the surface to that node along the ray: infinite where lit, 0 where the surface faces away, NaN
        where there is no surface."""
        return self._array("blocker_distance", np.float32)

    @property
    def shadow_maps(self) -> ShadowMaps:
        """Per light its views (V, R, R) as stored (window depth, or metric), row 0 at v = 1. Notebooks display them."""
        return ShadowMaps(self._output("shadow_maps"))

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds per pass: GPU time if its timestamps are reliable, otherwise wall-clock time after waiting for the GPU."""
        seconds: Mapping[str, float] = self._output("timings")
        return seconds

    def _array(self, name: str, dtype: type[D]) -> NDArray[D]:
        return np.asarray(self._output(name), dtype=dtype)  # the dtype matches: no copy

    def _output(self, name: str) -> Any:
        try:
            return self.outputs[name]
        except KeyError:
            wanted = ", ".join(f'"{each}"' for each in NAMES if each in self.outputs or each == name)
            raise MissingOutput(f'this frame has no "{name}": render it with outputs=({wanted})') from None

    def __repr__(self) -> str:
        lights = f"{len(self.lights)} light{'' if len(self.lights) == 1 else 's'}"
        return (
            f"Frame({self.scene.name!r}, {self.size[0]} x {self.size[1]}, {lights}, outputs {', '.join(self.outputs)})"
        )

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """The image, for numpy and matplotlib."""
        return np.array(self.image, dtype=dtype, copy=copy)

    def __getstate__(self) -> dict[str, Any]:
        """State without the scene, which may be a thousand times larger than the image."""
        return {**vars(self), "scene": LeftBehind(self.scene.name)}

    def show(self) -> None:
        """Show the image in a notebook, or else in the system's image viewer.

        Raises
        ------
        GlshadowError
            If no image viewer is found.
        """
        from glshadow.inline import show

        show(self.image)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the frame: .png, .jpg and .tif the image; .exr all float outputs as named channels, and `exposure` (stops) and `tone`
        in its header; .npz all outputs as arrays.

        An .npz has the arrays under the names of the outputs (of several shadow maps `shadow_maps_0` and so on, without timings), the
        names of the scene's nodes as `nodes`, `near` and `far`, the pose `R`, `t` and, of a perspective camera, the intrinsic matrix `K`
        as `Camera.opencv` and `Camera.K` give them; of a lens with distortion OpenCV's coefficients `D`, five of a `BrownDistortion`,
        four of a `FisheyeDistortion`. `np.load` reads it without pickle.

        Raises
        ------
        SettingsError
            For any other suffix, or if the output that the format needs was not rendered.
        GlshadowError
            If the file cannot be written.
        """
        from glshadow import archive, image

        path = as_path("path", path)
        if path.suffix.lower() == ".npz":
            archive.write(path, self._arrays())
            return
        if path.suffix.lower() == ".exr":
            image.write(path, self._channels(), {"exposure": float(self.exposure), "tone": self.tone})
        else:
            image.write(path, self.image)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """Everything that plain arrays hold, by name."""
        arrays = {name: value for name, value in self.outputs.items() if isinstance(value, np.ndarray)}
        if "shadow_maps" in self.outputs:
            arrays |= {f"shadow_maps_{number}": views for number, views in enumerate(self.shadow_maps)}
        arrays["R"], arrays["t"] = self.camera.opencv()
        if self.camera.is_perspective:
            arrays["K"] = self.camera.K(self.size)
        if self.distortion is not None:
            arrays["D"] = np.array(astuple(self.distortion))
        arrays["near"], arrays["far"] = np.array(self.near), np.array(self.far)
        if "image" in self.outputs:
            arrays["exposure"], arrays["tone"] = np.array(self.exposure), np.array(self.tone)
        if isinstance(self.scene, Scene):
            arrays["nodes"] = np.array([node.name for node in self.scene.nodes], dtype=str)
        return arrays

    def _channels(self) -> dict[str, NDArray[np.float32]]:
        """Channels named as compositors expect: R G B A premultiplied, Z, N.X N.Y N.Z, P.X P.Y P.Z."""
        channels: dict[str, NDArray[np.float32]] = {}
        if "linear" in self.outputs:
            channels["RGBA"] = self.linear
        elif "image" in self.outputs:
            light = decoded(self.image[..., :3])
            if self.image.shape[2] == 4:
                alpha = (self.image[..., 3:] / 255.0).astype(np.float32)
                light = np.concatenate([light * alpha, alpha], axis=-1)
            channels["RGBA"] = light
        if "alpha" in self.outputs and channels.get("RGBA", self.alpha[..., None]).shape[-1] != 4:
            channels["A"] = self.alpha
        for output in OUTPUTS:
            if output.name in self.outputs and output.name not in ("image", "linear", "alpha") and output.channels:
                channels |= _named(output.channels, self.outputs[output.name])
        return channels

    def _repr_png_(self) -> bytes | None:
        """The image in a notebook; without an image, the visibility of every light, one below the other."""
        from glshadow.inline import png, visibility_picture

        if "image" in self.outputs:
            return png(self.image)
        if "visibility" not in self.outputs or len(self.visibility) == 0:
            return None
        return png(np.concatenate([visibility_picture(one) for one in self.visibility]))


def _named(names: tuple[str, ...], value: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Planes (H, W) of an output by channel name; one numbered plane per light if one name stands for several."""
    if value.ndim == 2:
        return {names[0]: value}
    if value.ndim == 4:
        layer_channels = [name.split(".") for name in names]
        return {
            f"{layer}.{number}.{channel}": planes[..., k]
            for number, planes in enumerate(value)
            for k, (layer, channel) in enumerate(layer_channels)
        }
    if len(names) == 1:
        return {f"{names[0]}.{number}": plane for number, plane in enumerate(value)}
    return {name: value[..., k] for k, name in enumerate(names)}


def decoded(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """sRGB bytes as linear float32 values, same shape."""
    return np.asarray(linear_from_srgb(np.arange(256) / 255.0).astype(np.float32)[image])
