"""MTL material libraries: Kd, d, Tr, map_Kd and map_d with their options."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.io.imported import cut, of_mtl, reflectance
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.soup import Part
from glshadow.io.mesh_files.words import name_of, text_of, without_mark
from glshadow.scene.mesh import Material

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


READ = ("kd", "d", "tr", "map_kd", "map_d")
# statements that are not drawn, by how a note names them; specular highlights (Ks, Ns) are none of them: nothing of a matte surface
LEFT_OUT = {
    word.lower(): word
    for word in ("Ke", "map_Ke", "map_Bump", "bump", "norm", "disp", "decal", "refl", "map_Pr", "map_Pm")
}
CHANNELS = "rgbm"  # of -imfchan: m is the matte channel, alpha
LUMINANCE = (0.2126, 0.7152, 0.0722)  # Rec. 709
Placement = tuple[tuple[float, float], tuple[float, float]]
"""Scale and offset of texture coordinates."""
UNMOVED: Placement = ((1.0, 1.0), (0.0, 0.0))


@dataclass
class Library:
    """The materials that the MTL files of one OBJ define; their textures are read on use."""

    beside: Beside
    notes: list[str]
    lines: dict[str, dict[str, str]] = field(default_factory=dict)
    files: set[str] = field(default_factory=set)
    left_out: dict[str, None] = field(default_factory=dict)
    cut: dict[tuple[Any, ...], Material] = field(default_factory=dict)

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
                self._read(text_of(without_mark(data)).replace(b"\\\n", b" "))

    def _read(self, text: bytes) -> None:
        current: dict[str, str] = {}
        for line in text.splitlines():
            key, _, rest = line.strip().replace(b"\t", b" ").partition(b" ")
            word = name_of(key).lower()
            if word == "newmtl":
                current = self.lines.setdefault(name_of(rest.strip()), {})
            elif word in READ:
                current[word] = name_of(rest.strip())
            elif word in LEFT_OUT and _has_effect(name_of(rest)):
                self.left_out[LEFT_OUT[word]] = None

    def part(self, name: str) -> Part:
        """The part of the faces that use the material; white if it is not defined."""
        given = self.lines.get(name)
        if given is None:
            return Part(name)
        color = np.ones(3) if "kd" not in given else self._color(given["kd"], name)
        picture, placed = None, UNMOVED
        if "map_kd" in given:
            file, placed = self._map(given["map_kd"], name, "map_Kd")
            picture = self.beside.picture(file)
        mask = None
        if "map_d" in given:
            file, moved = self._map(given["map_d"], name, "map_d")
            mask = self.beside.picture(file)
            if picture is None:
                placed = moved
            elif mask is not None and moved != placed:
                self.notes.append(f"{name!r}: its map_d is placed as its map_Kd is, not by its own options")
        material = of_mtl(color, self._opacity(given, name), picture)
        if mask is not None:
            material = self._cut(material, mask, given["map_d"])
        return Part(name, material, *placed)

    def _cut(self, material: Material, mask: NDArray[np.uint8], options: str) -> Material:
        """The material with the alpha of a mask; materials with the same pair of images share the result."""
        key = (id(material.texture), id(mask), material.alpha_mode, options)
        if key not in self.cut:
            pixels = max(mask.size // 4, 1 if material.texture is None else material.texture.size // 4)
            self.beside.budget.take(12 * pixels, "its masks")
            self.cut[key] = cut(material, _scalar(mask, options))
        made = self.cut[key]
        return replace(material, texture=made.texture, alpha_mode=made.alpha_mode)

    def note_left_out(self) -> None:
        """Add the note on statements that are not drawn."""
        if self.left_out:
            self.notes.append(f"{', '.join(self.left_out)} of its materials: not drawn")

    def _opacity(self, given: dict[str, str], name: str) -> float:
        """d, or 1 - Tr. 0 counts as opaque, as the exporters that write it mean."""
        words = given.get("d", given.get("tr", "")).split()
        value = _number(words[-1]) if words else None  # "d -halo 0.5"
        if value is None:
            return 1.0
        opacity = value if "d" in given else 1.0 - value
        if opacity == 0.0:
            self.notes.append(f"{name!r} has an opacity of 0: drawn opaque, since exporters that write it mean this")
        return opacity

    def _color(self, words: str, name: str) -> Array:
        values = [_number(word) for word in words.split("#")[0].split()]
        if len(values) not in (1, 3) or None in values:
            self.notes.append(f"{name!r}: its Kd {words[:60]!r} is not three numbers: drawn white")
            return np.ones(3)
        return np.array(reflectance(np.resize(np.array(values, dtype=np.float64), 3), repr(name), self.notes))

    def _map(self, words: str, name: str, statement: str) -> tuple[str, Placement]:
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
            self.notes.append(
                f"{name!r}: {', '.join(sorted(set(left)))} of its {statement} not supported: drawn without"
            )
        return rest, (moved["-s"], moved["-o"])


def _usual(option: str, given: list[str]) -> bool:
    """Whether an option has its default value."""
    words = [word.lower() if _number(word) is None else f"{float(word):g}" for word in given]
    return option in USUAL and words == USUAL[option][: len(words)]


def _has_effect(rest: str) -> bool:
    """Whether a statement that is not drawn would change the image: a map, or a number other than 0."""
    values = [_number(each) for each in rest.split()]
    return None in values or any(values)


def _scalar(picture: NDArray[np.uint8], options: str) -> NDArray[np.uint8]:
    """The one channel (H, W) of a mask: as -imfchan says, otherwise its alpha if it has any, otherwise its luminance."""
    words = options.lower().split()
    channel = words[words.index("-imfchan") + 1] if "-imfchan" in words[:-1] else ""
    if channel and channel in CHANNELS:
        return np.ascontiguousarray(picture[..., CHANNELS.index(channel)])
    if channel != "l" and (picture[..., 3] < 255).any():
        return np.ascontiguousarray(picture[..., 3])
    luminance: NDArray[np.uint8] = np.rint(picture[..., :3] @ np.array(LUMINANCE)).astype(np.uint8)
    return luminance


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
