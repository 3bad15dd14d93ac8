"""Tables of the hard cases: scenes with an exact answer, and the techniques that fail in them."""

from __future__ import annotations

from collections import Counter

from glshadow.study.cases import Cases, Row, read_cases
from scripts.pages.markdown import Blocks, table


def blocks() -> Blocks:
    """Tables from the results that the tests check."""
    cases = read_cases()
    return {
        "hard cases": table(
            ("case", "scene", "the exact answer", "passed", "failed, by the note's number"), _rows(cases)
        ),
        "hard techniques": table(("technique", "cases passed", "failed"), _techniques(cases)),
        "hard notes": "\n".join(f"{number}. {note}" for number, note in enumerate(cases.notes, start=1)),
        "hard others": table(
            ("case", "scene", "technique", "verdict", "where, or why not"),
            [list(map(str, other)) for other in cases.others],
        ),
    }


def _rows(cases: Cases) -> list[list[str]]:
    return [[str(row.number), row.title, row.answer, *_verdicts(cases, row)] for row in cases.rows]


def _verdicts(cases: Cases, row: Row) -> tuple[str, str]:
    tested = [(name, cell) for name, cell in zip(cases.techniques, row.cells, strict=True) if cell is not None]
    failed = [f"{name} ({cell.note})" if cell.note else name for name, cell in tested if cell.verdict != "pass"]
    return f"{len(tested) - len(failed)} of {len(tested)}", ", ".join(failed)


def _techniques(cases: Cases) -> list[list[str]]:
    rows = []
    for k, name in enumerate(cases.techniques):
        verdicts = Counter(cell.verdict for row in cases.rows if (cell := row.cells[k]) is not None)
        failed = sum(verdicts.values()) - verdicts["pass"]
        rows.append([f"`{name}`", f"{verdicts['pass']} of {sum(verdicts.values())}", str(failed)])
    return rows
