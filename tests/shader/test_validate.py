"""What the GLSL standard and WebGL 1 do not allow is found; `scripts/check` asks it of every text."""

from __future__ import annotations

import shutil
from collections.abc import Callable

import pytest
from click.testing import CliRunner

from glshadow.errors import ShaderError
from scripts.shaders import validate
from scripts.shaders.validate import TOOL, complaints, limits, main, vectors
from scripts.shaders.variant import Variant


@pytest.fixture
def tool(optional: Callable[[str, str], None]) -> None:
    if shutil.which(TOOL) is None:
        optional(TOOL, "glslang-tools")


def of(dialect: str, body: str, stage: str = "frag") -> dict[str, Variant]:
    """A shader of our own, as if it had been composed."""
    heads = {
        "core330": "#version 330 core\n",
        "es100": "#version 100\n" + ("precision highp float;\n" if stage == "frag" else ""),
    }
    return {heads[dialect] + body: Variant(f"pass/forward.{stage}", dialect, OPEN, {})}


OPEN = {"light": "light/directional.glsl", "shadow": "receiver/open.glsl"}


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ("uniform int n; void main() { for (int i = 0; i < n; i++) {} gl_FragColor = vec4(0.0); }", "inductive-loop"),
        ("void main() { float x = 1.0; while (x > 0.0) x -= 1.0; gl_FragColor = vec4(x); }", "while loops"),
        (
            "uniform sampler2D s[2]; uniform int i; void main() { gl_FragColor = texture2D(s[i], vec2(0.0)); }",
            "Non-constant-index",
        ),
        ("uniform vec2 u[4]; uniform int i; void main() { gl_FragColor = u[i].xyxy; }", "Non-constant-index"),
        ("void main() { uint x = 1u; gl_FragColor = vec4(0.0); }", "'uint' : undeclared"),
        ("void main() { gl_FragColor = vec4(dFdx(gl_FragCoord.x)); }", "dFdx"),
        (
            "uniform vec4 u[17]; void main() { gl_FragColor = u[0]; }",
            "17 uniform vectors, MaxFragmentUniformVectors is 16",
        ),
        (
            "varying vec4 a[8]; varying float c; void main() { gl_FragColor = a[0] * c; }",
            "9 varying vectors, MaxVaryingVectors is 8",
        ),
    ],
)
def test_beyond_webgl1_is_found(tool: None, body: str, complaint: str) -> None:
    import re

    found = complaints(of("es100", body))
    assert any(re.search(complaint, line) for line in found), found
    assert all("pass/forward.frag es100" in line for line in found)


def test_vertex_limits_are_counted(tool: None) -> None:
    attributes = "".join(f"attribute float a_{i};\n" for i in range(9))
    found = complaints(of("es100", f"{attributes}void main() {{ gl_Position = vec4(a_8); }}", "vert"))
    assert found
    assert found[0].startswith("9 attribute vectors, MaxVertexAttribs is 8")
    sampler = "uniform sampler2D u_map;\nvoid main() { gl_Position = texture2D(u_map, vec2(0.0)); }"
    assert complaints(of("es100", sampler, "vert"))[0].startswith("1 samplers")


def test_core_errors_are_found_and_placed(tool: None) -> None:
    found = complaints(of("core330", "out vec4 o;\nvoid main() { o = vec4(1.0) }"))
    assert len(found) == 1
    # line 3 of a source that replaces the composed pass: its third line
    assert ":" in found[0].split()[0]
    assert "syntax error" in found[0]


@pytest.mark.parametrize(
    ("code", "rows"),
    [
        ("", 0),
        ("uniform vec4 u_a; uniform float u_b;", 2),
        ("uniform vec3 u_a; uniform float u_b;", 1),
        ("uniform vec2 u_a; uniform vec2 u_b; uniform float u_c;", 2),
        ("uniform vec2 u_a[6]; uniform vec2 u_b; uniform float u_c[6];", 7),
        ("uniform mat4 u_a; uniform mat3 u_b; uniform float u_c;", 7),
        ("uniform highp vec4 u_a[3]; uniform highp sampler2D u_map;", 3),
    ],
)
def test_uniforms_are_packed_as_the_standard_says(code: str, rows: int) -> None:
    assert vectors(code, "uniform") == rows


def test_attributes_are_not_packed() -> None:
    assert vectors("attribute vec2 a_uv; attribute float a_x; uniform vec4 u_a;", "attribute") == 2


def test_limits_are_the_least_of_webgl1() -> None:
    found = limits()
    assert (found["MaxVertexAttribs"], found["MaxVaryingVectors"]) == (8, 8)
    assert (found["MaxVertexUniformVectors"], found["MaxFragmentUniformVectors"]) == (128, 16)
    assert all(value == 0 for name, value in found.items() if name[0].islower())


@pytest.mark.parametrize(("ci", "code"), [("true", 1), ("", 0)])
def test_missing_tool_is_reported(monkeypatch: pytest.MonkeyPatch, ci: str, code: int) -> None:
    monkeypatch.setattr(validate, "TOOL", "no-such-validator")
    monkeypatch.setattr(validate, "distinct", dict)
    monkeypatch.setenv("CI", ci)
    result = CliRunner().invoke(main)
    assert result.exit_code == code
    assert "apt-get install glslang-tools" in result.output


def test_silence_of_the_tool_is_an_error(monkeypatch: pytest.MonkeyPatch, tool: None) -> None:
    monkeypatch.setattr(validate, "_run", lambda arguments, folder: "")
    with pytest.raises(ShaderError, match="answered for 0 of 2"):
        complaints(of("core330", "void main() {}"))
