"""Errors of the shadows of real models with default settings, against traced rays, compared with shadow maps.

Every image is 1280 x 720 with the scene's own camera, and its own directional light unless the line says otherwise. Pixels that show
another triangle than the exact ray are not counted (see glshadow.scoring). The limits: acne 0, leak and grain 0.005 % of the counted
pixels, wrong 0.3 % of them and 5 % of the score without any shadow. A line that exceeds one is marked with its name. Maps of 2048
and 4096 texels with 3 x 3 comparisons follow: errors that fall with the texel size, or faster, are limited by resolution.
"""

from __future__ import annotations

import json
import multiprocessing
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import MODELS, SIZE, models_in

import glshadow as gs
from glshadow.scoring.score import Outcome
from glshadow.study.formats import PROBES, foot_gap

MAPS = {"2048": gs.Shadow(filter=gs.Pcf(1)), "4096": gs.Shadow(resolution=4096)}
COLUMNS = ("counted", "wrong", "edge", "acne", "leak", "grain", "mean", "none", "ratio")
PLACES = {"counted": 1, "none": 2, "ratio": 2}
LIMITS = {"acne": 0.0, "leak": 5e-5, "grain": 5e-5, "wrong": 3e-3, "ratio": 0.05}
LARGEST = "brain_cortex.ply"  # 608,752 triangles
LOW_SUNS = (5.0, 2.0)  # degrees above the horizon


@dataclass(frozen=True)
class Lamps:
    """A spot (cone of 2 x 40 degrees) and a point light that cast long shadows within the default view; world units."""

    spot: tuple[float, float, float]
    target: tuple[float, float, float]
    point: tuple[float, float, float]

    def lights(self) -> dict[str, gs.SpotLight | gs.PointLight]:
        direction = tuple(np.subtract(self.target, self.spot))
        return {
            "spot": gs.SpotLight(position=self.spot, direction=direction, outer_angle=40.0),
            "point": gs.PointLight(position=self.point),
        }


LAMPS = {
    "courtyard": Lamps((6.0, 9.0, 5.0), (0.0, 0.0, 0.0), (0.5, 2.2, 0.8)),
    "chess_board.glb": Lamps((150.0, 200.0, 120.0), (10.0, 0.0, 0.0), (20.0, 80.0, 30.0)),
    "japanese_bridge_garden.glb": Lamps((6.0, 11.0, 6.0), (0.0, 2.0, 0.0), (1.0, 6.5, 1.5)),
}


def lines(name: str, scene: gs.Scene) -> Iterator[tuple[str, gs.Light]]:
    """The lights of a scene, with the name of their line."""
    sun = scene.lights[0]
    short = name.split("/")[-1].split(".")[0]
    yield short, sun
    if name.startswith("terrain") and isinstance(sun, gs.DirectionalLight):
        x, _, z = sun.direction
        for elevation in LOW_SUNS:
            down = -np.hypot(x, z) * np.tan(np.radians(elevation))
            yield f"{short}, sun {elevation:g} degrees high", replace(sun, direction=(x, down, z))
    if name in LAMPS:
        for kind, light in LAMPS[name].lights().items():
            yield f"{short}, {kind}", light


def scored(renderer: gs.Renderer, truth: gs.Truth, shadow: gs.Shadow) -> dict[str, float]:
    """The errors of one image, as fractions; `none` is the wrong share of an image without shadows."""
    light = replace(truth.lights[0], shadow=shadow)
    frame = renderer.render(truth.scene, truth.camera, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
    error = gs.measure(frame, truth)
    none = float((truth.visibility[0][error.kinds[0] >= Outcome.GOOD] < 0.5).mean())
    ratio = error.wrong / none if none else np.inf if error.wrong else 0.0
    return {**{name: getattr(error, name) for name in COLUMNS if hasattr(error, name)}, "none": none, "ratio": ratio}


def missed(row: dict[str, float]) -> list[str]:
    """Names of the limits that a line exceeds."""
    return [name for name, limit in LIMITS.items() if row[name] > limit]


def printed(name: str, row: dict[str, float]) -> str:
    """A line of the table; all but the mean in percent."""
    cells = [f"{row[c]:9.5f}" if c == "mean" else f"{100 * row[c]:9.{PLACES.get(c, 4)}f}" for c in COLUMNS]
    return f"{name:42s} {' '.join(cells)}  {' '.join('!' + each for each in missed(row))}".rstrip()


def cost_of_truth(path: Path, up: str) -> dict[str, float]:
    """Seconds to trace a model, and the peak memory of a process that does nothing else, in bytes."""
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    scene = gs.load(path, up_axis=up, look="plain")
    start = time.perf_counter()
    gs.trace(scene, size=SIZE, samples=1)
    seconds = time.perf_counter() - start
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {"trace_s": seconds, "peak_bytes": 1024.0 * float(status["VmHWM"].split()[0])}


def measured_lines(name: str, scene: gs.Scene, results: dict[str, Any]) -> None:
    """Print and collect the lines of one scene."""
    for line, light in lines(name, scene):
        truth = gs.trace(scene, None, [light], SIZE, samples=1)
        with gs.Renderer() as renderer:
            row = results[line] = scored(renderer, truth, gs.Shadow())
            click.echo(printed(line, row))
            for what, shadow in MAPS.items():
                other = results[f"{line}, {what}"] = scored(renderer, truth, shadow)
                click.echo(printed(f"    map of {what}", other))


def formats() -> list[dict[str, Any]]:
    """Print and collect the gaps that coarse formats leave at the foot of a wall."""
    click.echo("\ngap at a wall's foot     step mm  predicted mm  measured mm  measured / predicted")
    rows = []
    with gs.Renderer() as renderer:
        for light, target in ((light, target) for light, (_, spans) in PROBES.items() for target in spans):
            gap = foot_gap(renderer, light, target)
            ratio = gap.measured / gap.predicted
            rows.append({**asdict(gap), "target": target.value, "ratio": ratio})
            cells = f"{1e3 * gap.step:9.2f} {1e3 * gap.predicted:13.2f} {1e3 * gap.measured:12.2f} {ratio:21.2f}"
            click.echo(f"{light + ', ' + target.value:22s} {cells}")
    return rows


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--only", help="Only scenes whose name contains this, and no table of formats.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(folder: Path | None, only: str | None, output: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    folder = models_in(folder)
    scenes: list[tuple[str, Callable[[], gs.Scene]]] = [("courtyard", gs.scenes.courtyard)]
    if folder:
        scenes += [(name, lambda n=name, u=up: gs.load(folder / n, up_axis=u, look="plain")) for name, up in MODELS]
    results: dict[str, Any] = {"lines": {}}
    click.echo(f"{'% of the counted pixels, default settings':42s} {' '.join(f'{name:>9s}' for name in COLUMNS)}")
    for name, make in scenes:
        if only is None or only in name:
            measured_lines(name, make(), results["lines"])
    if folder and (only is None or only in LARGEST):
        with multiprocessing.get_context("spawn").Pool(1) as pool:  # a separate process: its peak memory is the trace's
            cost = results["truth"] = pool.apply(cost_of_truth, (folder / LARGEST, dict(MODELS)[LARGEST]))
        click.echo(f"\n{LARGEST}: traced in {cost['trace_s']:.1f} s, peak memory {cost['peak_bytes'] / 2**30:.2f} GiB")
    if only is None:
        results["formats"] = formats()
    if output:
        output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
