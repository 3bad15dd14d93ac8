"""glshadow measure: the error of an image's shadows."""

from __future__ import annotations

from typing import Any

import click

from glshadow.cli.blank import refuse_blank
from glshadow.cli.options import (
    Request,
    common,
    light_facts,
    picture_options,
    request,
    scene_facts,
    warn_fallbacks,
)
from glshadow.cli.orbit import refuse_video
from glshadow.cli.running import Work
from glshadow.cli.sections import Command

EXAMPLES = """
\b
Examples:
  glshadow measure
  glshadow measure chess_board.glb -o error.png
  glshadow measure --filter hard --resolution 1024 --json
  glshadow measure house.glb --bias constant:0.001    (error of a bias set by hand)
"""


@click.command(cls=Command, epilog=EXAMPLES)
@picture_options
@common
def command(as_json: bool, debug: bool, **options: Any) -> None:
    """Render MODEL, trace the exact shadows, and print the error of each light.

    All numbers are shares of the counted pixels (smooth, facing the light). wrong = edge (limited by resolution)
    + acne (lit, rendered dark) + leak (dark, rendered lit). Needs embreex: pip install 'glshadow[reference]'.

    -o writes reference | rendered | error, a row per light: edge yellow, acne red, leak blue, grain orange, not counted green.
    """
    with Work(as_json, debug) as work:
        wanted = request(**options)
        if wanted.output and wanted.output.suffix.lower() in (".exr", ".npz"):
            raise click.UsageError("-o of measure is an 8-bit image: use .png, .jpg or .tif")
        if wanted.output:
            refuse_video(wanted.output)
        _measure(work, wanted)


def _measure(work: Work, wanted: Request) -> None:
    with work.stage("load", f"loading {wanted.name}"):
        scene = wanted.load()
    camera, lights = wanted.camera(scene), wanted.lit(scene)
    with work.stage("open", "opening OpenGL"):
        from glshadow.renderer import Renderer

        renderer = Renderer(wanted.driver)
    with renderer:
        with work.stage("render", f"rendering {wanted.name}"):
            frame = renderer.render(
                scene, camera, lights, wanted.size, outputs=("visibility", "triangle", "alpha"), samples=1
            )
        refuse_blank(frame)
        warn_fallbacks(work, frame.used, scene, wanted)
        with work.stage("trace", "tracing the reference"):
            from glshadow.lights import traced_points
            from glshadow.reference.trace import trace

            truth = trace(scene, camera, lights, wanted.size, light_samples=traced_points(lights), samples=1)
        with work.stage("measure", "measuring"):
            from glshadow.scoring.error import measure

            error = measure(frame, truth)
        if wanted.output is not None:
            with work.stage("write", f"writing {wanted.output.name}"):
                from glshadow import image
                from glshadow.triptych import triptych

                picture = triptych(renderer, frame, truth, error, wanted.ambient, wanted.background)
                image.write(wanted.output, picture)
    if wanted.output is not None:
        work.say(
            f"{wanted.output}: reference | rendered | error, {len(lights)} x 3 of {wanted.size[0]}x{wanted.size[1]}"
        )
    work.finish({"path": wanted.output and str(wanted.output), "size": wanted.size, "scene": scene_facts(scene),
                 "error": error.as_dict(),
                 "lights": [light_facts(*pair) for pair in zip(frame.lights, frame.used, strict=True)]})  # fmt: skip
    if not work.as_json:
        click.echo(str(error))
