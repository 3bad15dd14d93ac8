"""Sums over suns, and the file that keeps them while they are unfinished."""

from __future__ import annotations

import time
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from glshadow import archive
from glshadow.core.spaces import Array
from glshadow.journal import Journal, Kept, digest_of_file

EVERY_S = 20.0
"""Seconds between two writes."""


@dataclass(eq=False)
class Sums:
    """What is summed over the suns that are done.

    Attributes
    ----------
    done : int
        Number of suns.
    hours, possible : (36, F) float64
        Hours by month (12) and by hour of the day (24).
    direct : (F,) float64
        Direct irradiation, kWh/m^2; empty without weather.
    mean_seen, mean_front : (G,) float64
        For each sun the share of the area that sees it, and that faces it.
    """

    done: int
    hours: Array
    possible: Array
    direct: Array
    mean_seen: Array
    mean_front: Array

    @classmethod
    def zero(cls, places: int, suns: int, weather: bool) -> Sums:
        """None of the suns."""
        return cls(
            0, np.zeros((36, places)), np.zeros((36, places)), np.zeros(places if weather else 0), np.zeros(suns), np.zeros(suns)
        )  # fmt: skip


class Unfinished:
    """A file with sums, and a journal that says which request they belong to.

    Parameters
    ----------
    path : Path, optional
        None: nothing is kept.
    request : str
        Digest of everything that the sums depend on.
    """

    def __init__(self, path: Path | None, request: str) -> None:
        self._path, self._request = path, request
        self._last = time.monotonic()
        if path is not None:
            self._kept = Kept(journal := Journal(path.with_suffix(".jsonl")))
            journal.add()

    def read(self) -> Sums | None:
        """The sums of an earlier call with this request; None if there are none."""
        if self._path is None or not self._kept.has(self._path.name, self._request):
            return None
        with np.load(self._path, allow_pickle=False) as arrays:
            found = {each.name: arrays[each.name] for each in fields(Sums)}
        return Sums(**{**found, "done": int(found["done"])})

    def write(self, sums: Sums, at_once: bool = False) -> None:
        """Keep sums, if some time has passed since the last write."""
        if self._path is None or (time.monotonic() - self._last < EVERY_S and not at_once):
            return
        archive.write(self._path, {each.name: np.asarray(getattr(sums, each.name)) for each in fields(Sums)})
        self._kept.add(self._request, {self._path.name: digest_of_file(self._path)})
        self._last = time.monotonic()
