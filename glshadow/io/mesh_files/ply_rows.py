"""Reads rows of PLY elements: all at once if every list is as long as the first row's, otherwise row by row."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError
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


def read_elements(data: Bytes, elements: list[Element], budget: Budget) -> dict[str, Columns]:
    """Columns of every element, by element and property name.

    Raises
    ------
    SceneError
        If the header declares more than the file contains.
    """
    found: dict[str, Columns] = {}
    at = 0
    for element in elements:
        least = sum(field.least for field in element.fields)
        if least * element.count > len(data) - at:
            raise _short(element)
        if element.count and least:
            found[element.name], at = _alike(data, at, element) or _one_by_one(data, at, element, budget)
    return found


def _short(element: Element) -> SceneError:
    return SceneError(
        f"its header declares more than the file can hold: {element.count} rows of {element.name!r}; it is cut off or broken"
    )


def _alike(data: Bytes, at: int, element: Element) -> tuple[Columns, int] | None:
    """Columns, and their end; None if lists differ in length."""
    kinds: list[tuple[Any, ...]] = []
    end = at
    for number, field in enumerate(element.fields):
        if field.length is None:
            kinds.append((f"{number}", field.kind))
            end += field.kind.itemsize
            continue
        length = _length(data, end, field.length, element)
        kinds += [(f"{number}n", field.length), (f"{number}", field.kind, (length,))]
        end += field.length.itemsize + length * field.kind.itemsize
        if end > len(data):
            raise _short(element)
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
    return columns, at + rows.nbytes


def _length(data: Bytes, at: int, kind: np.dtype[Any], element: Element) -> int:
    if at + kind.itemsize > len(data):
        raise _short(element)
    return _whole(np.frombuffer(data, dtype=kind, count=1, offset=at)[0].item(), element)


def _whole(length: float, element: Element) -> int:
    if not 0 <= length < 2**53 or length != int(length):
        raise SceneError(f"a row of {element.name!r} has a list of {length} numbers; it is cut off or broken")
    return int(length)


def _one_by_one(data: Bytes, at: int, element: Element, budget: Budget) -> tuple[Columns, int]:
    """The same if the position of a row depends on all rows before it."""
    fields = element.fields
    readers = [
        None if field.length is None else struct.Struct(field.length.str.replace("|", "<")[0] + field.length.char)
        for field in fields
    ]
    sizes = [field.kind.itemsize for field in fields]
    view = data.data
    starts = np.zeros(element.count, dtype=np.int64)
    lengths = np.zeros((len(fields), element.count), dtype=np.int64)
    for row in range(element.count):
        if row % ROWS == 0:
            budget.check_time(f"its rows of {element.name!r}")
        starts[row] = at
        for number, reader in enumerate(readers):
            if reader is None:
                at += sizes[number]
                continue
            if at + reader.size > len(data):
                raise _short(element)
            length = _whole(reader.unpack_from(view, at)[0], element)
            lengths[number, row] = length
            at += reader.size + length * sizes[number]
        if at > len(data):
            raise _short(element)
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
    return columns, at


def _gathered(data: Bytes, places: Indices, kind: np.dtype[Any]) -> NDArray[Any]:
    """Numbers (N,) that begin at `places`."""
    found = np.zeros((len(places), kind.itemsize), dtype=np.uint8)
    for k in range(kind.itemsize):
        found[:, k] = data[places + k]
    return found.reshape(-1).view(kind)
