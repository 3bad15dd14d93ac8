"""glshadow study: speed against error of many shadow settings, as an HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from glshadow.cli.bar import Bar
from glshadow.cli.options import Request, common, driver_options, scene_options, size_option
from glshadow.cli.running import Work
from glshadow.cli.sections import Command, option

JOURNAL = "study.jsonl"
REPEATS, QUICK_REPEATS = 7, 3

EXAMPLES = """
\b
Examples:
  glshadow study -o courtyard                 the built-in scene, a minute or two
  glshadow study chess_board.glb -o chess --quick
  glshadow study chess_board.glb -o chess     the same command resumes after an interruption
"""


@click.command(cls=Command, epilog=EXAMPLES)
@option(
    "Study",
    "-o",
    "--output",
    "folder",
    required=True,
    metavar="FOLDER",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for study.html, study.json, the plot and the results.",
)
@option("Study", "--quick", is_flag=True, help="Four settings and three rounds instead of some fifty and seven.")
@option(
    "Study",
    "--resume/--fresh",
    default=True,
    show_default="resume",
    help="Keep the results in FOLDER, or measure everything again.",
)
@size_option
@driver_options
@scene_options
@common
def command(as_json: bool, debug: bool, folder: Path, quick: bool, resume: bool, **options: Any) -> None:
    """Try many shadow settings on MODEL, measure speed and error of each, and write a page with the results.

    Settings: resolution, filter, bias and format; each light is studied alone. Speed is frame time over the time of the
    same image without shadows (plus one depth pass); error is the share of wrong pixels against a traced reference.
    Needs pip install 'glshadow[reference,study]'.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        _study(work, Request(**options), folder, quick, resume)


def _study(work: Work, wanted: Request, folder: Path, quick: bool, resume: bool) -> None:
    with work.stage("load", f"loading {wanted.name}"):
        from glshadow.study import Grid, report, run_study

        report.require()
        scene = wanted.load()
    camera, lights = wanted.camera(scene), wanted.lit(scene)
    folder.mkdir(parents=True, exist_ok=True)
    journal = folder / JOURNAL
    if not resume:
        journal.unlink(missing_ok=True)
    with work.stage("study", "measuring"), Bar(work) as bar:
        done = run_study(
            scene, camera, lights, wanted.size, Grid.quick() if quick else None, QUICK_REPEATS if quick else REPEATS,
            journal, bar, wanted.driver,
        )  # fmt: skip
    with work.stage("report", "writing the page"):
        page = report.write_report(done, folder)
    work.say(f"{page}: {len(done.results)} settings in {done.seconds:.0f} s")
    work.finish({"path": str(page), **done.as_dict()})
    if not work.as_json:
        click.echo(str(done))
