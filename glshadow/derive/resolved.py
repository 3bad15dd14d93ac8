"""Resolves the settings of one light's shadow: every None replaced by a value."""

from __future__ import annotations

from dataclasses import dataclass, replace

from glshadow.core.spaces import ClipSpace
from glshadow.lights import Light
from glshadow.shadows.bias import Bias, ReceiverPlaneBias
from glshadow.shadows.channel import Channel
from glshadow.shadows.filters import Filter
from glshadow.shadows.fits import Fit, ViewFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, ResolvedShadow, Shadow
from glshadow.shadows.view import fine_depth


@dataclass(frozen=True)
class CasterSettings:
    """What a light's shadow map is drawn with."""

    target: Target
    bias: Bias
    faces: Faces | None
    channel: Channel | None = None


@dataclass(frozen=True)
class ResolvedSettings:
    """What a light's shadow map is drawn and sampled with; `fallbacks`: every request that could not be met, with its reason."""

    filter: Filter
    fit: Fit
    caster: CasterSettings
    clip: ClipSpace
    fallbacks: tuple[str, ...]

    @property
    def fine(self) -> bool:
        """Whether the map's depth rounds relative to 1 / depth."""
        return fine_depth(self.caster.target, self.clip)


def resolve_shadow(light: Light, without_map: str = "") -> ResolvedShadow | None:
    """Filter, resolution and fit of a light's shadow; None: it casts nothing.

    Parameters
    ----------
    without_map : str
        Why triangles cannot be used; empty: they can.
    """
    if light.shadow is None:
        return None
    planes = "" if light.planes == (None, None) else "the light's near and far"
    resolved = light.shadow.resolved(without_map, planes, light.has_size, light.usual_filter)
    filter_ = light.filter_for(resolved.filter)
    if filter_ is resolved.filter:
        return resolved
    return replace(
        resolved, filter=filter_, why=f"{resolved.why}; {type(light).__name__} has no single map, but {filter_}"
    )


def resolve_settings(light: Light, resolved: ResolvedShadow, clip_control: bool, driver: str) -> ResolvedSettings:
    """Resolve the settings of a light with a shadow map.

    Parameters
    ----------
    clip_control : bool
        Whether the driver supports 0..1 depth.
    driver : str
        Its name, for the reason of a fallback.
    """
    shadow = resolved.requested
    target = shadow.target or Target.DEPTH32F
    clip, fallbacks = _clip(light, shadow, target, clip_control, driver)
    bias = (shadow.bias or ReceiverPlaneBias()).derived(resolved.filter.reach_texels)
    settings = CasterSettings(target, bias, shadow.faces, shadow.channel)
    fit = resolved.fit
    if fit.at_infinity_only and not light.at_infinity:
        fallbacks += (f"fit {fit} became {ViewFit()}: only a directional light's map can be fitted this way",)
        fit = ViewFit()
    if fit.warps and (not target.is_depth or resolved.filter.encoding or bias.shift_texels > 0.0):
        fallbacks += (
            f"fit {fit} became {ViewFit()}: perspective needs a depth target, a filter that compares depths and a bias without texel shift",
        )
        fit = ViewFit()
    return ResolvedSettings(resolved.filter, fit, settings, clip, fallbacks + ignored_size(light, resolved.filter))


def ignored_size(light: Light, filter_: Filter) -> tuple[str, ...]:
    """The fallback of an area light whose filter ignores its size; empty otherwise."""
    if not light.has_size or filter_.obeys_size:
        return ()
    return (f"the light's size is ignored: {filter_!r} treats the light as a point, so its shadow is hard",)


def _clip(
    light: Light, shadow: Shadow, target: Target, clip_control: bool, driver: str
) -> tuple[ClipSpace, tuple[str, ...]]:
    """Clip convention, with a fallback. Reversed 0..1 depth helps only perspective views in float formats; orthographic depth is linear."""
    reversed_pays = light.projection != "orthographic" and target is Target.DEPTH32F
    wanted = shadow.clip or ClipSpace(True, reversed_pays)
    if not wanted.zero_to_one or clip_control:
        return wanted, ()
    have = ClipSpace(False, wanted.reversed if shadow.clip else False)
    return have, (f"clip {wanted} became {have}: this driver has no glClipControl ({driver})",)
