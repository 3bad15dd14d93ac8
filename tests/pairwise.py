"""Products of settings, of which every run takes a few cells that hold every pair of values, and `scripts/test --all` takes all."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import combinations, product
from typing import Any

import pytest

Cell = tuple[int, ...]
"""One index for each setting."""


def pair_cover(counts: Sequence[int]) -> list[Cell]:
    """Cells of a product that hold every pair of values of any two settings; always the same ones.

    Greedy: the next cell is the one with most pairs that none before it has, the first of them in the product's order.

    Parameters
    ----------
    counts : sequence of int
        How many values each setting has.
    """
    cells = {cell: set(combinations(enumerate(cell), 2)) for cell in product(*map(range, counts))}
    missing = set().union(*cells.values())
    chosen = []
    while missing:
        best = max(cells, key=lambda cell: len(cells[cell] & missing))
        missing -= cells[best]
        chosen.append(best)
    return chosen


def every_pair(**settings: Sequence[Any]) -> pytest.MarkDecorator:
    """Parametrize a test over a product of settings, all but a cover of its pairs marked `exhaustive`."""
    values = [list(each) for each in settings.values()]
    chosen = set(pair_cover([len(each) for each in values]))
    cells = []
    for cell in product(*(range(len(each)) for each in values)):
        picked = [each[i] for each, i in zip(values, cell, strict=True)]
        marks = () if cell in chosen else (pytest.mark.exhaustive,)
        cells.append(pytest.param(*picked, id="-".join(map(_named, picked)), marks=marks))
    return pytest.mark.parametrize(tuple(settings), cells)


def _named(value: Any) -> str:
    return str(value.value if isinstance(value, Enum) else value)
