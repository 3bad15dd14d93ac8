"""Triangulates one simple polygon with very many corners by a sweep line: K log K steps, where ear clipping takes K^2.

Between the polygon's edges that the line crosses are intervals of its inside. Each knows the edges below and above it, and the
chain of corners to the left of the line that is not yet cut off by triangles. The chain is concave everywhere, so that the next
corner on the line sees the corners from one of its ends on (Hertel and Mehlhorn 1983, "Fast triangulation of simple polygons",
FCT, section 2).

        upper ____________
             /            |  <- the line, going right
      chain (             |
             \\____________|
        lower
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

Edge = tuple[int, int]  # its left and its right corner


@dataclass(eq=False)
class Interval:
    """An interval of the inside; `chain` goes from the lower edge to the upper one.

    If two intervals have met at a corner, `rest` continues from there until the next corner. The last such corner is where
    a chain can be cut in two; otherwise it is at one of the chain's ends.
    """

    lower: Edge
    upper: Edge
    chain: deque[int]
    rest: deque[int] | None = None
    last_is_lower: bool = True

    def join(self) -> None:
        """Join both parts into one chain; the shorter one is moved."""
        if self.rest is not None:
            if len(self.rest) <= len(self.chain):
                self.chain.extend(islice(self.rest, 1, None))
            else:
                self.rest.extendleft(islice(reversed(self.chain), 1, None))
                self.chain = self.rest
            self.rest = None

    def halves(self) -> tuple[deque[int], deque[int]]:
        """The chain up to the last corner, and from there on."""
        if self.rest is not None:
            return self.chain, self.rest
        if self.last_is_lower:
            return deque([self.chain[0]]), self.chain
        return self.chain, deque([self.chain[-1]])


@dataclass
class Sweep:
    """The state of the line."""

    x: list[float]
    y: list[float]
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    active: list[Interval] = field(default_factory=list)  # from bottom to top
    lower_at: dict[int, Interval] = field(default_factory=dict)  # by the right corner of their lower edge
    upper_at: dict[int, Interval] = field(default_factory=dict)

    def turn(self, a: int, b: int, c: int) -> float:
        """Twice the area of the triangle, positive if it is counter-clockwise."""
        x, y = self.x, self.y
        return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])

    def place(self, corner: int) -> int:
        """Number of intervals that start below a corner, or at it."""
        return bisect_left(self.active, True, key=lambda each: self.turn(each.lower[0], each.lower[1], corner) < 0.0)

    def remove(self, interval: Interval, corner: int) -> int:
        """Remove an interval that ends at a corner; returns its index."""
        place = self.place(corner) - 1
        if self.active[place] is not interval:
            raise LookupError
        del self.active[place]
        return place

    def insert(self, place: int, interval: Interval) -> None:
        self.active.insert(place, interval)
        self.lower_at[interval.lower[1]] = interval
        self.upper_at[interval.upper[1]] = interval

    def add_lower(self, interval: Interval, corner: int) -> None:
        """Process a corner at the lower end of the chain: cut off what it sees."""
        chain = interval.chain
        while True:
            while len(chain) > 1 and self.turn(chain[0], corner, chain[1]) >= 0.0:
                self.triangles.append((chain.popleft(), corner, chain[0]))
            if len(chain) > 1 or interval.rest is None:
                break
            chain = interval.chain = interval.rest
            interval.rest = None
        chain.appendleft(corner)
        interval.join()
        interval.last_is_lower = True

    def add_upper(self, interval: Interval, corner: int) -> None:
        """Process a corner at the upper end of the chain."""
        while True:
            chain = interval.chain if interval.rest is None else interval.rest
            while len(chain) > 1 and self.turn(corner, chain[-1], chain[-2]) >= 0.0:
                self.triangles.append((corner, chain.pop(), chain[-1]))
            if len(chain) > 1 or interval.rest is None:
                break
            interval.rest = None
        chain.append(corner)
        interval.join()
        interval.last_is_lower = False

    def meet(self, before: int, corner: int, after: int, before_is_left: bool, after_is_left: bool) -> None:
        """Process the next corner of the sweep; the polygon goes counter-clockwise from `before` to `after`."""
        convex = self.turn(before, corner, after) >= 0.0
        if before_is_left and not after_is_left:
            interval = self.lower_at.pop(corner)
            self.add_lower(interval, corner)
            interval.lower = (corner, after)
            self.lower_at[after] = interval
        elif after_is_left and not before_is_left:
            interval = self.upper_at.pop(corner)
            self.add_upper(interval, corner)
            interval.upper = (corner, before)
            self.upper_at[before] = interval
        elif before_is_left:
            self._close(self.lower_at.pop(corner), self.upper_at.pop(corner), corner)
        elif convex:
            self.insert(self.place(corner), Interval((corner, after), (corner, before), deque([corner])))
        else:
            self._split(self.place(corner) - 1, before, corner, after)

    def _close(self, above: Interval, below: Interval, corner: int) -> None:
        """End an interval, or merge two."""
        self.add_lower(above, corner)
        place = self.remove(above, corner)
        if above is below:
            return
        self.add_upper(below, corner)
        if self.active[place - 1] is not below or place == 0:
            raise LookupError
        below.upper, below.rest = above.upper, above.chain
        self.upper_at[below.upper[1]] = below

    def _split(self, place: int, before: int, corner: int, after: int) -> None:
        """Split an interval at a corner that points left into it."""
        if place < 0:
            raise LookupError
        whole = self.active.pop(place)
        lower, upper = whole.halves()
        below = Interval(whole.lower, (corner, before), lower, last_is_lower=False)
        above = Interval((corner, after), whole.upper, upper)
        self.add_upper(below, corner)
        self.add_lower(above, corner)
        self.insert(place, below)
        self.insert(place + 1, above)


def swept(plane: Array) -> NDArray[np.int64] | None:
    """Triangles (T, 3) of one polygon.

    Parameters
    ----------
    plane : (K, 2)
        Counter-clockwise. Corners equal to the previous one are skipped.

    Returns
    -------
    (T, 3) int64, or None
        None if the sweep finds that the polygon crosses itself. It need not find every crossing: compare the areas.
    """
    corners = np.flatnonzero((plane != np.roll(plane, 1, axis=0)).any(axis=1))
    points = plane[corners]
    order = np.lexsort((points[:, 1], points[:, 0]))  # from left to right, from below where one is above the other
    rank = np.zeros(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    before, after = np.roll(np.arange(len(order)), 1), np.roll(np.arange(len(order)), -1)
    events = zip(
        *(each[order].tolist() for each in (before, after, rank[before] < rank, rank[after] < rank)), strict=True
    )
    line = Sweep(points[:, 0].tolist(), points[:, 1].tolist())
    try:
        for corner, (p, q, p_left, q_left) in zip(order.tolist(), events, strict=True):
            line.meet(p, corner, q, p_left, q_left)
    except LookupError:  # an edge ends in the wrong place
        return None
    return corners[np.array(line.triangles, dtype=np.int64).reshape(-1, 3)]
