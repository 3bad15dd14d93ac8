"""MTL material libraries: base colour, opacity, emission, normal maps, and the options of their maps."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.core.srgb import LUMINANCE
from glshadow.io.imported import cut, of_mtl, reflectance
from glshadow.io.mesh_files.beside import LONGEST, Beside
from glshadow.io.mesh_files.soup import Part
from glshadow.io.mesh_files.words import name_of, text_of, without_mark
from glshadow.scene.mesh import MOST, Material
from glshadow.scene.texture import CLAMP, Sampler, Texture

MOST_NAMES = 8  # in a note
MOST_LIBRARIES = 100  # per file: more indicate a list of names rather than materials

UNESCAPED = re.compile(r"(?<!\\)\s+")
WITH_SUFFIX = re.compile(r"\S.*?\.mtl(?=\s|$)", re.IGNORECASE)  # several names with spaces
# option of a map: number of its words; for NUMERIC ones at most that many
OPTIONS = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-bm": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2}
OPTIONS |= {"-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1, "-colorspace": 1}
NUMERIC = ("-o", "-s", "-t")
WITHOUT_EFFECT = ("-blendu", "-blendv", "-boost", "-bm", "-cc", "-imfchan", "-texres")  # on a colour, as drawn here
# values that equal the default
USUAL = {
    "-mm": ["0", "1"],
    "-t": ["0", "0", "0"],
    "-colorspace": ["srgb"],
}


READ = ("kd", "d", "tr", "map_kd", "map_d", "ke", "map_ke", "norm", "map_bump", "bump")
# statements that are not drawn, by how a note names them; specular highlights (Ks, Ns) are none of them: nothing of a matte surface
LEFT_OUT = {word.lower(): word for word in ("disp", "decal", "refl", "map_Pr", "map_Pm")}
# further maps: the statement, the material's field, and whether the image may be a height map, which is not drawn
MAPS = {
    "map_ke": ("emission_map", False),
    "norm": ("normal_map", False),
    "map_bump": ("normal_map", True),
    "bump": ("normal_map", True),
}
SHOWN = {"map_ke": "map_Ke", "map_bump": "map_Bump"}
CHANNELS = "rgbm"  # of -imfchan: m is the matte channel, alpha
REPEATED, CLAMPED = Sampler(), Sampler((CLAMP, CLAMP))


class Map(NamedTuple):
    """A map of a material: its file, and its effect on texture coordinates: u' = scale u + offset, clamped or repeated."""

    file: str
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    clamp: bool = False


UNMOVED = Map("")


