"""Measures every technique on the courtyard: frame time over the floor, and error against traced rays.

Settings are the defaults, and those that plans, studies and the hard cases try. Times as in `scripts/bench frame`, errors as in
`scripts/bench accuracy`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from accuracy import scored
from frame import SIZE, measure

import glshadow as gs
from glshadow.shadows.filters import FILTERS
from scripts.pages.techniques import measured


@click.command(help=__doc__)
@click.option("--repeats", default=15, show_default=True, help="Rounds of the timing; 0: errors alone.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(repeats: int, output: Path | None) -> None:
    scene = gs.scenes.courtyard()
    filters = {str(each): each for kind in FILTERS for each in measured(kind)}
    times = measure(scene, repeats, filters) if repeats else {}
    truth = gs.trace(scene, size=SIZE, samples=1)
    results: dict[str, dict[str, Any]] = {}
    click.echo(f"{'':12s} {'x floor':>9s} {'wrong %':>9s} {'acne %':>9s} {'leak %':>9s} {'grain %':>9s}")
    with gs.Renderer() as renderer:
        for name, kind in filters.items():
            error = scored(renderer, truth, gs.Shadow(filter=kind))
            results[name] = {"cost": times[name]["ratio"] if times else None, **error}
            cost = f"{results[name]['cost']:9.2f}" if times else f"{'-':>9s}"
            shown = " ".join(f"{100.0 * error[each]:9.4f}" for each in ("wrong", "acne", "leak", "grain"))
            click.echo(f"{name:12s} {cost} {shown}")
    if output:
        output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
