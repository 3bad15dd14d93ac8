"""House rules of the snippets: headers, contracts of slots, defaults of defines, names, constants, none left unused."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

from glshadow.core.metric import unpack
from glshadow.gl.context import Caps
from glshadow.shader import source
from glshadow.shader.variants import Variant, receivers, variants

FILES = sorted(
    str(p.relative_to(source.root()))
    for p in source.root().rglob("*")
    if p.suffix in (".glsl", ".vert", ".frag", ".comp")
)
SNIPPETS = [name for name in FILES if not name.startswith("dialect/")]


def code_of(name: str) -> str:
    """Text without comments."""
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


@pytest.mark.parametrize("name", SNIPPETS)
def test_header_says_what_it_is(name: str) -> None:
    first = source.read(name).splitlines()[0]
    assert re.match(r"// \S.{15,}", first), first


@pytest.mark.parametrize("name", FILES)
def test_every_define_has_its_default_in_the_file(name: str) -> None:
    # What a dialect gives, and what compose adds.
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
    code = code_of(name)
    used = set(re.findall(r"\bGLS_\w+", code)) - given
    missing = {define for define in used if not re.search(rf"#(?:ifndef {define}\n\s*#)?define {define}\b", code)}
    assert not missing
    # A define that is set from outside must be open to it.
    settable = {define for variant in all_variants() for define in variant.defines} & used
    assert all(f"#ifndef {define}\n" in re.sub(r" +\n", "\n", code) for define in settable)


@pytest.mark.parametrize("name", SNIPPETS)
def test_names_follow_the_style(name: str) -> None:
    code = code_of(name)
    words = set(re.findall(r"[A-Za-z_]\w*", code))
    assert not {word for word in words if "__" in word}
    assert not {word for word in words if word.startswith("gl_")} - {
        "gl_Position", "gl_FragCoord", "gl_FragColor", "gl_VertexID", "gl_PrimitiveID", "gl_FrontFacing", "gl_FragDepth",
        "gl_GlobalInvocationID",
    }  # fmt: skip
    heads = {"uniform": "u_", "GLS_ATTRIBUTE": "a_", "GLS_VARYING": "v_"}
    for storage, head in heads.items():
        for declared in re.findall(rf"^{storage}\s+(?:highp\s+)?\w+\s+(\w+)", code, re.MULTILINE):
            assert declared.startswith(head), declared
    for declared in re.findall(r"^layout\(.*\)\s*out\s+\w+\s+(\w+)", code, re.MULTILINE):
        assert declared.startswith("o_"), declared
    assert all(word.isupper() for word in re.findall(r"#define\s+(\w+)", code) if not word.startswith("o_"))


@pytest.mark.parametrize("name", SNIPPETS)
def test_no_set_up_of_the_dialects(name: str) -> None:
    assert not re.search(
        r"^\s*(#version|#extension|#line|precision\b|attribute\b|varying\b)", code_of(name), re.MULTILINE
    )


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
    assert len(slots()[slot]) > 1
    for name in slots()[slot]:
        assert all(f"{signature} {{" in code_of(name) for signature in signatures), (name, signatures)


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


def test_twin_of_the_packing() -> None:
    code = code_of("lib/packing.glsl")
    packing, unpacking = (
        [float(number) for number in re.search(rf"{head}\(([^)]*)\)", code).group(1).split(",")]  # type: ignore[union-attr]
        for head in (r"value \* vec4", r"dot\(bytes, vec4")
    )
    np.testing.assert_array_equal(packing, 255.0 ** np.array([3, 2, 1, 0]))
    # Written with eight digits: right to half a float32 step.
    np.testing.assert_allclose(unpacking, unpack(np.eye(4)), rtol=2.0**-24)


def test_twin_of_the_singular_plane() -> None:
    number = re.search(r"terms \* (\S+) \?", code_of("bias/receiver_plane_derivatives.glsl"))
    assert number is not None
    assert np.float32(number.group(1)) == 2.0**-20


def test_slots_are_those_of_the_renderer() -> None:
    """The rules of shader.slots and of gl.sources.mapped are one."""
    from types import SimpleNamespace
    from typing import Any, cast

    from glshadow.gl.sources.mapped import map_defines, map_slots

    from ..gl.small_scene import light_of

    for receiver in receivers():
        view = SimpleNamespace(kind=receiver.kind, inset=0, clip=SimpleNamespace(reversed=receiver.reversed_depth))
        settings = SimpleNamespace(target=receiver.target, bias=receiver.bias)
        shadow_map = cast(Any, SimpleNamespace(views=(view,), settings=settings, filter=receiver.filter))
        caps = SimpleNamespace(texture_gather="gather" in receiver.dialect, software=receiver.compare.endswith("_raw"))
        light = light_of(receiver.kind, None)  # type: ignore[arg-type]
        assert map_slots(light, shadow_map, cast(Caps, caps)) == receiver.slots
        theirs = map_defines(light, shadow_map)
        assert {key: str(value) for key, value in theirs.items()} == {k: str(v) for k, v in receiver.defines.items()}
