"""Runs mutated model files, random settings and odd arguments through the renderer, in worker processes that may crash or hang.

The generators and the rules of judgement are those of tests/robustness, which runs a few fixed cases.
"""

from __future__ import annotations

import faulthandler
import multiprocessing as mp
import os
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import click
import mutated_files
import numpy as np
import odd_arguments
import random_settings
import verdict
from verdict import FAIL, OK, REFUSED, WARNED, Verdict

import glshadow as gs

ROOT = Path(__file__).resolve().parents[1]
MODELS = Path(os.environ.get("GLSHADOW_MODELS", ROOT.parent / "shared" / "models"))
KINDS = ("files", "settings", "arguments")
START_S = 60.0  # start-up limit of a worker: Python, the driver, the first shaders
MEMORY = 6 << 30  # address space of a worker: a runaway allocation must fail in it, not on the machine
PAUSE_S = 2.0  # gaps longer than this in the loop of this process mean that the machine was suspended
CONTROL = 64  # cases between two control images, which must not change

Job = tuple[str, int, int]  # kind, seed, number


def rng_of(job: Job) -> np.random.Generator:
    """Each case has its own generator, so that it can be repeated alone."""
    return np.random.default_rng([job[1], KINDS.index(job[0]), job[2]])


@cache
def stock() -> tuple[dict[str, bytes], frozenset[str]]:
    """The files to mutate, and those that are refused unchanged."""
    files = mutated_files.sources(MODELS)
    return files, mutated_files.refused(files)


def mutant_of(job: Job) -> mutated_files.Mutant:
    """The mutated file of a case."""
    return mutated_files.mutant(rng_of(job), *stock())


class Bench:
    """One renderer, and a control image that must never change."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.renderer = gs.Renderer()
        self.control = random_settings.case(np.random.default_rng(3))
        self.expected = self._control()
        self.done = 0

    def close(self) -> None:
        """Release everything."""
        self.renderer.release()

    def _control(self) -> np.ndarray:
        case = self.control
        return self.renderer.render(case.scene, None, None, (32, 32), samples=1).image

    def run(self, job: Job) -> Verdict:
        """Judge one case; every CONTROL cases, and after every refusal by the renderer, also the control image."""
        result = {"files": self._file, "settings": self._settings, "arguments": self._arguments}[job[0]](job)
        self.done += 1
        if self.done % CONTROL == 0 or (result.kind in (REFUSED, FAIL) and not result.cause.startswith("SceneError")):
            after = verdict.judged(lambda: np.testing.assert_array_equal(self._control(), self.expected))
            if after.kind == FAIL:
                return Verdict(FAIL, f"the next image is wrong after: {result.cause}", after.detail + result.detail)
        return result

    def _file(self, job: Job) -> Verdict:
        mutant = mutant_of(job)
        path = self.folder / f"fuzz{os.getpid()}{mutant.suffix}"
        path.write_bytes(mutant.data)

        def work() -> None:
            scene = gs.load(path)
            verdict.checked_render(self.renderer, scene, None, verdict.small_maps(scene.lights), (64, 64))

        return verdict.judged(work)

    def _arguments(self, job: Job) -> Verdict:
        case = odd_arguments.case(rng_of(job))

        def work() -> None:
            used = odd_arguments.in_use(case.call())
            if used is not None:
                scene, camera, lights = (used.get(name) for name in ("scene", "camera", "lights"))
                verdict.checked_render(self.renderer, scene, camera, lights, odd_arguments.SIZE)

        return verdict.judged(work)

    def _settings(self, job: Job) -> Verdict:
        case = random_settings.case(rng_of(job))
        return verdict.judged(lambda: verdict.checked_case(self.renderer, case))  # type: ignore[arg-type,return-value]


def _text(job: Job) -> str:
    """The settings or arguments of a case, as text."""
    return (odd_arguments if job[0] == "arguments" else random_settings).case(rng_of(job)).text


def keep(folder: Path, job: Job, result: Verdict) -> None:
    """Save everything needed to reproduce a failure."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{job[0]}_{job[1]}_{job[2]}"
    story = [f"scripts/fuzz --only {job[0]}:{job[1]}:{job[2]}", result.cause, result.detail]
    if job[0] == "files":
        mutant = mutant_of(job)
        (folder / f"{name}{mutant.suffix}").write_bytes(mutant.data)
        story.insert(1, f"{mutant.source}: {'; '.join(mutant.changes)}")
    else:
        story.insert(1, _text(job))
    (folder / f"{name}.txt").write_text("\n\n".join(story) + "\n")


