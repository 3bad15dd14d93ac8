"""Materials of glTF files: samplers, texture coordinates, factors and maps, what is unlit or emits; and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow import image
from glshadow.io.imported import WHITE

from .glb import Glb

UV = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
SECOND = [[0.5, 0.5], [0.75, 0.5], [0.75, 0.75], [0.5, 0.75]]


def square(folder: Path, material: dict[str, Any], **attributes: Any) -> Glb:
    """A square with two sets of texture coordinates and one texture, of this material."""
    glb, picture = Glb(), folder / "texels.png"
    image.write(picture, np.full((2, 2, 4), 255, dtype=np.uint8))
    glb.json["images"] = [
        {"bufferView": glb.view(np.frombuffer(picture.read_bytes(), np.uint8)), "mimeType": "image/png"}
    ]
    glb.json["textures"] = [{"source": 0}]
    glb.json["materials"] = [material]
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    data = {"POSITION": corners, "TEXCOORD_0": UV, "TEXCOORD_1": SECOND} | attributes
    primitive = {"attributes": {name: glb.add(each) for name, each in data.items()}, "material": 0}
    primitive["indices"] = glb.add([0, 1, 2, 0, 2, 3], "uint32")
    glb.json["nodes"] = [{"mesh": glb.mesh(primitive)}]
    return glb


def loaded(folder: Path, material: dict[str, Any], **attributes: Any) -> gs.Mesh:
    return gs.load(square(folder, material, **attributes).save(folder / "square.glb"), look="plain").nodes[0].mesh


def textured(**info: Any) -> dict[str, Any]:
    return {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **info}, "metallicFactor": 0}}


def moved(u: float, v: float, scale: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"extensions": {"KHR_texture_transform": {"offset": [u, v], "scale": [scale, scale], **more}}}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, (("repeat", "repeat"), "linear", "linear mipmap linear")),
        ({"wrapS": 33071, "wrapT": 33648}, (("clamp", "mirror"), "linear", "linear mipmap linear")),
        ({"magFilter": 9728, "minFilter": 9728}, (("repeat", "repeat"), "nearest", "nearest")),
        ({"magFilter": 9729, "minFilter": 9986}, (("repeat", "repeat"), "linear", "nearest mipmap linear")),
        ({"magFilter": 9987, "minFilter": [1], "wrapS": "x"}, (("repeat", "repeat"), "linear", "linear mipmap linear")),
    ],
)
def test_samplers(tmp_path: Path, given: dict[str, Any], expected: tuple[Any, ...]) -> None:
    glb = square(tmp_path, textured())
    glb.json["samplers"], glb.json["textures"] = [given], [{"source": 0, "sampler": 0}]
    sampler = gs.load(glb.save(tmp_path / "square.glb")).nodes[0].mesh.material.sampler
    assert (sampler.wrap, sampler.magnify, sampler.minify) == expected


def test_one_placement_is_applied_to_the_mesh(tmp_path: Path) -> None:
    material = {**textured(**moved(0.5, 0.25, 2.0)), "normalTexture": {"index": 0, **moved(0.5, 0.25, 2.0)}}
    mesh = loaded(tmp_path, material)
    assert mesh.uv is not None
    assert mesh.second_uv is None
    np.testing.assert_allclose(mesh.uv, np.array([0.5, 1.0 - 0.25]) + 2.0 * np.array([1, -1]) * UV)
    assert mesh.material.sampler.transform is None
    assert mesh.material.normal_map is not None
    assert mesh.material.normal_map.sampler.transform is None


def test_each_map_has_its_set_and_transform(tmp_path: Path) -> None:
    material = {
        **textured(texCoord=1, **moved(0.5, 0.25, 2.0)),
        "emissiveTexture": {"index": 0, **moved(0.1, 0.2, rotation=np.pi / 2)},
        "emissiveFactor": [1, 1, 1],
    }
    mesh = loaded(tmp_path, material)
    # set 1 comes first, since the base colour needs it
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv, [[u, 1.0 - v] for u, v in SECOND])
    placed = mesh.placed_uv
    assert placed is not None
    np.testing.assert_allclose(placed, [[0.5 + 2 * u, 1.0 - (0.25 + 2 * v)] for u, v in SECOND], atol=1e-6)
    assert mesh.material.emission_map is not None
    sampler = mesh.material.emission_map.sampler
    assert sampler.uv_set == 1
    found = sampler.place(mesh.uv, mesh.second_uv)
    assert found is not None
    # rotation by 90 degrees, v down: (u, v) -> (v, -u), then the offset
    np.testing.assert_allclose(found, [[0.1 + v, 1.0 - (0.2 - u)] for u, v in UV], atol=1e-6)


def test_third_set_is_left_out_with_a_note(tmp_path: Path) -> None:
    material = {
        **textured(),
        "normalTexture": {"index": 0, "texCoord": 1},
        "occlusionTexture": {"index": 0, "texCoord": 2},
    }
    with pytest.warns(gs.GlshadowWarning, match="its occlusion map has a third set"):
        mesh = loaded(tmp_path, material)
    assert mesh.material.occlusion_map is None
    assert mesh.material.normal_map is not None


def test_map_without_coordinates_is_left_out_with_a_note(tmp_path: Path) -> None:
    with pytest.warns(gs.GlshadowWarning, match="normal map but no usable TEXCOORD_5"):
        mesh = loaded(tmp_path, {"normalTexture": {"index": 0, "texCoord": 5}})
    assert mesh.material.normal_map is None
    assert mesh.uv is None


def test_factors(tmp_path: Path) -> None:
    block = {"metallicFactor": 0.25, "roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": 0}}
    material = {
        "pbrMetallicRoughness": block,
        "normalTexture": {"index": 0, "scale": -2.0},
        "occlusionTexture": {"index": 0, "strength": 0.75},
        "emissiveFactor": [0.5, 0.25, 0.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}},
        "doubleSided": True,
    }
    found = loaded(tmp_path, material).material
    assert (found.metallic, found.roughness, found.normal_scale, found.occlusion_strength) == (0.25, 0.5, -2.0, 0.75)
    assert found.emission == (2.0, 1.0, 0.0)
    assert found.metallic_roughness_map is not None
    assert (found.double_sided, found.cull_back_faces) == (True, False)
    assert not found.matte


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        ({}, (0.0, None)),  # nothing said of reflection
        ({"pbrMetallicRoughness": {}}, (1.0, 1.0)),  # the specification's defaults
        ({"pbrMetallicRoughness": {"metallicFactor": 0}}, (0.0, 1.0)),
        ({"pbrMetallicRoughness": {"metallicFactor": 7, "roughnessFactor": -1}}, (1.0, 0.0)),
        ({"pbrMetallicRoughness": {"roughnessFactor": 0.3}, "extensions": {"KHR_materials_unlit": {}}}, (0.0, None)),
    ],
)
def test_defaults(tmp_path: Path, material: dict[str, Any], expected: tuple[float, float | None]) -> None:
    found = loaded(tmp_path, material).material
    assert (found.metallic, found.roughness) == expected
    assert found.matte == (expected[1] is None)
    assert found.rough == (expected == (0.0, 1.0))
    assert found.unlit == ("extensions" in material)
    assert found.cull_back_faces, "what is not doubleSided"


def test_tangents_are_read_for_a_normal_map_alone(tmp_path: Path) -> None:
    tangents, normals = [[1.0, 0.0, 0.0, -1.0]] * 4, [[0.0, 0.0, 1.0]] * 4
    with_map = loaded(tmp_path, {"normalTexture": {"index": 0}}, NORMAL=normals, TANGENT=tangents)
    assert with_map.tangents is not None
    assert with_map.tangents.tolist() == tangents
    assert loaded(tmp_path, textured(), NORMAL=normals, TANGENT=tangents).tangents is None
    lost = [[np.nan, 0.0, 0.0, 1.0], *tangents[1:]]
    assert loaded(tmp_path, {"normalTexture": {"index": 0}}, NORMAL=normals, TANGENT=lost).tangents is None


@pytest.mark.parametrize(
    "material",
    [
        {"pbrMetallicRoughness": {"metallicFactor": "x"}},
        {"emissiveFactor": [1, 2]},
        {"emissiveFactor": [1, 2, float("inf")]},
        {"normalTexture": []},
        {"normalTexture": {"index": 0, "scale": None}},
        {"extensions": {"KHR_materials_emissive_strength": 3}},
        textured(texCoord="x"),
        textured(extensions={"KHR_texture_transform": {"offset": [1]}}),
        {"alphaCutoff": {}},
    ],
)
def test_broken_material_is_the_default_one(tmp_path: Path, material: dict[str, Any]) -> None:
    with pytest.warns(gs.GlshadowWarning, match=r"materials\[0\].*: drawn with the default material") as caught:
        mesh = loaded(tmp_path, material)
    assert len(caught) == 1
    assert len(mesh.triangles) == 2
    assert mesh.material is WHITE


@pytest.mark.parametrize("index", [7, -1, None, "x", [0]])
def test_texture_that_is_not_there_is_left_out(tmp_path: Path, index: Any) -> None:
    given = {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1], "baseColorTexture": {"index": index}}}
    with pytest.warns(gs.GlshadowWarning, match=r"materials\[0\] refers to textures\[.*; drawn without this texture"):
        material = loaded(tmp_path, given).material
    assert (material.color, material.texture) == ((1.0, 0.0, 0.0, 1.0), None)


def test_material_that_is_not_there_is_the_default_one(tmp_path: Path) -> None:
    glb = square(tmp_path, {})
    glb.json["meshes"][0]["primitives"][0]["material"] = 3
    with pytest.warns(gs.GlshadowWarning, match=r"refers to materials\[3\].*: drawn with the default material"):
        assert gs.load(glb.save(tmp_path / "a.glb"), look="plain").nodes[0].mesh.material is WHITE


@pytest.mark.parametrize(
    "settings",
    [
        {"metallic": 1.5},
        {"roughness": -0.1},
        {"normal_map": 3},
        {"emission": (1.0, -1.0, 0.0)},
        {"sampler": "clamp"},
        {"occlusion_map": np.zeros((2, 2), np.uint8)},
    ],
)
def test_material_refuses(settings: dict[str, Any]) -> None:
    with pytest.raises(gs.SceneError, match=f"Material {next(iter(settings))}"):
        gs.Material(**settings)


def test_pixels_alone_become_a_texture() -> None:
    pixels = np.zeros((2, 2, 4), np.uint8)
    material = gs.Material(texture=pixels, normal_map=pixels, emission_map=gs.Texture(pixels, gs.Sampler("clamp")))
    assert material.texture is pixels
    assert material.normal_map is not None
    assert material.normal_map.pixels is pixels
    assert material.emission_map is not None
    assert material.emission_map.sampler.wrap == ("clamp", "clamp")
    with pytest.raises(gs.SceneError, match="Sampler wrap must be one of"):
        gs.Sampler(wrap="round")
    with pytest.raises(gs.SceneError, match="Sampler transform"):
        gs.Sampler(transform=np.ones((3, 3)))
