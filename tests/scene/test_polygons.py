"""Triangulation of polygons: simple ones are covered exactly, in any plane, with any number of corners; all others terminate quickly."""

import numpy as np
import pytest

from glshadow.io.limits import Budget
from glshadow.io.polygons import MANY, MOST, triangulated
from glshadow.io.sweep import swept

from ..pace import at_most


def ring(radii):
    """A polygon that is star-shaped about the origin: simple, counter-clockwise."""
    angle = np.linspace(0.0, 2.0 * np.pi, len(radii), endpoint=False)
    return np.stack([radii * np.cos(angle), radii * np.sin(angle)], axis=1)


def comb(corners, turned=False):
    """Teeth on a bar: half of the corners are reflex."""
    x = np.arange(corners - 2) / (corners - 2)
    y = np.where(np.arange(corners - 2) % 2, 1.0, 0.1)
    plane = np.stack([np.append(x, [x[-1], 0.0]), np.append(y, [0.0, 0.0])], axis=1)[::-1]
    return plane[:, ::-1] * (1, -1) if turned else plane


def spiral(corners):
    angle = np.linspace(0.0, min(60.0, corners / 12.0) * np.pi, corners // 2)  # steps of 30 degrees at most
    radius = np.linspace(1.0, 10.0, corners // 2)
    arms = [np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1) for r in (radius, radius - 0.05)]
    return np.concatenate([arms[0], arms[1][::-1]])


def stairs(corners):
    """Axis-parallel: many corners share an x or a y."""
    steps = [(x, y) for k in range(corners // 4) for x, y in ((4 * k, 0), (4 * k, 3), (4 * k + 2, 3), (4 * k + 2, 0))]
    return np.array([*steps, (corners, 0), (corners, -1), (0, -1)], dtype=float)[::-1]


def keyhole(corners):
    """A ring with a hole: an edge that leads to it and back."""
    outer, inner = ring(np.full(corners // 2, 2.0)), ring(np.full(corners // 2, 1.0))[::-1]
    return np.concatenate([outer, outer[:1], inner[-1:], inner[:-1], inner[-1:]])


SIMPLE = {
    "star": lambda n: ring(1.0 + 0.3 * np.sin(50.0 * np.linspace(0, 2 * np.pi, n))),
    "needles": lambda n: ring(np.where(np.arange(n) % 2, 1.0, 0.01)),
    "random": lambda n: ring(np.random.default_rng(n).uniform(0.1, 1.0, n)),
    "comb": comb,
    "turned comb": lambda n: comb(n, turned=True),
    "spiral": spiral,
    "stairs": stairs,
    "keyhole": keyhole,
}


def double_area(plane):
    x, y = plane.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def cut(*polygons):
    """(triangles as corners (T, 3, 3), polygon of each, notes) of polygons (K, 3)."""
    positions = np.concatenate(polygons)
    notes = []
    counts = np.array([len(polygon) for polygon in polygons])
    triangles, owner = triangulated(positions, np.arange(len(positions)), counts, notes, Budget())
    return positions[triangles], owner, notes


def in_space(plane, rng):
    """The polygon in a random plane of space, and its unit normal."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return plane @ axes[:, :2].T + rng.normal(size=3), axes[:, 2]


@pytest.mark.parametrize("corners", [9, 12, 40, 401, MANY + 2])
@pytest.mark.parametrize("name", SIMPLE)
def test_simple_polygons_are_covered_exactly(name, corners, rng):
    plane = SIMPLE[name](corners)
    area = 0.5 * double_area(plane)
    for points, sign in ((plane, 1.0), (plane[::-1], -1.0)):
        points, normal = in_space(points, rng)
        triangles, _, notes = cut(points)
        vectors = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        # 1e-9: rounding of the turned coordinates, 1e-16 of each of up to 4,000 corners on needles of .01
        np.testing.assert_allclose(sign * vectors.sum(axis=0), area * normal, atol=1e-9 * abs(area))
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).sum(), area, rtol=1e-9)
        assert notes == []


def test_polygons_of_few_corners(rng):
    """Every simple polygon of up to 8 corners from a random walk around a point, all at once and each alone."""
    planes = [ring(rng.uniform(0.05, 1.0, rng.integers(3, 9))) for _ in range(300)]
    areas = np.array([0.5 * double_area(plane) for plane in planes])
    triangles, owner, notes = cut(*(np.column_stack([plane, np.zeros(len(plane))]) for plane in planes))
    signed = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[:, 2]
    # 1e-12: rounding
    np.testing.assert_allclose(np.bincount(owner, signed), areas, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(np.bincount(owner, np.abs(signed)), areas, rtol=1e-12, atol=1e-14)
    assert (np.diff(owner) >= 0).all()
    assert notes == []


def test_convex_quad_keeps_its_first_diagonal():
    """As in trimesh and most exporters: a non-planar quad keeps its fold."""
    points = np.array([[0, 0, 0], [1, 0, 0.1], [1, 1, 0], [0, 1, 0.1]])
    triangles, _, _ = cut(points)
    assert triangles.tolist() == [points[[0, 1, 2]].tolist(), points[[0, 2, 3]].tolist()]


@pytest.mark.parametrize("name", SIMPLE)
def test_many_corners_use_the_sweep(name):
    """Ear clipping takes 6 s for the comb and the needles; the sweep at most 1.3 s: 10 s of an idle core leave a margin."""
    plane = SIMPLE[name](100_000)
    with at_most(10.0):
        triangles = swept(plane)
    a, b, c = (plane[triangles[:, k]] for k in range(3))
    signed = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    # 1e-9: rounding of 1e5 corners
    np.testing.assert_allclose(signed.sum(), double_area(plane), rtol=1e-9)
    np.testing.assert_allclose(np.abs(signed).sum(), double_area(plane), rtol=1e-9)


def crossing(kind, corners, rng):
    if kind == "noise":
        return rng.random((corners, 2))
    if kind == "walk":
        return rng.normal(size=(corners, 2)).cumsum(axis=0)
    if kind == "bow ties":
        return np.column_stack([np.arange(corners) % 7, np.arange(corners) % 5]).astype(float)
    plane = ring(1.0 + 0.3 * np.sin(50.0 * np.linspace(0, 2 * np.pi, corners)))
    plane[[10, 12]] = plane[[12, 10]]  # one crossing
    return plane


@pytest.mark.parametrize("corners", [5, 30, 3000, MANY + 500, MOST + 20_000])
@pytest.mark.parametrize("kind", ["noise", "walk", "bow ties", "one crossing"])
def test_self_intersecting_polygons_terminate_quickly(kind, corners, rng):
    plane = crossing(kind, max(corners, 14) if kind == "one crossing" else corners, rng)
    with at_most(10.0):
        triangles, _, notes = cut(np.column_stack([plane, np.zeros(len(plane))]))
    if corners >= 30 and kind in ("noise", "walk"):
        assert "cross themselves" in notes[0]
    if kind == "one crossing":  # all but the place of the crossing is right
        vectors = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        assert np.linalg.norm(vectors, axis=1).sum() == pytest.approx(
            0.5 * double_area(plane), rel=0.7 if corners < 100 else 0.01
        )


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((9, 3)),
        np.column_stack([np.arange(9.0), np.zeros((9, 2))]),
        np.full((9, 3), np.nan),
        np.column_stack([1.7e308 * np.cos(np.arange(9)), 1.7e308 * np.sin(np.arange(9)), np.zeros(9)]),
        np.column_stack([1e-310 * np.arange(9.0) ** 2, 1e-310 * np.arange(9), np.zeros(9)]),
        np.array([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]),
    ],
)
def test_degenerate_polygons_raise_no_error(points):
    triangles, _, _ = cut(points, points[::-1])
    assert triangles.shape[1:] == (3, 3)


def test_fewer_than_three_corners_give_no_triangle():
    triangles, owner, notes = cut(np.eye(3), np.eye(3)[:2], np.zeros((0, 3)), np.eye(3)[::-1])
    assert owner.tolist() == [0, 3]
    assert triangles.tolist() == [np.eye(3).tolist(), np.eye(3)[::-1].tolist()]
    assert notes == ["2 face(s) with fewer than 3 corners left out"]
