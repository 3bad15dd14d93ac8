"""The large scene: error by distance, and time, with one map, cascades, a perspective map and no map.

Mean visibility error against traced rays over lit pixels; medians of frames with a moving light, alternating, over those of one map.
"""

from __future__ import annotations

import json
import time
import warnings
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

import glshadow as gs

SIZE = (960, 540)
BANDS = ((0.0, 10.0), (10.0, 30.0), (30.0, 100.0), (100.0, 300.0), (300.0, 2000.0))
FITS: dict[str, gs.Fit | None] = {
    "one map": None, "Lispsm()": gs.Lispsm(), "Lispsm(psm=True)": gs.Lispsm(True), "Cascades(1)": gs.Cascades(1),
    "Cascades(2)": gs.Cascades(2),
    "Cascades(4)": gs.Cascades(4), "Cascades(4, by_depth=True)": gs.Cascades(4, by_depth=True), "Cascades(8)": gs.Cascades(8),
    "Cascades(4, stable=True)": gs.Cascades(4, stable=True),
}  # fmt: skip


@click.command(help=__doc__)
@click.option("--repeats", default=9, show_default=True, help="Rounds of the timing.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(repeats: int, output: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    scene = gs.scenes.outdoors()
    assert scene.lights is not None
    sun = scene.lights[0]
    assert isinstance(sun, gs.DirectionalLight)
    shadows = {name: gs.Shadow(filter=gs.Pcf(1), fit=fit) for name, fit in FITS.items()}
    shadows["Evsm(), Cascades(4)"] = gs.Shadow(filter=gs.Evsm(), fit=gs.Cascades(4))
    shadows["Exact()"] = gs.Shadow(filter=gs.Exact())
    truth = gs.trace(scene, None, [sun], SIZE, samples=1)
    results: dict[str, dict[str, Any]] = {name: {} for name in shadows}
    with ExitStack() as stack:
        # one renderer each: a shared atlas would be allocated again whenever its size changes
        renderers = {name: stack.enter_context(gs.Renderer()) for name in shadows}
        times: dict[str, list[float]] = {name: [] for name in shadows}
        for k in range(-2, repeats):
            for number, (name, shadow) in enumerate(shadows.items()):
                step = 1e-3 * (k + number / len(shadows))
                moved = replace(sun, direction=tuple(np.add(sun.direction, (step, 0.0, 0.0))), shadow=shadow)
                start = time.perf_counter()
                renderers[name].render(scene, None, [moved], SIZE, outputs=("image",), samples=1)
                if k >= 0:
                    times[name].append(time.perf_counter() - start)
        for name, shadow in shadows.items():
            frame = renderers[name].render(
                scene, None, [replace(sun, shadow=shadow)], SIZE, outputs=("visibility", "depth"), samples=1
            )
            gap = np.abs(frame.visibility[0] - truth.visibility[0])
            facing = (truth.cosine[0] > 0.0) & ~np.isnan(gap)
            row = results[name]
            row["time"] = float(np.median(np.array(times[name]) / np.array(times["one map"])))
            row["wrong"] = gs.measure(frame, truth).wrong
            row["bands"] = [
                float(gap[facing & (frame.depth >= low) & (frame.depth < high)].mean()) for low, high in BANDS
            ]
    click.echo(f"{'':28s} time  wrong %  mean error to {', '.join(f'{far:g} m' for _, far in BANDS)}")
    for name, row in results.items():
        bands = " ".join(f"{each:.4f}" for each in row["bands"])
        click.echo(f"{name:28s} {row['time']:4.2f} {100.0 * row['wrong']:8.3f}  {bands}")
    if output:
        output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
