"""Compares images bit for bit with those of another version: hashes of every scene, filter, light and target.

`--save FILE` writes the hashes, `--against FILE` compares with a file from another version and lists differences.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
from exact import lights_of
from frame import MODELS, models_in

import glshadow as gs

SIZE = (320, 180)
OUTPUTS = ("image", "visibility", "depth")


def settings() -> Iterator[tuple[str, gs.Shadow]]:
    """Every filter with every target that it supports."""
    for kind in (gs.Hard(), *(gs.Pcf(radius) for radius in range(5))):
        for target in gs.Target:
            yield f"{kind!r} {target.value}", gs.Shadow(filter=kind, target=target, resolution=512)
    yield "Exact(1)", gs.Shadow(filter=gs.Exact())  # its name in older versions' hashes


def hashes(folder: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Hashes of each image's outputs."""
    from dataclasses import replace

    plain: dict[str, Any] = (
        {"look": "plain"} if hasattr(gs.Scene, "defaults") else {}
    )  # older versions have this look alone
    models = [(name, gs.load(folder / name, up_axis=up, **plain)) for name, up in MODELS]
    for name, scene in [("courtyard", gs.scenes.courtyard()), *models]:
        with gs.Renderer() as renderer:
            for kind, light in lights_of(name, scene).items():
                for label, shadow in settings():
                    lit = replace(light, shadow=shadow)
                    frame = renderer.render(scene, None, [lit], SIZE, outputs=OUTPUTS, samples=1)
                    yield (
                        f"{name} | {kind} | {label}",
                        {each: digest(getattr(frame, each)) for each in OUTPUTS},
                    )


def digest(array: Any) -> str:
    """Hash of an array's shape and bytes."""
    return hashlib.sha256(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--save", type=click.Path(path_type=Path), help="Write the hashes to this file.")
@click.option("--against", type=click.Path(exists=True, path_type=Path), help="Compare with these.")
def main(folder: Path | None, save: Path | None, against: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    folder = models_in(folder)
    if folder is None:
        raise click.UsageError("the 12 models are needed: --models FOLDER, or GLSHADOW_MODELS")
    found = dict(hashes(folder))
    if save:
        save.write_text(json.dumps(found, indent=1))
    if against:
        before = json.loads(against.read_text())
        moved = 0
        for name, now in found.items():
            differs = [each for each in OUTPUTS if before.get(name, {}).get(each) != now[each]]
            if differs:
                moved += 1
                click.echo(f"{name}: {', '.join(differs)}")
        click.echo(f"{len(found)} images, {moved} differ")


if __name__ == "__main__":
    main()
