"""Transparency of files: what alpha 0 hides, what blends, and KHR_materials_transmission."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from tests.scene.glb import write_glb

CASES = Path(__file__).parents[3] / "shared" / "cases" / "meant"
DOWN = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
SIZE = (64, 64)


@pytest.fixture(scope="module")
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer
