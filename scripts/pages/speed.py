"""Table of frame times over the floor."""

from __future__ import annotations

import numpy as np

from scripts.pages.markdown import Blocks, Numbers, Part, fixed, short, table

FILTERS = {"default": "default: `Exact()`", "hard": "`Hard()`", "pcf 1": "`Pcf(1)`", "pcf 3": "`Pcf(3)`"}


def _condensed(results: Numbers) -> Numbers:
    rows = {name: row for name, row in results.items() if "triangles" in row}
    scenes = {
        short(name): {"triangles": row["triangles"], "nodes": row["nodes"], "floor_ms": row["floor"]["median_ms"]}
        | {kind: row[kind]["ratio"] for kind in FILTERS}
        for name, row in rows.items()
    }
    models = [row["default"]["ratio"] for name, row in rows.items() if name != "courtyard"]
    return {"scenes": scenes, "models": len(models), "median": float(np.median(models))}


def _blocks(numbers: Numbers) -> Blocks:
    results = numbers["results"]
    rows = [
        [
            name,
            f"{row['triangles']:,d}",
            f"{row['nodes']:,d}",
            fixed(row["floor_ms"], 0, "-"),
            *(fixed(row[kind], 2) for kind in FILTERS),
        ]
        for name, row in results["scenes"].items()
    ]
    return {
        "speed": table(("scene", "triangles", "nodes", "floor, ms", *FILTERS.values()), rows),
        "median": f"Over {results['models']} real models the default costs {results['median']:.2f} of the floor in the median.",
    }


PART = Part("speed", ("frame",), _condensed, _blocks)
