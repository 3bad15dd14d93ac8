"""The README's Python runs and prints what the README says."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from glshadow.batch.job import parse_job
from glshadow.cli import main

README = Path(__file__).parents[2] / "README.md"


def test_readme_code_prints_what_it_says(tmp_path: Path) -> None:
    text = README.read_text()
    code = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    said = re.search(r"```text\n(\(720.*?)```", text, re.DOTALL)
    assert code
    assert said
    done = subprocess.run([sys.executable, "-c", code[1]], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "courtyard.png").exists()
    ours, theirs = done.stdout.splitlines(), said[1].splitlines()
    assert ours[0] == theirs[0]
    # The figures are llvmpipe's; another driver may move a pixel at an edge.
    assert re.sub(r"[\d.]+", "#", "\n".join(ours)) == re.sub(r"[\d.]+", "#", "\n".join(theirs))
    for a, b in zip(re.findall(r"[\d.]+", done.stdout), re.findall(r"[\d.]+", said[1]), strict=True):
        assert abs(float(a) - float(b)) <= 0.002 * abs(float(b)) + 0.002


def test_pictures_of_the_readme_exist() -> None:
    for name in re.findall(r"\]\((examples/[^)]+)\)", README.read_text()):
        assert (README.parent / name).is_file(), name


PAGES = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(.*?)```(?:\s*```text\n(.*?)```)?", re.DOTALL)
BLOCKS = [
    pytest.param(code, said, id=f"{page.stem}-{number}")
    for page in sorted(PAGES.glob("*.md"))
    for number, (code, said) in enumerate(BLOCK.findall(page.read_text()))
]


@pytest.mark.parametrize(("code", "said"), BLOCKS)
def test_code_of_the_pages_runs(code: str, said: str, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    if said:
        assert done.stdout == said


def test_jobs_of_the_batch_page_are_jobs(tmp_path: Path) -> None:
    (block,) = re.findall(r"```json\n(.*?)```", (PAGES / "batch.md").read_text(), re.DOTALL)
    lines = [line for line in block.splitlines() if line]
    assert [parse_job(line, tmp_path).output for line in lines] == ["evening.png"]


def test_commands_of_the_readme_are_understood(tmp_path: Path) -> None:
    """Each option and command of its shell lines is one that there is."""
    commands = re.findall(r"^glshadow .*", README.read_text(), re.MULTILINE)
    assert len(commands) >= 8
    for line in commands:
        words = shlex.split(line.partition("#")[0])
        command = main.commands[words[1]]
        known = {name for param in command.params for name in param.opts}
        assert {word for word in words[2:] if word.startswith("-") and not word[1:2].isdigit()} <= known, line
