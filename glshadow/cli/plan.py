"""glshadow plan: the cheapest settings for an error budget."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.cli import values
from glshadow.cli.bar import Bar
from glshadow.cli.options import Request, common, driver_options, scene_options, size_option
from glshadow.cli.running import FAILED, Work
from glshadow.cli.sections import Command, option
from glshadow.errors import printable

if TYPE_CHECKING:
    from glshadow.shadows.shadow import Shadow
    from glshadow.study import Plan

GIVEN = "glshadow.given"  # key of Context.meta
OWN = ("wrong", "ms", "journal", "as_json", "debug")  # options that do not affect the image

EXAMPLES = """
\b
Examples:
  glshadow plan --wrong 0.1%                  the built-in courtyard
  glshadow plan chess_board.glb --ground --wrong 0.5%
  glshadow plan house.glb --light point:0,2,0 --wrong 0.2% --json
  glshadow plan house.glb --ms 20             the most accurate within 20 ms on this machine
  glshadow plan --wrong 0.05% --journal courtyard/study.jsonl     (uses a study's measurements)
"""


class PlanCommand(Command):
    """Keeps the text of the options, for the command line that it prints."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        rest = super().parse_args(ctx, list(args))
        texts, _, order = self.make_parser(ctx).parse_args(args=list(args))
        ctx.meta[GIVEN] = {param: texts[param.name] for param in order if isinstance(param, click.Option)}
        return rest


@click.command(cls=PlanCommand, epilog=EXAMPLES)
@option("Plan", "--wrong", metavar="SHARE", read=values.share,
        help="Budget: largest share of the counted pixels that may be wrong, 0.1% or 0.001.")  # fmt: skip
@option("Plan", "--ms", metavar="MS", read=values.milliseconds,
        help="Budget: longest time of a frame with one light on this machine; without --wrong: the most accurate within it.")  # fmt: skip
@option("Plan", "--journal", metavar="FILE", type=click.Path(dir_okay=False, path_type=Path),
        help="File for measurements; existing ones are used again, such as a study's study.jsonl.")  # fmt: skip
@size_option
@driver_options
@scene_options
@common
def command(
    as_json: bool, debug: bool, wrong: float | None, ms: float | None, journal: Path | None, **options: Any
) -> None:
    """Find the cheapest shadow settings for MODEL whose measured error is within a budget.

    Every filter tries increasing resolutions until its share of wrong pixels, against a traced reference, is at most --wrong
    for every light (and its share of grainy pixels too). Those that succeed are timed, and the fastest wins. Prints it
    with its error, its time as a multiple of the floor (the image without shadows plus one depth pass), and the
    `glshadow render` line that uses it. With --ms, the cheapest within it that meets --wrong, else the most accurate. Exit
    code 1 if no setting meets the budget. Needs pip install 'glshadow[reference]'.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        if wrong is None and ms is None:
            raise click.UsageError("a plan needs a budget: give --wrong 0.1%, --ms 20, or both")
        _plan(work, Request(**options), wrong, ms, journal)


def _plan(work: Work, wanted: Request, wrong: float | None, ms: float | None, journal: Path | None) -> None:
    with work.stage("load", f"loading {wanted.name}"):
        from glshadow.study.plan import run_plan

        scene = wanted.load()
    camera, lights = wanted.camera(scene), wanted.lit(scene)
    with work.stage("plan", "measuring"), Bar(work) as bar:
        plan = run_plan(
            scene, wrong, camera, lights, wanted.size, resume=journal, progress=bar, backend=wanted.driver, ms=ms
        )  # fmt: skip
    line = _render_line(click.get_current_context(), plan.best.shadow)
    work.finish({**plan.as_dict(), "command": line if plan.met else None})
    if not plan.met:
        work.say(_refusal(plan))
        raise click.exceptions.Exit(FAILED)
    if not work.as_json:
        best = plan.best
        click.echo(f"{best.name}: wrong {best.error:.4%}, {best.cost:.2f} x floor ({best.ms:.0f} ms)\n{line}")


def _refusal(plan: Plan) -> str:
    best = plan.best
    if plan.budget is None or best.error <= plan.budget:
        return (
            f"error: none of {len(plan.tried)} settings draws a frame within {plan.ms:g} ms; the fastest is {best.name} with "
            f"{best.ms:.1f} ms; allow more with --ms, or use a smaller image"
        )
    return (
        f"error: none of {len(plan.tried)} settings keeps the wrong pixels within {_percent(plan.budget)}; the best is "
        f"{best.name} with {best.error:.4%} at {best.cost:.2f} x floor ({best.ms:.0f} ms); "
        "allow more with --wrong"
    )


def _percent(value: float) -> str:
    return f"{100.0 * value:.6g}%"


def _render_line(ctx: click.Context, shadow: Shadow) -> str:
    """`glshadow render` with the options given here, and the setting."""
    model = ctx.params["model"]
    words = ["glshadow", "render", *([] if model is None else [str(model)])]
    given: Mapping[click.Option, Any] = ctx.meta[GIVEN]
    for param, value in given.items():
        name = max(param.opts, key=len)
        if param.name in OWN:
            continue
        if param.is_flag:
            words.append(name)
        else:
            words += [f"{name}={text}" for text in (value if param.multiple else [value])]
    resolved = shadow.resolved()
    size = ["--resolution", str(resolved.resolution)] if resolved.filter.has_map else []
    return printable(shlex.join([*words, *size, "--filter", str(resolved.filter)]))
