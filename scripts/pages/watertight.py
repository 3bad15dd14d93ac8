"""Table of light leaks and false shadows."""

from __future__ import annotations

from collections import defaultdict

from scripts.pages.markdown import Blocks, Numbers, Part, span, table

WHAT = {
    "rays slipped": "rays at edges and vertices that slip through closed surfaces",
    "leaks": "pixels under a jittered sheet that are lit",
    "acne": "pixels of coplanar tessellations that are dark, light 60 to 0.1 degrees high",
}


def _condensed(results: list[Numbers]) -> Numbers:
    found: Numbers = {}
    for key in WHAT:
        asked: dict[str, int] = defaultdict(int)
        wrong: dict[str, int] = defaultdict(int)
        control = []
        for row in results:
            if row["what"].startswith(key):
                asked[row["light"]] += row["asked"]
                wrong[row["light"]] += row["wrong"]
                if row["control"] is not None and not row["every"]:
                    control.append(1e6 * row["control"] / row["asked"])
        found[key] = {"asked": min(asked.values()), "wrong": sum(wrong.values())}
        if control:
            found[key]["control_per_million"] = [min(control), max(control)]
    return found


def _blocks(numbers: Numbers) -> Blocks:
    results = numbers["results"]
    slipped = results["rays slipped"]["control_per_million"]
    rows = [[text, f"{results[key]['asked']:,d}", f"{results[key]['wrong']:,d}"] for key, text in WHAT.items()]
    return {
        "watertight": table(("what", "tested for each kind of light", "wrong, all lights together"), rows)
        + f"\n\nOf a million of these rays a triple product in float32 lets {span(slipped, 0)} through."
    }


PART = Part("watertight", ("watertight",), _condensed, _blocks)
