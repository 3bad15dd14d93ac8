"""Open3D's meshes of both interfaces: with stand-ins, and with the library where it is installed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import GlshadowWarning, SceneError

POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
COLORS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.5]])
NORMALS = np.tile([0.0, 0.0, 1.0], (4, 1))
TOP_RED = np.zeros((2, 1, 3), dtype=np.uint8)  # row 0, the top, is red, the bottom blue
TOP_RED[0, 0, 0] = TOP_RED[1, 0, 2] = 255


def legacy(**given: Any) -> Any:
    kind = type("TriangleMesh", (SimpleNamespace,), {"__module__": "open3d.cpu.pybind.geometry"})
    plain = {
        "vertices": POINTS,
        "triangles": TRIANGLES,
        "vertex_normals": [],
        "vertex_colors": [],
        "triangle_uvs": [],
        "triangle_material_ids": [],
        "textures": [],
    }
    return kind(**{**plain, **given})


class Tensor:
    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values)

    def cpu(self) -> Tensor:
        return self

    def numpy(self) -> Any:
        return self.values


def tensor(vertex: dict[str, Any] | None = None, triangle: dict[str, Any] | None = None, **material: Any) -> Any:
    kind = type("TriangleMesh", (SimpleNamespace,), {"__module__": "open3d.cpu.pybind.t.geometry"})
    plain = {"texture_maps": {}, "vector_properties": {}, **material}
    return kind(
        vertex={"positions": Tensor(POINTS.astype(np.float32)), **{k: Tensor(v) for k, v in (vertex or {}).items()}},
        triangle={"indices": Tensor(TRIANGLES.astype(np.int64)), **{k: Tensor(v) for k, v in (triangle or {}).items()}},
        material=SimpleNamespace(**plain),
    )


@pytest.mark.parametrize(
    "source",
    [
        legacy(vertex_colors=COLORS, vertex_normals=NORMALS),
        tensor({"colors": COLORS.astype(np.float32), "normals": NORMALS}),
        tensor({"colors": np.rint(COLORS * 255).astype(np.uint8), "normals": NORMALS}),
    ],
)
def test_arrays(source: Any) -> None:
    (node,) = gs.load(source).nodes
    np.testing.assert_array_equal(node.mesh.positions, POINTS)
    np.testing.assert_array_equal(node.mesh.triangles, TRIANGLES)
    np.testing.assert_array_equal(node.mesh.normals, NORMALS)
    np.testing.assert_allclose(node.mesh.colors[:, :3], linear_from_srgb(COLORS), atol=0.003)  # a byte's half step


def test_colors_of_triangles() -> None:
    (node,) = gs.load(tensor(triangle={"colors": COLORS[:2]})).nodes
    np.testing.assert_allclose(node.mesh.colors[node.mesh.triangles[:, 0]][:, :3], COLORS[:2], atol=1e-6)


def at_vertices(scene: gs.Scene) -> dict[tuple[float, ...], list[int]]:
    """The texture's colour at each corner, by its position: the nearest texel, v up."""
    found = {}
    for node in scene.nodes:
        mesh = node.mesh
        height, width = mesh.material.texture.shape[:2]
        for position, (u, v) in zip(mesh.positions.tolist(), mesh.uv.tolist(), strict=True):
            row, column = min(int((1.0 - v) * height), height - 1), min(int(u * width), width - 1)
            found[tuple(position)] = mesh.material.texture[row, column].tolist()
    return found


UV = POINTS[TRIANGLES][..., :2] * 0.8 + 0.1  # by corner; v up


def test_textures_are_the_right_way_up() -> None:
    """The legacy interface keeps images with row 0 at v = 0, the tensor interface with row 0 at the top."""
    expected = {(x, y, 0.0): [255, 0, 0, 255] if y else [0, 0, 255, 255] for x in (0.0, 1.0) for y in (0.0, 1.0)}
    image = SimpleNamespace(as_tensor=lambda: Tensor(TOP_RED))
    old = legacy(triangle_uvs=UV.reshape(-1, 2), textures=[TOP_RED[::-1]], triangle_material_ids=[0, 0])
    new = tensor(triangle={"texture_uvs": UV}, texture_maps={"albedo": image})
    for source in (old, new):
        assert at_vertices(gs.load(source)) == expected


