"""glshadow batch: many pictures from a file of jobs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from glshadow.cli.bar import Bar
from glshadow.cli.options import Command, common, option
from glshadow.cli.running import FAILED, Work

if TYPE_CHECKING:
    from glshadow.gl.driver.context import Backend

EXAMPLES = """
\b
A job is a JSON object in a line:
  {"scene": "house.glb", "output": "house_{:02d}.png", "orbit": 24, "ground": true, "size": [640, 360]}
  {"scene": "courtyard", "output": "evening.png", "lights": [{"kind": "sun", "direction": [-3, -1, -1], "angle": 0.5}]}
  {"scene": "car.glb", "output": "car.exr", "cameras": [{"position": [3, 2, 4], "target": [0, 0.5, 0], "fov_y": 35}],
   "shadow": {"filter": "pcf:1", "resolution": 1024}}                             (in one line)
\b
Examples:
  glshadow batch jobs.jsonl -o pictures
  glshadow batch jobs.jsonl -o pictures            again: what is done is kept, what failed is tried anew
  glshadow batch jobs.jsonl -o pictures --check    say what is wrong with the file, and draw nothing
  glshadow batch jobs.jsonl -o /shared/pictures --dask tcp://scheduler:8786
"""


@click.command(cls=Command, epilog=EXAMPLES)
@click.argument("jobs", type=click.Path(dir_okay=False, path_type=Path))
@option("Batch", "-o", "--output", "folder", default=".", metavar="FOLDER", type=click.Path(file_okay=False, path_type=Path),
        help="Where pictures go, and the journal of what is done. Default: the current folder.")  # fmt: skip
@option("Batch", "--processes", metavar="N", type=click.IntRange(1, 1024), help="Default: one for each core.")
@option(
    "Batch",
    "--backend",
    type=click.Choice(["auto", "egl", "osmesa", "window"]),
    default="auto",
    help="Of every process.",
)
@option("Batch", "--fresh", is_flag=True, help="Draw also what is done.")
@option("Batch", "--check", is_flag=True, help="Only read the file, and say what is wrong with it.")
@option(
    "Batch",
    "--dask",
    metavar="ADDRESS",
    help="A Dask scheduler, whose workers draw. Needs pip install 'glshadow[dask]'.",
)
@common
def command(
    as_json: bool,
    debug: bool,
    jobs: Path,
    folder: Path,
    processes: int | None,
    backend: Backend,
    fresh: bool,
    check: bool,
    dask: str | None,
) -> None:
    """Draw the pictures of JOBS, a file of JSON lines, in processes of their own.

    All lines are checked before work begins. What fails is listed at the end and fails no other; each picture is put in place whole; an
    interrupted batch goes on where it was. Keys of a job: scene, output, cameras or orbit, lights, shadow, size, samples, background,
    ground, up_axis. Exit code 1 if a job failed.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        from glshadow.batch import read_jobs, run_batch

        with work.stage("read", f"reading {jobs.name}"):
            wanted = read_jobs(jobs)
        pictures = sum(job.pictures for job in wanted)
        if check:
            work.say(f"{jobs.name}: {len(wanted)} jobs, {pictures} pictures")
            work.finish({"jobs": len(wanted), "pictures": pictures})
            return
        with work.stage("draw", "drawing"), Bar(work) as bar:
            done = run_batch(wanted, folder, processes, backend, fresh, bar, dask)
        for text in done.warnings:
            work.say(f"warning: {text}")
        for failed in done.failed:
            work.say(f"error: {failed.job.output}: {failed.reason}")
        work.say(f"{done.drawn} jobs drawn ({done.pictures} pictures), {done.kept} kept, {len(done.failed)} failed")
        facts = {"drawn": done.drawn, "pictures": done.pictures, "kept": done.kept, "seconds": done.seconds}
        work.finish({**facts, "failed": [{"output": each.job.output, "reason": each.reason} for each in done.failed]})
        if done.failed:
            raise click.exceptions.Exit(FAILED)
