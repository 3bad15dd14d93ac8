"""Tables of the errors of real models, and of the cost of coarse formats."""

from __future__ import annotations

from scripts.pages.markdown import Blocks, Numbers, Part, fixed, percent, table

MAPS = {"2048": "map of 2048", "4096": "map of 4096"}
KINDS = ("counted", "none", "wrong", "acne", "leak", "grain")


def _condensed(results: Numbers) -> Numbers:
    lines: Numbers = {}
    for name, row in results["lines"].items():
        line, _, resolution = name.rpartition(", ")
        if resolution in MAPS:
            lines[line]["maps"][resolution] = {each: row[each] for each in ("wrong", "grain")}
        else:
            lines[name] = {each: row[each] for each in KINDS} | {"maps": {}}
    gaps = [{each: row[each] for each in ("light", "target", "predicted", "measured")} for row in results["formats"]]
    return {"lines": lines, "truth": results["truth"], "formats": gaps}


def _blocks(numbers: Numbers) -> Blocks:
    results = numbers["results"]
    truth = results["truth"]
    return {
        "accuracy": table(
            (
                "scene and light",
                "valid",
                "no shadow",
                *KINDS[2:],
                *(f"{what}: wrong, grain" for what in MAPS.values()),
            ),
            [_line(name, row) for name, row in results["lines"].items()],
        ),
        "truth": f"The ray-traced reference of the brain cortex (608,752 triangles) takes {truth['trace_s']:.0f} s and a peak of "
        f"{truth['peak_bytes'] / 2**30:.1f} GiB.",
        "formats": _formats(results["formats"]),
    }


def _line(name: str, row: Numbers) -> list[str]:
    maps = [row["maps"].get(each) for each in MAPS]
    return [
        name.replace("_", " "),
        percent(row["counted"], 0),
        percent(row["none"], 2),
        *(percent(row[each], 3) for each in KINDS[2:]),
        *("" if each is None else f"{percent(each['wrong'], 3)}, {percent(each['grain'], 3)}" for each in maps),
    ]


def _formats(gaps: list[Numbers]) -> str:
    lights = list(dict.fromkeys(gap["light"] for gap in gaps))
    found = {(gap["target"], gap["light"]): gap for gap in gaps}
    rows = [
        [f"`{target}`", *(_gap(found.get((target, light))) for light in lights)]
        for target in dict.fromkeys(gap["target"] for gap in gaps)
    ]
    return table(("format", *lights), rows)


def _gap(gap: Numbers | None) -> str:
    if gap is None:
        return ""
    return f"{fixed(1e3 * gap['predicted'], 1)} predicted, {fixed(1e3 * gap['measured'], 1)} measured"


PART = Part("accuracy", ("accuracy",), _condensed, _blocks)
