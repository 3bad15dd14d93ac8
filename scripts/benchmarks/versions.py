"""Frame time of this checkout against another one: each in a process of its own, alternating frame by frame.

`--other FOLDER` is the other checkout. A row per scene, light and filter: the median of the ratios inside each round, this over other;
lights move every frame. A second column compares the other checkout with itself, as a measure of the machine's noise.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import click
import numpy as np

WORKER = """
import json, sys, time, warnings
from dataclasses import replace
import numpy as np
import glshadow as gs
warnings.simplefilter("ignore")
renderer = scene = light = None
plain = {"look": "plain"} if hasattr(gs.Scene, "defaults") else {}  # older versions have this look alone
for line in sys.stdin:
    job = json.loads(line)
    if "scene" in job:
        path = job["scene"]
        scene = gs.scenes.courtyard() if path is None else gs.load(path, up_axis=job["up"], **plain)
        if renderer is not None:
            renderer.release()
        renderer = gs.Renderer()
        answer = {}
    elif "light" in job:
        light = eval(job["light"], {"gs": gs})
        if light is None:
            light = scene.lights[0]
        light = replace(light, shadow=gs.Shadow(filter=eval(job["filter"], {"gs": gs})))
        answer = {}
    elif not job:
        answer = {"code": gs.__file__}
    else:
        name = "direction" if isinstance(light, gs.DirectionalLight) else "position"
        old = np.asarray(getattr(light, name))
        moved = replace(light, **{name: tuple(old + 1e-3 * job["k"] * np.abs(old).max() * np.array([1.0, 0.0, -0.5]))})
        start = time.perf_counter()
        renderer.render(scene, None, [moved], (1280, 720), outputs=("image",), samples=1)
        answer = {"ms": 1e3 * (time.perf_counter() - start)}
    print(json.dumps(answer), flush=True)
"""
FILTERS = ("gs.Hard()", "gs.Pcf(1)", "gs.Pcf(3)", "gs.Exact()")


class Checkout:
    """A process that renders with one checkout's code."""

    def __init__(self, folder: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", WORKER],  # -P: or the working directory's code would come first
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )
        used = Path(self.ask()["code"]).resolve()
        if not used.is_relative_to(folder.resolve()):
            self.process.kill()
            raise click.ClickException(f"{folder} is no checkout: its code would come from {used}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        self.process.wait()

    def ask(self, **job: Any) -> dict[str, Any]:
        """Send one job; returns its answer."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(job) + "\n")
        self.process.stdin.flush()
        answer: dict[str, Any] = json.loads(self.process.stdout.readline())
        return answer


@click.command(help=__doc__)
@click.option(
    "--other", type=click.Path(exists=True, file_okay=False, path_type=Path), required=True, help="A checkout."
)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--rounds", default=15, show_default=True, help="Rounds per scene, light and filter.")
@click.option("--only", help="Only scenes whose name contains this.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(other: Path, folder: Path | None, rounds: int, only: str | None, output: Path | None) -> None:
    from exact import lights_of
    from frame import MODELS

    import glshadow as gs

    warnings.simplefilter("ignore", gs.GlshadowWarning)
    here = Path(__file__).resolve().parents[2]
    default = Path(os.environ.get("GLSHADOW_MODELS", here.parent / "shared" / "models"))
    folder = folder or (default if default.is_dir() else None)
    scenes: list[tuple[str, Path | None, str]] = [("courtyard", None, "y")]
    if folder is not None:
        scenes += [(name, folder / name, up) for name, up in MODELS]
    results: dict[str, Any] = {}
    with Checkout(here) as new, Checkout(other) as old, Checkout(other) as control:
        for name, path, up in scenes:
            if only and only not in name:
                continue
            scene = gs.scenes.courtyard() if path is None else gs.load(path, up_axis=up, look="plain")
            for each in (new, old, control):
                each.ask(scene=None if path is None else str(path), up=up)
            for kind, light in lights_of(name, scene).items():
                text = "None" if kind == "sun" and path is not None else _spelled(light)
                for filter in FILTERS:
                    for each in (new, old, control):
                        each.ask(light=text, filter=filter)
                    times: list[list[float]] = [[], [], []]
                    for k in range(-2, rounds):
                        for number, each in enumerate((new, old, control)):
                            ms = each.ask(k=k)["ms"]
                            if k >= 0:
                                times[number].append(ms)
                    ours, theirs, again = (np.array(values) for values in times)
                    row = results[f"{name} {kind} {filter}"] = {
                        "ratio": float(np.median(ours / theirs)), "control": float(np.median(again / theirs)),
                        "ms": float(np.median(ours)),
                    }  # fmt: skip
                    click.echo(
                        f"{name:34s} {kind:6s} {filter:11s} {row['ms']:7.1f} ms  this / other {row['ratio']:.3f}  "
                        f"other / other {row['control']:.3f}"
                    )
    for key in ("ratio", "control"):
        values = np.array([row[key] for row in results.values()])
        click.echo(f"{key}: median {np.median(values):.3f}, worst {values.max():.3f} of {len(values)}")
    if output:
        output.write_text(json.dumps(results, indent=1))


def _spelled(light: Any) -> str:
    """Python code that makes the light, with arguments that all versions have."""
    names = {"DirectionalLight": ("direction",), "SpotLight": ("position", "direction", "inner_angle", "outer_angle")}
    kind = type(light).__name__
    given = ", ".join(f"{name}={getattr(light, name)!r}" for name in names.get(kind, ("position",)))
    return f"gs.{kind}({given})"


if __name__ == "__main__":
    main()
