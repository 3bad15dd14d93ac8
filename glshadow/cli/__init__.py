"""The command `glshadow`: each command parses its options, calls one function and prints the result. One module per command."""

from __future__ import annotations

from typing import Any

import click

from glshadow import __version__
from glshadow.cli import batch, doctor, export, measure, plan, render, study, sun, view
from glshadow.cli.running import exit_code, one_line, say, terminable


class Group(click.Group):
    """Handles interrupts: Ctrl-C exits with 130, SIGTERM with 143, at any point, after cleaning up."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with terminable():
                return super().invoke(ctx)
        except KeyboardInterrupt as error:
            say(f"error: {one_line(error)}")
            raise click.exceptions.Exit(exit_code(error)) from None


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, message="glshadow %(version)s")
def main() -> None:
    """Headless shadow mapping, with measured errors.

    \b
    glshadow render                             the built-in courtyard into courtyard.png
    glshadow render model.glb -o model.png      any .glb .gltf .obj .ply .stl .off .tif
    glshadow measure model.glb                  its shadows against a traced reference
    glshadow study model.glb -o folder          speed and error of many settings, as an HTML page
    glshadow plan model.glb --wrong 0.1%        the cheapest settings for that error
    glshadow sun model.glb --place 48.1,11.6 --year 2026 --zone Europe/Berlin -o hours.html
    glshadow batch jobs.jsonl -o folder         many images, in processes or on a cluster
    glshadow export model.glb -o page           a page for browsers: WebGL 1, one file
    glshadow view model.glb                     an interactive window with lights and errors
    glshadow doctor                             what works on this machine

    Exit codes: 0 success, 1 the input cannot be rendered, 2 invalid command line, 130 interrupted, 143 terminated.
    """


main.add_command(render.command, "render")
main.add_command(measure.command, "measure")
main.add_command(study.command, "study")
main.add_command(plan.command, "plan")
main.add_command(sun.command, "sun")
main.add_command(batch.command, "batch")
main.add_command(export.command, "export")
main.add_command(view.command, "view")
main.add_command(doctor.command, "doctor")
