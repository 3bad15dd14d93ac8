"""glshadow study: speed against error of many shadow settings, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.cli import values
from glshadow.cli.options import Command, common, option
from glshadow.cli.running import Work

if TYPE_CHECKING:
    from glshadow.scene.mesh import Scene

JOURNAL = "study.jsonl"
REPEATS, QUICK_REPEATS = 7, 3

EXAMPLES = """
\b
Examples:
  glshadow study -o courtyard                 the built-in scene, some minutes
  glshadow study chess_board.glb -o chess --quick
  glshadow study chess_board.glb -o chess     interrupted? the same line goes on where it was
"""


@click.command(cls=Command, epilog=EXAMPLES)
@click.argument("model", required=False, type=click.Path())
@option(
    "Study",
    "-o",
    "--output",
    required=True,
    metavar="FOLDER",
    type=click.Path(file_okay=False, path_type=Path),
    help="Where study.html, study.json, the plot and the results as they come go.",
)
@option("Study", "--size", metavar="WxH", read=values.size, default="1280x720", show_default=True, help="Pixels.")
@option("Study", "--quick", is_flag=True, help="Four settings and three rounds instead of some fifty and seven.")
@option(
    "Study",
    "--resume/--fresh",
    default=True,
    show_default="resume",
    help="Keep the results that are in FOLDER, or measure everything anew.",
)
@option(
    "Study",
    "--backend",
    type=click.Choice(["auto", "egl", "osmesa", "window"]),
    default="auto",
    show_default=True,
    help="Where the OpenGL context comes from.",
)
@option("Model", "--ground", is_flag=True, help="Put a plane under the model to catch its shadow.")
@option(
    "Model",
    "--up-axis",
    type=click.Choice(["x", "y", "z"]),
    help="Axis that is up in the file. Default: y; STL and PLY files are often z.",
)
@option(
    "Lights",
    "--light",
    "lights",
    metavar="LIGHT",
    read=values.light,
    multiple=True,
    help="As for render; each is studied alone. Default: the file's lights, else one sun.",
)
@common
def study(as_json: bool, debug: bool, **options: Any) -> None:
    """Try many shadow settings on MODEL, measure speed and error of each, and write a page that shows which are worth it.

    Settings: resolution, filter, bias and format. Speed is frame time over the time of the same picture without shadows
    (plus one depth pass); error is the share of wrong pixels against the traced truth. Needs pip install
    'glshadow[reference,study]'.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        _study(work, **options)


def _study(
    work: Work,
    model: str | None,
    output: Path,
    size: tuple[int, int],
    quick: bool,
    resume: bool,
    backend: str,
    ground: bool,
    up_axis: str | None,
    lights: tuple[Any, ...],
) -> None:
    with work.stage("load", f"loading {Path(model).name if model else 'courtyard'}"):
        from glshadow.study import Grid, report, run_study

        report.require()
        scene = _scene(model, ground, up_axis)
    output.mkdir(parents=True, exist_ok=True)
    journal = output / JOURNAL
    if not resume:
        journal.unlink(missing_ok=True)
    with work.stage("study", "measuring"), _Bar(work) as bar:
        done = run_study(
            scene, None, lights or None, size, Grid.quick() if quick else None, QUICK_REPEATS if quick else REPEATS,
            journal, bar, backend,
        )  # fmt: skip
    with work.stage("report", "writing the page"):
        page = report.write_report(done, output)
    work.say(f"{page}: {len(done.results)} settings in {done.seconds:.0f} s")
    work.finish({"path": str(page), **done.as_dict()})
    if not work.as_json:
        click.echo(str(done))


def _scene(model: str | None, ground: bool, up_axis: str | None) -> Scene:
    if model is None:
        if up_axis is not None:
            raise click.UsageError("--up-axis is a property of a MODEL, and none is given")
        from glshadow.scene.builtin import courtyard

        return courtyard().with_ground() if ground else courtyard()
    from glshadow.scene.load import load

    return load(model, ground=ground, up_axis=up_axis)


class _Bar:
    """A progress bar on a terminal; nothing elsewhere."""

    def __init__(self, work: Work) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        work.progress.end()  # one display at a time
        console = Console(stderr=True)
        columns = (
            TextColumn("{task.description:<44}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
        )
        self._display = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._display.add_task("", total=None)

    def __enter__(self) -> _Bar:
        self._display.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._display.stop()

    def __call__(self, done: int, total: int, text: str) -> None:
        self._display.update(self._task, completed=done, total=total, description=text)
