"""Contracts of the snippets: signatures of slots, defaults of defines, none unused, one set of slot rules."""

from __future__ import annotations

import re
from functools import cache

import pytest

from glshadow.gl.driver.context import Caps
from glshadow.shader import source
from scripts.shaders.variant import Variant
from scripts.shaders.variants import receivers, variants

FILES = sorted(
    str(p.relative_to(source.root()))
    for p in source.root().rglob("*")
    if p.suffix in (".glsl", ".vert", ".frag", ".comp", ".geom")
)


def code_of(name: str) -> str:
    """Source without comments."""
    return re.sub(r"//[^\n]*", "", source.read(name))


@cache
def all_variants() -> list[Variant]:
    return list(variants())


@cache
def slots() -> dict[str, set[str]]:
    """Slot -> snippets that fill it."""
    found: dict[str, set[str]] = {}
    for variant in all_variants():
        for slot, name in variant.slots.items():
            found.setdefault(slot, set()).add(name)
    return found


def test_every_define_has_its_default_in_its_file() -> None:
    """A core compiler treats `#if` of an undefined name as 0: a misspelled switch would always be off."""
    # Defined by a dialect, or added by compose.
    given = {
        "GLS_VERTEX",
        "GLS_FRAGMENT",
        "GLS_COMPUTE",
        "GLS_PRECISE",
        "GLS_CORE",
        "GLS_ATTRIBUTE",
        "GLS_VARYING",
        "GLS_TEXTURE_2D",
    }
    settable = {define for variant in all_variants() for define in variant.defines}
    for name in FILES:
        code = re.sub(r" +\n", "\n", code_of(name))
        used = set(re.findall(r"\bGLS_\w+", code)) - given
        assert used <= set(re.findall(r"#define (GLS_\w+)", code)), name
        # A define that is set from outside must be overridable.
        assert all(f"#ifndef {define}\n" in code for define in used & settable), name


# receiver/ is the folder of slot <shadow>, exact/ that of slot <candidates>.
FOLDERS = {"shadow": "receiver", "candidates": "exact"}


@pytest.mark.parametrize(
    "slot", ["light", "shadow", "candidates", "projection", "depth", "bias", "compare", "filter", "metric"]
)
def test_files_of_a_slot_share_the_signatures_of_its_readme(slot: str) -> None:
    readme = (source.root() / FOLDERS.get(slot, slot) / "README.md").read_text(encoding="utf-8")
    signatures = re.findall(r"`((?:float|void|vec[234]|bool|Receiver) \w+\([^`]*\))`", readme)
    assert f"`<{slot}>`" in readme
    assert signatures
    assert len(slots()[slot]) > (slot != "candidates")  # whose other snippet is that of tests/exact/fans.py
    for name in slots()[slot]:
        code = code_of(name) + "".join(map(code_of, re.findall(r'^#include "(.+)"', source.read(name), re.MULTILINE)))
        assert all(f"{signature} {{" in code for signature in signatures), (name, signatures)


def test_every_slot_is_known_and_every_snippet_used() -> None:
    wanted = {slot for name in FILES for slot in re.findall(r"^#include <(\w+)>", source.read(name), re.MULTILINE)}
    assert wanted == set(slots())
    used = {name for variant in all_variants() for name in variant.slots.values()}
    used |= {variant.name for variant in all_variants()} | {
        f"dialect/{variant.dialect}.glsl" for variant in all_variants()
    }
    while more := {n for name in used for n in re.findall(r'^#include "(.+)"', source.read(name), re.MULTILINE)} - used:
        used |= more
    assert set(FILES) == used


def test_slots_equal_those_of_the_renderer() -> None:
    """shader.slots and gl.techniques.mapped use the same rules."""
    from types import SimpleNamespace
    from typing import Any, cast

    from glshadow.gl.techniques.mapped import map_defines, map_slots

    from ..gl.small_scene import light_of

    lights = [light_of(kind, None) for kind in ("directional", "spot", "point")]  # type: ignore[arg-type]

    for receiver in receivers():
        clip = SimpleNamespace(reversed=receiver.reversed_depth)
        view = SimpleNamespace(projection=receiver.kind.projection, inset=0, clip=clip, cascade=None, warp=None)
        settings = SimpleNamespace(target=receiver.target, bias=receiver.bias, channel=None)
        shadow_map = cast(Any, SimpleNamespace(views=(view,), settings=settings, filter=receiver.filter))
        caps = SimpleNamespace(texture_gather="gather" in receiver.dialect, software=receiver.compare.endswith("_raw"))
        light = next(each for each in lights if type(each) is receiver.kind)
        assert map_slots(light, shadow_map, cast(Caps, caps)) == receiver.slots
        theirs = map_defines(light, shadow_map)
        assert {key: str(value) for key, value in theirs.items()} == {k: str(v) for k, v in receiver.defines.items()}
