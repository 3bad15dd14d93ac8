"""PyVista's objects: with the library, and with stand-ins that show that it need not be there."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import GlshadowWarning, SceneError

SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 2.0, 0.0]])
RGB = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 128, 128], [1, 2, 3]], dtype=np.uint8)


class Data(dict):  # type: ignore[type-arg]
    """A stand-in of DataSetAttributes."""

    def __init__(self, active: str | None = None, normals: Any = None, **arrays: Any) -> None:
        super().__init__(arrays)
        self.active_scalars_name, self.active_normals = active, normals


def polydata(**given: Any) -> Any:
    kind = type("PolyData", (SimpleNamespace,), {"__module__": "pyvista.core.pointset"})
    plain = {
        "points": SQUARE,
        "faces": [4, 0, 1, 2, 3, 3, 3, 2, 4],
        "strips": [],
        "verts": [],
        "lines": [],
        "point_data": Data(),
        "cell_data": Data(),
        "active_texture_coordinates": None,
    }
    return kind(**{**plain, **given})


def mesh_of(source: Any) -> gs.Mesh:
    (node,) = gs.load(source).nodes
    return node.mesh


def test_faces_of_several_sizes() -> None:
    mesh = mesh_of(polydata())
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [3, 2, 4]]
    np.testing.assert_array_equal(mesh.positions, SQUARE)
    assert mesh.normals is None


def test_colors_of_points() -> None:
    linear = linear_from_srgb(RGB / 255.0)
    for data in (Data("paint", paint=RGB), Data(RGB=RGB), Data("height", height=np.zeros(5), Colors=RGB / 255.0)):
        np.testing.assert_allclose(mesh_of(polydata(point_data=data)).colors[:, :3], linear, atol=1e-6)


def test_colors_of_cells_follow_vtks_order() -> None:
    """VTK numbers points, lines, polygons, strips: here one point, one line, two polygons, and a strip of two triangles."""
    cells = np.arange(15, dtype=np.uint8).reshape(5, 3) * 16
    source = polydata(
        verts=[1, 0],
        lines=[2, 0, 1],
        strips=[4, 0, 1, 3, 2],
        cell_data=Data("RGB", RGB=cells),
        point_data=Data("z", z=np.zeros(5)),
    )
    with pytest.warns(GlshadowWarning, match="left out: Points need a radius"):
        mesh, line = (node.mesh for node in gs.load(source).nodes)
    np.testing.assert_allclose(line.material.color[:3], linear_from_srgb(cells[1] / 255.0), atol=1e-12)
    expected = linear_from_srgb(cells[[2, 2, 3, 4, 4]] / 255.0)
    np.testing.assert_allclose(mesh.colors[mesh.triangles[:, 0]][:, :3], expected, atol=1e-6)
    np.testing.assert_array_equal(mesh.positions[mesh.triangles[3:]], SQUARE[[[0, 1, 3], [1, 2, 3]]])


def test_points_and_lines_have_the_colors_of_points_or_cells() -> None:
    """VTK numbers cells of points first, then lines, then polygons."""
    linear = linear_from_srgb(RGB / 255.0)
    given = {"verts": [1, 4, 2, 0, 1], "lines": [3, 0, 1, 2, 2, 3, 4], "faces": []}
    points, lines = (node.mesh for node in gs.load(polydata(point_data=Data(RGB=RGB), **given)).nodes)
    assert isinstance(points, gs.Points)
    assert isinstance(lines, gs.Lines)
    np.testing.assert_array_equal(points.positions, SQUARE[[4, 0, 1]])
    np.testing.assert_allclose(points.colors[:, :3], linear[[4, 0, 1]], atol=1e-6)
    np.testing.assert_array_equal(lines.positions[lines.ends], SQUARE[[[0, 1], [1, 2], [3, 4]]])
    np.testing.assert_allclose(lines.colors[:, :3], linear, atol=1e-6)
    points, lines = (node.mesh for node in gs.load(polydata(cell_data=Data(RGB=RGB[:4]), **given)).nodes)
    np.testing.assert_allclose(points.colors[:, :3], linear[[0, 1, 1]], atol=1e-6)
    np.testing.assert_allclose(lines.colors[:, :3], linear[[2, 2, 2, 3, 3]], atol=1e-6)


def test_scalars_that_are_not_colors_are_named() -> None:
    with pytest.warns(GlshadowWarning, match="'Elevation' are not colours"):
        assert mesh_of(polydata(point_data=Data("Elevation", Elevation=np.zeros(5)))).colors is None


def test_normals_and_texture_coordinates_are_kept() -> None:
    normals, uv = np.tile([0.0, 0.0, 1.0], (5, 1)), SQUARE[:, :2] * 0.5
    mesh = mesh_of(polydata(point_data=Data(normals=normals, Normals=normals), active_texture_coordinates=uv))
    np.testing.assert_array_equal(mesh.normals, normals)
    np.testing.assert_array_equal(mesh.uv, uv.astype(np.float32))
    assert mesh.material.texture is None


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"faces": [3, 0, 1, 9]}, "vertex 9, but there are 5"),
        ({"faces": [3, 0, 1, -1]}, "vertex -1"),
        ({"faces": [3, 0, 1, 2, 9, 1]}, "cells are broken"),
        ({"faces": [-2, 0, 1]}, "cells are broken"),
        ({"faces": []}, "no polygons, lines or points"),
        ({"cell_data": Data("RGB", RGB=RGB[:1])}, "1 colours of cells for 2 cells"),
        ({"points": SQUARE + np.inf}, "finite"),
    ],
)
def test_broken_objects_are_named(change: dict[str, Any], named: str) -> None:
    with pytest.raises(SceneError, match=named):
        gs.load(polydata(**change))


def test_nothing_is_imported() -> None:
    code = (
        "import sys, types, numpy as np, glshadow as gs\n"
        "kind = type('PolyData', (types.SimpleNamespace,), {'__module__': 'pyvista'})\n"
        "data = type('D', (dict,), {'active_scalars_name': None})()\n"
        "gs.load(kind(points=np.eye(3), faces=[3, 0, 1, 2], point_data=data, cell_data=data))\n"
        "assert not {'pyvista', 'vtk', 'vtkmodules', 'open3d'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.fixture(scope="module")
def pv() -> Any:
    return pytest.importorskip("pyvista", reason="PyVista's objects: pip install 'glshadow[dev]'")


def test_polydata(pv: Any) -> None:
    cube = pv.Cube(x_length=2.0)
    mesh = mesh_of(cube)
    assert mesh.triangles.shape == (12, 3)
    np.testing.assert_array_equal(np.ptp(mesh.positions, axis=0), (2.0, 1.0, 1.0))
    np.testing.assert_allclose(mesh.normals, cube.point_data["Normals"])
    np.testing.assert_array_equal(mesh.uv, cube.active_texture_coordinates)
    # volume by the divergence theorem: the windings point outwards
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(2.0)


def test_strips_have_the_area_and_winding_of_the_triangles(pv: Any) -> None:
    sphere = pv.Sphere()
    a, b, c = np.moveaxis(mesh_of(sphere.strip()).positions[mesh_of(sphere.strip()).triangles], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(sphere.volume, rel=1e-5)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_grids_by_their_surface(pv: Any) -> None:
    """3 x 3 x 3 points: 2 x 2 x 2 cells, 24 squares outside, each cell with its colour."""
    grid = pv.ImageData(dimensions=(3, 3, 3))
    grid.cell_data["RGB"] = np.arange(24, dtype=np.uint8).reshape(8, 3) * 10
    for source in (grid, grid.cast_to_unstructured_grid(), grid.cast_to_structured_grid()):
        mesh = mesh_of(source)
        assert len(mesh.triangles) == 48
        corner = (mesh.positions[mesh.triangles] == 0.0).all(axis=2).any(axis=1)
        expected = np.tile(linear_from_srgb(np.array([0, 10, 20]) / 255.0), (corner.sum(), 1))
        np.testing.assert_allclose(mesh.colors[mesh.triangles[corner]][:, 0, :3], expected, atol=1e-6)


def test_multiblock(pv: Any) -> None:
    blocks = pv.MultiBlock({"box": pv.Cube(), "inner": pv.MultiBlock({"ball": pv.Sphere()}), "empty": None})
    assert [node.name for node in gs.load(blocks).nodes] == ["box", "inner/ball"]


def test_scalars_of_a_filter_are_named(pv: Any) -> None:
    with pytest.warns(GlshadowWarning, match="'Elevation' are not colours"):
        gs.load(pv.Plane().elevation())


def test_points_and_lines(pv: Any) -> None:
    for cloud in (pv.PolyData(SQUARE), pv.PointSet(SQUARE)):
        points = mesh_of(cloud)
        assert isinstance(points, gs.Points)
        np.testing.assert_array_equal(points.positions, SQUARE)
    spline = mesh_of(pv.MultipleLines(SQUARE))
    assert isinstance(spline, gs.Lines)
    assert spline.count == 4
    both = gs.load(pv.Cube().merge(pv.MultipleLines(SQUARE)))
    assert [(node.name, type(node.mesh)) for node in both.nodes] == [("mesh", gs.Mesh), ("lines", gs.Lines)]
    assert [node.name for node in gs.load(pv.MultiBlock({"axis": pv.PolyData(SQUARE), "ball": pv.Sphere()})).nodes] == [
        "axis",
        "ball",
    ]


def test_tables_have_no_surface(pv: Any) -> None:
    with pytest.raises(SceneError, match="no surface"):
        gs.load(pv.Table())
