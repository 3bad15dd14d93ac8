"""A real browser, without a screen and without a GPU."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from shutil import which

import pytest

from ..tolerances import PATIENCE_S


@pytest.fixture
def browser(optional: Callable[[str, str], None], tmp_path: Path) -> Callable[[Path, str], str]:
    program = which("chromium") or which("chromium-browser") or which("google-chrome")
    if program is None:
        optional("Chromium", "chromium")

    def shown(page: Path, fragment: str) -> str:
        command = [
            str(program), "--headless", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=20000", "--dump-dom", f"{page.resolve().as_uri()}#{fragment}",
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert 'id="error"' not in done.stdout, re.findall(r'id="error">(.*?)<', done.stdout)
        return done.stdout

    return shown
