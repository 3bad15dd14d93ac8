"""Which settings a study tries, and how it calls them."""

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
CONSTANT_SHARE = 1e-3  # of the scene's diagonal: a constant bias as people set it by hand


@dataclass(frozen=True)
class Grid(Settings):
    """Every resolution with every filter, bias and target, and some settings more.

    Parameters
    ----------
    resolutions : tuple of int
    filters : tuple of Filter
    biases, targets : tuple
        As in Shadow; None is what Shadow derives.
    more : tuple of Shadow
        Settings outside the product.

    Raises
    ------
    SettingsError
        If nothing is left to try.
    """

    resolutions: tuple[int, ...] = setting(SIDES, (512, 1024, 2048, 4096), help="texels along a side of the map")
    filters: tuple[Filter, ...] = setting(CHOSEN, MAPPED, help="how one receiver is answered for")
    biases: tuple[Bias | None, ...] = setting(BIASES, (None,), help="what keeps surfaces from shadowing themselves")
    targets: tuple[Target | None, ...] = setting(TARGETS, (None,), help="formats of the map")
    more: tuple[Shadow, ...] = setting(SHADOWS, (), help="settings outside the product")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.settings():
            raise SettingsError(f"the grid is empty: give at least one resolution, filter, bias and target, got {self}")

    @classmethod
    def default(cls, scene: Scene, lights: Iterable[Light] | None = None) -> Self:
        """Resolution, filter and the four kinds of bias that people use; formats at the default setting only; exact.

        Parameters
        ----------
        lights : optional
            The scene's own if None. For those that have a size also the filters that obey it.
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
        """Every setting once, in order; pairs that Shadow refuses (polygon offset on a colour target) are left out."""
        chosen: dict[Shadow, None] = {}
        for resolution, target, kind, bias in product(self.resolutions, self.targets, self.filters, self.biases):
            plain = Shadow(resolution=resolution, filter=kind).spelled_out()
            with suppress(SettingsError):
                chosen[replace(plain, bias=bias, target=target)] = None
        return tuple(dict.fromkeys((*chosen, *(each.spelled_out() for each in self.more))))


def settings_of(grid: Grid | Iterable[Shadow]) -> tuple[Shadow, ...]:
    """The settings of a grid, or of a list of them, each once.

    Raises
    ------
    SettingsError
        If there is none, or something else among them.
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
    """What tells a setting from the default, in a few words: `2048 pcf:1 slope:1.1,4 depth16`."""
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
"""What a picture is made with where nobody says otherwise, as a setting of a study."""
