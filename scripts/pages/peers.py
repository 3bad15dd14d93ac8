"""Table of glshadow beside pyrender and Embree: time and error of the same picture."""

from __future__ import annotations

from scripts.pages.markdown import Blocks, Numbers, Part, fixed, percent, table

FLOOR = "floor"


def _condensed(results: Numbers) -> Numbers:
    rows = {name: row for name, row in results["results"].items() if not name.startswith(FLOOR)}
    return {name: {each: row.get(each) for each in ("cost", "wrong", "mean")} for name, row in rows.items()}


def _blocks(numbers: Numbers) -> Blocks:
    rows = [
        [name, fixed(row["cost"], 2), percent(row["wrong"], 3, "-"), fixed(row["mean"], 5, "-")]
        for name, row in numbers["results"].items()
    ]
    return {"peers": table(("renderer", "time over the floor", "wrong pixels, %", "mean error of visibility"), rows)}


PART = Part("peers", ("peers", "--processor-time"), _condensed, _blocks)
