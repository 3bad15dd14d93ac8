"""Outputs for training data: node, normal and position against rays."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs

SIZE = (320, 180)
OUTPUTS = ("depth", "triangle", "node", "normal", "position")


def scene() -> gs.Scene:
    """The courtyard, with an empty node before the others."""
    built = gs.scenes.courtyard()
    empty = gs.Node(gs.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), np.eye(4), "empty")
    return gs.Scene((empty, *built.nodes), built.camera, built.lights)


CAMERAS = {
    "perspective": None,
    "orthographic": gs.OrthographicCamera((8.0, 9.0, 12.0), (0.0, 0.0, 0.0), height=18.0),
}


@pytest.mark.parametrize("name", list(CAMERAS))
def test_against_rays(renderer: gs.Renderer, name: str) -> None:
    built = scene()
    frame = renderer.render(built, CAMERAS[name], None, SIZE, outputs=OUTPUTS, samples=1)
    truth = gs.trace(built, CAMERAS[name], size=SIZE, samples=1)
    seen = truth.triangle >= 0
    np.testing.assert_array_equal(frame.node >= 0, np.isfinite(frame.depth))
    same = seen & (frame.triangle == truth.triangle)
    assert same.sum() > 0.99 * seen.sum()
    np.testing.assert_array_equal(frame.node[same], truth.node[same])
    np.testing.assert_allclose(frame.normal[same], truth.normal[same], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(frame.normal[seen & (frame.node >= 0)], axis=-1), 1.0, atol=1e-6)
    off = np.linalg.norm(frame.position[same] - truth.position[same], axis=-1)
    # depth is that of vertices snapped to 1/256 pixel, put back on the triangle's plane
    assert np.quantile(off, 0.99) < 2e-4
    assert np.isnan(frame.normal[~np.isfinite(frame.depth)]).all()
    assert np.isnan(frame.position[~np.isfinite(frame.depth)]).all()
    assert (frame.node.dtype, frame.normal.dtype, frame.position.dtype) == (np.int32, np.float32, np.float64)
    names = {built.nodes[i].name for i in np.unique(frame.node) if i >= 0}
    assert "empty" not in names
    assert len(names) > 3


def test_far_away_positions_keep_their_precision(renderer: gs.Renderer) -> None:
    """Moved by 1e7, positions relative to the origin equal those of the unmoved scene, within float64's rounding there."""
    built = gs.scenes.courtyard()
    shift = np.array([1e7, -3e6, 2e6])
    away = np.eye(4)
    away[:3, 3] = shift
    nodes = tuple(gs.Node(n.mesh, away @ n.world_from_mesh, n.name) for n in built.nodes)
    camera = built.camera
    there_camera = gs.PerspectiveCamera(
        tuple(np.asarray(camera.position) + shift), tuple(np.asarray(camera.target) + shift), fov_y=camera.lens["fov_y"]
    )
    here = renderer.render(built, camera, None, SIZE, outputs=OUTPUTS, samples=1)
    there = renderer.render(gs.Scene(nodes, there_camera, built.lights), None, None, SIZE, outputs=OUTPUTS, samples=1)
    both = (here.triangle >= 0) & (here.triangle == there.triangle)
    assert both.mean() > 0.5
    gap = (there.position - shift - here.position)[both]
    assert np.quantile(np.abs(gap), 0.99) < 5e-4
    np.testing.assert_allclose(there.normal[both], here.normal[both], atol=1e-6)
