"""Reads STL, binary and ASCII."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.imported import of_mtl, srgb_colors
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.soup import Part, Soup
from glshadow.io.mesh_files.words import blocks, name_of, text_of

HEADER, FACET = 84, 50  # bytes
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
UNCOUNTED = (0, 2**32 - 1)  # placeholders in the header, left by exporters that write before they count
LOOKED = 100_000  # bytes at the beginning that decide whether it is text

MAGICS = b"COLOR="  # in the header of Materialise Magics: red, green, blue and alpha of the whole part follow
LEAST_SHARE = 0.01  # of the facets that a header declares must be there: otherwise it is no STL file

STATEMENT = re.compile(
    rb"\bvertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)|(\bend[ \t]*(?:loop|facet)\b)|^[ \t]*(solid)\b([^\n]*)",
    re.IGNORECASE | re.MULTILINE,
)


def read_stl(data: bytes, _: Beside, notes: list[str], budget: Budget) -> Soup:
    """Read the facets of an STL file, which share no vertices; a text file gives a part per solid.

    Raises
    ------
    SceneError
        If it is neither binary nor ASCII STL, or cut off.
    """
    if _is_text(data):
        return _text(text_of(data), notes, budget)
    records = _binary(data, notes, budget)
    with np.errstate(invalid="ignore"):  # signalling NaNs are handled like others
        corners = records["corners"].reshape(-1, 3).astype(np.float64)
    parts, colors = _colors(data[: HEADER - 4], records["attribute"], notes)
    counts = np.full(len(records), 3)
    return _whole(Soup(corners, np.arange(len(corners)), counts, parts=parts, face_colors=colors), notes)


def is_binary_stl(data: bytes) -> bool:
    """Whether the file has just the length that its binary header declares."""
    return len(data) >= HEADER and len(data) == HEADER + FACET * _declared(data)


def _is_text(data: bytes) -> bool:
    """Whether it is ASCII. Binary files may also begin with 'solid': only text has no zero bytes and soon contains 'facet' or 'solid'."""
    if is_binary_stl(data):
        return False
    head = data[:LOOKED].lower()
    return (b"facet" in head or head.lstrip().startswith(b"solid")) and b"\0" not in data.rstrip(b"\0")


def _declared(data: bytes) -> int:
    return int.from_bytes(data[HEADER - 4 : HEADER], "little")


def _binary(data: bytes, notes: list[str], budget: Budget) -> NDArray[np.void]:
    """Facets (T,) as stored."""
    declared = _declared(data) if len(data) >= HEADER else 0
    facets, left = divmod(max(len(data) - HEADER, 0), FACET)
    if declared in UNCOUNTED and facets and not left:
        notes.append(f"its header declares {declared} facets, the file holds {facets}: all are drawn")
    elif 0 < declared <= facets:
        behind = len(data) - HEADER - FACET * declared
        if behind:
            notes.append(f"{behind} byte(s) behind the last of {declared} facets are ignored")
        facets = declared
    elif facets and facets >= LEAST_SHARE * declared:
        notes.append(
            f"its header declares {declared} facets, {HEADER + FACET * declared} bytes, but the file has {len(data)}: the {facets} that "
            "are there are drawn; it is cut off"
        )
    elif declared or len(data) != HEADER:
        raise SceneError(
            f"broken STL: its header declares {declared} facets, {HEADER + FACET * declared} bytes, but the file has "
            f"{len(data)}; export or download it again"
        )
    budget.limits.check("triangles", facets, "its facets")
    budget.take(200 * facets, "its facets")  # 72 of coordinates, 12 of indices, temporarily twice
    return np.frombuffer(data, dtype=RECORD, count=facets, offset=HEADER)


def _colors(header: bytes, attribute: NDArray[np.uint16], notes: list[str]) -> tuple[list[Part], Array | None]:
    """The part, and colours of facets (T, 4), linear, from two bytes of each: five bits a channel, sRGB.

    Materialise Magics: red in the lowest bits, bit 15 set where the part's colour applies, which the header states; if all are zero, the
    part's colour applies too. VisCAM and SolidView: blue in the lowest bits, bit 15 set where there is a colour.
    """
    own = (attribute & 0x8000) != 0
    levels = np.stack([(attribute >> shift) & 31 for shift in (0, 5, 10)], axis=1) / 31.0
    at = header.find(MAGICS) + len(MAGICS)
    if at < len(MAGICS) or at + 4 > len(header):
        if not own.any():
            return [Part("mesh")], None
        return [Part("mesh")], srgb_colors(np.where(own[:, None], levels[:, ::-1], 1.0), "its facets", notes)
    if b"MATERIAL=" in header:
        notes.append("MATERIAL of its header is not drawn: only COLOR is")
    stored = np.frombuffer(header, dtype=np.uint8, count=4, offset=at) / 255.0
    color, opacity = stored[:3], float(stored[3])
    part = of_mtl(srgb_colors(color[None], "its header", notes)[0, :3], opacity, None)
    if own.all() or not attribute.any():
        return [Part("mesh", part)], None
    white = of_mtl(np.ones(3), opacity, None)
    return [Part("mesh", white)], srgb_colors(np.where(own[:, None], color, levels), "its facets", notes)


def _whole(soup: Soup, notes: list[str]) -> Soup:
    """Remove facets with coordinates that are not finite; since facets share no vertices, others are not affected."""
    good = np.isfinite(soup.positions).all(axis=1)
    if good.all():
        return soup
    facet = np.repeat(np.arange(len(soup.counts)), soup.counts)
    broken = np.bincount(facet[~good], minlength=len(soup.counts)) > 0
    notes.append(f"{int(broken.sum())} of {len(broken)} facets left out: their coordinates are not finite")
    return soup.only(~broken)


def _text(text: bytes, notes: list[str], budget: Budget) -> Soup:
    """Facets of ASCII STL: the corners of each loop, whatever else is around it."""
    solids: list[str] = []
    tables, counts, part, corners = [], [], [], 0
    for block in blocks(text):
        budget.check_time("its facets")
        # a corner of 30 letters: coordinates, indices and triangles (measured: 5)
        budget.take(8 * len(block), "its facets")
        words: list[bytes] = []
        for found in STATEMENT.finditer(block):
            x, y, z, end, solid, name = found.groups()
            if x is not None:
                words += (x, y, z)
                corners += 1
            elif end is not None and corners:
                counts.append(corners)
                part.append(max(len(solids) - 1, 0))
                corners = 0
            elif solid is not None:
                solids.append(name_of(name.strip()) or "mesh")
        tables.append(_numbers(words).reshape(-1, 3))
    if corners:
        notes.append("its last facet is cut off: left out")
    lengths = np.array(counts, dtype=np.int64)
    positions = np.concatenate([np.zeros((0, 3)), *tables])[: int(lengths.sum())]
    parts = [Part(name) for name in solids] or [Part("mesh")]
    several = np.array(part, dtype=np.int64) if len(parts) > 1 else None
    return _whole(Soup(positions, np.arange(len(positions)), lengths, parts=parts, part=several), notes)


def _numbers(words: list[bytes]) -> Array:
    """Words as numbers; NaN for words that are not numbers."""
    try:
        return np.array(words, dtype=np.float64)
    except ValueError:
        return np.concatenate([_number(word) for word in words])


def _number(word: bytes) -> Array:
    try:
        return np.array([word], dtype=np.float64)
    except ValueError:
        return np.array([np.nan])
