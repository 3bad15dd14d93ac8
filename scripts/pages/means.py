"""Table of the cost of a prefiltered shadow map, in addition to the map itself."""

from __future__ import annotations

from scripts.pages.markdown import Blocks, Numbers, Part, fixed, table

KINDS = ("Esm", "Vsm", "Evsm", "Msm")


def _condensed(results: Numbers) -> Numbers:
    return {kind: [results["means"][f"{kind} {radius}"] for radius in (0, 1, 4)] for kind in KINDS}


def _blocks(numbers: Numbers) -> Blocks:
    rows = [
        (f"`{kind}`", fixed(fill - 1.0, 2), fixed(narrow - fill, 2), fixed(wide - fill, 2))
        for kind, (fill, narrow, wide) in numbers["results"].items()
    ]
    return {"means": table(("filter", "filled and sampled, not blurred", "blur of 3 x 3", "of 9 x 9"), rows)}


PART = Part("means", ("filters", "--section", "means"), _condensed, _blocks)
