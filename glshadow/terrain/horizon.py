"""The horizon of every cell of a height field in one direction, by a sweep along it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

Heights = NDArray[np.floating[Any]]

STRIP = 4096
"""Lines that are swept together: 16 bytes of memory each for every vertex of their hulls."""

PART = 1 << 20
"""Cells whose rays are followed together."""

_FIRST_DEPTH = 32  # vertices of a hull for which memory is there at the beginning


@dataclass(frozen=True, eq=False)
class Oriented:
    """A height field turned so that the sun is towards row 0, and lines away from it go by `slope` columns per row.

    Attributes
    ----------
    heights : (n, m)
        A copy with contiguous rows, or a view of them.
    slope : float
        Columns per row, in [0, 1].
    length : float
        Map units along a line from row to row.
    """

    heights: Heights
    slope: float
    length: float
    swapped: bool
    flipped: tuple[bool, bool]

    @classmethod
    def of(cls, heights: Heights, cell: Array, azimuth: float) -> Oriented:
        """A height field (R, C), whose columns and rows are the map vectors in `cell` (2, 2), for an azimuth in degrees from map y."""
        turn = np.radians(azimuth)
        along = np.linalg.solve(cell, [np.sin(turn), np.cos(turn)])[::-1]  # rows and columns per map unit, to the sun
        swapped = bool(abs(along[1]) > abs(along[0]))
        major, minor = along[::-1] if swapped else along
        # the sine or cosine of a quarter turn is rounded to 6e-17: lines along rows or columns stay within the field
        minor = 0.0 if abs(minor) <= 1e-12 * abs(major) else minor
        flipped = bool(major > 0.0), bool(minor > 0.0)
        view = _turned(heights, swapped, flipped)
        return cls(np.ascontiguousarray(view), abs(minor / major), 1.0 / abs(major), swapped, flipped)

    def view(self, values: NDArray[Any]) -> NDArray[Any]:
        """An array (R, C) as a view (n, m) of this orientation."""
        return _turned(values, self.swapped, self.flipped)


def _turned(values: NDArray[Any], swapped: bool, flipped: tuple[bool, bool]) -> NDArray[Any]:
    view = values.T if swapped else values
    return view[:: -1 if flipped[0] else 1, :: -1 if flipped[1] else 1]


def sweep(field: Oriented, drop: float, above: float) -> Iterator[tuple[int, slice, Array, Array, float]]:
    """Tangents of the horizon on the lines at both sides of the cells, row by row of strips of lines.

    Lines run away from the sun, one column apart in each row. On them heights are linear between the two nearest cells of a row, which is
    exact for a bilinear and for a triangulated surface, and straight from row to row. The horizon of each point of a line is that of the
    line, exactly: the neighbour on the upper hull of the points before it. A cell lies between two lines that are a column apart.

    Parameters
    ----------
    field : Oriented
    drop : float
        1 / (2 R) of an earth of radius R, in map units: what is at distance d is lower by drop d^2. 0: flat.
    above : float
        Height of the receiver above the ground.

    Yields
    ------
    int, slice, (k,) float64, (k,) float64, float
        Row, columns, tangents on the line before each cell and on the line after it, and the weight of the line before; -inf where
        nothing stands before the point, NaN where there is no height.
    """
    rows, columns = field.heights.shape
    first = -int(np.ceil((rows - 1) * field.slope))
    for start in range(first, columns, STRIP):
        lines = _Lines(start, min(STRIP, columns - start) + 1)
        for row in range(rows):
            shift = row * field.slope
            base = int(np.floor(shift))
            share = shift - base
            # Cells of this strip: between line c - base - 1 (at column c - 1 + share) and line c - base (at column c + share).
            low, high = max(start + base + 1, 0), min(start + base + lines.count - 1, columns - 1)
            if start == first:
                low = 0
            if start + lines.count - 1 >= columns:
                high = columns - 1
            if high < 0 or low > high:
                continue
            along = row * field.length
            tangent = lines.advance(field.heights[row], base, share, along, drop, above)
            before = _picked(tangent, low - base - 1 - start, high - base - 1 - start)
            after = _picked(tangent, low - base - start, high - base - start)
            yield row, slice(low, high + 1), before, after, share


def _picked(values: Array, low: int, high: int) -> Array:
    """values[low : high + 1], with NaN outside."""
    found = np.full(high - low + 1, np.nan)
    first, last = max(low, 0), min(high, len(values) - 1)
    if first <= last:
        found[first - low : last - low + 1] = values[first : last + 1]
    return found


def between(before: Array, after: Array, share: float) -> Array:
    """Values at cells: `share` of those on the line before, the rest of those after; where one is missing, the other."""
    if share == 0.0:
        return after
    with np.errstate(invalid="ignore"):  # of -inf
        found = share * before + (1.0 - share) * after
    found = np.where(np.isnan(before), after, np.where(np.isnan(after), before, found))
    return np.where((before == -np.inf) | (after == -np.inf), np.fmax(before, after), found)


class Single:
    """Cells of one orientation that get a ray of their own: where their two lines differ, and beside holes, where there are none."""

    def __init__(self, field: Oriented) -> None:
        self.field = field
        self._rows: list[NDArray[np.int64]] = []
        self._columns: list[NDArray[np.int64]] = []

    def add(self, row: int, columns: NDArray[np.int64]) -> None:
        """Add cells of a row."""
        if len(columns):
            self._rows.append(np.full(len(columns), row))
            self._columns.append(columns)

    def add_unknown(self, row: int, place: slice, values: Array) -> None:
        """Add the cells of a row that have a height and no value."""
        unknown = np.isnan(values)
        if unknown.any():
            self.add(row, place.start + np.flatnonzero(unknown & ~np.isnan(self.field.heights[row, place])))

    def tangents(self, drop: float, above: float, floor: float = -np.inf) -> Iterator[tuple[Any, Array]]:
        """Indices of cells, and their tangents as of `ray_tangents`, in parts."""
        if not self._rows:
            return
        rows, columns = np.concatenate(self._rows), np.concatenate(self._columns)
        for start in range(0, len(rows), PART):
            part = rows[start : start + PART], columns[start : start + PART]
            yield part, ray_tangents(self.field, *part, drop, above, floor)


def ray_tangents(
    field: Oriented,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    drop: float,
    above: float,
    floor: float = -np.inf,
) -> Array:
    """Tangents (N,) of the horizon of cells (N,), each by a ray of its own; -inf where nothing stands before it, NaN without a height.

    The surface is that of `sweep`. A ray ends where the highest cell of the field would not rise above its horizon, or above `floor`: a
    tangent below that is a lower bound.
    """
    heights = field.heights
    start = heights[rows, columns].astype(np.float64)
    found = np.where(np.isnan(start), np.nan, -np.inf)
    peak = float(np.nanmax(heights, initial=-np.inf)) - above
    active = np.flatnonzero(~np.isnan(start))
    for step in range(1, len(heights)):
        distance = step * field.length
        go = (rows[active] >= step) & ((peak - start[active]) > np.maximum(found[active], floor) * distance)
        active = active[go]
        if len(active) == 0:
            break
        shift = step * field.slope
        base = int(np.floor(shift))
        share = shift - base
        row, column = rows[active] - step, columns[active] - base
        inside = column >= (1 if share > 0.0 else 0)
        active, row, column = active[inside], row[inside], column[inside]
        sample = heights[row, column].astype(np.float64)
        if share > 0.0:
            sample += share * (heights[row, column - 1] - sample)
        rise = (sample - drop * distance * distance - start[active] - above) / distance
        found[active] = np.fmax(found[active], rise)
    return found


class _Lines:
    """Upper hulls of the profiles of neighbouring lines, as stacks of vertices."""

    def __init__(self, start: int, count: int) -> None:
        self.start, self.count = start, count
        self.depth = _FIRST_DEPTH
        self.x = np.zeros(count * self.depth)
        self.y = np.zeros(count * self.depth)
        self.size = np.zeros(count, dtype=np.int64)

    def advance(self, heights: Heights, base: int, share: float, along: float, drop: float, above: float) -> Array:
        """Add the points of the next row, and return their tangents (count,): NaN where there is no point."""
        tangent = np.full(self.count, np.nan)
        low = max(0, -(self.start + base))
        high = min(self.count, len(heights) - base - self.start - (1 if share > 0.0 else 0))
        if low >= high:
            return tangent
        place = slice(self.start + base + low, self.start + base + high)
        sample = heights[place].astype(np.float64)
        if share > 0.0:
            sample += share * (heights[place.start + 1 : place.stop + 1] - sample)
        lane = np.arange(low, high)
        known = ~np.isnan(sample)
        if not known.all():
            lane, sample = lane[known], sample[known]
        y = sample - drop * along * along
        tangent[lane] = self._tangents(lane, along, y, above) - 2.0 * drop * along
        self._push(lane, along, y)
        return tangent

    def _tangents(self, lane: NDArray[np.int64], along: float, y: Array, above: float) -> Array:
        """Pop vertices below the line from the new point to the vertex before them; the slope to the last that is left, or -inf."""
        size = self.size[lane]
        found = np.full(len(lane), -np.inf)
        active = np.flatnonzero(size > 0)
        top = lane[active] * self.depth + size[active] - 1
        slope = (self.y[top] - y[active]) / (along - self.x[top])
        while len(active):
            more = size[active] > 1
            done = active[~more]
            found[done] = slope[~more]
            active, top, slope = active[more], top[more] - 1, slope[more]
            beyond = (self.y[top] - y[active]) / (along - self.x[top])
            pop = beyond >= slope
            done = active[~pop]
            found[done] = slope[~pop]
            active, top, slope = active[pop], top[pop], beyond[pop]
            size[active] -= 1
        self.size[lane] = size
        if above:
            known = np.flatnonzero(size > 0)
            top = lane[known] * self.depth + size[known] - 1
            found[known] -= above / (along - self.x[top])
        return found

    def _push(self, lane: NDArray[np.int64], along: float, y: Array) -> None:
        if len(lane) and int(self.size[lane].max()) == self.depth:
            for name in ("x", "y"):
                wider = np.zeros((self.count, 2 * self.depth))
                wider[:, : self.depth] = getattr(self, name).reshape(self.count, self.depth)
                setattr(self, name, wider.ravel())
            self.depth *= 2
        top = lane * self.depth + self.size[lane]
        self.x[top], self.y[top] = along, y
        self.size[lane] += 1


def lit_share(elevation: float, tangent: Array, angle: float) -> Array:
    """Share of the sun's disc above a horizon that is straight across it.

    Parameters
    ----------
    elevation : float
        Of the disc's middle, degrees.
    tangent : (N,) float64
        Of the horizon's elevation.
    angle : float
        The disc's diameter, degrees. 0: a point.
    """
    clear = elevation - np.degrees(np.arctan(tangent))
    if angle == 0.0:
        return np.where(np.isnan(clear), np.nan, (clear > 0.0).astype(np.float64))
    x = np.clip(2.0 * clear / angle, -1.0, 1.0)
    return np.asarray(1.0 - (np.arccos(x) - x * np.sqrt(1.0 - x * x)) / np.pi)
