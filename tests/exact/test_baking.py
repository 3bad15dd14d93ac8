"""Baked faces, vertices and texels: closed forms, seams, and the objects and files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.baking.texels import covered, padded
from glshadow.derive import coherence
from glshadow.scenes import shapes

SUN = gs.DirectionalLight(direction=(1.0, -1.0, 0.0))
WALL = gs.Mesh([(0, 0, -5), (0, 0, 5), (0, 2, 5), (0, 2, -5)], [(0, 1, 2), (0, 2, 3)])


def floor(cells: int = 20, side: float = 10.0) -> gs.Mesh:
    """Squares on y = 0 with texture coordinates from 0 to 1, u along x and v along -z."""
    line = np.linspace(0.0, 1.0, cells + 1)
    u, v = (each.ravel() for each in np.meshgrid(line, line))
    positions = np.stack([side * (u - 0.5), 0.0 * u, side * (0.5 - v)], axis=1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 2, corner + cells + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return gs.Mesh(positions, triangles, uv=np.stack([u, v], axis=1))


def walled(cells: int = 20) -> gs.Scene:
    return gs.Scene([gs.Node(floor(cells), name="floor"), gs.Node(WALL, name="wall")])


def lit(x: Any) -> Any:
    """On the floor behind the wall, two high, in light at 45 degrees."""
    return ~((x > 0.0) & (x < 2.0))


def test_faces_are_shares_of_area() -> None:
    """The shadow ends at x = 2, between faces of 0.75 x 0.75: those between 1.5 and 2.25 are partly lit."""
    scene = gs.Scene([gs.Node(floor(40, 30.0), name="floor"), gs.Node(WALL, name="wall")])
    baked = gs.bake(scene, SUN, samples=64)
    mesh = scene.nodes[0].mesh
    corners = mesh.positions[mesh.triangles]
    x, z = corners[..., 0], corners[..., 2]
    inside = (np.abs(z) <= 5.0).all(axis=1)  # the wall's length
    low, high = x.min(axis=1), x.max(axis=1)
    clear = inside & ((low >= 2.0 - 1e-9) | (high <= 1e-9))
    dark = inside & (low >= -1e-9) & (high <= 2.0 + 1e-9)
    values, error = baked.values[0, : len(x)], baked.error[0, : len(x)]
    assert (values[clear] == 1.0).all()
    assert (values[dark] == 0.0).all()
    assert (error[clear | dark] == 0.0).all()
    # a right triangle of which the part beyond x = 2, a third of its width, is lit: 1/9 of it, or 1 - 4/9
    cut = inside & (low < 1.9) & (high > 2.1)
    expected = np.where((np.abs(x[cut] - high[cut, None]) < 1e-9).sum(axis=1) == 1, 1.0 / 9.0, 1.0 - (2.0 / 3.0) ** 2)
    assert len(expected) > 10
    assert np.abs(values[cut] - expected).max() < 4.0 * 0.71 * 64**-0.75
    assert abs((values[cut] - expected).mean()) < 0.02
    assert (values[cut] > 0.0).all()
    assert (error[cut] > 0.0).all()
    assert baked.of("wall").tolist() == [1.0, 1.0]


def test_back_side() -> None:
    scene = gs.Scene([floor(2)])
    below = gs.DirectionalLight(direction=(0.1, 1.0, 0.0))
    for side, expected in (("front", [[1.0], [0.0]]), ("back", [[0.0], [1.0]])):
        values = gs.bake(scene, [SUN, below], samples=4, side=side).values
        assert np.unique(values, axis=1).tolist() == expected


def test_vertices() -> None:
    """A vertex at the wall's foot has faces on both sides: half of the light; beyond the shadow all of it."""
    scene = walled()
    values = gs.bake(scene, SUN, to="vertices").of("floor")
    x, _, z = scene.nodes[0].mesh.positions.T
    middle = np.abs(z) < 4.9
    foot, far = np.abs(x) < 1e-9, np.abs(x - 2.0) < 1e-9
    assert np.abs(values[middle & foot] - 0.5).max() < 1e-6
    assert np.abs(values[middle & far] - 0.5).max() < 1e-6
    rest = middle & ~foot & ~far
    assert (values[rest] == lit(x[rest])).all()


