"""Every example runs in a fresh process without output on stderr, and writes the image that its docstring describes."""

import subprocess
import sys
from pathlib import Path

import pytest

from ..pairwise import mostly
from ..tolerances import PATIENCE_S

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("[0-9]*.py"))
LONG = ("04", "07", "10", "12", "13", "14", "17", "22")
"""Those that take long; the gallery runs them too."""


@pytest.mark.parametrize(
    "example", mostly(EXAMPLES, *(each for each in EXAMPLES if each.stem[:2] in LONG)), ids=lambda path: path.stem
)
def test_example_runs(example: Path, headless: dict[str, str], tmp_path: Path) -> None:
    command = [sys.executable, str(example)]
    done = subprocess.run(command, cwd=tmp_path, env=headless, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    if ".png" in example.read_text():
        assert (tmp_path / f"{example.stem}.png").stat().st_size > 10_000
    else:
        assert done.stdout.strip()


def test_examples_are_short_and_say_what_to_look_at() -> None:
    assert len(EXAMPLES) >= 8
    for example in EXAMPLES:
        text = example.read_text()
        assert len(text.splitlines()) < 75, example.name
        assert "Look at:" in text.splitlines()[0], example.name
