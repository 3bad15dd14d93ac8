"""Every shader of materials that are more than a base colour."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from glshadow.core.sampling import SAMPLES, grid
from glshadow.gl.scene.paint import FACE_NORMALS, MAP, Features
from glshadow.shader.slots import exact_defines, exact_slots, open_slots, precomputed_slots
from scripts.shaders.variant import KINDS, PER_SAMPLE, WIDE, Variant

_FEATURES = tuple(
    Features(*shine, *each)
    for shine in ((False, False), (True, False), (False, True))
    for each in product((False, True), repeat=3)
    if any((*shine, *each))
)
_MAPS = ("GLS_METALLIC_ROUGHNESS_MAP", "GLS_OCCLUSION_MAP")


def materials() -> Iterator[Variant]:
    """The camera pass by features of the scene and maps of a material; passes that read its surface buffer."""
    for features in _FEATURES:
        scene: dict[str, int | str] = {**features.defines(4), "GLS_SURFACE": 4}
        for defines in _drawn(features):
            yield from _camera_pass({**scene, **defines})
        yield from _read(features, {**scene, "GLS_COLORS": 2})


def _drawn(features: Features) -> Iterator[dict[str, int | str]]:
    """What a material of such a scene draws: nothing more, or all that the scene has."""
    yield {}
    maps = [name for name, there in zip(_MAPS, (features.glossy, features.occluded), strict=True) if there]
    for normal_map in range(1, FACE_NORMALS + 1) if features.bumped else (0,):
        for emission in range(1, MAP + 2) if features.emits else (0,):
            sets = int(bool(maps) or normal_map > 0 or emission == MAP)
            defines = {
                "GLS_SETS": sets,
                "GLS_NORMAL_MAP": normal_map,
                "GLS_EMISSION": emission,
                **dict.fromkeys(maps, 1),
            }
            yield {**defines, "GLS_SMOOTH": int(normal_map > 0), "GLS_TEXTURED": int(normal_map != 1)}


def _camera_pass(defines: dict[str, int | str]) -> Iterator[Variant]:
    for name in ("pass/surface.vert", "pass/surface.frag", "pass/surface.geom"):
        yield Variant(name, "core330", {}, defines)
    yield Variant("pass/surface.vert", "core330", {}, {**defines, "GLS_INSTANCED": 1})
    for dialect, double in (("core330", 0), ("core400", 1)):
        tested: dict[str, int | str] = {"GLS_CONSERVATIVE": 1, "GLS_ORTHO": double, "GLS_DOUBLE": double}
        yield Variant("pass/surface.frag", dialect, {}, {**defines, **tested})


def _read(features: Features, scene: dict[str, int | str]) -> Iterator[Variant]:
    for samples in SAMPLES[1:]:
        columns, rows = grid(samples)
        yield Variant("pass/fill.frag", "core400", {}, {**scene, "GLS_COLUMNS": columns, "GLS_ROWS": rows})
    for kind, first in product(KINDS, (0, 1)):
        each: dict[str, int | str] = {**scene, "GLS_FIRST": first, "GLS_AT_INFINITY": int(kind.at_infinity)}
        for more in ({}, {"GLS_ORTHO": 1}, {**PER_SAMPLE, "GLS_LAST": 0}):
            yield Variant("pass/resolve.frag", "core330", open_slots(kind), {**each, **more})
    for rounded, catches in product((0, 1), (0, 1)):
        exact = exact_defines(KINDS[0].projection, 512, 16, False)
        seen: dict[str, int | str] = {"GLS_ROUNDED": rounded, "GLS_CATCHES": catches, "GLS_AT_INFINITY": 1}
        yield Variant("pass/resolve.frag", "core330", exact_slots(KINDS[0]), {**exact, **scene, **seen})
    for channels, colors in ((1, 0), (1, 1), (2, 0), (2, 1)) if features == Features(rough=True) else ():
        few = {**features.defines(channels), "GLS_SURFACE": channels, "GLS_COLORS": colors}
        for kind, more in product(KINDS, ({}, {"GLS_ORTHO": 1}, {**PER_SAMPLE, "GLS_LAST": 0})):
            yield Variant(
                "pass/resolve.frag",
                "core330",
                open_slots(kind),
                {**few, "GLS_AT_INFINITY": int(kind.at_infinity), **more},
            )
    for kind in WIDE:
        for slots, weighed in ((open_slots(kind), 0), (precomputed_slots(kind), 2 if kind.per_channel else 0)):
            for first, more in product((0, 1), ({}, {"GLS_ORTHO": 1}, {**PER_SAMPLE, "GLS_LAST": 0})):
                wide: dict[str, int | str] = {**scene, "GLS_FIRST": first, "GLS_WEIGHED": weighed}
                yield Variant(
                    "pass/resolve.frag", "core330", slots, {**wide, "GLS_AT_INFINITY": int(kind.at_infinity), **more}
                )
                for channels, colors in ((1, 0), (1, 1), (2, 0), (2, 1)) if features == Features(rough=True) else ():
                    few = {**features.defines(channels), "GLS_SURFACE": channels, "GLS_COLORS": colors}
                    yield Variant("pass/resolve.frag", "core330", slots, {**wide, **few, **more})
    for orthographic in (0, 1):
        yield Variant("pass/resolve.vert", "core330", {}, {"GLS_ORTHO": orthographic, "GLS_ROUGH": int(features.rough)})
