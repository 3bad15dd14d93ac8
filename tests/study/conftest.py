"""One study of the box for the whole folder, with its journal."""

from __future__ import annotations

from pathlib import Path

import pytest

import glshadow as gs
from glshadow.study import Grid, Study, run_study

SIZE = (160, 90)
STEPS = (8, 16, 32, 64)  # so coarse that each has wrong pixels even in so small an image
KINDS = (gs.Hard(), gs.Pcf(1))
GRID = Grid(STEPS, KINDS, more=(gs.Shadow(),))
REPEATS = 2


@pytest.fixture(scope="session")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


@pytest.fixture(scope="session")
def journal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The journal of `study`; a test that measures more uses a copy."""
    return tmp_path_factory.mktemp("study") / "study.jsonl"


@pytest.fixture(scope="session")
def study(scene: gs.Scene, journal: Path) -> Study:
    return run_study(scene, size=SIZE, grid=GRID, repeats=REPEATS, resume=journal, backend="egl")
