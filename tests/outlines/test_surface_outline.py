"""Shadows on surfaces that are not flat: closed forms, a plane's outline, and rays to points of a rough terrain."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

import glshadow as gs

from ..tolerances import RTOL_FLOAT64
from .solids import box, moved, sheet, torus

SLANT = gs.DirectionalLight(direction=(-1.0, -1.0, 0.0))
FLOOR = gs.Node(sheet([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)]), name="floor")


def terrain(count: int, height: float) -> gs.Mesh:
    """A rough height field over a square of 4."""
    x, z = np.meshgrid(np.linspace(-2, 2, count), np.linspace(-2, 2, count))
    y = height * np.random.default_rng(3).uniform(size=x.shape)
    i, j = np.meshgrid(np.arange(count - 1), np.arange(count - 1))
    a = (i * count + j).ravel()
    quads = [np.stack([a, a + count, a + 1], axis=1), np.stack([a + 1, a + count, a + count + 1], axis=1)]
    return gs.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(quads))


def test_a_flat_node_has_the_area_of_the_plane() -> None:
    scene = gs.Scene([torus(1.0, 0.4, 1.0), box((-1, 0.0, 1), (1, 2, 2)), FLOOR])
    light = gs.DirectionalLight(direction=(-1.0, -2.0, 0.3))
    found = gs.surface_outline(scene, "floor", light)
    assert found.area == pytest.approx(gs.shadow_outline(scene, light, "floor").area, rel=1e-11)
    assert found.facing_area == pytest.approx(18.0**2, rel=RTOL_FLOAT64)
    assert set(found.triangles.tolist()) == {0, 1}


def test_a_shadow_bends_up_a_wall() -> None:
    """A square of 2 x 2 at a height of 2 under 45 degrees, above a floor whose border stands up as a wall at x = -2."""
    corner = gs.Mesh(
        np.array([(-2, 0, 5), (9, 0, 5), (9, 0, -5), (-2, 0, -5), (-2, 9, 5), (-2, 9, -5)], dtype=float),
        np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4]]),
    )
    square = sheet([(-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1)])
    scene = gs.Scene([gs.Node(square, name="square"), gs.Node(corner, name="corner")])
    found = gs.surface_outline(scene, "corner", SLANT)
    points = np.concatenate([ring for ring, _ in found.polygons])
    # of x from -3 to -1, one half falls on the floor, and the other on the wall up to a height of 1
    assert found.area == pytest.approx(2.0 + 2.0, rel=RTOL_FLOAT64)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [(-2, 0, -1), (-1, 1, 1)], atol=1e-12)
    assert (np.isclose(points[:, 0], -2.0, atol=1e-12) | np.isclose(points[:, 1], 0.0, atol=1e-12)).all()
    assert found.triangles.max() >= 2


@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-6, 0.0), (1.0, 1e5)])
def test_a_terrain_is_dark_where_rays_are_blocked(rng: np.random.Generator, scale: float, shift: float) -> None:
    land = terrain(14, 0.5)
    place = shift * np.array([1.0, 0.0, -1.0])
    scene = moved(
        gs.Scene([gs.Node(land, name="land"), gs.Node(box((-0.3, 0.8, -0.3), (0.3, 1.4, 0.3)), name="box")]),
        scale,
        place,
    )
    light = gs.DirectionalLight(direction=(-1.0, -0.7, 0.4))
    found = gs.surface_outline(scene, "land", light)
    assert 0.1 < found.area / found.facing_area < 0.9
    here = lambda ring: (ring - place)[:, ::2] / scale  # noqa: E731
    flat = [shapely.Polygon(here(ring), [here(hole) for hole in holes]) for ring, holes in found.polygons]
    whole = shapely.union_all(np.array(flat))
    triangle = rng.integers(len(land.triangles), size=3000)
    weights = rng.dirichlet((1, 1, 1), size=3000)
    points = np.einsum("nk,nkj->nj", weights, land.positions[land.triangles[triangle]])
    blocked = gs.blockers(scene, scale * points + place, light, triangles=triangle)
    cast = (blocked.node[0] >= 0) & (blocked.distance[0] > 0.0)
    away = blocked.distance[0] == 0.0  # the back of a two-sided triangle has its own shadow
    clear = shapely.distance(shapely.points(points[:, ::2]), whole.boundary) > 1e-3
    counted = clear & ~away
    np.testing.assert_array_equal(shapely.contains_xy(whole, points[:, 0], points[:, 2])[counted], cast[counted])
    assert counted.mean() > 0.5


def test_both_sides_of_a_triangle_receive() -> None:
    turned = gs.Mesh(FLOOR.mesh.positions, FLOOR.mesh.triangles[:, ::-1])
    roof = gs.Node(box((-1, 1, -1), (1, 2, 1)))
    areas = [
        gs.surface_outline(gs.Scene([gs.Node(each, name="floor"), roof]), "floor", SLANT).area
        for each in (FLOOR.mesh, turned)
    ]
    np.testing.assert_allclose(areas, 4.0 + 2.0, rtol=RTOL_FLOAT64)


def test_nothing_above_leaves_nothing() -> None:
    found = gs.surface_outline(gs.Scene([FLOOR, box((-1, -3, -1), (1, -2, 1))]), "floor", SLANT)
    assert (found.area, found.polygons, len(found.triangles)) == (0.0, (), 0)
    assert "0 polygons" in repr(found)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"light": gs.PointLight(position=(0, 4, 0))}, "takes light at infinity, got PointLight"),
        ({"light": gs.SkyLight()}, "needs a light from one direction"),
        ({"onto": None}, "onto must be one node"),
        ({"onto": [0, 0, 1]}, "onto must be one node"),
        ({"onto": "roof"}, "onto must be nodes of the scene"),
        ({"of": 9}, "of must be nodes of the scene"),
    ],
    ids=["point", "sky", "none", "two", "name", "of"],
)
def test_what_is_wrong_is_named(arguments: dict[str, object], message: str) -> None:
    scene = gs.Scene([FLOOR, box((-1, 1, -1), (1, 2, 1))])
    with pytest.raises(gs.SettingsError, match=message):
        gs.surface_outline(scene, **{"onto": "floor", "light": SLANT, **arguments})  # type: ignore[arg-type]
