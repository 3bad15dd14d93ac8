"""N36: real models with narrow gaps and many instances against rays."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from glshadow.errors import GlshadowWarning
from glshadow.io.load import load
from glshadow.lights import DirectionalLight
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scoring.error import measure

from ..exact.compare import WRONG, compared

SIZE = (256, 256)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param("brain_cortex.ply", marks=pytest.mark.exhaustive), "dungeon_instances.glb"]
)
def test_n36_large_models(renderer: Renderer, models: Path, name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GlshadowWarning)
        scene = load(models / name, ground=True, look="plain")
    sun = DirectionalLight(direction=(-0.55, -0.8, -0.25))
    truth = trace(scene, scene.camera, [sun], SIZE, samples=1)
    assert (truth.visibility[0] == 0.0).any()
    frame = renderer.render(scene, scene.camera, [sun], SIZE, outputs=("visibility", "triangle"), samples=1)
    error = measure(frame, truth)
    assert error.counted > 0.05
    # The pixels tested are those away from silhouettes and creases.
    assert error.acne + error.leak == 0.0, str(error)
    result = compared(renderer, scene, sun, scene.camera, SIZE)
    assert result.wrong.sum() <= WRONG, str(result)  # of all pixels
