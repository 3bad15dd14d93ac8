"""Parts of an OBJ file: its objects, groups, materials and smoothing groups, from the statements between its faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glshadow.io.mesh_files.mtl import Library
from glshadow.io.mesh_files.soup import Indices, Part, Soup

Statement = tuple[int, str, str]  # faces before it, its keyword, the rest of its line
NO_GROUP = ("", "default", "off")


def assign(soup: Soup, statements: list[Statement], library: Library) -> None:
    """Give a soup a part for each object, group and material in use, and its smoothing groups.

    An `o` begins an object, also where the name was used before; a `g` that repeats a name of its object goes on with that group. Parts are
    named after object and group, or, in a file with only one of these, after their materials.
    """
    faces = len(soup.counts)
    material, materials = _numbered([(at, name) for at, key, name in statements if key == "usemtl"], "", faces)
    segment, names = _segments(statements, faces)
    pairs = segment * len(materials) + material
    used, first = np.unique(pairs, return_index=True) if faces else (np.zeros(0, dtype=np.int64),) * 2
    used = used[np.argsort(first)]  # in the order of the file
    dressed = {number: library.part(materials[number]) for number in dict.fromkeys((used % len(materials)).tolist())}
    several = len(np.unique(used // len(materials))) > 1
    soup.named = several
    soup.parts = []
    for each in used.tolist():
        part, name = dressed[each % len(materials)], names[each // len(materials)] or "mesh"
        by_material = not several and len(used) > 1 and part.name
        soup.parts.append(part if by_material else replace(part, name=name))
    soup.parts = soup.parts or [Part("mesh")]
    if len(used) > 1:
        order = np.argsort(used)
        soup.part = order[np.searchsorted(used[order], pairs)]
    soup.smoothing = _smoothing([(at, name) for at, key, name in statements if key == "s"], faces)


def _numbered(changes: list[tuple[int, str]], start: str, faces: int) -> tuple[Indices, list[str]]:
    """The number of the name that applies to each face, and the names, each once; `changes`: faces before each name."""
    number = {start: 0}
    numbers = [0, *(number.setdefault(name, len(number)) for _, name in changes)]
    return _spread([at for at, _ in changes], numbers, faces), list(number)


def _spread(begins: list[int], values: list[int], faces: int) -> Indices:
    """For each face the value that applies to it: the first one, then another from each of `begins` on."""
    return np.repeat(np.array(values, dtype=np.int64), np.diff([0, *begins, faces]))


def _segments(statements: list[Statement], faces: int) -> tuple[Indices, list[str]]:
    """The number of the object and group of each face, and their names."""
    begins: list[int] = []
    numbers, names = [0], [""]
    groups = {"": 0}  # of the present object
    title = ""
    for at, key, name in statements:
        if key == "o":
            title, groups = name, {"": len(names)}
            names.append(title)
        elif key == "g":
            group = "" if name in NO_GROUP or name == title else name
            if group not in groups:
                groups[group] = len(names)
                names.append(f"{title}/{group}" if title else group)
        else:
            continue
        begins.append(at)
        numbers.append(groups[""] if key == "o" else groups[group])
    return _spread(begins, numbers, faces), names


def _smoothing(changes: list[tuple[int, str]], faces: int) -> Indices | None:
    """The smoothing group of each face, 0 for none; None if no face has one."""
    number = {"": 0, "off": 0, "0": 0}
    values = [0, *(number.setdefault(name.lower(), len(number)) for _, name in changes)]
    found = _spread([at for at, _ in changes], values, faces)
    return found if found.any() else None
