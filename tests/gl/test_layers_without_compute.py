"""Blended surfaces on a driver of OpenGL 3.3: the same image."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

CHECKOUT = Path(__file__).resolve().parents[2]
OUTPUTS = ("linear", "alpha", "image", "transmittance", "node")


def frame(samples: int, panes: bool = True) -> gs.Frame:
    """Crossing panes before and behind a box, under a sun."""

    def node(mesh: gs.Mesh, *color: float) -> gs.Node:
        mode = gs.AlphaMode.BLEND if color[3] < 1.0 else gs.AlphaMode.OPAQUE
        return gs.Node(gs.Mesh(mesh.positions, mesh.triangles, material=gs.Material(color=color, alpha_mode=mode)))  # type: ignore[arg-type]

    scene = gs.Scene((
        node(gs.Mesh(*shapes.rectangle((-4, 0, 4), (8, 0, 0), (0, 0, -8))), 0.8, 0.8, 0.8, 1.0),
        node(gs.Mesh(*shapes.box((1, 1, 1), (0, 0.5, 0))), 0.9, 0.5, 0.2, 1.0),
        node(gs.Mesh(*shapes.rectangle((-2, 0.1, -1), (4, 0, 3), (0, 2, 0))), 0.2, 0.3, 0.9, 0.4),
        node(gs.Mesh(*shapes.rectangle((-2, 0.1, 2), (4, 0, -3), (0, 2, 0))), 0.9, 0.2, 0.3, 0.6),
    ))  # fmt: skip
    if samples > 1:  # borders of tints are not sampled more than once where OpenGL is newer
        scene = gs.Scene((*scene.nodes[:2], *(replace(each, casts=False) for each in scene.nodes[2:])))
    scene = scene if panes else gs.Scene(scene.nodes[:2])
    camera = gs.PerspectiveCamera((1.0, 3.0, 7.0), (0.0, 0.5, 0.0), fov_y=40.0)
    sun = gs.DirectionalLight(direction=(0.5, -1.0, -0.3))
    with gs.Renderer() as renderer:
        return renderer.render(scene, camera, [sun], (80, 60), outputs=OUTPUTS, samples=samples)


@pytest.mark.parametrize("samples", [1, 4])
def test_opengl_3_3_draws_the_same_layers(tmp_path: Path, samples: int) -> None:
    path = tmp_path / "old.npz"
    code = (
        f"import numpy as np; from tests.gl.test_layers_without_compute import frame; f = frame({samples}); "
        f"np.savez({str(path)!r}, version=f.used[0].why, **f.outputs)"
    )
    settings = {**os.environ, "MESA_GL_VERSION_OVERRIDE": "3.3", "PYTHONPATH": str(CHECKOUT)}
    subprocess.run([sys.executable, "-c", code], check=True, env=settings, cwd=CHECKOUT)
    old, new = np.load(path), frame(samples)
    assert "OpenGL 4.3" in str(old["version"]), "the override had no effect"
    np.testing.assert_array_equal(old["node"], new.node)
    # elsewhere all samples of a pixel are shaded there, here those that may differ
    layered = (new.linear != frame(samples, panes=False).linear).any(axis=-1)
    assert layered.sum() > 1000
    np.testing.assert_allclose(old["alpha"][layered], new.alpha[layered], atol=1e-6)
    np.testing.assert_allclose(old["linear"][layered], new.linear[layered], atol=1e-5)  # rounded in another order
    np.testing.assert_allclose(old["transmittance"], new.transmittance, atol=1e-5)
