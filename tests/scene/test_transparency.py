"""Transparency of files: what alpha 0 hides, what blends, and KHR_materials_transmission."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs

from .glb import Glb

DOWN = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
PLAN = gs.OrthographicCamera((0.0, 10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=8.0)
SIZE = (64, 64)
SQUARE = [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]]


@pytest.fixture
def cases(models: Path) -> Path:
    """Folder of the cases."""
    return models.parent / "cases" / "meant"


def loaded(tmp_path: Path, material: dict[str, Any], uv: bool = False, **top: Any) -> gs.Scene:
    """A white floor, and a pane above it with a material."""
    glb = Glb(materials=[material], **top)
    floor = glb.add([[4 * x, 0, 4 * z] for x, _, z in SQUARE])
    attributes = {"POSITION": glb.add(SQUARE)} | (
        {"TEXCOORD_0": glb.add([[0, 1], [1, 1], [1, 0], [0, 0]])} if uv else {}
    )
    faces = glb.add([0, 1, 2, 0, 2, 3], "uint16")
    meshes = [glb.mesh({"attributes": {"POSITION": floor}, "indices": faces}),
              glb.mesh({"attributes": attributes, "indices": faces, "material": 0})]  # fmt: skip
    glb.json["nodes"] = [{"mesh": mesh, "name": name} for mesh, name in zip(meshes, ("floor", "pane"), strict=True)]
    return quietly(glb.save(tmp_path / "pane.glb"))


def quietly(path: Path) -> gs.Scene:
    """The scene of a file, whatever notes there are on its materials."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return gs.load(path)


def test_box_of_alpha_0_does_not_hide_the_model(renderer: gs.Renderer, cases: Path) -> None:
    scene = gs.load(cases / "helper_box.glb")
    model = gs.Scene(scene.nodes[:1], lights=scene.lights)
    frames = [renderer.render(each, size=SIZE, outputs=("image", "node", "visibility")) for each in (scene, model)]
    assert (frames[0].node == 0).sum() > 200
    for name in ("image", "node", "visibility"):
        np.testing.assert_array_equal(getattr(frames[0], name), getattr(frames[1], name))


def test_transparent_half_of_a_leaf_is_not_there(renderer: gs.Renderer, cases: Path) -> None:
    scene = gs.load(cases / "leafcard_blend.glb")
    camera = gs.OrthographicCamera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), height=2.0)
    light = gs.DirectionalLight(direction=(0.0, 0.6, -1.0), intensity=0.5)
    outputs = ("linear", "transmittance", "node")
    frame = renderer.render(scene, camera, [light], SIZE, outputs=outputs, samples=1)
    bare = renderer.render(gs.Scene(scene.nodes[:1]), camera, [light], SIZE, outputs=outputs, samples=1)
    assert (frame.node == 0).all()
    left, right = np.s_[2:62, 21:28], np.s_[18:46, 37:43]  # away from the texture's filtered border
    np.testing.assert_array_equal(frame.linear[left], bare.linear[left])
    np.testing.assert_array_equal(frame.transmittance[0][left], 1.0)
    green = frame.linear[right]
    assert (green[..., 1] > 4.0 * green[..., 0]).all()
    # its shadow, a third of a unit above it
    np.testing.assert_array_equal(frame.transmittance[0, 10:16, 37:43], 0.0)


def test_light_passes_through_a_pane_of_glass(renderer: gs.Renderer, cases: Path) -> None:
    scene = quietly(cases / "pane_transmission.glb")
    tilted = gs.DirectionalLight(direction=(0.5, -1.0, 0.2))  # the pane is a mirror: not into the camera
    outputs = ("linear", "visibility", "transmittance", "node")
    frame = renderer.render(scene, PLAN, [tilted], SIZE, ambient=0.0, outputs=outputs, samples=1)
    assert (frame.node == 0).all()
    np.testing.assert_array_equal(frame.visibility, 1.0)
    np.testing.assert_array_equal(frame.transmittance, 1.0)
    bare = renderer.render(gs.Scene(scene.nodes[:1]), PLAN, [tilted], SIZE, ambient=0.0, outputs=outputs, samples=1)
    np.testing.assert_allclose(frame.linear, bare.linear, atol=1e-4)


