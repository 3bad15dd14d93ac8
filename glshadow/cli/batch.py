"""glshadow batch: many images from a file of jobs."""

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
A job is a JSON object on one line:
  {"scene": "house.glb", "output": "house_{:02d}.png", "orbit": 24, "ground": true, "size": [640, 360]}
  {"scene": "courtyard", "output": "evening.png", "lights": [{"kind": "sun", "direction": [-3, -1, -1], "angle": 0.5}]}
  {"scene": "car.glb", "output": "car.exr", "cameras": [{"position": [3, 2, 4], "target": [0, 0.5, 0], "fov_y": 35}],
   "shadow": {"filter": "pcf:1", "resolution": 1024}}                             (on one line)
\b
Examples:
  glshadow batch jobs.jsonl -o images
  glshadow batch jobs.jsonl -o images              again: keeps finished images, retries failed jobs
  glshadow batch jobs.jsonl -o images --check      check the file without rendering
  glshadow batch jobs.jsonl -o /shared/images --dask tcp://scheduler:8786
"""


@click.command(cls=Command, epilog=EXAMPLES)
@click.argument("jobs", type=click.Path(dir_okay=False, path_type=Path))
@option("Batch", "-o", "--output", "folder", default=".", metavar="FOLDER", type=click.Path(file_okay=False, path_type=Path),
        help="Folder for the images and the journal. Default: the current folder.")  # fmt: skip
@option(
    "Batch",
    "--processes",
    metavar="N",
    type=click.IntRange(1, 1024),
    help="Number of processes. Default: one per core.",
)
@option(
    "Batch",
    "--backend",
    type=click.Choice(["auto", "egl", "osmesa", "window"]),
    default="auto",
    help="OpenGL backend of every process.",
)
@option("Batch", "--fresh", is_flag=True, help="Render finished jobs again.")
@option("Batch", "--check", is_flag=True, help="Check the file without rendering.")
@option(
    "Batch",
    "--dask",
    metavar="ADDRESS",
    help="Address of a Dask scheduler whose workers render. Needs pip install 'glshadow[dask]'.",
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
    """Render the images of JOBS, a file of JSON lines, in separate processes.

    All lines are checked before work begins. A job that fails is listed at the end and does not affect others; images are written
    atomically; an interrupted batch resumes. Keys of a job: scene, output, cameras or orbit, lights, shadow, size, samples, background,
    exposure, tone, ground, up_axis, outputs. Exit code 1 if a job failed.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        from glshadow.batch import read_jobs, run_batch

        with work.stage("read", f"reading {jobs.name}"):
            wanted = read_jobs(jobs)
        pictures = sum(job.pictures for job in wanted)
        if check:
            work.say(f"{jobs.name}: {len(wanted)} jobs, {pictures} images")
            work.finish({"jobs": len(wanted), "pictures": pictures})
            return
        with work.stage("draw", "drawing"), Bar(work) as bar:
            done = run_batch(wanted, folder, processes, backend, fresh, bar, dask)
        for text in done.warnings:
            work.say(f"warning: {text}")
        for failed in done.failed:
            work.say(f"error: {failed.job.output}: {failed.reason}")
        work.say(f"{done.drawn} jobs drawn ({done.pictures} images), {done.kept} kept, {len(done.failed)} failed")
        facts = {"drawn": done.drawn, "pictures": done.pictures, "kept": done.kept, "seconds": done.seconds}
        work.finish({**facts, "failed": [{"output": each.job.output, "reason": each.reason} for each in done.failed]})
        if done.failed:
            raise click.exceptions.Exit(FAILED)
