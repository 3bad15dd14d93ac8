"""Every shader of scenes that have points or lines."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from glshadow.shader.slots import exact_defines, exact_slots, mapped_defines, mapped_slots, metric_slot, open_slots
from glshadow.shadows.bias import ReceiverPlaneBias
from glshadow.shadows.filters import Pcf
from glshadow.shadows.metric import Target
from scripts.shaders.variant import KINDS, PER_SAMPLE, Variant


def capsules() -> Iterator[Variant]:
    """The passes that draw balls and tubes, and those that light them and that find their shadows."""
    for kind, (capsule, parallel) in product(KINDS, product((1, 2), (0, 1))):
        drawn: dict[str, int | str] = {"GLS_CAPSULES": capsule, "GLS_ORTHO": parallel}
        slots = {"metric": metric_slot(kind.projection)}
        yield Variant("pass/capsule.vert", "core330", {}, drawn)
        for channels, colored, emits in ((1, 0, 0), (2, 0, 0), (4, 0, 0), (4, 1, 0), (4, 1, 1)):
            surface = {**drawn, "GLS_SURFACE": channels, "GLS_COLORED": colored, "GLS_EMITS": emits}
            yield Variant("pass/capsule.frag", "core330", slots, surface)
        for metric, packed in ((0, 0), (1, 0), (1, 1)):
            caster = {**drawn, "GLS_CASTS": 1, "GLS_METRIC": metric, "GLS_PACKED": packed}
            yield Variant("pass/capsule.frag", "core330", slots, caster)
    for kind, capsule in product(KINDS, (1, 2)):
        scene: dict[str, int | str] = {"GLS_CAPSULES": capsule}
        exact = {**exact_defines(kind.projection, 512, 16, False), **scene}
        for double in (0, 1):
            lists = {key: value for key, value in exact.items() if key != "GLS_HUGE"}
            yield Variant("pass/lists.comp", "core430", {}, {**lists, "GLS_DOUBLE": double})
        for parallel in (0, 1):
            yield Variant("pass/fill.frag", "core400", {}, {**scene, "GLS_ORTHO": parallel})
        for dialect, more in product(("core330", "core400"), ({}, PER_SAMPLE, {"GLS_MARKS": 1})):
            yield Variant("pass/resolve.frag", dialect, exact_slots(kind), {**exact, **more})
            alone = {**exact, "GLS_ALONE": 1, "GLS_ROUNDED": capsule - 1, "GLS_HUGE": capsule - 1, **more}
            yield Variant("pass/resolve.frag", dialect, exact_slots(kind), alone)
        target, bias, filter = Target.DEPTH32F, ReceiverPlaneBias(), Pcf(1)
        slots = mapped_slots(kind, target, bias, filter, "depth_taps")
        defines = {**mapped_defines(kind, target, bias, filter, False, False), **scene}
        for more in ({}, PER_SAMPLE):
            yield Variant("pass/resolve.frag", "core330", slots, {**defines, **more})
            yield Variant("pass/resolve.frag", "core330", open_slots(kind), {**scene, "GLS_ROUNDED": 1, **more})