# --- workers


def serve(pipe: Connection, log: str) -> None:
    """Main function of a worker: receives jobs and sends verdicts until it receives None."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends it
    with Path(log).open("w") as stream:
        os.dup2(stream.fileno(), 2)
        faulthandler.enable(stream, all_threads=False)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        bench = Bench(Path(log).parent)
        stock()
        pipe.send("ready")
        while (job := pipe.recv()) is not None:
            pipe.send(bench.run(job))
        bench.close()


@dataclass
class Worker:
    """A process with its job and the job's deadline."""

    folder: Path
    number: int
    job: Job | None = None
    deadline: float = 0.0
    cpu_s: float = 0.0
    process: Any = field(init=False)
    pipe: Connection = field(init=False)

    def __post_init__(self) -> None:
        context = mp.get_context("spawn")
        self.log = self.folder / f"worker{self.number}.log"
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, str(self.log)), daemon=True)
        self.process.start()
        theirs.close()
        self.deadline = time.monotonic() + START_S

    def give(self, job: Job, seconds: float) -> None:
        """Start a job."""
        self.job, self.deadline, self.cpu_s = job, time.monotonic() + seconds, self._cpu_s()
        self.pipe.send(job)

    def late(self, seconds: float) -> bool:
        """Whether it hangs: it used its time on the processor, or took six times as long. A busy machine does not count as a hang."""
        over = time.monotonic() - self.deadline
        return over > 0.0 and (self._cpu_s() - self.cpu_s > 0.5 * seconds or over > 5.0 * seconds)

    def _cpu_s(self) -> float:
        try:
            words = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> str:
        """Kill the process; returns its last output on standard error."""
        self.process.kill()
        self.process.join()
        self.pipe.close()
        return self.log.read_text(errors="replace")[-4000:]


def run_all(
    jobs: list[Job], workers: int, seconds: float, kept: Path, tick: Any
) -> dict[str, list[tuple[Job, Verdict]]]:
    """Verdicts of all jobs by kind. A crash or a hang is the verdict of its job, and a new worker continues."""
    results: dict[str, list[tuple[Job, Verdict]]] = {kind: [] for kind in KINDS}
    waiting = list(reversed(jobs))
    broken_starts = 0

    def note(job: Job, result: Verdict) -> None:
        results[job[0]].append((job, result))
        if result.kind == FAIL:
            keep(kept, job, result)
        tick(job[0], result.kind)

    with tempfile.TemporaryDirectory(prefix="glshadow-fuzz-") as logs:
        crew = [Worker(Path(logs), i) for i in range(workers)]
        try:
            while crew:
                asleep = time.monotonic()
                ready = wait([each.pipe for each in crew], timeout=0.2)
                asleep = time.monotonic() - asleep
                for worker in crew if asleep > PAUSE_S else ():
                    worker.deadline += asleep  # the whole machine was suspended
                for place, worker in enumerate(list(crew)):
                    answer, ended = None, False
                    if worker.pipe in ready:
                        try:
                            answer = worker.pipe.recv()
                        except (EOFError, OSError):
                            ended = True
                    late = answer is None and worker.late(seconds)
                    if ended or late:
                        code, said = worker.process.exitcode, worker.end()
                        cause = (
                            f"crash, exit code {worker.process.exitcode}" if ended else f"hang: more than {seconds:g} s"
                        )
                        if worker.job is None:
                            broken_starts += 1
                            if broken_starts > 3:
                                raise click.ClickException(f"the workers do not start ({code}):\n{said}")
                        else:
                            note(worker.job, Verdict(FAIL, cause, said))
                        crew[place] = Worker(Path(logs), worker.number)
                        continue
                    if answer is None:
                        continue
                    if worker.job is not None:
                        note(worker.job, answer)
                    if waiting:
                        worker.give(waiting.pop(), seconds)
                    else:
                        worker.pipe.send(None)
                        worker.process.join(10)
                        worker.end()
                        crew.remove(worker)
                        break  # list positions have changed
        except KeyboardInterrupt:
            click.echo(f"interrupted, {len(waiting)} cases not started", err=True)
        finally:
            for worker in crew:
                worker.end()
    return results


# --- report