def test_unused_vertices_are_nan() -> None:
    mesh = gs.Mesh([(0, 0, 0), (0, 0, 1), (1, 0, 0), (9, 9, 9)], [(0, 1, 2)])
    values = gs.bake(gs.Scene([gs.Node(mesh, name="one")]), SUN, to="vertices").of("one")
    assert np.isnan(values).tolist() == [False, False, False, True]


@pytest.mark.parametrize("samples", [1, 4])
def test_texels(samples: int) -> None:
    """40 texels of 0.25: the shadow covers columns 20 to 27 exactly, all of them away from its ends."""
    scene = gs.Scene([gs.Node(floor(3), name="floor"), gs.Node(WALL, name="wall")])
    with pytest.raises(gs.SceneError, match="wall of scene has no texture coordinates"):
        gs.bake(scene, SUN, to="texels")
    wall = gs.Node(WALL, name="wall")
    wall = gs.Node(gs.Mesh(WALL.positions, WALL.triangles, uv=[(0, 0), (1, 0), (1, 1), (0, 1)]), name="wall")
    scene = gs.Scene([gs.Node(floor(3), name="floor"), wall])
    image = gs.bake(scene, SUN, to="texels", size=(40, 40), samples=samples).of("floor")
    assert image.shape == (40, 40)
    expected = np.ones(40)
    expected[20:28] = 0.0
    assert (image == expected).all()


def test_texels_between_charts_take_their_neighbours() -> None:
    """Two triangles, far apart in the image: around both a ring is filled, the rest stays empty."""
    uv = np.array([(0.1, 0.1), (0.3, 0.1), (0.1, 0.3), (0.6, 0.6), (0.8, 0.6), (0.6, 0.8)])
    mesh = gs.Mesh(np.random.default_rng(0).random((6, 3)), [(0, 1, 2), (3, 4, 5)], uv=uv)
    scene = gs.Scene([gs.Node(mesh, name="charts")])
    light = gs.DirectionalLight(shadow=None)
    bare, wide = (gs.bake(scene, light, to="texels", size=(50, 50), padding=k).of("charts") for k in (0, 3))
    known, filled = np.isfinite(bare), np.isfinite(wide)
    assert 80 < known.sum() < 120  # two triangles of 10 x 10 texels
    assert (wide[known] == bare[known]).all()
    rows, columns = np.nonzero(known)
    away = np.abs(np.indices((50, 50))[:, None] - np.stack([rows, columns])[:, :, None, None]).max(axis=0).min(axis=0)
    assert (filled == (away <= 3)).all()


def test_texels_of_overlapping_coordinates_warn() -> None:
    mesh = gs.Mesh([(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1)], [(0, 1, 2), (2, 1, 3)],
                   uv=[(0, 0), (0, 1), (1, 0), (0.1, 0.1)])  # fmt: skip
    with pytest.warns(gs.GlshadowWarning, match="texels of double are inside several triangles"):
        gs.bake(gs.Scene([gs.Node(mesh, name="double")]), SUN, to="texels", size=(32, 32))


