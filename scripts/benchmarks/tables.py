"""Measures everything again and writes the tables of docs/ and the README.

The tables' numbers are kept in docs/numbers, with day, commit and machine. It takes an hour or more on an idle machine and needs the
12 models. With --from-stored nothing is measured: the tables are made from the stored numbers.
"""

from __future__ import annotations

import datetime
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import click
from frame import models_in

import glshadow as gs
from glshadow.study.machine import machine
from scripts.pages import PARTS, ROOT, rendered, stored
from scripts.pages.markdown import Numbers, Part, rounded


def measured(part: Part, more: tuple[str, ...]) -> Any:
    """Run a part's benchmark, which prints as it goes; returns its results.

    Raises
    ------
    click.ClickException
        If it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "numbers.json"
        name, *arguments = part.command
        script = Path(__file__).with_name(f"{name}.py")
        done = subprocess.run([sys.executable, script, *arguments, *more, "--json", output], check=False)
        if done.returncode:
            raise click.ClickException(f"scripts/bench {' '.join(part.command)} failed; nothing of it is stored")
        return json.loads(output.read_text())


def circumstances() -> dict[str, str]:
    """Day, commit and machine of a measurement."""
    with gs.Renderer() as renderer:
        here = machine(renderer.info)
    git = ("git", "-C", str(ROOT), "rev-parse", "--short", "HEAD")
    # without git, and in a checkout from an archive, there is no commit
    commit = (
        subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip() if shutil.which("git") else ""
    )
    return {
        "on": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "commit": commit or f"of version {here['glshadow']}",
        "machine": f"{here['processor']}; {here['driver']}",
    }


def store(part: Part, results: Any) -> None:
    """Store the numbers of a part's results that the tables show."""
    numbers: Numbers = {"measured": circumstances(), "results": rounded(part.condensed(results))}
    stored(part).write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")


@click.command(help=__doc__)
@click.option("--from-stored", is_flag=True, help="Measure nothing.")
@click.option(
    "--only", multiple=True, type=click.Choice([part.name for part in PARTS]), help="Measure only these parts."
)
@click.option("--models", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
def main(from_stored: bool, only: tuple[str, ...], models: Path | None) -> None:
    if not (from_stored or models_in(models)):
        raise click.UsageError("the 12 models are needed: --models FOLDER, or GLSHADOW_MODELS")
    parts = [] if from_stored else [part for part in PARTS if not only or part.name in only]
    for number, part in enumerate(parts, start=1):
        start = time.monotonic()
        click.echo(f"[{number}/{len(parts)}] scripts/bench {' '.join(part.command)}", err=True)
        more = ("--models", str(models)) if models and part.name not in ("techniques", "peers") else ()
        store(part, measured(part, more))
        click.echo(f"[{number}/{len(parts)}] stored after {time.monotonic() - start:.0f} s", err=True)
    for path, text in rendered().items():
        if path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            click.echo(f"written: {path.relative_to(ROOT)}", err=True)


if __name__ == "__main__":
    main()
