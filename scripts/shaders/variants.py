"""Every shader that settings can lead to: passes with their slots and defines, in each dialect."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from glshadow.core.sampling import SAMPLES, grid
from glshadow.lights import Light
from glshadow.shader.slots import Compare, mapped_defines, mapped_slots, metric_slot, open_slots, parallel_define
from glshadow.shadows.bias import Bias, ConstantBias, NoBias, NormalOffsetBias, ReceiverPlaneBias
from glshadow.shadows.filters import FILTERS, Filter, Pcss
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.metric import Target
from scripts.shaders.variant import KINDS, ONE_VIEW, PER_SAMPLE, Variant
from scripts.shaders.variants_capsules import capsules
from scripts.shaders.variants_exact import area, exact, points
from scripts.shaders.variants_materials import materials

TARGETS = (Target.DEPTH32F, Target.R32F, Target.RGBA8)  # the others differ in numbers, not in code
BIASES: tuple[Bias, ...] = (ReceiverPlaneBias(), ConstantBias(0.0), NormalOffsetBias(), NoBias())  # others: as NoBias
MAPPED: tuple[Filter, ...] = tuple(
    each for kind in FILTERS for each in kind.variants() if each.needs is Needs.COMPARISON
)
MOMENTS: tuple[Filter, ...] = tuple(each for kind in FILTERS for each in kind.variants() if each.encoding)
_SURFACES = ((1, 0), (1, 1), (2, 0), (2, 1), (4, 2))
"""Channels of the surface buffer, and where the colour is."""

_PAINTS = tuple(product((0, 1), (0, 1)))  # whether a texture, whether colours of vertices
DIALECTS = ("core330", "core330_gather", "es100")
# How a depth texture can be read: a comparison sampler needs a core dialect. The last: stored depth reversed.
_DEPTH_READS: tuple[tuple[str, Compare, bool], ...] = (
    ("core330", "depth_taps", False),
    ("core330_gather", "depth_gather", False),
    ("core330_gather", "depth_gather_raw", False),
    ("core330_gather", "depth_gather_raw", True),
)
_METRIC_READS: tuple[tuple[str, Compare, bool], ...] = tuple((dialect, "metric", False) for dialect in DIALECTS)


@dataclass(frozen=True)
class Receiver:
    """One way to sample a light's map."""

    kind: type[Light]
    target: Target
    bias: Bias
    filter: Filter
    dialect: str
    compare: Compare
    reversed_depth: bool

    @property
    def slots(self) -> dict[str, str]:
        """Snippets of its slots."""
        return mapped_slots(self.kind, self.target, self.bias, self.filter, self.compare)

    @property
    def defines(self) -> dict[str, int | str]:
        """Defines of its snippets."""
        return mapped_defines(self.kind, self.target, self.bias, self.filter, self.reversed_depth, False)


def receivers() -> Iterator[Receiver]:
    """Receivers that together cover every pair of settings.

    Bias and filter are independent: one passes a position and a depth to the other. So all biases are combined with the first filter and
    all filters with the first bias, for every light and every way to read a map, whose uniforms add up; other biases meet other filters
    once.
    """
    for kind, target, bias, filter in product(KINDS, TARGETS, BIASES, MAPPED):
        alone = bias is BIASES[0] or filter is MAPPED[0]
        for read in _DEPTH_READS if target.is_depth else _METRIC_READS:
            if alone or (kind, target, read) == (KINDS[0], TARGETS[0], _DEPTH_READS[0]):
                yield Receiver(kind, target, bias, filter, *read)


def variants() -> Iterator[Variant]:
    """Every variant, some of them more than once."""
    yield from _casters()
    yield from _packed()
    yield from _forward()
    yield from _surface()
    yield from materials()
    yield from _resolve()
    yield from exact()
    yield from area()
    yield from points()
    yield from capsules()
    yield from _depths_read()
    yield from _means()
    yield from _laid_out()


