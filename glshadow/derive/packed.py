"""PackedShadow: the shadow maps of up to four lights in the channels of one texture."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, overload

from glshadow.core.setting import shown
from glshadow.errors import SettingsError
from glshadow.lights import Light, as_lights
from glshadow.shadows.channel import CHANNELS, Channel
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow

_TARGETS = (Target.R32F, Target.R16F, Target.R8)


class PackedShadow(Sequence[Light]):
    """Directional and spot lights whose depth metrics share one texture, one channel each, and one depth buffer, split into as many ranges.

    A sequence of the same lights, for `Renderer.render`. The first light's map is drawn into the farthest range of depth, the next in front
    of it, so that the buffer is cleared once. The price is precision of the depth test, a third of it with three lights; the metric keeps
    its precision. All maps have the resolution of the largest.

    Parameters
    ----------
    lights : sequence of DirectionalLight and SpotLight
        1 to 4, each with a shadow that has a map; target None, R32F, R16F or R8: the format of a channel.

    Raises
    ------
    SettingsError
        For other lights, more than four, and shadows that cannot be packed.

    References
    ----------
    Grootjans 2003 to 2011, "Riemer's XNA tutorials: Multiple lights; Adjusting Z values". He splits at 0.33 and 0.66, so that ranges
    overlap; here they are exact.
    """

    _numbers = itertools.count(1)

    def __init__(self, lights: Iterable[Light]) -> None:
        given: tuple[Light, ...] = as_lights("lights", lights)
        if not 1 <= len(given) <= CHANNELS:
            raise SettingsError(f"PackedShadow lights must be 1 to {CHANNELS}: a texture's channels, got {len(given)}")
        for each in given:
            if each.most_views != 1 or each.shadow is None:
                raise SettingsError(
                    f"PackedShadow lights must be directional or spot lights that have a shadow, got {shown(each)}"
                )
        shadows = [each.shadow for each in given if each.shadow is not None]
        target = _common(shadows)
        pack = next(self._numbers)
        resolution = max(each.spelled_out().resolution or 0 for each in shadows)
        self._lights = tuple(
            replace(
                light,
                shadow=replace(
                    shadow,
                    target=target,
                    resolution=resolution,
                    channel=Channel(number, len(given), pack),
                    filter=_filter(shadow),
                ),
            )
            for number, (light, shadow) in enumerate(zip(given, shadows, strict=True))
        )

    def __len__(self) -> int:
        return len(self._lights)

    @overload
    def __getitem__(self, index: int) -> Light: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Light, ...]: ...
    def __getitem__(self, index: int | slice) -> Light | tuple[Light, ...]:
        return self._lights[index]

    def __iter__(self) -> Iterator[Light]:
        return iter(self._lights)

    def __repr__(self) -> str:
        return f"PackedShadow({list(self._lights)!r})"


def _filter(shadow: Shadow) -> Any:
    return shadow.filter or shadow.resolved(with_map="PackedShadow").filter


def _common(shadows: Sequence[Shadow]) -> Target:
    """The format of a channel."""
    found = {each.target for each in shadows if each.target is not None} or {Target.R32F}
    if len(found) > 1 or not found <= set(_TARGETS):
        names = ", ".join(sorted(each.value for each in found))
        raise SettingsError(f"PackedShadow lights must share one target of r32f, r16f, r8, got {names}")
    for each in shadows:
        if each.filter is not None and (not each.filter.has_map or each.filter.encoding or each.filter.points_of_light):
            raise SettingsError(
                f"PackedShadow lights must have a filter that compares depths, got filter {each.filter!r}"
            )
        if each.fit is not None and each.fit.at_infinity_only:
            raise SettingsError(f"PackedShadow lights must have one view each, got fit {each.fit!r}")
    return next(iter(found))
