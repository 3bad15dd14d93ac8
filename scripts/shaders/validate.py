"""`python -m scripts.shaders.validate`: checks every shader against its GLSL version with glslangValidator.

Drivers accept more than the standard. GLSL ES 1.00 is checked with the limits of WebGL 1 (webgl1.conf): only the features that its
Appendix A requires of drivers, and the minimum number of attributes, varyings and uniform vectors.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from glshadow.errors import ShaderError
from scripts.shaders.variant import Variant
from scripts.shaders.variants import distinct

TOOL = "glslangValidator"
MISSING = f"{TOOL} is missing, so no shader was validated (apt-get install glslang-tools)"
_LIMITS = Path(__file__).with_name("webgl1.conf")
_CANARY = "canary.frag"  # an invalid file in each batch: a tool that does not report it checks nothing
_DECLARATION = re.compile(r"\b(uniform|attribute|varying)\s+(?:\w+p\s+)?(\w+)\s+\w+\s*(?:\[\s*(\d+)\s*\])?\s*;")
# Rows and columns of a variable in the packing of GLSL ES 1.00, Appendix A.7.
_SHAPES = {"float": (1, 1), "int": (1, 1), "bool": (1, 1), "vec2": (1, 2), "vec3": (1, 3), "vec4": (1, 4)}
_SHAPES |= {"mat2": (2, 4), "mat3": (3, 3), "mat4": (4, 4)}


def limits() -> dict[str, int]:
    """The limits of WebGL 1, by glslang's names."""
    lines = (line.split("#")[0].split() for line in _LIMITS.read_text(encoding="utf-8").splitlines())
    return {words[0]: int(words[1]) for words in lines if words}


def complaints(texts: Mapping[str, Variant]) -> list[str]:
    """Errors in the given texts (code -> variant), with the snippets' names and lines; empty: none.

    Raises
    ------
    ShaderError
        If glslangValidator is not installed.
    """
    if shutil.which(TOOL) is None:
        raise ShaderError(MISSING)
    found = []
    core = {code: variant for code, variant in texts.items() if variant.dialect != "es100"}
    es = {code: variant for code, variant in texts.items() if variant.dialect == "es100"}
    with tempfile.TemporaryDirectory() as folder:
        found += _validate(core, Path(folder), [])
        conf = Path(folder) / "limits.conf"
        conf.write_text(_es_limits())
        found += _validate(es, Path(folder), [conf.name])
        found += _count(es, Path(folder))
    return found


def _es_limits() -> str:
    """A complete configuration file: glslang takes missing values as 0."""
    lines = []
    ours = limits()
    for line in _run(["-c"], Path.cwd()).splitlines():
        name, value = line.split()
        lines.append(f"{name} {ours.get(name, value)}")
    return "\n".join(lines) + "\n"


def _run(arguments: Sequence[str], folder: Path) -> str:
    return subprocess.run([TOOL, *arguments], cwd=folder, capture_output=True, text=True, check=False).stdout


def _write(texts: Mapping[str, Variant], folder: Path) -> list[str]:
    names = []
    for i, (code, variant) in enumerate(texts.items()):
        names.append(f"{i}.{variant.name.rsplit('.', 1)[1]}")
        (folder / names[-1]).write_text(code, encoding="utf-8")
    return names


def _validate(texts: Mapping[str, Variant], folder: Path, options: list[str]) -> list[str]:
    if not texts:
        return []
    (folder / _CANARY).write_text("this is no shader\n", encoding="utf-8")
    names = [*_write(texts, folder), _CANARY]
    output = _run([*options, *names], folder)
    messages: dict[str, list[str]] = {}
    name = ""
    for line in output.splitlines():
        if line.strip() in names:
            name = line.strip()
            messages[name] = []
        elif line.startswith("ERROR") and "compilation" not in line:
            messages.setdefault(name, []).append(line)
    if set(messages) != set(names) or not messages[_CANARY]:
        raise ShaderError(f"{TOOL} answered for {len(messages)} of {len(names)} files; it printed {output[:500]!r}")
    return [
        f"{variant.compose().explain(line)}    in {variant.label}"
        for key, variant in zip(names, texts.values(), strict=False)
        for line in messages[key]
    ]


def _count(texts: Mapping[str, Variant], folder: Path) -> list[str]:
    """Attributes, varyings and uniform vectors against the limits, which glslang does not count."""
    if not texts:
        return []
    allowed = limits()
    names = _write(texts, folder)
    bodies = _run(["-E", *names], folder).split("#version 100")[1:]
    if len(bodies) != len(names):
        raise ShaderError(f"{TOOL} -E gave {len(bodies)} texts for {len(names)} files")
    found = []
    for body, variant in zip(bodies, texts.values(), strict=True):
        stage = "Vertex" if variant.name.endswith(".vert") else "Fragment"
        names_of_limits = ("MaxVertexAttribs", "MaxVaryingVectors", f"Max{stage}UniformVectors")
        for storage, name in zip(("attribute", "varying", "uniform"), names_of_limits, strict=True):
            rows = vectors(body, storage)
            if rows > allowed[name]:
                found.append(f"{rows} {storage} vectors, {name} is {allowed[name]}    in {variant.label}")
        samplers = len(re.findall(r"\buniform\s+(?:\w+p\s+)?sampler", body))
        if samplers > allowed[f"Max{stage.replace('Fragment', '')}TextureImageUnits"]:
            found.append(f"{samplers} samplers    in {variant.label}")
    return found


def vectors(code: str, storage: str) -> int:
    """Vectors of four that the variables of a preprocessed text use, packed as in GLSL ES 1.00 Appendix A.7.

    Parameters
    ----------
    storage : {"uniform", "attribute", "varying"}
        Attributes are not packed: each uses at least one vector. Samplers use none.
    """
    shapes = []
    for kind, type_name, count in _DECLARATION.findall(code):
        if kind == storage and not type_name.startswith("sampler"):
            rows, columns = _SHAPES[type_name]
            shapes.append((4 if storage == "attribute" else columns, rows * int(count or 1)))
    used: set[tuple[int, int]] = set()
    for columns, rows in sorted(shapes, reverse=True):
        starts = (0, 2) if columns == 2 else range(5 - columns)
        for row, column in ((r, c) for r in range(len(used) + 1) for c in starts):
            cells = {(row + i, column + j) for i in range(rows) for j in range(columns)}
            if not cells & used:
                used |= cells
                break
    return 1 + max((row for row, _ in used), default=-1)


@click.command(help="Compose every shader and check it with glslangValidator.")
def main() -> None:
    texts = distinct()
    try:
        found = complaints(texts)
    except ShaderError as error:
        click.echo(str(error), err=True)
        missing = shutil.which(TOOL) is None
        sys.exit(1 if not missing or os.environ.get("CI") == "true" else 0)
    for line in found:
        click.echo(line, err=True)
    es = sum(variant.dialect == "es100" for variant in texts.values())
    click.echo(f"{len(texts)} shaders ({es} of them GLSL ES 1.00), {len(found)} complaints")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