def distinct() -> dict[str, Variant]:
    """Every different shader once: its code and variant."""
    found: dict[str, Variant] = {}
    for variant in variants():
        found.setdefault(variant.compose().code, variant)
    return found


def _casters() -> Iterator[Variant]:
    for kind, dialect, name in product(KINDS, ("core330", "es100"), ("pass/caster.vert", "pass/caster.frag")):
        for metric, packed, biased, alpha, (textured, colored) in product((0, 1), (0, 1), (0, 1), (0, 1), _PAINTS):
            if metric >= packed and alpha >= max(textured, colored):
                defines = {"GLS_METRIC": metric, "GLS_PACKED": packed, "GLS_CLIP_BIAS": biased}
                defines |= {"GLS_ALPHA": alpha, "GLS_TEXTURED": textured, "GLS_COLORED": colored}
                yield Variant(name, dialect, {"metric": metric_slot(kind.projection)}, defines)


def _packed() -> Iterator[Variant]:
    """Variants for lights that share a texture with others."""
    for kind, alpha in product(ONE_VIEW, (0, 1)):
        drawn: dict[str, int | str] = {"GLS_METRIC": 1, "GLS_CHANNELS": 1, "GLS_ALPHA": alpha}
        yield Variant("pass/caster.frag", "core330", {"metric": metric_slot(kind.projection)}, drawn)
    for kind, channel, dialect in product(ONE_VIEW, range(4), DIALECTS):
        slots = mapped_slots(kind, Target.R32F, BIASES[0], MAPPED[0], "metric")
        defines = {**mapped_defines(kind, Target.R32F, BIASES[0], MAPPED[0], False, True), "GLS_CHANNEL": channel}
        yield Variant("pass/forward.frag", dialect, slots, {**defines, "GLS_OUTPUT": 2})
        if dialect != "es100":
            yield Variant("pass/resolve.frag", dialect, slots, defines)


def _forward() -> Iterator[Variant]:
    for dialect, derived in product(("core330", "es100"), (0, 1)):
        yield Variant("pass/forward.vert", dialect, {}, {"GLS_DERIVATIVES": derived})
    for dialect, kind, derived, output in product(DIALECTS, KINDS, (0, 1), (0, 1, 2)):
        defines = {"GLS_DERIVATIVES": derived, "GLS_OUTPUT": output}
        yield Variant("pass/forward.frag", dialect, open_slots(kind), defines)
    for receiver in receivers():
        # The longest text of each; a receiver does not depend on the outputs of its pass.
        longest = {**receiver.defines, "GLS_BOUNDED": 1, "GLS_OUTPUT": 2}
        yield Variant("pass/forward.frag", receiver.dialect, receiver.slots, longest)
    for dialect, kind in product(DIALECTS, KINDS):
        yield Variant("pass/include.frag", dialect, open_slots(kind), {})


def _surface() -> Iterator[Variant]:
    for channels, (textured, colored), smooth, alpha in product((1, 2, 4), _PAINTS, (0, 1), (0, 1)):
        painted = channels == 4 or not (textured or colored)
        if painted and smooth <= (channels >= 2):
            defines = {"GLS_SURFACE": channels, "GLS_SMOOTH": smooth, "GLS_ALPHA": alpha}
            defines |= {"GLS_TEXTURED": textured, "GLS_COLORED": colored}
            for name in ("pass/surface.vert", "pass/surface.frag"):
                yield Variant(name, "core330", {}, defines)
            yield Variant("pass/surface.vert", "core330", {}, {**defines, "GLS_INSTANCED": 1})
            yield Variant("pass/surface.geom", "core330", {}, defines)
            for reverse, mapped in product((0, 1), (0, 1)):
                if mapped <= textured:
                    peeled = {"GLS_PEEL": 1, "GLS_REVERSED": reverse, "GLS_TRANSMISSION_MAP": mapped}
                    yield Variant("pass/surface.frag", "core330", {}, {**defines, **peeled})
            for parallel, (dialect, double) in product((0, 1), (("core330", 0), ("core400", 0), ("core400", 1))):
                tested = {"GLS_CONSERVATIVE": 1, "GLS_ORTHO": parallel, "GLS_DOUBLE": double}
                yield Variant("pass/surface.frag", dialect, {}, {**defines, **tested})


