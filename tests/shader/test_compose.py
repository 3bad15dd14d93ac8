"""Shader composition: includes, slots, defines, and messages that name the snippet and its line."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from glshadow.errors import ShaderError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Programs
from glshadow.shader import source
from glshadow.shader.compose import compose

Replace = Callable[[dict[str, str]], None]


@pytest.fixture
def snippets(monkeypatch: pytest.MonkeyPatch) -> Replace:
    """Call with {name: text} to add or replace snippets."""
    original = source.read

    def replace(texts: dict[str, str]) -> None:
        monkeypatch.setattr(source, "read", lambda name: texts[name] if name in texts else original(name))

    return replace


MAIN = "pass/test.frag"


def test_version_is_first_and_defines_follow(snippets: Replace) -> None:
    snippets({MAIN: "#ifndef GLS_B\n#define GLS_B 0\n#endif\n#ifndef GLS_A\n#define GLS_A 0\n#endif\n"})
    lines = compose(MAIN, "core330", defines={"GLS_B": 2, "GLS_A": "1.5"}).code.splitlines()
    assert lines[:4] == ["#version 330 core", "#define GLS_FRAGMENT 1", "#define GLS_A 1.5", "#define GLS_B 2"]


def test_stage_follows_the_name(snippets: Replace) -> None:
    snippets({"pass/test.vert": "\n"})
    assert "#define GLS_VERTEX 1\n" in compose("pass/test.vert", "es100").code


def test_includes_nest_and_every_line_knows_its_file(snippets: Replace) -> None:
    snippets(
        {
            MAIN: 'a\n#include "lib/x.glsl"\nb\n',
            "lib/x.glsl": "c\n#include <slot> // what fills it\nd\n",
            "lib/y.glsl": "e\n",
        }
    )
    text = compose(MAIN, "core330", {"slot": "lib/y.glsl"})
    code = text.code.splitlines()
    found = {line: text.origin[i] for i, line in enumerate(code) if line in "abcde"}
    assert found == {
        "a": (MAIN, 1),
        "b": (MAIN, 3),
        "c": ("lib/x.glsl", 1),
        "d": ("lib/x.glsl", 3),
        "e": ("lib/y.glsl", 1),
    }
    assert len(text.origin) == len(code)
    assert text.files == ("dialect/core330.glsl", MAIN, "lib/x.glsl", "lib/y.glsl")


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({MAIN: "#include <nothing>\n"}, r"pass/test\.frag:1: slot <nothing> is not filled; filled are \['slot'\]"),
        ({MAIN: '#include "lib/missing.glsl"\n'}, r'no snippet "lib/missing\.glsl"'),
        ({MAIN: '#include "../README.md"\n'}, r'no snippet "\.\./README\.md"'),
        (
            {
                MAIN: '#include "lib/x.glsl"\n',
                "lib/x.glsl": '#include "lib/y.glsl"\n',
                "lib/y.glsl": '#include "lib/x.glsl"\n',
            },
            r"include each other: pass/test\.frag -> lib/x\.glsl -> lib/y\.glsl -> lib/x\.glsl",
        ),
        ({MAIN: f'#include "{MAIN}"\n'}, r"include each other"),
        (
            {
                MAIN: '#include "lib/x.glsl"\n#include <slot>\n',
                "lib/x.glsl": "\n",
                "lib/y.glsl": '#include "lib/x.glsl"\n',
            },
            r'"lib/x\.glsl" is included twice, the second time by "lib/y\.glsl"',
        ),
    ],
    ids=["unknown slot", "missing file", "outside the folder", "cycle", "itself", "twice"],
)
def test_invalid_slots_and_includes_are_named(snippets: Replace, texts: dict[str, str], message: str) -> None:
    snippets(texts)
    with pytest.raises(ShaderError, match=message):
        compose(MAIN, "core330", {"slot": "lib/y.glsl"})


def test_undeclared_define_is_refused(snippets: Replace) -> None:
    snippets({MAIN: "#ifndef GLS_KNOWN\n#define GLS_KNOWN 0\n#endif\n"})
    with pytest.raises(ShaderError, match=r"no included snippet declares GLS_A, GLS_B; included are .*pass/test\.frag"):
        compose(MAIN, "core330", defines={"GLS_KNOWN": 1, "GLS_B": 1, "GLS_A": 1})
    assert compose(MAIN, "core330").declared == {"GLS_KNOWN"}


# 8 is the snippet's line in the composed source.
@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("0:8(21): error: `x' undeclared", "lib/x.glsl:1: error: `x' undeclared"),
        ("0:8(12): preprocessor error: syntax error", "lib/x.glsl:1: preprocessor error: syntax error"),
        ("0:8(4): warning: `a' used uninitialized", "lib/x.glsl:1: warning: `a' used uninitialized"),
        ("ERROR: 0:8: 'x' : undeclared identifier", "lib/x.glsl:1: 'x' : undeclared identifier"),
        ("WARNING: 0:8: 'x' : something", "lib/x.glsl:1: 'x' : something"),
        ("0(8) : error C1503: undefined variable", "lib/x.glsl:1: error C1503: undefined variable"),
        ("0:4000(1): error: beyond", "0:4000(1): error: beyond"),
        ("error: 0:8 texels, 10:8(2): no place", "error: 0:8 texels, 10:8(2): no place"),
    ],
)
def test_places_in_messages_of_compilers(snippets: Replace, message: str, expected: str) -> None:
    snippets({MAIN: '#include "lib/x.glsl"\n', "lib/x.glsl": "broken\n"})
    text = compose(MAIN, "core330")
    at = text.origin.index(("lib/x.glsl", 1)) + 1
    swap = message.replace("0:8", f"0:{at}").replace("0(8)", f"0({at})") if "texels" not in message else message
    assert text.explain(f"head\n{swap}\ntail") == f"head\n{expected}\ntail"


BROKEN = {
    "undeclared name": "float broken = nowhere;",
    "syntax": "float broken( ;",
    "preprocessor": "#error on purpose",
    "wrong argument": "float broken(Receiver receiver) { return compare_one(1.0); }",
}


@pytest.mark.parametrize("dialect", ["core330", "es100"])
@pytest.mark.parametrize("line", BROKEN.values(), ids=list(BROKEN))
def test_driver_names_the_broken_snippet_and_line(
    snippets: Replace, glcontext: GLContext, line: str, dialect: str
) -> None:
    healthy = source.read("filter/pcf.glsl")
    snippets({"filter/pcf.glsl": f"{healthy}{line}\n"})
    number = healthy.count("\n") + 1
    slots = {
        "light": "light/directional.glsl",
        "shadow": "receiver/mapped.glsl",
        "projection": "projection/orthographic.glsl",
        "depth": "depth/affine.glsl",
        "bias": "bias/none.glsl",
        "compare": "compare/metric.glsl",
        "filter": "filter/pcf.glsl",
    }
    with pytest.raises(ShaderError, match=rf"pass/forward\.frag of .*\n(.*\n)*filter/pcf\.glsl:{number}: ") as caught:
        Programs(glcontext).get("pass/forward.vert", "pass/forward.frag", dialect, slots)
    assert not re.search(r"\b0:\d", str(caught.value)), "a line number of the composed text is left"


def test_driver_names_a_broken_vertex_stage(snippets: Replace, glcontext: GLContext) -> None:
    healthy = source.read("pass/forward.vert")
    snippets({"pass/forward.vert": f"int broken = nowhere;\n{healthy}"})
    with pytest.raises(ShaderError, match=r"^pass/forward\.vert of .*\n(.*\n)*pass/forward\.vert:1: "):
        Programs(glcontext).get(
            "pass/forward.vert",
            "pass/forward.frag",
            slots={"light": "light/directional.glsl", "shadow": "receiver/open.glsl"},
        )
