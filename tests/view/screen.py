"""Screenshots and key presses of a display."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glshadow import image

from ..tolerances import PATIENCE_S

GRAB = "import sys\nfrom PIL import ImageGrab\nImageGrab.grab(xdisplay=sys.argv[1]).convert('RGB').save(sys.argv[2])"


def seen_on(display: str, folder: Path) -> NDArray[np.uint8]:
    """Pixels (H, W, 3); in a process of its own, because a display that closes ends the process."""
    path = folder / "screen.png"
    subprocess.run([sys.executable, "-c", GRAB, display, str(path)], check=True, timeout=PATIENCE_S)
    picture = image.read(path)[..., :3].astype(np.uint8)
    path.unlink()
    return picture


def kept(name: str, picture: NDArray[np.uint8]) -> None:
    """If GLSHADOW_SCREENSHOTS names a folder, save the image there for inspection."""
    if folder := os.environ.get("GLSHADOW_SCREENSHOTS"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        image.write(Path(folder) / f"{name}.png", picture)


def pressed(display: str, *words: str) -> str:
    """Run xdotool and return its output: empty where it finds nothing.

    Raises
    ------
    RuntimeError
        If it cannot do what it is told.
    """
    done = subprocess.run(
        ["xdotool", *words], env=os.environ | {"DISPLAY": display}, capture_output=True, text=True, timeout=PATIENCE_S
    )
    if done.returncode != 0 and words[0] != "search":
        raise RuntimeError(done.stderr)
    return done.stdout
