"""Table of the large scene: error by distance with several maps, one perspective map and no map."""

from __future__ import annotations

from scripts.pages.markdown import Blocks, Numbers, Part, fixed, percent, table

BANDS = ("to 10 m", "30 m", "100 m", "300 m", "2 km")


def _condensed(results: Numbers) -> Numbers:
    return results


def _blocks(numbers: Numbers) -> Blocks:
    rows = [
        (f"`{name}`", fixed(row["time"], 2), percent(row["wrong"], 3), *(fixed(each, 4) for each in row["bands"]))
        for name, row in numbers["results"].items()
    ]
    return {"outdoors": table(("setting", "time", "wrong, %", *BANDS), rows)}


PART = Part("outdoors", ("outdoors",), _condensed, _blocks)