@dataclass
class Library:
    """The materials that the MTL files of one OBJ define; their textures are read on use."""

    beside: Beside
    notes: list[str]
    lines: dict[str, dict[str, str]] = field(default_factory=dict)
    files: set[str] = field(default_factory=set)
    left_out: dict[str, None] = field(default_factory=dict)
    unknown: dict[str, None] = field(default_factory=dict)
    cut: dict[tuple[Any, ...], Material] = field(default_factory=dict)
    textures: dict[tuple[int, bool], Texture] = field(default_factory=dict)

    def add(self, statement: str) -> None:
        """Read the files that a line `mtllib` names: one file, whose name may have spaces, or several."""
        if len(self.files) > MOST_LIBRARIES:
            return
        spaced = [name.replace("\\ ", " ") for name in UNESCAPED.split(statement, MOST_LIBRARIES + 1)]
        suffixed = WITH_SUFFIX.findall(statement) if len(statement) <= LONGEST else []  # takes the square of the length
        ways = [statement], spaced, suffixed[: MOST_LIBRARIES + 1]
        names = next((names for names in ways if any(self.beside.has(name) for name in names)), [statement])
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
            if name and self.lines:
                self.unknown[name] = None
            return Part(name)
        color = np.ones(3) if "kd" not in given else self._color(given["kd"], name)
        maps = {key: self._map(given[key], name) for key in ("map_kd", "map_d", *MAPS) if key in given}
        pictures = {key: self.beside.picture(each.file) for key, each in maps.items()}
        used = [key for key in maps if pictures[key] is not None and self._is_drawn(key, pictures[key])]
        placed = maps[used[0]] if used else UNMOVED
        for key in used:
            if maps[key][1:] != placed[1:]:
                self.notes.append(
                    f"{name!r}: its {_shown(key)} is placed as its {_shown(used[0])} is, not by its own options"
                )
        material = of_mtl(color, self._opacity(given, name), pictures.get("map_kd"))
        mask = pictures.get("map_d")
        if mask is not None:
            material = self._cut(material, mask, given["map_d"])
        sampler = CLAMPED if placed.clamp else REPEATED
        fields: dict[str, Any] = {}
        for key in used:
            if key in MAPS:
                fields.setdefault(MAPS[key][0], self._texture(pictures[key], sampler))
        emission = self._emission(given, name, "emission_map" in fields)
        if fields or any(emission) or placed.clamp:
            material = replace(material, sampler=sampler, emission=emission, **fields)
        return Part(name, material, placed.scale, placed.offset)

    def _is_drawn(self, key: str, picture: NDArray[np.uint8] | None) -> bool:
        """Whether a map is drawn; notes height maps, which are not."""
        if picture is None or not (key in MAPS and MAPS[key][1]) or _has_normals(picture):
            return picture is not None
        self.left_out[f"{_shown(key)} (a height map)"] = None
        return False

    def _texture(self, pixels: NDArray[np.uint8] | None, sampler: Sampler) -> Texture:
        """The texture of an image, one for all materials."""
        assert pixels is not None
        key = (id(pixels), sampler is CLAMPED)
        if key not in self.textures:
            self.textures[key] = Texture(pixels, sampler)
        return self.textures[key]

    def _emission(self, given: dict[str, str], name: str, mapped: bool) -> tuple[float, float, float]:
        """Ke; white where only a map is given, or the exporter left Ke at zero beside it."""
        values = [_number(word) for word in given.get("ke", "0").split("#")[0].split()]
        if len(values) not in (1, 3) or None in values:
            self.notes.append(f"{name!r}: its Ke {given['ke'][:60]!r} is not three numbers: left out")
            values = [0.0]
        stated = np.resize(np.array(values, dtype=np.float64), 3)
        if mapped and not stated.any():
            return (1.0, 1.0, 1.0)
        emitted = np.clip(stated, 0.0, MOST)
        if (emitted != stated).any():
            self.notes.append(f"{name!r}: its Ke is clipped to 0..{MOST:g}")
        red, green, blue = emitted.tolist()
        return red, green, blue

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
        if self.unknown:
            names = ", ".join(map(repr, list(self.unknown)[:MOST_NAMES]))
            self.notes.append(f"{len(self.unknown)} material(s) that no library defines ({names}): drawn white")

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

    def _map(self, words: str, name: str) -> Map:
        """A map by its options and its file's name, which may have spaces."""
        clamp = False
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
            elif option.lower() == "-clamp":
                clamp = given[:1] == ["on"]
            elif option.lower() not in WITHOUT_EFFECT and not _usual(option.lower(), given):
                left.append(option)
        if not self.beside.has(rest) and self.beside.has(rest.split(" ")[-1]):
            rest = rest.split(" ")[-1]
        if left:
            self.notes.append(f"{name!r}: {', '.join(sorted(set(left)))} of its maps not supported: drawn without")
        return Map(rest, moved["-s"], moved["-o"], clamp)


def _shown(key: str) -> str:
    """A statement as it is usually written."""
    return SHOWN.get(key, key.replace("map_k", "map_K"))


def _has_normals(picture: NDArray[np.uint8]) -> bool:
    """Whether an image is a normal map rather than a height map: bluish, while heights are grey."""
    red, green, blue = (float(picture[..., channel].mean()) for channel in range(3))
    return blue > 1.25 * max(red, green)


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
    luminance: NDArray[np.uint8] = np.rint(picture[..., :3] @ LUMINANCE).astype(np.uint8)
    return luminance


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
