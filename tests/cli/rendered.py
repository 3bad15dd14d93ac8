"""Runs `glshadow render` at a small size and says what it has made."""

from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner, Result

from glshadow.cli.render import command

SMALL = ("--size", "64x48", "--samples", "1", "--backend", "egl")


def run(*arguments: str, code: int = 0) -> Result:
    done = CliRunner().invoke(command, [*SMALL, *arguments])
    assert done.exit_code == code, done.output
    return done


def made(*arguments: str) -> list[bool]:
    return [row["made"] for row in json.loads(run(*arguments, "--json").stdout)["pictures"]]


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())
