"""Back faces that a material culls: invisible to the camera, at every output, by the tracer too; their shadows stay."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

SIZE = (96, 72)
OUTPUTS = ("image", "node", "depth", "triangle", "visibility", "normal")
CULLED = gs.Material(cull_back_faces=True)
MIRRORED = np.diag([-1.0, 1.0, 1.0, 1.0])


def room(material: gs.Material = CULLED, matrix: np.ndarray | None = None) -> gs.Scene:
    """A box that is seen from inside: its faces are turned inwards; in it a ball."""
    positions, triangles = shapes.box((4.0, 3.0, 4.0))
    box = gs.Mesh(positions, triangles[:, ::-1], material=material)
    ball = gs.Mesh(*shapes.icosphere(3, 0.6), material=gs.Material((1.0, 0.2, 0.1, 1.0)))
    matrix = np.eye(4) if matrix is None else matrix
    camera = gs.PerspectiveCamera((5.0, 3.5, 9.0), (0.0, 0.0, 0.0))
    lamp = gs.PointLight(position=(0.5, 1.0, 0.5))
    return gs.Scene((gs.Node(box, matrix, "room"), gs.Node(ball, matrix, "ball")), camera, (lamp,))


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("matrix", [None, MIRRORED], ids=["as it is", "mirrored"])
def test_room_is_seen_through_its_near_walls(renderer: gs.Renderer, matrix: np.ndarray | None, samples: int) -> None:
    scene = room(matrix=matrix)
    frame = renderer.render(scene, None, None, SIZE, outputs=OUTPUTS, samples=samples)
    assert (frame.node == 1).sum() > 40, "the ball is seen"
    solid = renderer.render(room(replace(CULLED, cull_back_faces=False), matrix), None, None, SIZE, outputs=OUTPUTS)
    assert (solid.node != 1).all(), "else the walls hide it"
    truth = gs.trace(scene, None, None, SIZE, samples=samples)
    assert (frame.triangle == truth.triangle).mean() > 0.9999  # a ray through an edge may see either triangle
    known = ~np.isnan(frame.visibility[0]) & ~np.isnan(truth.visibility[0])
    assert (np.isnan(frame.visibility[0]) == np.isnan(truth.visibility[0])).mean() > 0.999
    assert np.abs(frame.visibility[0] - truth.visibility[0])[known].max() < 1.0 / samples + 1e-6
    assert (np.abs(frame.visibility[0] - truth.visibility[0])[known] > 0).mean() < 2e-3


def test_file_with_one_right_picture(renderer: gs.Renderer, models: Path) -> None:
    scene = gs.load(models.parent / "cases" / "meant" / "dollhouse.glb")
    camera = gs.OrthographicCamera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), height=1.8)
    frame = renderer.render(scene, camera, [], (32, 32), ambient=1.0, outputs=("image", "node"), tone="none")
    assert (frame.node == 1).all()
    assert np.unique(frame.image.reshape(-1, 3), axis=0).tolist() == [[0, 255, 0]]
    behind = gs.OrthographicCamera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), height=1.8)
    assert (renderer.render(scene, behind, [], (32, 32), outputs=("node",)).node == 0).all()


@pytest.mark.parametrize("filter", [gs.Exact(), gs.Pcf(1), gs.Msm(1)], ids=str)
@pytest.mark.parametrize("turned", [False, True])
def test_shadows_are_cast_by_both_sides(renderer: gs.Renderer, filter: gs.Filter, turned: bool) -> None:
    """A sheet over a ground, lit from above, whichever side is up; with `faces` the light says otherwise."""
    positions, triangles = shapes.rectangle((-1, 1, 1), (2, 0, 0), (0, 0, -2))
    sheet = gs.Mesh(positions, triangles[:, ::-1] if turned else triangles, material=CULLED)
    ground = gs.Mesh(*shapes.rectangle((-4, 0, 4), (8, 0, 0), (0, 0, -8)))
    scene = gs.Scene((gs.Node(ground, name="ground"), gs.Node(sheet, name="sheet")))
    camera = gs.OrthographicCamera((0.0, 9.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=8.0)
    light = gs.DirectionalLight(direction=(2.5, -1.0, 0.0), shadow=gs.Shadow(filter=filter))
    frame = renderer.render(scene, camera, [light], SIZE, outputs=OUTPUTS, samples=1)
    assert (frame.node == 1).any() != turned
    shaded = (frame.visibility[0] < 0.5) & (frame.node == 0)
    # 2 by 2 units of 8 by 10.7
    assert shaded.sum() == pytest.approx(4.0 * (SIZE[1] / 8.0) ** 2, rel=0.12)


def test_closed_model_is_drawn_as_before(renderer: gs.Renderer) -> None:
    for name, positions, triangles in (("ball", *shapes.icosphere(3, 1.0)), ("box", *shapes.box((1.0, 2.0, 3.0)))):
        frames = [
            renderer.render(
                gs.Scene((gs.Mesh(positions, triangles, material=gs.Material(cull_back_faces=culls)),)),
                None, None, SIZE, outputs=OUTPUTS, samples=4,
            )
            for culls in (False, True)
        ]  # fmt: skip
        for output in OUTPUTS:
            np.testing.assert_array_equal(*(getattr(each, output) for each in frames), err_msg=f"{name} {output}")


def test_nothing_but_backs(renderer: gs.Renderer) -> None:
    positions, triangles = shapes.rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    scene = gs.Scene((gs.Mesh(positions, triangles[:, ::-1], material=CULLED),))
    camera = gs.OrthographicCamera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), height=1.0)
    with pytest.warns(gs.GlshadowWarning, match="nothing is in view"):
        frame = renderer.render(scene, camera, None, SIZE, outputs=OUTPUTS)
    assert (frame.node == -1).all()


def test_copies_that_cull_do_not_hide_those_that_do_not(renderer: gs.Renderer) -> None:
    positions, triangles = shapes.rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    behind = gs.OrthographicCamera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), height=1.0)
    shared = gs.Mesh(positions, triangles, material=CULLED)
    other = gs.Mesh(shared.positions, shared.triangles, material=gs.Material())
    frame = renderer.render(gs.Scene((shared, other)), behind, None, SIZE, outputs=("node",))
    assert (frame.node == 1).all()
