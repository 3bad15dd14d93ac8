"""The settings that a study tries, and their names."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np

from glshadow.arguments import checked_scene
from glshadow.core.setting import Settings, instance, optional, setting, several, whole
from glshadow.errors import SettingsError
from glshadow.lights import Light, as_lights
from glshadow.scene.nodes import Scene
from glshadow.shadows.bias import Bias, ConstantBias, NormalOffsetBias, ReceiverPlaneBias, SlopeScaledBias
from glshadow.shadows.filters import FILTERS, Filter, Hard, Pcf
from glshadow.shadows.fits import ViewFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import MAX_RESOLUTION, Shadow

SIDES = several(whole(1, MAX_RESOLUTION, unit="texels"), "resolutions")
CHOSEN = several(instance(Filter), "filters")
BIASES = several(optional(instance(Bias)), "biases or None")
TARGETS = several(optional(instance(Target)), "targets or None")
SHADOWS = several(instance(Shadow), "Shadow")

MAPPED = tuple(each for kind in FILTERS for each in kind.rungs() if each.has_map)
CONSTANT_SHARE = 1e-3  # share of the scene's diagonal: a constant bias as set by hand


@dataclass(frozen=True)
class Grid(Settings):
    """Every combination of resolution, filter, bias and target, and some more settings.

    Parameters
    ----------
    resolutions : tuple of int
    filters : tuple of Filter
    biases, targets : tuple
        As for Shadow; None is Shadow's derived value.
    more : tuple of Shadow
        Further settings, not combined with the others.

    Raises
    ------
    SettingsError
        If there are no settings to try.
    """

    resolutions: tuple[int, ...] = setting(
        SIDES, (512, 1024, 2048, 4096), help="texels along each side of the shadow map"
    )
    filters: tuple[Filter, ...] = setting(CHOSEN, MAPPED, help="shadow techniques")
    biases: tuple[Bias | None, ...] = setting(BIASES, (None,), help="depth biases")
    targets: tuple[Target | None, ...] = setting(TARGETS, (None,), help="shadow map formats")
    more: tuple[Shadow, ...] = setting(SHADOWS, (), help="further settings, not combined with the others")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.settings():
            raise SettingsError(f"the grid is empty: give at least one resolution, filter, bias and target, got {self}")

    @classmethod
    def default(cls, scene: Scene, lights: Iterable[Light] | None = None) -> Self:
        """Resolutions and filters with the four common kinds of bias; formats with the default setting only; Exact().

        Parameters
        ----------
        lights : optional
            None: the scene's own. If any has a size, filters that support it are added.
        """
        low, high = checked_scene(scene).extent
        constant = ConstantBias(float(f"{CONSTANT_SHARE * np.linalg.norm(high - low):.1g}"))
        formats = tuple(Shadow(target=target) for target in (Target.DEPTH16, Target.R32F, Target.RGBA8))
        others = (each for kind in FILTERS for each in kind.studied() if each not in MAPPED)
        more = (*formats, *(Shadow(filter=each) for each in others))
        if any(each.has_size for each in (scene.lights if lights is None else as_lights("lights", lights))):
            more += tuple(Shadow(filter=each) for kind in FILTERS for each in kind.soft())
        return cls(biases=(None, SlopeScaledBias(), NormalOffsetBias(), constant), more=more)

    @classmethod
    def quick(cls) -> Self:
        """Two resolutions, two filters, the derived bias."""
        return cls(resolutions=(1024, 2048), filters=(Hard(), Pcf(1)))

    def settings(self) -> tuple[Shadow, ...]:
        """Every setting once, in order; combinations that Shadow refuses (polygon offset on a colour target) are left out."""
        chosen: dict[Shadow, None] = {}
        for resolution, target, kind, bias in product(self.resolutions, self.targets, self.filters, self.biases):
            plain = Shadow(resolution=resolution, filter=kind).spelled_out()
            with suppress(SettingsError):
                chosen[replace(plain, bias=bias, target=target)] = None
        return tuple(dict.fromkeys((*chosen, *(each.spelled_out() for each in self.more))))


def settings_of(grid: Grid | Iterable[Shadow]) -> tuple[Shadow, ...]:
    """The settings of a grid, or of a list, each once.

    Raises
    ------
    SettingsError
        If there are none, or if the list contains anything else.
    """
    try:
        chosen = (
            grid.settings()
            if isinstance(grid, Grid)
            else tuple(dict.fromkeys(each.spelled_out() for each in SHADOWS("grid", grid)))
        )
    except SettingsError as error:
        raise SettingsError(f"a grid is a glshadow.study.Grid or at least one glshadow.Shadow: {error}") from None
    if not chosen:
        raise SettingsError("a grid is a glshadow.study.Grid or at least one glshadow.Shadow, got nothing")
    return chosen


def setting_name(shadow: Shadow) -> str:
    """Name of a setting by its differences from the default: `2048 pcf:1 slope:1.1,4 depth16`."""
    resolved = shadow.resolved()
    words = [str(resolved.resolution)] if resolved.filter.has_map else []
    words.append(str(resolved.filter))
    if shadow.bias not in (None, ReceiverPlaneBias()):
        words.append(str(shadow.bias))
    words += [str(value.value) for value in (shadow.target, shadow.faces) if value is not None]
    words += [f"clip {shadow.clip}"] if shadow.clip is not None else []
    words += [f"fit {shadow.fit}"] if shadow.fit not in (None, ViewFit()) else []
    return " ".join(words)


DEFAULT = Shadow().spelled_out()
"""The default settings, as a setting of a study."""