@pytest.mark.parametrize("factor", [0.0, 0.4, 1.0])
def test_transmission_is_tinted_by_the_base_colour(renderer: gs.Renderer, tmp_path: Path, factor: float) -> None:
    color = np.array([0.8, 0.5, 0.1])
    scene = loaded(tmp_path, {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": 0, "roughnessFactor": 0},
                              "extensions": {"KHR_materials_transmission": {"transmissionFactor": factor}}})  # fmt: skip
    frame = renderer.render(scene, PLAN, [DOWN], SIZE, outputs=("transmittance", "visibility", "node"), samples=1)
    if factor == 0.0:
        assert frame.node[32, 32] == 1
        return
    np.testing.assert_allclose(frame.transmittance[0, 32, 32], factor * color, rtol=1e-5)
    assert frame.visibility[0, 32, 32] == 1.0


def png(pixels: Any, path: Path) -> bytes:
    gs.image.write(path, np.asarray(pixels, dtype=np.uint8))
    return path.read_bytes()


def test_transmission_texture_is_linear_red(renderer: gs.Renderer, tmp_path: Path) -> None:
    import base64

    image = np.zeros((4, 4, 3), dtype=np.uint8)
    image[..., 0] = 128
    uri = "data:image/png;base64," + base64.b64encode(png(image, tmp_path / "t.png")).decode()
    extension = {"transmissionFactor": 1.0, "transmissionTexture": {"index": 0}}
    scene = loaded(tmp_path, {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
                              "extensions": {"KHR_materials_transmission": extension}},
                   uv=True, images=[{"uri": uri}], textures=[{"source": 0}])  # fmt: skip
    frame = renderer.render(scene, PLAN, [DOWN], SIZE, outputs=("transmittance",), samples=1)
    np.testing.assert_allclose(frame.transmittance[0, 32, 32], 128 / 255, rtol=1e-4)


@pytest.mark.parametrize("given", [2.5, -1.0, "much", None, [1]])
def test_odd_transmission_factors(tmp_path: Path, given: object) -> None:
    """Clipped; what is no number breaks the material."""
    scene = loaded(tmp_path, {"extensions": {"KHR_materials_transmission": {"transmissionFactor": given}}})
    factors = [node.mesh.material.transmission for node in scene.nodes]
    assert factors == [0.0, min(max(given, 0.0), 1.0) if isinstance(given, float) else 0.0]


def test_transmission_is_announced(tmp_path: Path) -> None:
    loaded(tmp_path, {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}})
    with pytest.warns(gs.GlshadowWarning, match="KHR_materials_transmission is approximated"):
        gs.load(tmp_path / "pane.glb")


def test_blending_panes_need_no_warning(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = loaded(
            tmp_path,
            {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.5], "metallicFactor": 0}},
        )
    assert [node.blends for node in scene.nodes] == [False, True]


def test_file_of_alpha_0_alone_is_refused(tmp_path: Path) -> None:
    mesh = gs.Mesh(np.array(SQUARE, dtype=float), np.array([[0, 1, 2]], dtype=np.int32),
                   material=gs.Material(color=(1.0, 1.0, 1.0, 0.0), alpha_mode=gs.AlphaMode.BLEND))  # fmt: skip
    with pytest.raises(gs.SceneError, match="alpha of all of it is 0"):
        gs.Scene((gs.Node(mesh),))


def test_bounds_and_ground_ignore_what_alpha_0_hides() -> None:
    shown = gs.Mesh(np.array(SQUARE, dtype=float), np.array([[0, 1, 2]], dtype=np.int32))
    hidden = gs.Mesh(np.array(SQUARE, dtype=float) * 50.0 - 90.0, np.array([[0, 1, 2]], dtype=np.int32),
                     material=gs.Material(color=(1.0, 1.0, 1.0, 0.0), alpha_mode=gs.AlphaMode.BLEND))  # fmt: skip
    both, alone = gs.Scene((gs.Node(hidden), gs.Node(shown))), gs.Scene((gs.Node(shown),))
    np.testing.assert_array_equal(both.bounds, alone.bounds)
    np.testing.assert_array_equal(both.extent, alone.extent)
    assert both.camera == alone.camera
    np.testing.assert_array_equal(both.with_ground().extent, alone.with_ground().extent)