def test_textures_by_triangle() -> None:
    red, green = np.full((2, 2, 3), (255, 0, 0), dtype=np.uint8), np.full((2, 2), 77, dtype=np.uint8)
    source = legacy(triangle_uvs=UV.reshape(-1, 2), textures=[np.array(0), red, green], triangle_material_ids=[2, 1])
    scene = gs.load(source)
    assert [node.name for node in scene.nodes] == ["mesh1", "mesh2"]
    assert [node.mesh.material.texture[0, 0].tolist() for node in scene.nodes] == [[255, 0, 0, 255], [77, 77, 77, 255]]
    np.testing.assert_array_equal(scene.nodes[0].mesh.positions, POINTS[TRIANGLES[1]])


def test_textures_without_coordinates_are_named() -> None:
    with pytest.warns(GlshadowWarning, match="no usable texture coordinates"):
        assert gs.load(legacy(textures=[TOP_RED])).nodes[0].mesh.material.texture is None


def test_base_color() -> None:
    scene = gs.load(tensor(vector_properties={"base_color": np.array([0.5, 0.25, 1.0, 1.0])}))
    assert scene.nodes[0].mesh.material.color == (0.5, 0.25, 1.0, 1.0)


@pytest.mark.parametrize(
    ("source", "named"),
    [
        (legacy(triangles=[]), "no triangles"),
        (legacy(vertices=[]), "no triangles"),
        (legacy(triangles=[[0, 1, 7]]), "vertex 7, but there are 4"),
        (legacy(triangles=[[0, 1, -1]]), "vertex -1"),
        (type("PointCloud", (), {"__module__": "open3d.pybind.geometry"})(), "PointCloud has no triangles"),
    ],
)
def test_what_is_not_a_mesh_is_named(source: Any, named: str) -> None:
    with pytest.raises(SceneError, match=named):
        gs.load(source)


@pytest.fixture(scope="module")
def o3d() -> Any:
    return pytest.importorskip("open3d", reason="optional: pip install open3d", exc_type=ImportError)


@pytest.mark.exhaustive
def test_library(o3d: Any, tmp_path: Any) -> None:
    box = o3d.geometry.TriangleMesh.create_box(2.0, 1.0, 1.0)
    box.compute_vertex_normals()
    box.paint_uniform_color((0.5, 0.25, 1.0))
    for source in (box, o3d.t.geometry.TriangleMesh.from_legacy(box)):
        (node,) = gs.load(source).nodes
        assert node.mesh.triangles.shape == (12, 3)
        np.testing.assert_array_equal(np.ptp(node.mesh.positions, axis=0), (2.0, 1.0, 1.0))
        np.testing.assert_allclose(node.mesh.normals, np.asarray(box.vertex_normals), atol=1e-6)
        np.testing.assert_allclose(node.mesh.material.color[:3], linear_from_srgb([0.5, 0.25, 1.0]), atol=1e-6)
    (cloud,) = gs.load(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))).nodes
    assert isinstance(cloud.mesh, gs.Points)


@pytest.mark.exhaustive
def test_library_reads_the_same_texture_as_we(o3d: Any, tmp_path: Any) -> None:
    gs.image.write(tmp_path / "a.png", np.repeat(np.repeat(TOP_RED, 8, axis=0), 16, axis=1))
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd a.png\n")
    rows = ["v {} {} {}".format(*row) for row in POINTS] + ["vt {} {}".format(*(row[:2] * 0.8 + 0.1)) for row in POINTS]
    faces = ["f " + " ".join(f"{k + 1}/{k + 1}" for k in row) for row in TRIANGLES]
    path = tmp_path / "a.obj"
    path.write_text("\n".join(["mtllib a.mtl", *rows, "usemtl m", *faces, ""]))
    ours = at_vertices(gs.load(path))
    assert at_vertices(gs.load(o3d.io.read_triangle_mesh(str(path)))) == ours
    assert at_vertices(gs.load(o3d.t.io.read_triangle_mesh(str(path)))) == ours
