"""The README's Python and every example pass `mypy --strict` against the package's installed types, as a user's code would."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from ..tolerances import PATIENCE_S

CHECKOUT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((CHECKOUT / "examples").glob("*.py"))
README = (CHECKOUT / "README.md").read_text()

WRONG = """
import glshadow as gs

frame = gs.render(gs.scenes.courtyard())
frame.visibility + "text"
frame.colour
gs.render(size=3)
"""


def check(*files: Path) -> str:
    """What mypy reports for some scripts; empty if they pass."""
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--scripts-are-modules",
        "--config-file",
        str(CHECKOUT / "pyproject.toml"),
    ]
    done = subprocess.run(
        [*command, *map(str, files)],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    return "" if done.returncode == 0 else done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.exhaustive
def test_blocks_of_the_readme_and_examples(tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert blocks
    assert len(EXAMPLES) >= 9
    files = [tmp_path / f"readme_{number}.py" for number in range(len(blocks))]
    for file, block in zip(files, blocks, strict=True):
        file.write_text(block)
    for example in EXAMPLES:  # modules, whose names may not begin with a digit
        files.append(tmp_path / f"example_{example.name}")
        files[-1].write_text(example.read_text())
    assert check(*files) == ""


@pytest.mark.slow
@pytest.mark.exhaustive
def test_the_check_can_fail(tmp_path: Path) -> None:
    (tmp_path / "wrong.py").write_text(WRONG)
    said = check(tmp_path / "wrong.py")
    assert said.count("error:") == 4, said
