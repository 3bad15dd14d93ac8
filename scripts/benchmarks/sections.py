"""Command line of a benchmark with several sections over the courtyard and the models."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click
from frame import MODELS, models_in

import glshadow as gs

Scenes = list[tuple[str, Callable[[], gs.Scene]]]
Section = Callable[[Scenes, int, Path | None], dict[str, Any]]
"""(scenes, rounds, folder of the models) -> numbers; prints its lines."""


def command(text: str | None, sections: Mapping[str, Section]) -> click.Command:
    """A command with `--section`, `--only`, `--repeats`, `--models` and `--json`; `text` is its help."""

    @click.command(help=text)
    @click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
    @click.option("--repeats", default=9, show_default=True, help="Rounds per scene.")
    @click.option("--section", "wanted", multiple=True, type=click.Choice(list(sections)), help="Only these sections.")
    @click.option("--only", help="Only scenes whose name contains this.")
    @click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
    def main(folder: Path | None, repeats: int, wanted: tuple[str, ...], only: str | None, output: Path | None) -> None:
        warnings.simplefilter("ignore", gs.GlshadowWarning)
        folder = models_in(folder)
        scenes: Scenes = [("courtyard", gs.scenes.courtyard)]
        if folder:
            scenes += [
                (name, lambda n=name, u=up: gs.load(folder / n, up_axis=u, ground=True, look="plain"))
                for name, up in MODELS
            ]
        scenes = [(name, make) for name, make in scenes if only is None or only in name]
        results = {name: sections[name](scenes, repeats, folder) for name in wanted or sections}
        if output:
            output.write_text(json.dumps(results, indent=1))

    return main
