"""shadow_pair: an image with shadows, the same without, and what the shadows remove."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from glshadow import image
from glshadow.arguments import DEFAULT_SIZE, as_scene, frame_arguments
from glshadow.core.cameras import Camera
from glshadow.core.outputs import checked_outputs
from glshadow.core.setting import as_path, instance, number, optional, refuse, text
from glshadow.core.spaces import Bools
from glshadow.core.srgb import LUMINANCE
from glshadow.errors import GlshadowError, SettingsError
from glshadow.frame import Frame
from glshadow.lights import Lights
from glshadow.renderer import DEFAULT_OUTPUTS, Renderer, RenderOptions

LEAST = 0.01
_NEEDED = ("linear", "alpha")


@dataclass(frozen=True, eq=False, repr=False)
class ShadowPair:
    """Images with and without shadows, of the same scene, camera, lights and exposure.

    Attributes
    ----------
    shadowed, shadow_free : Frame
        The second one's lights cast no shadows. Surfaces that face away from a light are dark in both.
    """

    shadowed: Frame
    shadow_free: Frame

    @cached_property
    def removed(self) -> NDArray[np.float32]:
        """(H, W) share of the luminance that the shadows remove: 0 where there is none, 1 where they leave nothing; in linear light."""
        with_shadows, without = (
            each.linear[..., :3].astype(np.float64) @ LUMINANCE for each in (self.shadowed, self.shadow_free)
        )
        share = 1.0 - with_shadows / np.where(without > 0.0, without, 1.0)
        return np.where(without > 0.0, np.clip(share, 0.0, 1.0), 0.0).astype(np.float32)

    @property
    def matte(self) -> NDArray[np.uint8]:
        """(H, W) the shadows alone: 255 where they remove nothing, 0 where they leave nothing."""
        return np.rint(255.0 * (1.0 - self.removed.astype(np.float64))).astype(np.uint8)

    def mask(self, least: float = LEAST) -> Bools:
        """(H, W) pixels from which shadows remove at least this share of the luminance.

        Raises
        ------
        SettingsError
            For a share that is not in (0, 1].
        """
        return np.asarray(self.removed >= number(0.0, 1.0, above=True)("least", least))

    def save(self, folder: str | PathLike[str], name: str) -> None:
        """Write four images of one name into the folders `shadow`, `shadow_free`, `mask` (white in shadow) and `matte` of a folder, which
        are made.

        Raises
        ------
        SettingsError
            For a name without the ending of an image, or with a folder.
        GlshadowError
            If a file cannot be written.
        """
        folder, name = as_path("folder", folder), text()("name", name)
        if Path(name).name != name or Path(name).suffix.lower() not in (".png", ".tif", ".tiff"):
            raise refuse("name", "a file name that ends in .png or .tif", name)
        masked = np.where(self.mask(), 255, 0).astype(np.uint8)
        for kind, pixels in (
            ("shadow", self.shadowed.image),
            ("shadow_free", self.shadow_free.image),
            ("mask", masked),
            ("matte", self.matte),
        ):
            _make(folder / kind)
            image.write(folder / kind / name, pixels)

    def __repr__(self) -> str:
        width, height = self.shadowed.size
        return f"ShadowPair({width} x {height}, {float(self.mask().mean()):.2%} in shadow)"


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadowError(f"{folder} cannot be made: {error.strerror or error}") from error


def shadow_pair(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    renderer: Renderer | None = None,
    **options: Unpack[RenderOptions],
) -> ShadowPair:
    """Render an image with shadows, and the same without, for training.

    Parameters
    ----------
    scene
        As for `render`.
    camera, lights, size
        As for `Renderer.render`.
    renderer : Renderer, optional
        None: a temporary one.
    **options
        Further arguments of `Renderer.render`; `outputs` are added to image, visibility, linear and alpha. `max_wrong` and `max_ms` are
        refused.

    Returns
    -------
    ShadowPair

    Raises
    ------
    SettingsError, SceneError
        As `Renderer.render`.

    References
    ----------
    Wang, Li, Yang 2018, "Stacked conditional generative adversarial networks for jointly learning shadow detection and shadow removal",
    CVPR, for triplets of image, mask and shadow-free image.
    """
    scene = as_scene(scene)
    camera, lights, size = frame_arguments(scene, camera, lights, size)
    if options.get("max_wrong") is not None or options.get("max_ms") is not None:
        raise SettingsError("shadow_pair takes no max_wrong and no max_ms: find settings with render")
    names = checked_outputs(options.get("outputs", DEFAULT_OUTPUTS))
    options["outputs"] = tuple(dict.fromkeys((*DEFAULT_OUTPUTS, *_NEEDED, *names)))
    renderer = optional(instance(Renderer), "a temporary one")("renderer", renderer)
    if renderer is None:
        with Renderer() as temporary:
            return _pair(temporary, scene, camera, lights, size, options)
    return _pair(renderer, scene, camera, lights, size, options)


def _pair(
    renderer: Renderer, scene: Any, camera: Camera, lights: Any, size: tuple[int, int], options: Any
) -> ShadowPair:
    shadowed = renderer.render(scene, camera, lights, size, **options)
    bare = [replace(light, shadow=None) for light in lights]
    free = renderer.render(scene, camera, bare, size, **options)
    return ShadowPair(shadowed, free)
