"""The promises of the README, each with its number and the command that measures it."""

from __future__ import annotations

from collections.abc import Mapping

from scripts.pages.markdown import Blocks, Numbers, percent


def blocks(results: Mapping[str, Numbers]) -> Blocks:
    """From the results of the parts, by name."""
    courtyard, speed = results["accuracy"]["lines"]["courtyard"], results["speed"]
    rays = results["watertight"]["rays slipped"]
    exact, mapped = percent(courtyard["wrong"], 4), percent(courtyard["maps"]["2048"]["wrong"], 3)
    return {
        "promises": f"""\
- **Exact hard shadows by default.** Shadow rays are tested against the scene's triangles on the GPU: no texel, no bias, no epsilon.
  On the courtyard {exact} % of the valid pixels are wrong, with a 2048 map {mapped} % (`scripts/bench accuracy`). [How](docs/exact.md)
- **As fast as a shadow map.** Over {speed["models"]} real models the default frame takes {speed["median"]:.2f} of the time of a Lambert
  pass and a depth pass, in the median (`scripts/bench frame`). [Speed](docs/speed.md)
- **Watertight.** Of {rays["asked"]:,d} rays aimed at edges and vertices of closed meshes {rays["wrong"]} pass through
  (`scripts/bench watertight`). [How results are checked](docs/how_checked.md)"""
    }
