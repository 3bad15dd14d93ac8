"""A light's own numbers: how strong it arrives, and the frame in which its receivers are given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.spaces import Array, rigid_inverse, view_axes
from glshadow.shadows.view import ShadowView

BRIGHTEST = 1e18
"""Of a radiance: its square root is still a float32."""


def light_uniforms(light: Light) -> dict[str, Any]:
    """Uniforms of the shading: radiance, cone, range and falloff."""
    values: dict[str, Any] = {"u_radiance": tuple(min(c * light.intensity, BRIGHTEST) for c in light.color)}
    if isinstance(light, DirectionalLight):
        return values
    values["u_reach"] = (0.0 if light.range is None else 1.0 / light.range, light.falloff)
    values["u_cone"] = (0.0, 1.0)
    if isinstance(light, SpotLight):
        inner, outer = np.cos(np.radians([light.inner_angle, light.outer_angle]))
        width = max(float(inner - outer), 1e-6)
        values["u_cone"] = (1.0 / width, -float(outer) / width)
    return values


def light_view(light: Light, views: Sequence[ShadowView], origin: Array | None = None) -> Array:
    """(4, 4) lv_from_world: the frame in which a light's receivers are given.

    Parameters
    ----------
    views : sequence of ShadowView
        Of the light's map; empty: it has none, and a sun's frame begins at `origin`.
    """
    if isinstance(light, PointLight):  # one frame for all faces: world axes
        return rigid_inverse(np.eye(3), np.asarray(light.position))
    if views:
        return views[0].view_from_world
    place = light.position if isinstance(light, SpotLight) else origin if origin is not None else np.zeros(3)
    return rigid_inverse(view_axes(np.asarray(light.direction)), np.asarray(place))
