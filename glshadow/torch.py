"""Visibility and images as functions of a light's settings that PyTorch differentiates. Needs `pip install 'glshadow[torch]'`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import Any, Literal, Unpack

import numpy as np

from glshadow.arguments import DEFAULT_SIZE
from glshadow.core.cameras import Camera
from glshadow.core.setting import refuse, shown
from glshadow.core.spaces import Array
from glshadow.errors import GlshadowError, SettingsError
from glshadow.inverse.gradients import LightFunction
from glshadow.lights import Light
from glshadow.renderer import Renderer, RenderOptions
from glshadow.scene.nodes import Scene

Tensor = Any
"""torch.Tensor: torch is not imported before it is needed."""


def visibility(
    renderer: Renderer | None,
    scene: Scene,
    camera: Camera | None,
    light: Light,
    parameters: Mapping[str, Tensor],
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    step: float = 1.0,
    **options: Unpack[RenderOptions],
) -> Tensor:
    """The visibility of a light, with gradients by the light's settings.

    Soft shadows by `Exact()` have no noise, so that central differences of them are gradients: all lights that differ by a step are
    rendered in one frame, when a gradient is wanted. The steps are those of `fit_light`. There are no gradients by vertices, materials
    or cameras, and none of second order.

    Parameters
    ----------
    renderer : Renderer, optional
        None: a temporary one for each image and each gradient, which takes a fraction of a second; keep one for optimisations.
    scene : Scene
        Its own lights do not count.
    camera : Camera, optional
        None: the scene's own.
    light : Light
        Directional, spot, point or rectangular; the settings that are no parameters.
    parameters : mapping of str to tensors
        Of "direction", "position", "color" (3,), "angle", "radius", "width", "height", "intensity" (): those that the light has, in their
        units. Floating point, on the CPU. A direction may have any length but 0.
    size : (2,) ints
        Width and height in pixels.
    step : float
        Factor of the half steps of the differences, which are half a degree, a hundredth of the scene's diagonal, and a tenth of a size.
        At most 4.
    **options
        Further arguments of `Renderer.render`: `samples`, which is 1 here.

    Returns
    -------
    (H, W) tensor of the first parameter's type
        Visibility as of `Frame.visibility`; NaN where there is no surface, where no gradient comes from. Intensity and colour do not
        change it: their gradients are 0.

    Raises
    ------
    SettingsError, SceneError
        For parameters that the light has not, and for values that it refuses.
    GlshadowError
        If torch is not installed.
    """
    return _applied(renderer, scene, camera, light, "visibility", size, options, step, parameters)


def image(
    renderer: Renderer | None,
    scene: Scene,
    camera: Camera | None,
    light: Light,
    parameters: Mapping[str, Tensor],
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    step: float = 1.0,
    **options: Unpack[RenderOptions],
) -> Tensor:
    """The image of a light in linear light, with gradients by the light's settings.

    As `visibility`, but that each light of a difference is rendered in a frame of its own. By intensity and colour the image is linear,
    and its gradient exact.

    Parameters
    ----------
    renderer, scene, camera, light, parameters, size, step
        As for `visibility`.
    **options
        Further arguments of `Renderer.render`: `ambient`, `background`, and `samples`, which is 1 here.

    Returns
    -------
    (H, W, 3) tensor of the first parameter's type
        As `Frame.linear`.

    Raises
    ------
    SettingsError, SceneError, GlshadowError
        As for `visibility`.
    """
    return _applied(renderer, scene, camera, light, "linear", size, options, step, parameters)


def _applied(
    renderer: Renderer | None,
    scene: Scene,
    camera: Camera | None,
    light: Light,
    output: Literal["visibility", "linear"],
    size: tuple[int, int],
    options: Mapping[str, Any],
    step: float,
    parameters: Mapping[str, Tensor],
) -> Tensor:
    torch = _torch()
    function = LightFunction(renderer, scene, camera, light, output, size, options, step)
    if not isinstance(parameters, Mapping) or not parameters:
        raise refuse("parameters", "tensors by the names of a light's settings", parameters)
    for name, tensor in parameters.items():
        if not isinstance(tensor, torch.Tensor) or not tensor.is_floating_point():
            raise refuse(f"parameters[{shown(name)}]", "a torch.Tensor of floating point", tensor)
        if tensor.device.type != "cpu":
            raise SettingsError(f"parameters[{shown(name)}] must be on the CPU, got {tensor.device}: give it as .cpu()")
    return _autograd(torch).apply(function, tuple(parameters), *parameters.values())


def _torch() -> Any:
    try:
        return import_module("torch")
    except (ImportError, OSError) as error:
        raise GlshadowError(
            f"glshadow.torch needs torch ({error}); install it with: pip install 'glshadow[torch]'"
        ) from error


def _array(tensor: Tensor) -> Array:
    return np.asarray(tensor.detach().double().numpy())


@cache
def _autograd(torch: Any) -> Any:
    """The autograd function, whose class needs torch's."""

    class ImageOfLight(torch.autograd.Function):  # type: ignore[misc]  # torch is not there for type checkers
        """A LightFunction, the names of its parameters, and these."""

        @staticmethod
        def forward(ctx: Any, function: LightFunction, names: tuple[str, ...], *tensors: Tensor) -> Tensor:
            ctx.function, ctx.names = function, names
            ctx.save_for_backward(*tensors)
            values = {name: _array(tensor) for name, tensor in zip(names, tensors, strict=True)}
            return torch.as_tensor(function.at(values)).to(tensors[0].dtype)

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator]
        def backward(ctx: Any, cotangent: Tensor) -> tuple[Any, ...]:
            tensors = dict(zip(ctx.names, ctx.saved_tensors, strict=True))
            values = {name: _array(tensor) for name, tensor in tensors.items()}
            needed = [name for name, need in zip(tensors, ctx.needs_input_grad[2:], strict=True) if need]
            found = ctx.function.pulled_back(values, _array(cotangent), needed)
            return (
                None,
                None,
                *(torch.as_tensor(found[name]).to(t.dtype) if name in found else None for name, t in tensors.items()),
            )

    return ImageOfLight


__all__ = ["image", "visibility"]