def _depths_read() -> Iterator[Variant]:
    """A filter that reads depths, for every way to read them."""
    reads: tuple[tuple[str, Compare], ...] = (("core330", "depth_taps_raw"), ("core330_gather", "depth_gather_raw"))
    for kind, target, reverse in product(KINDS, TARGETS, (False, True)):
        metric: tuple[tuple[str, Compare], ...] = (("core330", "metric"), ("es100", "metric"))
        for dialect, compare in reads if target.is_depth else metric:
            slots = mapped_slots(kind, target, BIASES[0], Pcss(), compare)
            defines = {**mapped_defines(kind, target, BIASES[0], Pcss(), reverse, True), "GLS_OUTPUT": 2}
            yield Variant("pass/forward.frag", dialect, slots, defines)


def _means() -> Iterator[Variant]:
    """Moment filters, and the passes that make their maps."""
    target = Target.DEPTH32F
    yield Variant("pass/over.vert", "core330", {}, {})
    for filter in MOMENTS:
        yield Variant("pass/blur.frag", "core330", {}, dict(filter.defines()))
        for kind in KINDS:
            defines = {**filter.defines(), **parallel_define(kind.projection)}
            for row in (0, 1):
                yield Variant(
                    "pass/moments.frag", "core330", {"encoding": filter.encoding}, {**defines, "GLS_ROW": row}
                )
            for bias, dialect in product((BIASES[0], BIASES[-1]), ("core330", "core330_gather", "es100")):
                slots = mapped_slots(kind, target, bias, filter, "metric")
                defines = {**mapped_defines(kind, target, bias, filter, False, True), "GLS_OUTPUT": 2}
                yield Variant("pass/forward.frag", dialect, slots, defines)
                if dialect != "es100":
                    yield Variant(
                        "pass/resolve.frag", dialect, slots, {**defines, "GLS_ROUNDED": int(bias is BIASES[0])}
                    )


def _laid_out() -> Iterator[Variant]:
    """Variants for a directional light with several maps, or one with perspective; texel filters do not depend on the layout."""
    kind, target, reads = KINDS[0], TARGETS[0], _DEPTH_READS[0]
    yield Variant("pass/depth_tiles.frag", "core330", {}, {"GLS_SIDE": 16})
    asked: tuple[tuple[Filter, Bias, Target, str, Compare], ...] = (
        *((MAPPED[0], bias, target, *reads[:2]) for bias in BIASES),
        *((filter, BIASES[0], target, *reads[:2]) for filter in (MAPPED[1], MOMENTS[0])),
        (MAPPED[0], BIASES[0], Target.RGBA8, "es100", "metric"),
        (MAPPED[0], BIASES[0], Target.RGBA8, "core330", "metric"),
    )
    for (filter, bias, stored, dialect, compare), count, by_depth in product(asked, (1, 4), (0, 1)):
        slots = mapped_slots(kind, stored, bias, filter, compare, "cascades")
        count = min(count, 2) if dialect == "es100" else count  # WebGL 1 guarantees 16 uniform vectors
        defines = {**mapped_defines(kind, stored, bias, filter, False, True), "GLS_CASCADES": count}
        defines |= {"GLS_BY_DEPTH": by_depth, "GLS_OUTPUT": 2}
        yield Variant("pass/forward.frag", dialect, slots, defines)
        if dialect != "es100":
            yield Variant("pass/resolve.frag", dialect, slots, defines)
    for shaped in ONE_VIEW:
        slots = mapped_slots(shaped, target, BIASES[0], MAPPED[1], reads[1])
        defines = {**mapped_defines(shaped, target, BIASES[0], MAPPED[1], False, True), "GLS_FALLOFF": 1}
        yield Variant("pass/resolve.frag", reads[0], slots, defines)
    for bias, name in product((BIASES[0], BIASES[1]), ("pass/forward.frag", "pass/resolve.frag")):
        slots = mapped_slots(kind, target, bias, MAPPED[1], reads[1], "warped")
        defines = {**mapped_defines(kind, target, bias, MAPPED[1], False, True), "GLS_OUTPUT": 2}
        yield Variant(name, reads[0], slots, defines)


