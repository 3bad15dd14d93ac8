"""Every command and every Python block of README and docs runs, in the order of its page, and prints what the page shows."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from ..tolerances import PATIENCE_S
from ..view.screen import pressed

CHECKOUT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "CONTRIBUTING.md", *(f"docs/{path.name}" for path in sorted((CHECKOUT / "docs").glob("*.md"))))
JOB = '{"scene": "courtyard", "output": "a.png", "size": [64, 36]}\n'


@pytest.fixture
def sessions(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT)
    return importlib.import_module("scripts.manual.sessions")


def given(page: str, folder: Path, models: Path) -> None:
    """Create the files that a page assumes in the reader's folder."""
    if page == "docs/commands.md":
        shutil.copy(models / "cesium_man.glb", folder / "chess.glb")
        (folder / "jobs.jsonl").write_text(JOB)
    if page == "docs/sun.md":
        shutil.copy(models / "house_scene.glb", folder / "house.glb")
    if page in ("docs/commands.md", "docs/motion.md"):
        shutil.copy(models / "cesium_man.glb", folder / "walk.glb")


@pytest.mark.slow
@pytest.mark.parametrize("page", [PAGES[0], *(pytest.param(page, marks=pytest.mark.exhaustive) for page in PAGES[1:])])
def test_commands_and_blocks_of_a_page_work(page: str, sessions: ModuleType, models: Path, tmp_path: Path) -> None:
    given(page, tmp_path, models)
    for block in sessions.blocks_of((CHECKOUT / page).read_text()):
        printed = sessions.run(block, tmp_path)
        if block.said is not None:
            assert sessions.alike(block.said, printed), f"line {block.line} prints\n{printed}"
    for shown in re.findall(r"<!-- shows: (\S+) -->", (CHECKOUT / page).read_text()):
        assert (tmp_path / shown).stat().st_size > 1000, shown


def test_most_lines_are_run(sessions: ModuleType) -> None:
    """Only what installs, needs root, or runs elsewhere is left out; whatever can be checked of that is checked."""
    run, left = [], []
    for page in PAGES:
        for block in sessions.blocks_of((CHECKOUT / page).read_text()):
            if block.language == "sh":
                run += sessions.commands(block)
                left += sessions.left_out(block)
    assert sum(line.startswith("glshadow ") for line in run) >= 15
    unused = [start for start in sessions.ELSEWHERE if not any(re.match(start, line) for line in left)]
    assert unused == [], "leaves nothing out any more"
    for line in left:
        word = line.split()[0]
        assert not word.startswith("scripts/") or os.access(CHECKOUT / word, os.X_OK), line


def test_named_extras_exist() -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
    for page in PAGES:
        for names in re.findall(r"(?:glshadow|\.)\[([\w,]+)\]'", (CHECKOUT / page).read_text()):
            assert set(names.split(",")) <= set(project["optional-dependencies"]), page


def test_failing_blocks_and_different_output_are_detected(sessions: ModuleType, tmp_path: Path) -> None:
    page = "```sh\necho 1.00 s\nglshadow view\npip install x\n```\n\n```text\n7.3 s\n```\n\n```python\n1 / 0\n```\n"
    shell, python = sessions.blocks_of(page)
    assert sessions.commands(shell) == ["echo 1.00 s"]
    assert sessions.alike(shell.said, sessions.run(shell, tmp_path))
    with pytest.raises(RuntimeError, match=r"line 11: exit code 1\n(.|\n)*ZeroDivisionError"):
        sessions.run(python, tmp_path)
    assert not sessions.alike("wrong 0.10%", "wrong 0.20%")
    assert not sessions.alike("wrong 0.10%", "right 0.10%")


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["view"], ["view", "chess.glb"], ["view", "model.glb", "--ground"]], ids=str)
def test_window_opens_by_the_documented_command(
    arguments: list[str], screen: str, models: Path, tmp_path: Path
) -> None:
    assert "glshadow view chess.glb" in (CHECKOUT / "docs" / "commands.md").read_text()
    assert "glshadow view\nglshadow view model.glb --ground\n" in (CHECKOUT / "docs" / "window.md").read_text()
    for name in ("chess", "model"):
        shutil.copy(models / "cesium_man.glb", tmp_path / f"{name}.glb")
    command = [sys.executable, "-m", "glshadow", *arguments]
    with subprocess.Popen(
        command, cwd=tmp_path, env=os.environ | {"DISPLAY": screen}, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            _press_q(process, screen)
            _, said = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert process.returncode == 0, said
    assert "Traceback" not in said


def _press_q(process: subprocess.Popen[str], screen: str) -> None:
    """Press Q once the window is open."""
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until and process.poll() is None:
        if pressed(screen, "search", "--name", "^glshadow$").strip():
            time.sleep(1.0)
            pressed(screen, "key", "q")
            return
        time.sleep(0.2)
