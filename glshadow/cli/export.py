"""glshadow export: an HTML page for browsers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from glshadow.cli import values
from glshadow.cli.options import Request, common, scene_options
from glshadow.cli.running import Work
from glshadow.cli.sections import Command, option

EXAMPLES = """
\b
Examples:
  glshadow export -o page                     the built-in courtyard as page/index.html
  glshadow export house.glb -o page --ground --filter pcf:2
"""


@click.command(cls=Command, epilog=EXAMPLES)
@option("Page", "-o", "--output", "folder", required=True, metavar="FOLDER", type=click.Path(file_okay=False, path_type=Path),
        help="Folder for index.html.")  # fmt: skip
@option(
    "Page",
    "--filter",
    "filter_",
    metavar="FILTER",
    read=values.shadow_filter,
    help="Filter of the shadow map. Default: pcf:1.",
)
@option(
    "Page",
    "--resolution",
    metavar="N",
    type=click.IntRange(1, 2048),
    default=1024,
    show_default=True,
    help="Texels along each side of a view's shadow map.",
)
@option("Page", "--store", type=click.Choice(["packed", "unorm8"]), default="packed", show_default=True,
        help="Format of the shadow map: a depth metric in four bytes, or in one.")  # fmt: skip
@scene_options
@common
def command(
    as_json: bool, debug: bool, folder: Path, filter_: Any, resolution: int, store: str, **options: Any
) -> None:
    """Write a page that shows MODEL with the shadow of its first light in WebGL 1: one file without libraries or a server.

    Mouse and touch turn the view; d shows the shadow map. The shaders are glshadow's in GLSL ES 1.00; textures are left out.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        wanted = Request(**options)
        with work.stage("load", f"loading {wanted.name}"):
            scene = wanted.load()
        camera, lights = wanted.camera(scene), wanted.lit(scene)
        with work.stage("write", "writing the page"):
            from glshadow.web import export_page

            path = export_page(scene, folder, camera, lights, resolution, filter_, store)
        work.say(f"{path}: {path.stat().st_size / 1e6:.1f} MB; open it in a browser")
        work.finish({"output": str(path), "bytes": path.stat().st_size})