def _resolve() -> Iterator[Variant]:
    for parallel, per_sample in product((0, 1), (0, 1)):
        yield Variant("pass/resolve.vert", "core330", {}, {"GLS_ORTHO": parallel, "GLS_PER_SAMPLE": per_sample})
    opened = open_slots(KINDS[0])
    yield Variant("pass/resolve.frag", "core330", opened, {"GLS_ORTHO": 1})
    yield Variant("pass/resolve.frag", "core330", opened, {"GLS_ORTHO": 1, **PER_SAMPLE})
    # where the colour is; first, last, visibility, linear sum
    for (channels, colors), (first, last, visibility, total) in product(
        _SURFACES, product((0, 1), (0, 1), (0, 1), (0, 1))
    ):
        if total <= last:
            defines = {"GLS_SURFACE": channels, "GLS_COLORS": colors, "GLS_FIRST": first, "GLS_LAST": last}
            defines |= {"GLS_VISIBILITY": visibility, "GLS_SUM": total}
            yield Variant("pass/resolve.frag", "core330", opened, defines)
    for (channels, colors), first, visibility in product(_SURFACES, (0, 1), (0, 1)):
        defines = {"GLS_SURFACE": channels, "GLS_COLORS": colors, "GLS_FIRST": first, "GLS_VISIBILITY": visibility}
        yield Variant("pass/resolve.frag", "core330", opened, {**defines, "GLS_LAST": 0, **PER_SAMPLE})
    # what few pictures have, with one surface
    for above, catches, per_sample, total in product((0, 1), (0, 1), (0, 1), (0, 1)):
        defines = {"GLS_HEMISPHERE": above, "GLS_CATCHES": catches, "GLS_SUM": total}
        if not (per_sample and total):
            yield Variant("pass/resolve.frag", "core330", opened, {**defines, **(PER_SAMPLE if per_sample else {})})
    for toned, exposed, catches in product((0, 1), (0, 1), (0, 1)):
        shown: dict[str, int | str] = {"GLS_TONE": toned, "GLS_EXPOSED": exposed, "GLS_CATCHES": catches}
        yield Variant("pass/resolve.frag", "core330", opened, shown)
        for dialect in DIALECTS:
            yield Variant("pass/forward.frag", dialect, opened, {**shown, "GLS_OUTPUT": 2})
    emits: dict[str, int | str] = {"GLS_EMITS": 1, "GLS_METERED": 1, "GLS_SURFACE": 4, "GLS_COLORS": 2}
    for more in ({}, {**PER_SAMPLE, "GLS_LAST": 0}):
        yield Variant("pass/resolve.frag", "core330", opened, {**emits, **more})
    for kind in ONE_VIEW:
        yield Variant("pass/resolve.frag", "core330", open_slots(kind), {"GLS_COOKIE": 1})
        yield Variant("pass/resolve.frag", "core330", open_slots(kind), {"GLS_COOKIE": 1, **PER_SAMPLE})
        for dialect in DIALECTS:
            yield Variant("pass/forward.frag", dialect, open_slots(kind), {"GLS_COOKIE": 1, "GLS_OUTPUT": 1})
    for kind in KINDS:
        tint: dict[str, int | str] = {"GLS_TINT": kind.most_views, "GLS_AT_INFINITY": int(kind.at_infinity)}
        yield Variant("pass/resolve.frag", "core330", open_slots(kind), tint)
        yield Variant("pass/resolve.frag", "core330", open_slots(kind), {**tint, **PER_SAMPLE})
        for dialect in DIALECTS:
            few = tint | {"GLS_TINT": min(kind.most_views, 2 if dialect == "es100" else 6)}  # as of cascades
            yield Variant("pass/forward.frag", dialect, open_slots(kind), {**few, "GLS_OUTPUT": 1})
        yield Variant("pass/resolve.frag", "core330", open_slots(kind), {**tint, "GLS_TINT_LAYERS": 4})
        for parallel in (0, 1):
            yield Variant("pass/transmittance.frag", "core330", {}, {**tint, "GLS_ORTHO": parallel})
            yield Variant("pass/tinted.frag", "core430", {}, {**tint, "GLS_ORTHO": parallel})
    for textured, colored in _PAINTS:
        painted: dict[str, int | str] = {"GLS_TEXTURED": textured, "GLS_COLORED": colored}
        yield Variant("pass/translucent.vert", "core330", {}, painted)
        for alpha, behind, mapped in product((0, 1), (0, 1), (0, 1)):
            if mapped <= textured:
                defines = {"GLS_ALPHA": alpha, "GLS_BEHIND": behind, "GLS_TRANSMISSION_MAP": mapped}
                yield Variant("pass/translucent.frag", "core330", {}, painted | defines)
    yield Variant("pass/stack.frag", "core330", {}, {})
    for parallel, dialect in product((0, 1), ("core330", "core400")):
        yield Variant("pass/primary.frag", dialect, {}, {"GLS_ORTHO": parallel})
    for channels in (1, 2, 4):
        yield Variant("pass/nothing.frag", "core330", {}, {"GLS_SURFACE": channels})
    for product_ in (0, 1):
        yield Variant("pass/layer.frag", "core330", {}, {"GLS_PRODUCT": product_})
    for samples, name in product(SAMPLES, ("pass/unlayered.frag", "pass/layered_mean.frag")):
        columns, rows = grid(samples)
        yield Variant(name, "core330", {}, {"GLS_COLUMNS": columns, "GLS_ROWS": rows})
    for samples in SAMPLES[1:]:
        columns, rows = grid(samples)
        block: dict[str, int | str] = {"GLS_COLUMNS": columns, "GLS_ROWS": rows}
        for (channels, colors), parallel in product(_SURFACES, (0, 1)):
            defines = {"GLS_SURFACE": channels, "GLS_COLORS": colors, "GLS_ORTHO": parallel}
            yield Variant("pass/fill.frag", "core400", {}, {**defines, **block})
        for output, catches, total, (toned, exposed) in product(
            (0, 1), (0, 1), (0, 1), ((0, 0), (1, 0), (0, 1), (1, 1))
        ):
            choices = {"GLS_OUTPUT": output, "GLS_CATCHES": catches, "GLS_SUM": total}
            choices |= {"GLS_TONE": toned, "GLS_EXPOSED": exposed}
            yield Variant("pass/average.frag", "core430", {}, {**choices, **block})
    for first, marked, neighbors, every in product((0, 1), (0, 1), (0, 1), (0, 1)):
        if not (marked and every):
            asks = {"GLS_FIRST": first, "GLS_MARKED": marked, "GLS_NEIGHBORS": neighbors, "GLS_EVERY": every}
            yield Variant("pass/collect.frag", "core430", {}, asks)
    for receiver in receivers():
        if receiver.dialect != "es100":
            rounded: dict[str, int | str] = {"GLS_ROUNDED": int(receiver.filter is MAPPED[0]), "GLS_SURFACE": 2}
            yield Variant("pass/resolve.frag", receiver.dialect, receiver.slots, {**receiver.defines, **rounded})
            if receiver.target is TARGETS[0] and receiver.bias == BIASES[0]:
                marks = {**receiver.defines, "GLS_MARKS": 1}
                yield Variant("pass/resolve.frag", receiver.dialect, receiver.slots, marks)
