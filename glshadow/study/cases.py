"""The hard cases of the test suite for the report: the result of every technique in each case.

The numbers come from `hard_cases.json`, which the test suite writes: scenes with an exact answer, each expectation tested.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("hard_cases.json")

MARKS = {  # verdict: mark in the table, and the cell's class
    "pass": ("\N{CHECK MARK}", "yes"),
    "fails as predicted": ("\N{MULTIPLICATION SIGN}", "no"),
    "fails, to be mended": ("!", "no"),
}


@dataclass(frozen=True)
class Cell:
    """One technique in one case; `note` is the number of its reason, 0 for none."""

    mark: str
    look: str
    verdict: str
    note: int = 0


@dataclass(frozen=True)
class Row:
    """One case with its cells by technique; None where a technique does not apply."""

    number: int
    title: str
    answer: str
    cells: tuple[Cell | None, ...]


@dataclass(frozen=True)
class Cases:
    """The table, the reasons that its notes refer to, and the cases that are tested in another way: (case, title, what, verdict, why)."""

    techniques: tuple[str, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    others: tuple[tuple[int, str, str, str, str], ...]


def read_cases(path: Path = FILE) -> Cases:
    """Read the table from a file; reasons for failures become numbered notes."""
    content = json.loads(path.read_text(encoding="utf-8"))
    techniques = tuple(content["techniques"])
    notes: list[str] = []
    found: dict[tuple[int, str, str], dict[str, Cell]] = {}
    others = []
    for cell in content["cells"]:
        if cell["technique"] not in techniques:
            others.append(tuple(cell[name] for name in ("case", "title", "technique", "verdict", "why")))
            continue
        row = found.setdefault((cell["case"], cell["title"], cell["answer"]), {})
        row[cell["technique"]] = _cell(cell, notes)
    rows = [Row(*case, tuple(cells.get(name) for name in techniques)) for case, cells in found.items()]
    return Cases(techniques, tuple(rows), tuple(notes), tuple(others))


def _cell(cell: dict[str, Any], notes: list[str]) -> Cell:
    mark, look = MARKS[cell["verdict"]]
    if look != "no":
        return Cell(mark, look, cell["verdict"])
    if cell["why"] not in notes:
        notes.append(cell["why"])
    return Cell(mark, look, cell["verdict"], notes.index(cell["why"]) + 1)
