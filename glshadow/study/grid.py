"""Which settings a study tries, and how it calls them."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Self, get_args

import numpy as np

from glshadow.core.bias import Bias, ConstantBias, NormalOffsetBias, ReceiverPlaneBias, SlopeScaledBias
from glshadow.core.kernels import Exact, Filter, Hard, Pcf
from glshadow.core.metric import Target
from glshadow.core.setting import Settings, instance, optional, setting, several, whole
from glshadow.core.shadow import MAX_RESOLUTION, Shadow
from glshadow.errors import SettingsError
from glshadow.scene.arguments import checked_scene
from glshadow.scene.mesh import Scene

RESOLUTIONS = several(whole(1, MAX_RESOLUTION, unit="texels"), "resolutions")
FILTERS = several(instance(*get_args(Filter)), "filters")
BIASES = several(optional(instance(*get_args(Bias))), "biases or None")
TARGETS = several(optional(instance(Target)), "targets or None")
SHADOWS = several(instance(Shadow), "Shadow")

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

    resolutions: tuple[int, ...] = setting(RESOLUTIONS, (512, 1024, 2048, 4096), help="texels along a side of the map")
    filters: tuple[Filter, ...] = setting(FILTERS, (Hard(), Pcf(1), Pcf(2)), help="how many texels answer")
    biases: tuple[Bias | None, ...] = setting(BIASES, (None,), help="what keeps surfaces from shadowing themselves")
    targets: tuple[Target | None, ...] = setting(TARGETS, (None,), help="formats of the map")
    more: tuple[Shadow, ...] = setting(SHADOWS, (), help="settings outside the product")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.settings():
            raise SettingsError(f"the grid is empty: give at least one resolution, filter, bias and target, got {self}")

    @classmethod
    def default(cls, scene: Scene) -> Self:
        """Resolution, filter and the four kinds of bias that people use; formats at the default setting only; exact."""
        low, high = checked_scene(scene).bounds
        constant = ConstantBias(float(f"{CONSTANT_SHARE * np.linalg.norm(high - low):.1g}"))
        formats = tuple(Shadow(target=target) for target in (Target.DEPTH16, Target.R32F, Target.RGBA8))
        exact = (Shadow(filter=Exact()), Shadow(filter=Exact(16)))
        return cls(biases=(None, SlopeScaledBias(), NormalOffsetBias(), constant), more=formats + exact)

    @classmethod
    def quick(cls) -> Self:
        """Two resolutions, two filters, the derived bias."""
        return cls(resolutions=(1024, 2048), filters=(Hard(), Pcf(1)))

    def settings(self) -> tuple[Shadow, ...]:
        """Every setting once, in order; pairs that Shadow refuses (polygon offset on a colour target) are left out."""
        chosen: dict[Shadow, None] = {}
        for resolution, target, kind, bias in product(self.resolutions, self.targets, self.filters, self.biases):
            plain = Shadow(resolution=resolution, filter=kind)
            with suppress(SettingsError):
                chosen[replace(plain, bias=bias, target=target)] = None
        return tuple(dict.fromkeys((*chosen, *self.more)))


def settings_of(grid: Grid | Iterable[Shadow]) -> tuple[Shadow, ...]:
    """The settings of a grid, or of a list of them, each once.

    Raises
    ------
    SettingsError
        If there is none, or something else among them.
    """
    try:
        chosen = grid.settings() if isinstance(grid, Grid) else tuple(dict.fromkeys(SHADOWS("grid", grid)))
    except SettingsError as error:
        raise SettingsError(f"a grid is a glshadow.study.Grid or at least one glshadow.Shadow: {error}") from None
    if not chosen:
        raise SettingsError("a grid is a glshadow.study.Grid or at least one glshadow.Shadow, got nothing")
    return chosen


def filter_name(kind: Filter) -> str:
    """As on the command line, kind and number: hard, pcf:1, exact, exact:4."""
    numbers = [] if kind == Exact() else [f"{getattr(kind, item.name):g}" for item in fields(kind)]
    return ":".join([type(kind).__name__.lower(), *numbers])


def bias_name(bias: Bias | None) -> str:
    """Kind and numbers: receiver-plane, constant:0.03, slope:1.1,4."""
    kinds = {ReceiverPlaneBias: "receiver-plane", SlopeScaledBias: "slope", ConstantBias: "constant",
             NormalOffsetBias: "normal-offset"}  # fmt: skip
    bias = bias or ReceiverPlaneBias()
    name = kinds.get(type(bias), type(bias).__name__.removesuffix("Bias").lower())
    numbers = ",".join(f"{float(getattr(bias, item.name)):g}" for item in fields(bias))
    return f"{name}:{numbers}" if numbers else name


def setting_name(shadow: Shadow) -> str:
    """What tells a setting from the default, in a few words: `2048 pcf:1 slope:1.1,4 depth16`."""
    words = [filter_name(shadow.filter)]
    if not isinstance(shadow.filter, Exact):  # which has no map
        words.insert(0, str(shadow.resolution))
    if not isinstance(shadow.bias, ReceiverPlaneBias | None):
        words.append(bias_name(shadow.bias))
    words += [str(value.value) for value in (shadow.target, shadow.faces) if value is not None]
    words += [f"clip {shadow.clip}"] if shadow.clip is not None else []
    words += [type(shadow.fit).__name__] if shadow.fit != Shadow().fit else []
    return " ".join(words)