def test_each_texel_of_a_grid_is_covered_once() -> None:
    mesh = floor(7)
    texels = covered(np.asarray(mesh.uv, dtype=np.float64), mesh.triangles, (35, 28))
    assert texels.shared == 0
    assert texels.places.tolist() == list(range(35 * 28))
    uv = np.einsum(
        "nk,nkj->nj", texels.weights, np.asarray(mesh.uv, dtype=np.float64)[mesh.triangles[texels.triangles]]
    )
    column, row = texels.places % 35, texels.places // 35
    assert np.abs(uv - np.stack([(column + 0.5) / 35, 1.0 - (row + 0.5) / 28], axis=1)).max() < 1e-6
    beyond = covered(np.asarray(mesh.uv, dtype=np.float64) + np.array([3.0, -2.0]), mesh.triangles, (35, 28))
    assert (beyond.triangles == texels.triangles).mean() > 0.95  # the image repeats; centres on edges may go to either


def test_padding_takes_means() -> None:
    image = np.full((1, 5, 5), np.nan, dtype=np.float32)
    image[0, 2, 1], image[0, 2, 3] = 0.0, 1.0
    once = padded(image, 1)
    assert once[0, 2, 2] == 0.5
    assert once[0, 2, 0] == 0.0
    assert np.isfinite(padded(image, 5)).all()


def test_ambient_occlusion_beside_a_long_wall() -> None:
    """(1 + cos(alpha)) / 2 where the wall rises to an elevation alpha: see test_points."""
    strip = gs.Mesh(*shapes.rectangle((0.5, 0.0, 0.1), (3.5, 0.0, 0.0), (0.0, 0.0, -0.2)))
    wall = gs.Mesh(*shapes.rectangle((0.0, 0.0, -1e3), (0.0, 0.0, 2e3), (0.0, 1.0, 0.0)))
    scene = gs.Scene([gs.Node(strip, name="strip"), gs.Node(wall, name="wall")])
    values = gs.bake(scene, gs.SkyLight(), to="vertices", light_samples=512).of("strip")
    x = strip.positions[:, 0]
    expected = 0.5 * (1.0 + x / np.hypot(x, 1.0))
    assert np.abs(values - expected).max() < 0.03  # 512 directions; corners are tested at 1/64 of the way to the middle


def test_mean_of_lights_and_unknown_names() -> None:
    baked = gs.bake(walled(4), [SUN, gs.DirectionalLight(direction=(0.0, 1.0, 0.1))], samples=4)
    assert np.allclose(baked.of("floor"), 0.5 * baked.of("floor", 0))
    assert (baked.of("floor", 1) == 0.0).all()
    with pytest.raises(gs.SettingsError, match="no node of scene is named 'roof'"):
        baked.of("roof")
    with pytest.raises(gs.SettingsError, match="light must be"):
        baked.of("floor", 2)
    assert repr(baked) == "Baked('scene', to faces, 2 lights, 4 samples)"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"to": "edges"}, "to must be"),
        ({"to": "vertices", "samples": 4}, "samples must be None for vertices"),
        ({"samples": 0}, "samples must be"),
        ({"to": "texels", "samples": 3}, "samples must be"),
        ({"side": "both"}, "side must be"),
        ({"to": "texels", "size": (0, 4)}, "size must be"),
        ({"to": "texels", "uv_set": 2}, "uv_set must be"),
        ({"to": "texels", "padding": -1}, "padding must be"),
    ],
)
def test_bad_arguments(given: dict[str, Any], message: str) -> None:
    with pytest.raises(gs.SettingsError, match=message):
        gs.bake(gs.Scene([floor(2)]), SUN, **given)


def test_points_alone_have_no_faces() -> None:
    scene = gs.Scene([gs.Points([(0, 0, 0), (1, 0, 0)], radius=0.1)])
    assert np.isnan(gs.bake(scene, SUN).values).all()
    with pytest.raises(gs.SettingsError, match="has no faces"):
        gs.bake(scene, SUN, to="vertices")


# -- other programs


