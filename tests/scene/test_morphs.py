"""Morph targets at rest: the file's own weights, applied to positions, normals, texture coordinates and colours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshadow.core.spaces import Array
from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load
from glshadow.scene.mesh import Mesh

from .glb import Glb

BASE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
UP, OUT = np.array([[0.0, 0, 2]] * 3), np.array([[0.0, 0, 0], [4, 0, 0], [0, 0, 0]])


def face(targets: list[dict[str, Any]], weights: Any = None, node: dict[str, Any] | None = None) -> Glb:
    """BASE with morph targets; arrays become accessors."""
    file = Glb(nodes=[{"mesh": 0, **(node or {})}])
    attributes = {
        "POSITION": file.add(BASE),
        "NORMAL": file.add(np.tile((0.0, 0, 1), (3, 1))),
        "COLOR_0": file.add(np.array([[1.0, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]])),
    }
    moved = [
        {name: file.add(values) if isinstance(values, np.ndarray) else values for name, values in target.items()}
        for target in targets
    ]
    file.mesh({"attributes": attributes, "targets": moved}, **({} if weights is None else {"weights": weights}))
    return file


def mesh_of(file: Glb, path: Path) -> Mesh:
    return load(file.save(path / "face.glb")).nodes[0].mesh


@pytest.mark.parametrize(
    ("mesh", "node", "wanted"),
    [
        (None, {}, BASE),
        ([0, 0], {}, BASE),
        ([1, 0], {}, BASE + UP),
        ([1, 0.5], {}, BASE + UP + 0.5 * OUT),
        ([1, 0], {"weights": [0, 0.25]}, BASE + 0.25 * OUT),  # the node's before the mesh's
        ([1, 0], {"weights": [0, 0]}, BASE),
        (None, {"weights": [-2, 0]}, BASE - 2 * UP),
    ],
)
def test_positions(tmp_path: Path, mesh: Any, node: dict[str, Any], wanted: Array) -> None:
    made = mesh_of(face([{"POSITION": UP}, {"POSITION": OUT}], mesh, node), tmp_path)
    np.testing.assert_allclose(made.positions, wanted, rtol=1e-15)


def test_normals_colours_and_coordinates(tmp_path: Path) -> None:
    change = {"NORMAL": np.tile((1.0, 0, 0), (3, 1)), "COLOR_0": np.tile((0.0, 0.5, 0), (3, 1))}
    made = mesh_of(face([change], [1]), tmp_path)
    assert made.normals is not None
    assert made.colors is not None
    np.testing.assert_allclose(made.normals, np.tile((np.sqrt(0.5), 0, np.sqrt(0.5)), (3, 1)), rtol=1e-6)  # float32
    np.testing.assert_allclose(made.colors, [[1, 0.5, 0, 1], [0, 1, 0, 1], [0, 0.5, 1, 1]])  # clamped without a warning
    file = face([{"TEXCOORD_0": np.tile((0.5, 0.25), (3, 1))}], [2])
    primitive = file.json["meshes"][0]["primitives"][0]
    primitive["attributes"]["TEXCOORD_0"] = file.add(np.zeros((3, 2)))
    primitive["material"] = 0
    file.json |= {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
    }
    file.json["images"] = [{"bufferView": file.view(np.frombuffer(_png(), np.uint8)), "mimeType": "image/png"}]
    made = mesh_of(file, tmp_path)
    assert made.uv is not None
    np.testing.assert_allclose(made.uv, np.tile((1.0, 0.5), (3, 1)))  # v up


def _png() -> bytes:
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (255, 0, 0)).save(stream, "PNG")
    return stream.getvalue()


def test_sparse_targets(tmp_path: Path) -> None:
    """As Blender writes them: no values of their own, but a few replaced ones."""
    file = face([{"POSITION": UP}], [0.5])
    rows, values = file.view(np.array([[1]], dtype="<u2")), file.view(np.array([[0, 0, 8]], dtype="<f4"))
    sparse = {"count": 1, "indices": {"bufferView": rows, "componentType": 5123}, "values": {"bufferView": values}}
    file.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": file.declare(3, sparse=sparse)}]
    np.testing.assert_array_equal(mesh_of(file, tmp_path).positions, np.add(BASE, [[0, 0, 0], [0, 0, 4], [0, 0, 0]]))


def test_quantised_targets(tmp_path: Path) -> None:
    file = face([{"POSITION": UP}], [2])
    change = file.add([[0, 0, 127, 0], [0, 0, 0, 0], [-127, 0, 0, 0]], "int8", normalized=True, type="VEC3")
    file.json["bufferViews"][file.json["accessors"][change]["bufferView"]]["byteStride"] = 4
    file.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": change}]
    np.testing.assert_array_equal(mesh_of(file, tmp_path).positions, np.add(BASE, [[0, 0, 2], [0, 0, 0], [-2, 0, 0]]))


def test_two_nodes_with_weights_of_their_own(tmp_path: Path) -> None:
    file = face([{"POSITION": UP}], [1])
    file.json["nodes"] += [{"mesh": 0, "weights": [0.5]}, {"mesh": 0}]
    one, half, again = (node.mesh for node in load(file.save(tmp_path / "face.glb")).nodes)
    assert one is again
    np.testing.assert_array_equal(half.positions, BASE + 0.5 * UP)


def test_morph_comes_before_the_skin(tmp_path: Path) -> None:
    file = face([{"POSITION": UP}], [1], {"skin": 0})
    attributes = file.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = file.add(np.zeros((3, 4)), "uint8")
    attributes["WEIGHTS_0"] = file.add(np.tile((1.0, 0, 0, 0), (3, 1)))
    file.json["nodes"].append({"scale": [1, 1, 10]})
    file.json["skins"] = [{"joints": [1]}]
    np.testing.assert_array_equal(mesh_of(file, tmp_path).positions, (BASE + UP) * (1, 1, 10))


@pytest.mark.parametrize(
    ("targets", "weights", "said"),
    [
        ([{"POSITION": UP[:2]}], [1], "targets.POSITION has 2 elements, POSITION has 3"),
        ([{"POSITION": UP[:, :2]}], [1], "must be VEC3"),
        ([{"POSITION": 99}], [1], r"accessors\[99\]"),
        ([{"POSITION": np.where(UP > 0, np.nan, UP)}], [1], "3 of 3 vertices have coordinates that are not finite"),
        ([{"POSITION": UP}], [1e300], None),
        ([{"POSITION": UP}], ["a"], "weights of morph targets must be finite numbers"),
        ([{"POSITION": UP}], [[1]], "weights of morph targets must be finite numbers"),
        ([{"POSITION": UP}], 1, "weights of morph targets must be finite numbers"),
    ],
)
def test_broken_targets_are_refused(tmp_path: Path, targets: Any, weights: Any, said: str | None) -> None:
    with pytest.raises(SceneError, match=said):
        mesh_of(face(targets, weights), tmp_path)


def test_targets_must_be_an_array(tmp_path: Path) -> None:
    file = face([{"POSITION": UP}], [1])
    file.json["meshes"][0]["primitives"][0]["targets"] = {"POSITION": 0}
    with pytest.raises(SceneError, match="targets must be an array of objects"):
        mesh_of(file, tmp_path)


def test_more_weights_than_targets_warn(tmp_path: Path) -> None:
    with pytest.warns(GlshadowWarning, match="has 1 morph targets and 2 weights"):
        made = mesh_of(face([{"POSITION": UP}], [1, 1]), tmp_path)
    np.testing.assert_array_equal(made.positions, BASE + UP)
