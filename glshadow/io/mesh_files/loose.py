"""Points and lines of mesh files: statements `p` and `l` of OBJ, vertices without faces and edges of PLY; and the nodes made from them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.clouds import Loose, existing, lines_of, points_of
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.words import name_of, shown
from glshadow.scene.capsules import Lines, Points
from glshadow.scene.mesh import Material
from glshadow.scene.nodes import Node

STATEMENT = re.compile(rb"^[ \t]*(p|l|usemtl)[ \t]+([^\n]*)", re.MULTILINE)
VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.MULTILINE)


@dataclass
class ObjLoose:
    """The `p` and `l` statements of an OBJ file, by material."""

    found: dict[str, tuple[list[int], list[tuple[int, int]]]] = field(default_factory=dict)
    material: str = ""

    def read(self, block: bytes, before: int) -> None:
        """Read whole lines; `before`: vertices of earlier blocks."""
        if not re.search(rb"^[ \t]*[pl][ \t]", block, re.MULTILINE):
            last = block.rfind(b"usemtl")
            if last < 0:
                return
        at, count = 0, before
        for match in STATEMENT.finditer(block):
            key, rest = match.group(1), match.group(2).partition(b"#")[0].strip()
            if key == b"usemtl":
                self.material = name_of(rest)
                continue
            try:
                numbers = [int(word.partition(b"/")[0]) for word in rest.split()]
            except ValueError:
                raise SceneError(f"the line {shown(match.group())} has an index that is not an integer") from None
            if min(numbers, default=1) < 0:  # counts back from its line
                count += len(VERTEX.findall(block, at, match.start()))
                at = match.start()
                numbers = [count + number + 1 if number < 0 else number for number in numbers]
            points, segments = self.found.setdefault(self.material, ([], []))
            if key == b"p":
                points += [number - 1 for number in numbers]
            else:
                segments += [(a - 1, b - 1) for a, b in pairwise(numbers)]

    def made(self, material_of: Callable[[str], Material]) -> list[Loose]:
        """What was found, with its materials."""
        return [Loose(points, segments, material_of(name)) for name, (points, segments) in self.found.items()]


def loose_nodes(
    positions: Array, colors: Array | None, loose: list[Loose], notes: list[str], budget: Budget
) -> list[Node]:
    """Nodes of points and lines, whose indices refer to positions (V, 3) and linear colours (V, 4).

    Raises
    ------
    SceneError
        For more elements than the limit of triangles.
    """
    nodes: list[Node] = []
    if not loose:
        return nodes
    budget.limits.check(
        "triangles", sum(len(each.points) + len(each.segments) for each in loose), "its points and lines"
    )
    ball, tube = _radii(positions, loose)
    for each in loose:
        points = existing(np.asarray(each.points, dtype=np.int64)[:, None], len(positions), "", "points", notes)[:, 0]
        budget.take(80 * (len(points) + 2 * len(each.segments)), "its points and lines")
        own = None if colors is None else colors[points]
        cloud = points_of(positions[points], own, "its points", notes, each.material, ball)
        if cloud is not None:
            nodes.append(Node(cloud, np.eye(4), "points"))
        lines = lines_of(positions, each.segments, colors, "its lines", notes, each.material, tube)
        if lines is not None:
            nodes.append(Node(lines, np.eye(4), "lines"))
    return nodes


def _radii(positions: Array, loose: list[Loose]) -> tuple[float | None, float | None]:
    """One radius for all points of a file, and one for all lines; None where they have none."""
    found: list[float | None] = []
    for kind, each in ((Points, [each.points for each in loose]), (Lines, [each.segments for each in loose])):
        used = np.unique(np.concatenate([np.asarray(part, dtype=np.int64).ravel() for part in each]))
        places = positions[used[(used >= 0) & (used < len(positions))]]
        places = places[np.isfinite(places).all(axis=1)]
        try:
            found.append(float(kind(places).radius[0]))
        except SceneError:
            found.append(None)
    return found[0], found[1]
