"""Images of lights with exact shadows, as fits and gradients compare them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.errors import SettingsError
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.shadows.filters import Exact
from glshadow.shadows.shadow import Shadow

LIGHT_SAMPLES = 64
_OWN = {"outputs", "max_wrong", "max_ms", "exposure", "tone"}
_TOGETHER = 16  # lights of one frame


def exact_light(light: Light) -> Light:
    """The light with exact shadows, of at least LIGHT_SAMPLES points; raises SettingsError for one without a shadow."""
    shadow = light.shadow
    if shadow is None:
        raise SettingsError("a light without a shadow (shadow=None) has none to be compared with")
    count = max(shadow.filter.points_of_light if shadow.filter is not None else 0, LIGHT_SAMPLES)
    return replace(light, shadow=Shadow(filter=Exact(light_samples=count)))


def check_options(caller: str, options: Mapping[str, Any]) -> None:
    """Raise SettingsError for arguments of `Renderer.render` that would change what is compared."""
    if unwanted := set(options) & _OWN:
        raise SettingsError(f"{caller} takes no {', '.join(sorted(unwanted))}")


def drawn(
    renderer: Renderer,
    scene: Scene,
    camera: Camera | None,
    lights: Sequence[Light],
    size: tuple[int, int],
    output: str,
    options: Mapping[str, Any],
) -> NDArray[np.float32]:
    """The image of each light alone: (L, H, W) for "visibility", of up to sixteen lights in one frame; (L, H, W, 3) for "linear"."""
    given = {"samples": 1, **options, "outputs": (output,), "exposure": None, "tone": "none"}
    if output == "visibility":
        groups = [lights[first : first + _TOGETHER] for first in range(0, len(lights), _TOGETHER)]
        return np.concatenate([renderer.render(scene, camera, each, size, **given).visibility for each in groups])
    return np.stack([renderer.render(scene, camera, each, size, **given).linear[..., :3] for each in lights])
