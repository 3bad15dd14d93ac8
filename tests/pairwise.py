"""Which cells of a test every run takes, and which only `scripts/test --all`: of products of settings a cover of all pairs of values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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


def mostly(values: Iterable[Any], *rare: Any) -> list[Any]:
    """Values for `parametrize`; the `rare` ones, which cost much and differ little from others, are marked `exhaustive`.

    Raises
    ------
    ValueError
        If a rare one is none of the values.
    """
    values = list(values)
    if unknown := [each for each in rare if each not in values]:
        raise ValueError(f"{unknown} are not among {values}")
    return [pytest.param(each, marks=pytest.mark.exhaustive if each in rare else ()) for each in values]