def table(results: dict[str, list[tuple[Job, Verdict]]], seconds: float) -> Any:
    """Counts by kind and verdict."""
    from rich.table import Table

    shown = Table("", "cases", OK, WARNED, REFUSED, FAIL, title=f"{seconds:.0f} s")
    for kind, rows in results.items():
        if rows:
            counts = Counter(result.kind for _, result in rows)
            shown.add_row(kind, str(len(rows)), *(str(counts[each]) for each in (OK, WARNED, REFUSED, FAIL)))
    return shown


def causes(results: dict[str, list[tuple[Job, Verdict]]], which: tuple[str, ...]) -> list[str]:
    """`count x kind cause (first case)`, most frequent first."""
    groups: dict[tuple[str, str, str], list[Job]] = {}
    for kind, rows in results.items():
        for job, result in rows:
            if result.kind in which:
                groups.setdefault((result.kind, kind, result.cause), []).append(job)
    rows = sorted(groups.items(), key=lambda item: (item[0][0], -len(item[1])))
    return [
        f"{len(jobs):5d} x {verdict_} [{kind}] {cause}   (--only {kind}:{jobs[0][1]}:{jobs[0][2]})"
        for (verdict_, kind, cause), jobs in rows
    ]


def once(only: str) -> int:
    """Run one case in this process and print everything known about it."""
    kind, seed, number = only.split(":")
    job = (kind, int(seed), int(number))
    if kind != "files":
        click.echo(_text(job))
    if kind == "files":
        mutant = mutant_of(job)
        click.echo(f"{mutant.source}: {'; '.join(mutant.changes)}")
    with tempfile.TemporaryDirectory(prefix="glshadow-fuzz-") as folder:
        bench = Bench(Path(folder))
        result = bench.run(job)
        bench.close()
    click.echo(f"{result.kind}: {result.cause}\n{result.detail}")
    return int(result.kind == FAIL)


@click.command(help=__doc__)
@click.option("--files", default=10_000, show_default=True, help="Mutated model files.")
@click.option("--settings", default=10_000, show_default=True, help="Random settings, lights and cameras.")
@click.option("--arguments", default=10_000, show_default=True, help="Public calls with odd arguments.")
@click.option("--seed", default=0, show_default=True)
@click.option("--first", default=0, show_default=True, help="Number of the first case, to continue an earlier run.")
@click.option("--seconds-per-case", default=10.0, show_default=True, help="Time limit of a case; longer is a hang.")
@click.option("--workers", default=2, show_default=True)
@click.option(
    "--keep",
    "kept",
    default="fuzz_failures",
    show_default=True,
    type=click.Path(path_type=Path),
    help="Folder for the files and settings of failures; created for the first one.",
)
@click.option("--causes", "all_causes", is_flag=True, help="Also count the warnings and named errors by their text.")
@click.option("--only", metavar="KIND:SEED:NUMBER", help="Repeat one case in this process.")  # fmt: skip
def main(
    files: int, settings: int, arguments: int, seed: int, first: int, seconds_per_case: float, workers: int, kept: Path, all_causes: bool,
    only: str | None,
) -> None:  # fmt: skip
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if only:
        sys.exit(once(only))
    jobs: list[Job] = [("files", seed, first + i) for i in range(files)] + [
        (kind, seed, first + i)
        for kind, count in (("settings", settings), ("arguments", arguments))
        for i in range(count)
    ]
    console = Console(stderr=True)
    start = time.monotonic()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]} failed"),
    )
    with Progress(*columns, TimeRemainingColumn(), console=console) as progress:
        tasks = {
            "files": progress.add_task("files", total=files, failed=0),
            "settings": progress.add_task("settings", total=settings, failed=0),
            "arguments": progress.add_task("arguments", total=arguments, failed=0),
        }
        failed: Counter[str] = Counter()

        def tick(kind: str, result: str) -> None:
            failed[kind] += result == FAIL
            progress.update(tasks[kind], advance=1, failed=failed[kind])

        results = run_all(jobs, min(workers, max(len(jobs), 1)), seconds_per_case, kept, tick)
    out = Console(width=max(console.width, 120))
    out.print(table(results, time.monotonic() - start))
    for line in causes(results, (FAIL, WARNED, REFUSED) if all_causes else (FAIL,)):
        click.echo(line)
    wrong = sum(result.kind == FAIL for rows in results.values() for _, result in rows)
    if wrong:
        click.echo(f"{wrong} failures, kept in {kept}")
    sys.exit(int(wrong > 0))


if __name__ == "__main__":
    main()
