"""MTL material libraries: Kd, d and map_Kd with its options."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from glshadow.core.spaces import Array
from glshadow.io.imported import of_mtl, reflectance
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.soup import Part
from glshadow.io.mesh_files.words import name_of, text_of

MOST_LIBRARIES = 100  # per file: more indicate a list of names rather than materials

# option of a map: number of its words; for NUMERIC ones at most that many
OPTIONS = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-bm": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2}
OPTIONS |= {"-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1, "-colorspace": 1}
NUMERIC = ("-o", "-s", "-t")
WITHOUT_EFFECT = ("-blendu", "-blendv", "-boost", "-bm", "-cc", "-imfchan", "-texres")  # on a colour, as drawn here
# values that equal the default
USUAL = {
    "-clamp": ["off"],
    "-mm": ["0", "1"],
    "-t": ["0", "0", "0"],
    "-colorspace": ["srgb"],
}


@dataclass
class Library:
    """The materials that the MTL files of one OBJ define; their textures are read on use."""

    beside: Beside
    notes: list[str]
    lines: dict[str, dict[str, str]] = field(default_factory=dict)
    files: set[str] = field(default_factory=set)

    def add(self, statement: str) -> None:
        """Read the files that a line `mtllib` names: one file, whose name may have spaces, or several."""
        if len(self.files) > MOST_LIBRARIES:
            return
        names = [statement] if self.beside.has(statement) else statement.split(None, MOST_LIBRARIES + 1)
        if not any(self.beside.has(name) for name in names):
            names = [statement]
        for name in names:
            if name in self.files or len(self.files) > MOST_LIBRARIES:
                continue
            self.files.add(name)
            if len(self.files) > MOST_LIBRARIES:
                self.notes.append(f"it names more than {MOST_LIBRARIES} material libraries: the others are left out")
                continue
            data = self.beside.text(name)
            if data is not None:
                self._read(text_of(data).replace(b"\\\n", b" "))

    def _read(self, text: bytes) -> None:
        current: dict[str, str] = {}
        for line in text.splitlines():
            key, _, rest = line.strip().replace(b"\t", b" ").partition(b" ")
            word = name_of(key).lower()
            if word == "newmtl":
                current = self.lines.setdefault(name_of(rest.strip()), {})
            elif word in ("kd", "d", "map_kd", "map_d"):
                current[word] = name_of(rest.strip())

    def part(self, name: str) -> Part:
        """The part of the faces that use the material; white if it is not defined."""
        given = self.lines.get(name)
        if given is None:
            return Part(name)
        if "map_d" in given:
            self.notes.append(f"{name!r}: map_d is not supported: drawn opaque")
        color = np.ones(3) if "kd" not in given else self._color(given["kd"], name)
        if "map_kd" not in given:
            return Part(name, of_mtl(color, _opacity(given), None))
        picture, scale, offset = self._map(given["map_kd"], name)
        return Part(name, of_mtl(color, _opacity(given), self.beside.picture(picture)), scale, offset)

    def _color(self, words: str, name: str) -> Array:
        values = [_number(word) for word in words.split("#")[0].split()]
        if len(values) not in (1, 3) or None in values:
            self.notes.append(f"{name!r}: its Kd {words[:60]!r} is not three numbers: drawn white")
            return np.ones(3)
        return np.array(reflectance(np.resize(np.array(values, dtype=np.float64), 3), repr(name), self.notes))

    def _map(self, words: str, name: str) -> tuple[str, tuple[float, float], tuple[float, float]]:
        """Name of the texture, which may have spaces, and the effect of -s and -o on texture coordinates: u' = s u + o."""
        moved = {"-s": (1.0, 1.0), "-o": (0.0, 0.0)}
        left, rest = [], words.strip()
        while rest.startswith("-"):
            option, _, after = rest.partition(" ")
            if option.lower() not in OPTIONS:
                break
            given = after.split(None, OPTIONS[option.lower()])[: OPTIONS[option.lower()]]
            if option.lower() in NUMERIC:
                given = given[: next((k for k, word in enumerate(given) if _number(word) is None), len(given))]
            rest = (after.split(None, len(given)) + [""] * (len(given) + 1))[len(given)].strip()
            if option.lower() in moved:
                usual = moved[option.lower()]
                numbers = [_number(word) or 0.0 for word in given[:2]]
                moved[option.lower()] = (*numbers, *usual[len(numbers) :])  # type: ignore[assignment]
            elif option.lower() not in WITHOUT_EFFECT and not _usual(option.lower(), given):
                left.append(option)
        if not self.beside.has(rest) and self.beside.has(rest.split(" ")[-1]):
            rest = rest.split(" ")[-1]
        if left:
            self.notes.append(f"{name!r}: {', '.join(sorted(set(left)))} of its map_Kd not supported: drawn without")
        return rest, moved["-s"], moved["-o"]


def _usual(option: str, given: list[str]) -> bool:
    """Whether an option has its default value."""
    words = [word.lower() if _number(word) is None else f"{float(word):g}" for word in given]
    return option in USUAL and words == USUAL[option][: len(words)]


def _opacity(given: dict[str, str]) -> float:
    words = given.get("d", "1").split()
    value = _number(words[-1]) if words else None  # "d -halo 0.5"
    return 1.0 if value is None else value


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
