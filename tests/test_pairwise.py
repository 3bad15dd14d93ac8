"""The light suite leaves no pair of settings out, and says what it leaves."""

from __future__ import annotations

from itertools import combinations, product

import pytest

from .pairwise import every_pair, pair_cover

SIZES = [(3, 4, 7, 5), (2, 2, 2), (5, 1, 3), (3, 2, 2, 6, 4), (4, 4)]


@pytest.mark.parametrize("counts", SIZES, ids=str)
def test_every_pair_is_there(counts: tuple[int, ...]) -> None:
    cells = pair_cover(counts)
    for first, second in combinations(range(len(counts)), 2):
        found = {(cell[first], cell[second]) for cell in cells}
        assert found == set(product(range(counts[first]), range(counts[second])))


@pytest.mark.parametrize("counts", SIZES, ids=str)
def test_it_is_small_and_always_the_same(counts: tuple[int, ...]) -> None:
    cells = pair_cover(counts)
    assert cells == pair_cover(counts)
    assert len(set(cells)) == len(cells)
    least = max(a * b for a, b in combinations(counts, 2))  # no cover has fewer
    assert least <= len(cells) <= 1.5 * least


def test_all_cells_are_there_and_the_rest_is_exhaustive() -> None:
    mark = every_pair(kind=("sun", "spot"), size=(1, 2, 3), flag=(False, True)).mark
    names, cells = mark.args
    assert names == ("kind", "size", "flag")
    assert {cell.values for cell in cells} == set(product(("sun", "spot"), (1, 2, 3), (False, True)))
    assert cells[0].id == "sun-1-False"
    light = [cell.values for cell in cells if not cell.marks]
    assert len(light) == len(pair_cover((2, 3, 2))) < len(cells)
    assert {mark.name for cell in cells for mark in cell.marks} == {"exhaustive"}
