"""Reads rows of PLY elements: all at once if every list is as long as the first row's, otherwise row by row."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.words import Indices

Bytes = NDArray[np.uint8]
ROWS = 1 << 16  # rows between two checks of the time limit


@dataclass(frozen=True)
class Field:
    """A property: numbers of one type, or lists of them (`length`: the type of their count)."""

    name: str
    kind: np.dtype[Any]
    length: np.dtype[Any] | None = None

    @property
    def least(self) -> int:
        """Minimum bytes per row."""
        return self.kind.itemsize if self.length is None else self.length.itemsize


@dataclass(frozen=True)
class Element:
    """The header's declaration of one kind of row."""

    name: str
    count: int
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class Ragged:
    """Lists: their concatenated numbers, and the length of each."""

    values: NDArray[Any]
    counts: Indices


Columns = dict[str, "NDArray[Any] | Ragged"]


def read_elements(data: Bytes, elements: list[Element], notes: list[str], budget: Budget) -> dict[str, Columns]:
    """Columns of every element, by element and property name; of a file that is cut off, its whole rows, with a note."""
    found: dict[str, Columns] = {}
    at = 0
    for element in elements:
        least = sum(field.least for field in element.fields)
        if not (element.count and least):
            continue
        there = replace(element, count=min(element.count, (len(data) - at) // least))
        columns = _alike(data, at, there) if there.count else None
        if columns is None:
            columns = _one_by_one(data, at, there, notes, budget)
        found[element.name], rows, at = columns
        if rows < element.count:
            notes.append(
                f"its header declares more than the file can hold: {element.count} rows of {element.name!r}, of which {rows} are there; "
                "it is cut off or broken"
            )
            break  # what follows would be read from the wrong place
    return found


def without_surplus(
    values: Array, counts: Indices, elements: list[Element], notes: list[str]
) -> tuple[Array, set[tuple[str, str]]]:
    """The numbers of a text file without those behind the end of each row, where every row is a line.

    Also the properties, as names of element and property, that hold something else: VCGLIB declares colours of corners as numbers,
    but writes them as a list.

    Parameters
    ----------
    values : (N,)
        All numbers after the header.
    counts : (L,)
        Numbers on each line that is not empty.
    """
    ends = np.cumsum(counts)
    starts = ends - counts
    line, surplus = 0, np.zeros(len(values), dtype=bool)
    misread: set[tuple[str, str]] = set()
    for element in elements:
        if not element.fields:
            continue
        rows = slice(line, line + element.count)
        line += element.count
        at = starts[rows].copy()
        last, scalars = at.copy(), []  # what follows the last list
        for field in element.fields:
            if field.length is None:
                at += 1
                scalars.append(field.name)
                continue
            inside = at < ends[rows]
            with np.errstate(invalid="ignore"):  # NaN is not a length: not a row per line
                length = values[np.where(inside, at, 0)]
                length = np.where(inside & (length >= 0.0) & (length < len(values)), length, len(values))
            at += 1 + length.astype(np.int64)
            last, scalars = at.copy(), []
        if (at > ends[rows]).any():
            return values, set()  # rows go on over the ends of lines, or the file is broken
        behind = ends[rows] - at
        if behind.any():
            _mark(surplus, at, behind)
            notes.append(
                f"{int((behind > 0).sum())} rows of {element.name!r} are longer than its header says: {int(behind.sum())} surplus words "
                "skipped"
            )
            if scalars and (values[last] == ends[rows] - last - 1).all():
                notes.append(f"{', '.join(scalars)} of {element.name!r} are lists there, against its header: left out")
                misread |= {(element.name, name) for name in scalars}
    return (values[~surplus] if surplus.any() else values), misread


def _mark(marked: NDArray[np.bool_], starts: Indices, counts: Indices) -> None:
    """Mark runs of `counts` entries that begin at `starts`."""
    inside = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    marked[np.repeat(starts, counts) + inside] = True


def _alike(data: Bytes, at: int, element: Element) -> tuple[Columns, int, int] | None:
    """Columns, the number of rows, and their end; None if lists differ in length."""
    kinds: list[tuple[Any, ...]] = []
    end = at
    for number, field in enumerate(element.fields):
        if field.length is None:
            kinds.append((f"{number}", field.kind))
            end += field.kind.itemsize
            continue
        if end + field.length.itemsize > len(data):
            return None
        length = _length(np.frombuffer(data, dtype=field.length, count=1, offset=end)[0].item())
        if length is None:
            return None
        end += field.length.itemsize + length * field.kind.itemsize
        if end > len(data):
            return None
        kinds += [(f"{number}n", field.length), (f"{number}", field.kind, (length,))]
    if (end - at) * element.count > len(data) - at:
        return None
    rows = np.frombuffer(data, dtype=np.dtype(kinds), count=element.count, offset=at)
    columns: Columns = {}
    for number, field in enumerate(element.fields):
        values = rows[f"{number}"]
        if field.length is None:
            columns[field.name] = values
            continue
        counts = rows[f"{number}n"]
        if (counts != values.shape[1]).any():
            return None
        columns[field.name] = Ragged(values.reshape(-1), counts.astype(np.int64))
    return columns, element.count, at + rows.nbytes


def _length(stored: float) -> int | None:
    """The length of a list; None if it cannot be one."""
    return int(stored) if 0 <= stored < 2**53 and stored == int(stored) else None


def _one_by_one(data: Bytes, at: int, element: Element, notes: list[str], budget: Budget) -> tuple[Columns, int, int]:
    """The same if the position of a row depends on all rows before it; ends before the first row that is not whole."""
    fields = element.fields
    readers = [
        None if field.length is None else struct.Struct(field.length.str.replace("|", "<")[0] + field.length.char)
        for field in fields
    ]
    sizes = [field.kind.itemsize for field in fields]
    view = data.data
    starts = np.zeros(element.count, dtype=np.int64)
    lengths = np.zeros((len(fields), element.count), dtype=np.int64)
    rows = 0
    for row in range(element.count):
        if row % ROWS == 0:
            budget.check_time(f"its rows of {element.name!r}")
        starts[row] = end = at
        for number, reader in enumerate(readers):
            if reader is None:
                end += sizes[number]
                continue
            if end + reader.size > len(data):
                end = len(data) + 1
                break
            stored = reader.unpack_from(view, end)[0]
            length = _length(stored)
            if length is None:
                notes.append(f"a row of {element.name!r} has a list of {stored:g} numbers; it is cut off or broken")
                end = len(data) + 1
                break
            lengths[number, row] = length
            end += reader.size + length * sizes[number]
        if end > len(data):
            break
        at, rows = end, row + 1
    starts, lengths = starts[:rows], lengths[:, :rows]
    columns: Columns = {}
    for number, field in enumerate(fields):
        if field.length is None:
            columns[field.name] = _gathered(data, starts, field.kind)
            starts = starts + field.kind.itemsize
            continue
        counts, starts = lengths[number], starts + field.length.itemsize
        inside = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
        places = np.repeat(starts, counts) + inside * field.kind.itemsize
        columns[field.name] = Ragged(_gathered(data, places, field.kind), counts)
        starts = starts + counts * field.kind.itemsize
    return columns, rows, at


def _gathered(data: Bytes, places: Indices, kind: np.dtype[Any]) -> NDArray[Any]:
    """Numbers (N,) that begin at `places`."""
    found = np.zeros((len(places), kind.itemsize), dtype=np.uint8)
    for k in range(kind.itemsize):
        found[:, k] = data[places + k]
    return found.reshape(-1).view(kind)