@pytest.mark.parametrize("to", ["faces", "vertices"])
def test_gltf_has_the_values_as_colours(tmp_path: Path, to: str) -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = 1e5, 0.0, -2e5
    nodes = [gs.Node(floor(8), matrix, "floor"), gs.Node(WALL, matrix, "wall")]
    baked = gs.bake(gs.Scene(nodes), SUN, to=to)
    baked.to_gltf(tmp_path / "baked.glb")
    read = gs.load(tmp_path / "baked.glb", look="plain")
    assert [node.name for node in read.nodes] == ["floor", "wall"]
    for node, own in zip(read.nodes, nodes, strict=True):
        corners, values = node.mesh.positions[node.mesh.triangles], baked.of(own.name)
        placed = corners @ node.world_from_mesh[:3, :3].T + node.world_from_mesh[:3, 3]
        expected = own.mesh.positions[own.mesh.triangles] + matrix[:3, 3]
        assert np.abs(placed - expected).max() < 1e-5
        if node.mesh.colors is None:  # all are 1
            assert (values == 1.0).all()
            continue
        colors = node.mesh.colors[node.mesh.triangles][..., 0]
        assert np.abs(colors - (values[:, None] if to == "faces" else values[own.mesh.triangles])).max() < 1e-6


def test_gltf_has_texels_as_occlusion(tmp_path: Path) -> None:
    scene = gs.Scene([gs.Node(floor(3), name="floor"), gs.Node(gs.Mesh(WALL.positions, WALL.triangles, uv=[(0, 0), (1, 0), (1, 1), (0, 1)]),
                                                               name="wall")])  # fmt: skip
    baked = gs.bake(scene, SUN, to="texels", size=(40, 40))
    baked.to_gltf(tmp_path / "baked.glb")
    read = gs.load(tmp_path / "baked.glb", look="plain").nodes[0].mesh
    found = np.asarray(read.material.occlusion_map.pixels)[..., 0] / 255.0
    assert (found == baked.of("floor")).all()
    assert np.abs(read.uv - floor(3).uv).max() < 1e-6
    with pytest.raises(gs.SettingsError, match=r"path must be a file that ends in \.glb"):
        baked.to_gltf(tmp_path / "baked.obj")


def test_pyvista(optional: Any) -> None:
    scene = walled(4)
    for to, data in (("faces", "cell_data"), ("vertices", "point_data")):
        baked = gs.bake(scene, SUN, to=to)
        surface = baked.to_pyvista()
        assert surface.n_cells == sum(node.mesh.count for node in scene.nodes)
        values = getattr(surface, data)["visibility"]
        assert np.array_equal(values, np.concatenate([baked.of(node.name) for node in scene.nodes]))
    uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
    image = gs.bake(gs.Scene([gs.Mesh(WALL.positions, WALL.triangles, uv=uv)]), SUN, to="texels", size=(4, 4))
    with pytest.raises(gs.SettingsError, match="texels are images"):
        image.to_pyvista()


def test_xarray() -> None:
    scene = walled(4)
    faces = gs.bake(scene, [SUN, gs.PointLight(position=(0, 3, 0))])
    found = faces.to_xarray()
    assert found.visibility.dims == ("light", "face")
    assert np.array_equal(found.visibility, faces.values)
    assert found.sel(face=found.node == "wall").sizes["face"] == 2
    assert found.kind.values.tolist() == ["DirectionalLight", "PointLight"]
    vertices = gs.bake(scene, SUN, to="vertices").to_xarray()
    assert vertices["floor"].sizes == {"light": 1, "vertex of floor": 25}


# -- the order of points


def test_coherent_order_brings_neighbours_together(rng: np.random.Generator) -> None:
    points = rng.uniform(-3.0, 5.0, (20000, 3))
    order = coherence.coherent_order(points)
    assert order is not None
    assert np.array_equal(np.sort(order), np.arange(20000))
    step = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    assert step.mean() < 0.3 * np.linalg.norm(np.diff(points, axis=0), axis=1).mean()
    assert coherence.coherent_order(points[order]) is None
    assert coherence.coherent_order(points[:100]) is None
    assert coherence.coherent_order(np.ones((9000, 3))) is None
