"""Composes snippets into one program text, with a map from its lines back to the files.

`#include "lib/packing.glsl"` names a file, `#include <filter>` a slot that the caller fills. A file is included once. A cycle, an
unknown slot and a second inclusion are errors, because they mean that two snippets provide the same thing.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from glshadow.errors import ShaderError
from glshadow.shader import source

_INCLUDE = re.compile(r'^\s*#include\s+(?:"([^"]+)"|<(\w+)>)\s*(?://.*)?$')
_DEFAULT = re.compile(r"^\s*#ifndef\s+(GLS_\w+)", re.MULTILINE)
# At the start of a line: Mesa 0:12(3):, glslang, Apple and AMD ERROR: 0:12:, NVIDIA 0(12) :
_LOCATION = re.compile(r"^(?:(?:ERROR|WARNING): )?0(?::(\d+)(?:\(\d+\))?|\((\d+)\) ?)(?=:)", re.MULTILINE)

_STAGES = {"vert": "GLS_VERTEX", "geom": "GLS_GEOMETRY", "frag": "GLS_FRAGMENT", "comp": "GLS_COMPUTE"}


@dataclass(frozen=True)
class Text:
    """A composed program text.

    Parameters
    ----------
    code : str
        Source code for the compiler.
    origin : tuple of (str, int)
        File and line of each line of `code`.
    files : tuple of str
        Every snippet that it contains.
    declared : frozenset of str
        Defines for which its snippets have a default.
    """

    code: str
    origin: tuple[tuple[str, int], ...]
    files: tuple[str, ...]
    declared: frozenset[str]

    def explain(self, message: str) -> str:
        """A compiler's message with its line numbers replaced by file:line of the snippets."""

        def place(match: re.Match[str]) -> str:
            line = int(match.group(1) or match.group(2))
            if not 1 <= line <= len(self.origin):
                return match.group(0)
            name, number = self.origin[line - 1]
            return f"{name}:{number}"

        return _LOCATION.sub(place, message)


@dataclass
class _Builder:
    slots: Mapping[str, str]
    lines: list[str] = field(default_factory=list)
    origin: list[tuple[str, int]] = field(default_factory=list)
    files: list[str] = field(default_factory=list)

    def add(self, name: str, open_files: tuple[str, ...]) -> None:
        if name in open_files:
            raise ShaderError(f"snippets include each other: {' -> '.join((*open_files, name))}")
        if name in self.files:
            raise ShaderError(f'"{name}" is included twice, the second time by "{open_files[-1]}"')
        self.files.append(name)
        for number, line in enumerate(source.read(name).splitlines(), start=1):
            match = _INCLUDE.match(line)
            if match is None:
                self.lines.append(line)
                self.origin.append((name, number))
                continue
            file, slot = match.groups()
            if slot is not None:
                if slot not in self.slots:
                    raise ShaderError(f"{name}:{number}: slot <{slot}> is not filled; filled are {sorted(self.slots)}")
                file = self.slots[slot]
            self.add(file, (*open_files, name))


def compose(
    name: str, dialect: str, slots: Mapping[str, str] | None = None, defines: Mapping[str, int | str] | None = None
) -> Text:
    """One compilable text from a pass and the snippets it includes.

    Parameters
    ----------
    name : str
        The pass, e.g. "pass/resolve.frag".
    dialect : str
        "core330", "core330_gather" or "es100": the file in dialect/ that comes first and contains `#version`.
    slots : mapping
        Slot name to snippet file.
    defines : mapping
        GLS_ names to values; each needs a default (`#ifndef`) in an included file.

    Raises
    ------
    ShaderError
        For missing snippets, unfilled slots, cycles, double inclusion and undeclared defines.
    """
    builder = _Builder(slots or {})
    builder.add(f"dialect/{dialect}.glsl", ())
    settings = [f"#define {key} {value}" for key, value in sorted((defines or {}).items())]
    stage = _STAGES[name.rpartition(".")[2]]
    head = 1  # after #version, which must be first
    builder.lines[head:head] = [f"#define {stage} 1", *settings]
    builder.origin[head:head] = [("defines", i) for i in range(1 + len(settings))]
    builder.add(name, ())
    code = "\n".join(builder.lines) + "\n"
    declared = frozenset(_DEFAULT.findall(code))
    unknown = set(defines or {}) - declared
    if unknown:
        raise ShaderError(f"no included snippet declares {', '.join(sorted(unknown))}; included are {builder.files}")
    return Text(code, tuple(builder.origin), tuple(builder.files), declared)
