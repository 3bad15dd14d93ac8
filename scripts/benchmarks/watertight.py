"""Light leaks through closed surfaces, and self-shadowing of planes: the exact filter must show neither.

Rays: ten million per kind of light at edges and vertices of a sphere, a torus and a brain, by the filter's own GLSL; float32 triple
products on the same rays are the control. Leaks: whole images of a plane under a jittered sheet, at random orientations; the
control draws no shadow. Acne: three tessellations of one plane, light 60 to 0.1 degrees high, up to 1000 from the world's origin.
The generators are those of tests/exact. Exit code 1 if there is any leak or acne, or if a control shows none.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np
from frame import models_in

import glshadow as gs
from glshadow.gl.driver.context import open_context
from glshadow.gl.driver.program import Programs
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid
from tests.exact import fans, sheets

PICTURE = (1280, 720)
CELLS = (40, 300)  # sheets of 3,200 and of 180,000 triangles
OFFSETS = (0.0, 1.0, 30.0, 1000.0)
BATCH = 1_000_000
EXACT = gs.Shadow(filter=gs.Exact())


@dataclass(frozen=True)
class Row:
    """One line: wrong rays or pixels of those tested, and the control's wrong ones, which must be `expected`."""

    what: str
    light: str
    asked: int
    wrong: int
    control: int | None = None
    every: bool = False  # the control must fail everywhere, not only somewhere

    @property
    def good(self) -> bool:
        control = self.control is None or (self.control == self.asked if self.every else self.control > 0)
        return self.wrong == 0 and self.asked > 0 and control

    def __str__(self) -> str:
        control = "" if self.control is None else f"{self.control:,}"
        return f"{self.what:44s} {self.light:12s} {self.asked:12,d} {self.wrong:8,d} {control:>12s}{'' if self.good else '  !'}"


def solids(folder: Path | None) -> Iterator[tuple[str, Solid]]:
    """Targets of the rays."""
    yield "sphere", shapes.icosphere(6, 1.0)
    yield "torus", shapes.torus(1.0, 0.3, 256, 128)
    if folder:
        mesh = gs.load(folder / "brain_cortex.ply").nodes[0].mesh
        yield "brain", (mesh.positions, mesh.triangles)


def rays(folder: Path | None, total: int) -> Iterator[Row]:
    """Rays at edges and vertices; `total` per kind of light."""
    rng = np.random.default_rng(7)
    meshes = list(solids(folder))
    context = open_context("egl")
    with context:
        programs = Programs(context)
        for kind in fans.KINDS:
            for name, solid in meshes:
                found = fans.fans_of(solid, kind, rng)
                wrong = control = asked = 0
                while asked < total // len(meshes):
                    count = min(BATCH, total // len(meshes) - asked)
                    slipped = fans.slipped(context, programs, found, fans.rays_at(found, count, rng))
                    asked, wrong, control = asked + count, wrong + slipped[0], control + slipped[1]
                yield Row(f"rays slipped, {name}, {len(solid[1]):,d} triangles", kind, asked, wrong, control)
        found, asked, wrong = fans.closed_box(rng), 0, 0
        while asked < total:
            count = min(BATCH, total - asked)
            wrong += fans.slipped(context, programs, found, fans.rays_on_seams(count, rng))[0]
            asked += count
        yield Row("rays slipped between faces", "point", asked, wrong)
        programs.release()
    context.release()


def leaks(pixels: int) -> Iterator[Row]:
    """Images under sheets; `pixels` per kind of light, half of them under each sheet."""
    rng = np.random.default_rng(8)
    with gs.Renderer() as renderer:
        for cells in CELLS:
            totals = {name: np.zeros(3, dtype=np.int64) for name in sheets.LIGHTS}
            while min(total[0] for total in totals.values()) < pixels // len(CELLS):
                scene, lights = sheets.under_a_sheet(cells, rng)
                for name, light in lights.items():
                    lit, asked = sheets.lit_and_asked(
                        renderer, scene, replace(light, shadow=EXACT), sheets.PLANE_TRIANGLES, PICTURE
                    )
                    control, _ = sheets.lit_and_asked(
                        renderer, scene, replace(light, shadow=None), sheets.PLANE_TRIANGLES, PICTURE
                    )
                    totals[name] += (asked, lit, control)
            for name, total in totals.items():
                yield Row(f"leaks, sheet of {2 * cells**2:,d} triangles", name, *map(int, total), every=True)


def acne() -> Iterator[Row]:
    """Images of planes with three overlapping tessellations."""
    rng = np.random.default_rng(9)
    with gs.Renderer() as renderer:
        for elevation in sheets.ELEVATIONS:
            totals = {name: np.zeros(2, dtype=np.int64) for name in sheets.LIGHTS}
            for offset in OFFSETS:
                scene, lights = sheets.tessellations(elevation, offset, rng)
                for name, light in lights.items():
                    lit, asked = sheets.lit_and_asked(renderer, scene, replace(light, shadow=EXACT), 1 << 30, PICTURE)
                    totals[name] += (asked, asked - lit)
            for name, total in totals.items():
                yield Row(f"acne, light {elevation:g} degrees high", name, *map(int, total))


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--rays", "count", default=10_000_000, show_default=True, help="Rays per kind of light.")
@click.option("--pixels", default=10_000_000, show_default=True, help="Pixels under sheets, per kind of light.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(folder: Path | None, count: int, pixels: int, output: Path | None) -> None:
    folder = models_in(folder)
    click.echo(f"{'':44s} {'light':12s} {'tested':>12s} {'wrong':>8s} {'control':>12s}")
    rows = []
    for part in (rays(folder, count), leaks(pixels), acne()):
        for row in part:
            click.echo(str(row))
            rows.append(row)
    if output:
        output.write_text(json.dumps([vars(row) for row in rows], indent=1) + "\n")
    sys.exit(0 if all(row.good for row in rows) else 1)


if __name__ == "__main__":
    main()
