"""Runs the Python and shell blocks of a documentation page, in order in one folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ELSEWHERE = {
    r"(\.venv/bin/)?(pip|pre-commit) install": "installs: tests/examples/test_wheel.py, and the set-up of every script",
    r"apt-get ": "needs root; scripts/bare installs all on a bare machine",
    r"scripts/": "set-up comes first: .ci/run calls these",
    r"glshadow view": "needs a screen: tests/examples/test_pages_run.py gives it one",
    r"jupyter ": "a server: tests/view/test_explorer_live.py opens a page of one",
}
"""Start of a shell line that a session skips -> why, and where it is tested."""

_BLOCK = re.compile(
    r"(?:<!-- file: (?P<file>\S+) -->\n)?^```(?P<language>python|sh|json)\n(?P<text>.*?)^```\n(?:\s*^```text\n(?P<said>.*?)^```)?",
    re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Block:
    """A fenced code block.

    Attributes
    ----------
    said : str or None
        The output that the page shows.
    file : str or None
        File name under which a block that is not code is stored.
    """

    language: str
    text: str
    said: str | None
    file: str | None
    line: int


def blocks_of(page: str) -> Iterator[Block]:
    """The blocks of a page that are run or stored."""
    for found in _BLOCK.finditer(page):
        line = page.count("\n", 0, found.start("text"))
        yield Block(found["language"], found["text"], found["said"], found["file"], line)


def commands(block: Block) -> list[str]:
    """Lines of a shell block that a session runs."""
    return [line for line in _lines(block) if not _elsewhere(line)]


def left_out(block: Block) -> list[str]:
    """The other lines of a shell block."""
    return [line for line in _lines(block) if _elsewhere(line)]


def _lines(block: Block) -> list[str]:
    """One line per command, even if it is continued on the page."""
    return [line for line in block.text.replace("\\\n", " ").splitlines() if line.strip()]


def _elsewhere(line: str) -> bool:
    return any(re.match(start, line) for start in ELSEWHERE)


def headless() -> dict[str, str]:
    """The environment without a screen, in which `glshadow` is this checkout's."""
    here = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return kept | {"PATH": here}


def run(block: Block, folder: Path) -> str:
    """Run a block in a folder; returns its standard output.

    Raises
    ------
    RuntimeError
        If it fails, with the end of its output.
    """
    if block.file is not None:
        (folder / block.file).write_text(block.text)
    if block.language == "python":
        return _run([sys.executable, "-c", block.text], folder, block)
    if block.language == "sh" and (lines := commands(block)):
        return _run(["bash", "-euo", "pipefail", "-c", "\n".join(lines)], folder, block)
    return ""


def _run(command: list[str], folder: Path, block: Block) -> str:
    done = subprocess.run(
        command, cwd=folder, env=headless(), stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600
    )  # fmt: skip
    if done.returncode != 0:
        raise RuntimeError(
            f"line {block.line}: exit code {done.returncode}\n{done.stdout[-1000:]}{done.stderr[-3000:]}"
        )
    return done.stdout


_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]\d+)?")
_TIME = re.compile(r"[\d.]+ (?:s|ms|x floor)\b")


def alike(said: str, printed: str) -> bool:
    """Whether texts have the same words and nearly the same numbers: another driver may move a pixel at an edge; times may differ."""
    said, printed = _TIME.sub("T", said), _TIME.sub("T", printed)
    if _NUMBER.sub("#", said) != _NUMBER.sub("#", printed):
        return False
    pairs = zip(_NUMBER.findall(said), _NUMBER.findall(printed), strict=True)
    return all(abs(float(a) - float(b)) <= 0.002 * abs(float(a)) + 0.002 for a, b in pairs)
