"""Every shader of lights whose shadow rays are tested against triangles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from glshadow.shader.slots import (
    area_slots,
    direction_slots,
    exact_defines,
    exact_slots,
    open_slots,
    parallel_define,
    precomputed_slots,
    projection_defines,
)
from glshadow.shadows.view import Projection
from scripts.shaders.variant import KINDS, PER_SAMPLE, WIDE, Variant


def exact() -> Iterator[Variant]:
    """Lists, silhouette edges, and the passes that walk them."""
    for kind in KINDS:
        defines = {
            key: value for key, value in exact_defines(kind.projection, 512, 16, False).items() if key != "GLS_HUGE"
        }
        for double in (0, 1):
            yield Variant("pass/lists.comp", "core430", {}, {**defines, "GLS_DOUBLE": double})
        slots = exact_slots(kind)
        for masked, huge, dialect in product((False, True), (False, True), ("core330", "core400")):
            defines = exact_defines(kind.projection, 512, 16, masked, huge)
            # the projection of the camera and smooth meshes do not change the code of the tests: one variant of each
            for number, per_sample in product((0, 1), ({}, PER_SAMPLE)):
                each = {**defines, "GLS_ORTHO": number, "GLS_ROUNDED": number, "GLS_SURFACE": 1 + number, **per_sample}
                yield Variant("pass/resolve.frag", dialect, slots, each)
            for per_sample in ({}, PER_SAMPLE):
                alone = {**defines, "GLS_ALONE": 1, "GLS_WEIGHED": int(masked), "GLS_ROUNDED": int(huge), **per_sample}
                yield Variant("pass/resolve.frag", dialect, slots, alone)
        for masked, huge, parallel in product((False, True), (False, True), (0, 1)):
            defines = {**exact_defines(kind.projection, 512, 16, masked, huge), "GLS_ORTHO": parallel, "GLS_MARKS": 1}
            yield Variant(
                "pass/resolve.frag",
                "core400",
                slots,
                {**defines, "GLS_ROUNDED": parallel, "GLS_SURFACE": 1 + parallel},
            )
        plain = parallel_define(kind.projection)
        yield Variant("pass/edges.comp", "core430", {}, plain)
        yield Variant("pass/edge_lists.comp", "core430", {}, projection_defines(kind.projection))
        for counted, marks in ((0, 0), (1, 0), (1, 1)):
            defines = {**plain, "GLS_COUNTED": counted, "GLS_MARKS": marks}
            yield Variant("pass/resolve.frag", "core330", precomputed_slots(kind), defines)
    others: tuple[Projection, ...] = ("perspective", "cube")
    passes: tuple[dict[str, int | str], ...] = ({}, PER_SAMPLE, {"GLS_MARKS": 1})
    for kind, projection in product(KINDS, others):  # far lights have one grid, and large ones in a cone six
        if not kind.at_infinity and projection != kind.projection:
            for masked, dialect, more in product((False, True), ("core330", "core400"), passes):
                defines = exact_defines(projection, 512, 16, masked) | more
                yield Variant("pass/resolve.frag", dialect, exact_slots(kind), defines)


def points() -> Iterator[Variant]:
    """Passes over given points."""
    for kind, given, rounded in product(KINDS, (1, 2), (0, 1)):
        alone: dict[str, int | str] = {"GLS_POINTS": given, "GLS_ROUNDED": rounded, "GLS_CAPSULES": 2 * rounded}
        selective = {"GLS_SELECTIVE": rounded}
        for huge, dialect in product((False, True), ("core330", "core400")):
            defines = {**exact_defines(kind.projection, 512, 16, bool(rounded), huge), **alone, **selective}
            for weighed in (0, 1, 2):
                counted = {**defines, "GLS_ALONE": 1, "GLS_WEIGHED": weighed}
                yield Variant("pass/resolve.frag", dialect, exact_slots(kind), counted)
            yield Variant("pass/resolve.frag", dialect, exact_slots(kind), {**defines, "GLS_ALONE": 2})
        for stage, between in enumerate(("silhouettes", "region", "found")):
            settings = {
                **exact_defines(kind.projection, 512, 16, bool(rounded)),
                **selective,
                "GLS_POINTS": given,
                "GLS_ROUNDED": rounded,
                "GLS_STAGE": stage,
                "GLS_AREA": int(stage > 0),
            }
            yield Variant("pass/penumbra.frag", "core430", area_slots(kind, between), settings)
    for kind, given in product((*KINDS, *WIDE), (1, 2)):
        for slots in (precomputed_slots(kind), open_slots(kind)):
            final: dict[str, int | str] = {
                "GLS_AT_INFINITY": int(kind.at_infinity),
                "GLS_ALONE": 2,
                "GLS_POINTS": given,
                "GLS_WEIGHED": 2 if kind.per_channel else int(kind.weighted),
                "GLS_ROUNDED": given - 1,
            }
            yield Variant("pass/resolve.frag", "core330", slots, final)
    for given, capsules, dialect in product((1, 2), (0, 2), ("core330", "core400")):
        located: dict[str, int | str] = {"GLS_POINTS": given, "GLS_CAPSULES": capsules}
        yield Variant("pass/locate.frag", dialect, {}, located)


def area() -> Iterator[Variant]:
    """Variants for lights that have a size."""
    yield Variant("pass/scatter.comp", "core430", {}, {})
    for parallel, per_sample in product((0, 1), (0, 1)):
        yield Variant("pass/interpolate.frag", "core430", {}, {"GLS_ORTHO": parallel, "GLS_PER_SAMPLE": per_sample})
    for kind in KINDS:
        defines = projection_defines(kind.projection)
        for silhouettes in (0, 1):
            yield Variant("pass/lists.comp", "core430", {}, {**defines, "GLS_AREA": 1, "GLS_ROUNDED": silhouettes})
            yield Variant("pass/grown.comp", "core430", {}, {**defines, "GLS_SILHOUETTES": silhouettes})
        for (stage, between), masked, huge in product(
            enumerate(("silhouettes", "region", "found")), (False, True), (False, True)
        ):
            settings = {
                **exact_defines(kind.projection, 512, 16, masked, huge),
                "GLS_STAGE": stage,
                "GLS_AREA": int(stage > 0),
            }
            slots = area_slots(kind, between)
            if between == "found" and not masked and not huge:
                for panel, dither in product((0, int(kind.projection == "cube")), (0, 1)):
                    more = {**settings, "GLS_RECT": panel, "GLS_DITHER": dither}
                    yield Variant("pass/penumbra.frag", "core430", slots, more)
            for number, per_sample in product((0, 1), (0, 1)):
                each = {**settings, "GLS_ORTHO": number, "GLS_ROUNDED": number, "GLS_PER_SAMPLE": per_sample}
                yield Variant("pass/penumbra.frag", "core430", slots, each)
            if stage == 0:
                for parallel in (0, 1):
                    more = {**settings, "GLS_ORTHO": parallel, "GLS_ROUNDED": parallel, "GLS_MARKS": 1, "GLS_SOFT": 1}
                    yield Variant("pass/penumbra.frag", "core430", slots, more)
    for kind in WIDE:
        for slots, channels, more in product((precomputed_slots(kind), open_slots(kind)), (1, 2), ({}, PER_SAMPLE)):
            wide: dict[str, int | str] = {
                "GLS_AT_INFINITY": int(kind.at_infinity),
                "GLS_SURFACE": channels,
                "GLS_WEIGHED": 2 if kind.per_channel else int(kind.weighted),
                "GLS_ROUNDED": channels - 1,
            }
            yield Variant("pass/resolve.frag", "core330", slots, {**wide, **more})
        if kind.per_channel:
            for catches, weak in ((1, 0), (0, 1)):
                more = {"GLS_CATCHES": catches, "GLS_WEAK": weak}
                yield Variant("pass/resolve.frag", "core330", precomputed_slots(kind), {**wide, **more})
    for weighed in (1, 2):
        alone = {"GLS_AT_INFINITY": 1, "GLS_ALONE": 1, "GLS_WEIGHED": weighed}
        yield Variant("pass/resolve.frag", "core330", open_slots(KINDS[0]), alone)
        for sets, surface, more in product(
            (1, 4, 16), ({}, {"GLS_ROUNDED": 1}, {"GLS_CAPSULES": 2, "GLS_ORTHO": 1}), ({}, PER_SAMPLE)
        ):
            sampling = {
                **alone,
                **surface,
                **more,
                "GLS_DIRECTIONS": 64,
                "GLS_SETS": sets,
                "GLS_SELECTIVE": int(sets == 4),
                "GLS_BITS": int(sets == 4),
                "GLS_NEAR": int(sets > 1),
            }
            yield Variant("pass/resolve.frag", "core330", direction_slots(), sampling)
        light = next(kind for kind in WIDE if kind.weighted and kind.at_infinity and kind.per_channel == (weighed == 2))
        for orthographic, sets in ((0, 4), (1, 4), (0, 16)):
            mean = {"GLS_AT_INFINITY": 1, "GLS_WEIGHED": weighed, "GLS_PATTERN": sets, "GLS_ORTHO": orthographic}
            yield Variant("pass/resolve.frag", "core330", precomputed_slots(light), mean)
    for stage in (0, 1):
        yield Variant("pass/resolve.vert", "core330", {}, {"GLS_STAGE": stage})
    for point in (0, 1):
        yield Variant("pass/grounds.comp", "core430", {}, {"GLS_POINT": point})
    yield Variant("pass/chain.comp", "core430", {}, {})
    yield Variant("pass/direction_maps.comp", "core430", {}, {})
    yield Variant("pass/depth_bits.frag", "core330", {}, {})
