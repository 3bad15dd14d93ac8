"""Splits the text of mesh files into words and numbers, a block of lines at a time."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError

Indices = NDArray[np.int64]

BLOCK = 1 << 22  # bytes of text that are split at a time: a word takes ten times its length as an object
NEWLINE = 10
COMMENT = re.compile(rb"#[^\n]*")


# UTF-32 first: its mark for little endian begins with that of UTF-16
MARKS = {
    b"\xff\xfe\0\0": "utf-32-le",
    b"\0\0\xfe\xff": "utf-32-be",
    b"\xff\xfe": "utf-16-le",
    b"\xfe\xff": "utf-16-be",
    b"\xef\xbb\xbf": "utf-8",
}


def without_mark(data: bytes) -> bytes:
    """Bytes without a byte order mark at their beginning; text in UTF-16 or UTF-32, as the mark says, becomes UTF-8."""
    for mark, encoding in MARKS.items():
        if data.startswith(mark):
            rest = data[len(mark) :]
            return rest if encoding == "utf-8" else rest.decode(encoding, "replace").encode()
    return data


def text_of(data: bytes) -> bytes:
    """The text with LF at the end of every line, including the last, converted from CR LF, CR, or a mixture."""
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data if data.endswith(b"\n") else data + b"\n"


def name_of(word: bytes) -> str:
    """A name: UTF-8, or Latin-1 as in older exporters."""
    try:
        return word.decode("utf-8")
    except UnicodeDecodeError:
        return word.decode("latin-1")


def shown(word: bytes) -> str:
    """The word as shown in messages."""
    return repr(word[:60].decode(errors="replace"))


def blocks(text: bytes, start: int = 0) -> Iterator[bytes]:
    """Whole lines, in blocks of about BLOCK bytes."""
    while start < len(text):
        end = text.find(b"\n", start + BLOCK) + 1 or len(text)
        yield text[start:end]
        start = end


def first_letters(text: bytes) -> NDArray[np.bool_]:
    """For each byte whether a word starts there."""
    letter = np.frombuffer(text, dtype=np.uint8) > 32
    letter[1:] &= ~letter[:-1]
    return letter


def per_line(text: bytes) -> Indices:
    """Word count of each line; every line must end in LF."""
    ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == NEWLINE)
    return np.diff(np.searchsorted(np.flatnonzero(first_letters(text)), ends), prepend=0)


def numbers(text: bytes, what: str) -> Array:
    """All words as float64.

    Raises
    ------
    SceneError
        Names the first word that is not a number.
    """
    words = text.split()
    try:
        return np.array(words, dtype=np.float64)
    except ValueError:
        wrong = next(word for word in words if not _is(float, word))
        raise SceneError(f"{what}: {shown(wrong)} is not a number") from None


def whole_numbers(text: bytes, what: str) -> Indices:
    """All words as int64.

    Raises
    ------
    SceneError
        Names the first word that is not an integer.
    """
    words = text.split()
    try:
        return np.array(words, dtype=np.int64)
    except (ValueError, OverflowError):
        wrong = next((word for word in words if not _is(int, word)), max(words, key=len))
        raise SceneError(f"{what}: {shown(wrong)} is not an integer that can be an index") from None


def _is(kind: type, word: bytes) -> bool:
    try:
        kind(word)
    except ValueError:
        return False
    return True


def all_numbers(text: bytes, what: str, start: int = 0) -> Array:
    """All words from byte `start` on as float64, block by block; comments after # are skipped."""
    found = [numbers(COMMENT.sub(b"", block) if b"#" in block else block, what) for block in blocks(text, start)]
    return np.concatenate(found) if found else np.zeros(0)


def words_per_line(text: bytes) -> Indices:
    """Word count of each line that is not empty; comments after # are skipped."""
    found = [per_line(COMMENT.sub(b"", block) if b"#" in block else block) for block in blocks(text)]
    counts = np.concatenate([np.zeros(0, dtype=np.int64), *found])
    return counts[counts > 0]


def rows(values: Array, counts: Indices, width: int) -> Array:
    """Numbers of lines with `counts` (N,) of them as (N, width): extra ones are dropped, missing ones are NaN."""
    if len(counts) and (counts == counts[0]).all():
        table = values.reshape(len(counts), int(counts[0]))[:, :width]
        return (
            table
            if table.shape[1] == width
            else np.pad(table, ((0, 0), (0, width - table.shape[1])), constant_values=np.nan)
        )
    table = np.full((len(counts), width), np.nan)
    line = np.repeat(np.arange(len(counts)), counts)
    column = np.arange(len(values)) - np.repeat(np.cumsum(counts) - counts, counts)
    kept = column < width
    table[line[kept], column[kept]] = values[kept]
    return table
