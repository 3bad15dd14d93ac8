"""Tables of the exact filter: pixels against float64, time against maps, the floor and Embree."""

from __future__ import annotations

from collections.abc import Iterable

from scripts.pages.markdown import NOT_MEASURED, Blocks, Numbers, Part, fixed, percent, short, span, table

MAP = ", map "  # in the name of a load that differs only in its map, which Exact does not have
LIGHTS = ("sun", "spot", "point")


def _condensed(results: Numbers) -> Numbers:
    wrong, moving = results["wrong"], results["moving"]
    scenes = dict.fromkeys(name.rpartition(" ")[0] for name in wrong)
    embree, growth = results["embree"].values(), results["growth"]
    return {
        "scenes": {
            short(name): {
                "time": [moving[f"{name} {light}"]["ratio"] for light in LIGHTS],
                "wrong": [wrong[f"{name} {light}"]["ours"] for light in LIGHTS],
                "pixels": wrong[f"{name} sun"]["pixels"],
                "counted_wrong": max(wrong[f"{name} {light}"]["counted_wrong"] for light in LIGHTS),
            }
            for name in scenes
        },
        "embree_over_frame": _ends(1.0 / row["frame_trimesh"] for row in embree),
        "embree_with_tree_over_frame": _ends(1.0 / row["frame_trimesh_with_tree"] for row in embree),
        "build_over_depth_pass": _ends(row["ratio"] for row in results["build"].values()),
        "still_over_floor": _ends([results["still"]["exact"]]),
        "samples": {count: results["samples"][count] for count in ("1", "16")},
        "growth": {name: {key: row[key] for key in ("floor_ms", "map", "exact")} for name, row in growth.items()},
        "exact_ms_beside_maps": _ends(row["exact_ms"] for name, row in growth.items() if MAP in name),
    }


def _ends(values: Iterable[float]) -> list[float]:
    found = list(values)
    return [min(found), max(found)]


def _blocks(numbers: Numbers) -> Blocks:
    results = numbers["results"]
    one, many = (results["samples"][count] for count in ("1", "16"))
    return {
        "exact": table(
            (
                "scene",
                "time: sun",
                "spot",
                "point",
                "wrong pixels: sun, spot, point",
                "wrong valid pixels, %, worst of the three",
            ),
            [_scene(name, row) for name, row in results["scenes"].items()],
        ),
        "exact besides": "\n".join(
            [
                f"- Embree, called through trimesh for the same image, takes {span(results['embree_over_frame'], 1)} times as long as "
                f"the whole exact frame, {span(results['embree_with_tree_over_frame'], 1)} times with its tree built before.",
                f"- The list build takes {span(results['build_over_depth_pass'], 2)} of a depth-only pass from 600,000 triangles on.",
                f"- With a light at rest and a moving camera the exact frame costs {span(results['still_over_floor'], 2)} of "
                "the floor.",
                f"- Against 4 x 4 rays a pixel the mean error is {one['mean']:.4f} with one sample and {many['mean']:.4f} with 16, at "
                f"{many['ratio']:.1f} times the frame time.",
            ]
        ),
        "growth": table(
            ("load", "floor, ms", "default over the floor", "exact over the floor"),
            [
                [
                    _load(name),
                    fixed(row["floor_ms"], 0),
                    fixed(row["map"], 2),
                    "" if MAP in name else fixed(row["exact"], 2),
                ]
                for name, row in results["growth"].items()
            ],
        )
        + f"\n\n`Exact()` has no map: {span(results['exact_ms_beside_maps'], 0)} ms, for all sizes of the map beside it.",
    }


def _load(name: str) -> str:
    """A load in words: `9980 triangles`, `courtyard, 2 lights`, `courtyard, map 512`."""
    number, _, what = name.partition(" ")
    return (
        f"{int(number):,d} {what}"
        if number.isdigit()
        else name.replace(", 1 lights", ", 1 light").replace(MAP, ", map of ")
    )


def _scene(name: str, row: Numbers) -> list[str]:
    wrong = ", ".join(NOT_MEASURED if each is None else str(each) for each in row["wrong"])
    times = [fixed(each, 2) for each in row["time"]]
    return [name, *times, f"{wrong} of {row['pixels']:,d}", percent(row["counted_wrong"], 4)]


PART = Part("exact", ("exact",), _condensed, _blocks)
