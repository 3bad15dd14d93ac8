"""The tables in docs/ and the README: their names, measurements and pages."""

from __future__ import annotations

import json
import re
from pathlib import Path

from scripts import pictures
from scripts.pages import (
    accuracy,
    declared,
    exact,
    hard_cases,
    means,
    outdoors,
    peers,
    promises,
    speed,
    techniques,
    watertight,
)
from scripts.pages.markdown import Blocks, Part, measured_line

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"

PARTS: tuple[Part, ...] = (
    techniques.PART,
    accuracy.PART,
    speed.PART,
    exact.PART,
    watertight.PART,
    outdoors.PART,
    means.PART,
    peers.PART,
)
"""In the order of measurement."""

_BLOCK = re.compile(r"(<!-- table: ([\w ]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def stored(part: Part) -> Path:
    """File of a part's numbers."""
    return DOCS / "numbers" / f"{part.name}.json"


def blocks() -> Blocks:
    """Every table by its name, as Markdown, from the stored numbers."""
    found = declared.blocks() | hard_cases.blocks() | pictures.captions()
    results = {}
    for part in PARTS:
        numbers = json.loads(stored(part).read_text(encoding="utf-8"))
        results[part.name] = numbers["results"]
        found |= {f"measured {part.name}": measured_line(part, numbers["measured"]), **part.blocks(numbers)}
    return found | promises.blocks(results)


def rendered() -> dict[Path, str]:
    """Text of each page with tables, filled with the stored numbers.

    Raises
    ------
    ValueError
        If a page names an unknown table, or a table is on no page.
    """
    tables, used, pages = blocks(), set(), {}
    for path in (ROOT / "README.md", *sorted(DOCS.glob("*.md"))):
        text = path.read_text(encoding="utf-8")
        names = [name for _, name, _ in _BLOCK.findall(text)]
        unknown = [name for name in names if name not in tables]
        if unknown:
            raise ValueError(f"{path.name}: no table {', '.join(unknown)}; there are: {', '.join(tables)}")
        used.update(names)
        if names:
            pages[path] = _BLOCK.sub(lambda found: f"{found[1]}{tables[found[2]]}\n{found[3]}", text)
    if missing := set(tables) - used:
        raise ValueError(f"on no page: {', '.join(sorted(missing))}")
    return pages
