"""The promises of the README, each with its number and the command that measures it."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import median

from scripts.pages.markdown import Blocks, Numbers, percent


def blocks(results: Mapping[str, Numbers]) -> Blocks:
    """From the results of the parts, by name."""
    courtyard, speed = results["accuracy"]["lines"]["courtyard"], results["speed"]
    rays = results["watertight"]["rays slipped"]
    models = [row for name, row in speed["scenes"].items() if name != "courtyard"]
    over_map = median(row["default"] / row["pcf 1"] for row in models)
    exact, mapped = percent(courtyard["wrong"], 4), percent(courtyard["maps"]["2048"]["wrong"], 3)
    return {
        "promises": f"""\
- **Exact hard shadows by default.** Shadow rays are tested against the scene's triangles on the GPU: no texel, no bias, no epsilon.
  On the courtyard {exact} % of the valid pixels are wrong, with a 2048 map {mapped} % (`scripts/bench accuracy`). [How](docs/exact.md)
- **About as fast as a shadow map.** Over {speed["models"]} real models under one hard light
  a frame takes {over_map:.2f} of the time with a 2048 map and `Pcf(1)`, in the median (`scripts/bench frame`). [Speed](docs/speed.md)
- **Watertight.** Of {rays["asked"]:,d} rays aimed at edges and vertices of closed meshes {rays["wrong"]} pass through
  (`scripts/bench watertight`). [How results are checked](docs/how_checked.md)"""
    }
