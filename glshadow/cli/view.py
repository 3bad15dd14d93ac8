"""glshadow view: an interactive window."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.cli.options import Request, common, scene_options, size_option
from glshadow.cli.running import Work
from glshadow.cli.sections import Command

if TYPE_CHECKING:
    from glshadow.scene.nodes import Scene
    from glshadow.ui.showing import Showing

EXAMPLES = """
\b
Examples:
  glshadow view                                the built-in courtyard
  glshadow view house.glb --ground             drag to turn, h for the keys
  glshadow view rover.stl --up-axis z --light spot:6,6,6:-1,-1,-1
"""


@click.command(cls=Command, epilog=EXAMPLES)
@size_option
@scene_options
@common
def command(as_json: bool, debug: bool, **options: Any) -> None:
    """Show MODEL in a window: turn it, move the light, change filter and shadow map, see where shadows are wrong.

    Keys: h shows all of them. Drag turns, right drag pans, the wheel zooms; arrows move the light, a animates it; f, r and b change filter,
    resolution and bias; d shows the shadow map, l the light and its frustum; e shows errors against traced rays once nothing moves; c
    saves a screenshot in the current folder; dropping a file opens it. Needs a screen and pip install 'glshadow[view]'.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        wanted = Request(**options, pictures=True)
        with work.stage("load", f"loading {wanted.name}"):
            scene = wanted.load()
        with work.stage("open", "opening a window"):
            from glshadow.ui.window import Window

            window = Window(_showing(wanted, scene), _opener(wanted), wanted.size)
        work.progress.end()
        window.run()
        work.finish({})


def _showing(wanted: Request, scene: Scene) -> Showing:
    from glshadow.ui.showing import Showing

    return Showing(scene, wanted.camera(scene), wanted.lit(scene))


def _opener(wanted: Request) -> Any:
    def opened(path: Path) -> Showing:
        other = replace(wanted, model=str(path))
        return _showing(other, other.load())

    return opened
