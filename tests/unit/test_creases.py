"""Smooth normals of polygons: closed forms, creases, groups, and independence of how polygons are stored."""

import numpy as np
import pytest

from glshadow.geometry.creases import smooth_normals
from glshadow.geometry.parts import representatives

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float) - 0.5
FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def prism(sides, caps=False):
    """Side faces of a right prism, and its two caps; axis y."""
    angle = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angle), np.zeros(sides), np.sin(angle)], axis=1)
    places = np.concatenate([ring, ring + np.array([0, 1, 0])])
    k = np.arange(sides)
    walls = np.stack([k, k + sides, (k + 1) % sides + sides, (k + 1) % sides], axis=1).ravel()
    counts = [4] * sides
    if caps:
        walls = np.concatenate([walls, k, (k + sides)[::-1]])
        counts += [sides, sides]
    return places, walls, np.array(counts)


def per_corner(found):
    normals, of = found
    return normals[of]


def test_all_faces_of_a_cube_in_one_group_give_its_diagonals():
    """Three right angles with equal weights."""
    groups = np.ones(6, dtype=int)
    found = smooth_normals(CUBE, FACES.ravel(), np.full(6, 4), None, groups)
    assert len(found[0]) == 8
    # 1e-15: rounding
    np.testing.assert_allclose(per_corner(found), CUBE[FACES.ravel()] * 2 / np.sqrt(3), atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 30.0, 89.9, 90.0])
def test_a_cube_is_flat_up_to_a_right_angle(angle):
    assert smooth_normals(CUBE, FACES.ravel(), np.full(6, 4), np.radians(angle)) is None


def test_triangulation_changes_nothing():
    """Weights by angle: a vertex of a cube has one or two triangles of a face, with 90 degrees together."""
    triangles = FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    for turn in range(3):  # other diagonals
        turned = np.roll(FACES, turn, axis=1)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        found = smooth_normals(CUBE, turned.ravel(), np.full(12, 3), np.radians(91.0))
        np.testing.assert_allclose(per_corner(found), CUBE[turned.ravel()] * 2 / np.sqrt(3), atol=1e-15)
    assert smooth_normals(CUBE, triangles.ravel(), np.full(12, 3), np.radians(90.0)) is None


@pytest.mark.parametrize(("sides", "smooth"), [(13, True), (12, False), (11, False)])
def test_a_cylinder_at_30_degrees(sides, smooth):
    """Normals are radial where 360 / sides is below 30 degrees; just 30 is a crease, also where rounding says otherwise."""
    far = () if sides == 12 else ((1.0, 1e3),)  # float32 has angles to 1e-4 there
    for scale, shift in ((1.0, 0.0), (1e-20, 0.0), (1e20, 0.0), *far):
        places, corners, counts = prism(sides)
        stored = (places * scale + shift).astype(np.float32).astype(np.float64)  # as a file has it
        found = smooth_normals(stored, corners, counts, np.radians(30.0))
        assert (found is not None) == smooth
        if found is not None:
            radial = places[corners] * (1, 0, 1)
            # float32's 6e-8, over edges of half a unit; 1e-3 at 1,000 units from the origin
            np.testing.assert_allclose(per_corner(found), radial, atol=1e-6 if shift == 0.0 else 1e-3)


def test_caps_stay_flat_beside_a_smooth_wall():
    places, corners, counts = prism(24, caps=True)
    normals = per_corner(smooth_normals(places, corners, counts, np.radians(30.0)))
    np.testing.assert_allclose(normals[:96], places[corners[:96]] * (1, 0, 1), atol=1e-15)
    np.testing.assert_allclose(normals[96:120], [[0, -1, 0]] * 24, atol=1e-15)
    np.testing.assert_allclose(normals[120:], [[0, 1, 0]] * 24, atol=1e-15)


def test_vertices_that_are_not_shared_are_joined_by_position(rng):
    places, corners, counts = prism(24)
    shared = per_corner(smooth_normals(places, corners, counts, np.radians(30.0)))
    alone = smooth_normals(places[corners], np.arange(len(corners)), counts, np.radians(30.0))
    np.testing.assert_array_equal(per_corner(alone), shared)
    order = rng.permutation(24)
    mixed = corners.reshape(-1, 4)[order]
    # 1e-15: the sums are in another order
    np.testing.assert_allclose(
        per_corner(smooth_normals(places, mixed.ravel(), counts, np.radians(30.0))),
        shared.reshape(-1, 4, 3)[order].reshape(-1, 3),
        atol=1e-15,
    )


def test_groups_end_at_their_border():
    """A fold between two groups is a crease, within one it is not; group 0 is flat."""
    places = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1], [0, 1, 0], [0, 1, 1]], dtype=float)
    corners, counts = np.array([0, 1, 3, 2, 1, 0, 4, 5]), np.array([4, 4])
    for groups, joined in (((1, 1), True), ((1, 2), False), ((0, 0), False), ((0, 1), False)):
        assert (smooth_normals(places, corners, counts, None, np.array(groups)) is not None) == joined


def test_a_sheet_with_front_and_back_keeps_them_apart():
    """Each triangle twice, once turned over, as CAD exports sheets: four polygons at an edge."""
    places = np.array([[0, 0, 0], [0, 0, 1], [1, 0.1, 0], [1, 0.1, 1], [-1, 0.1, 0], [-1, 0.1, 1]], dtype=float)
    front = np.array([[0, 1, 3, 2], [1, 0, 4, 5]])
    corners = np.concatenate([front, front[:, ::-1]]).ravel()
    for groups, crease in ((np.ones(4, dtype=int), None), (None, np.radians(30.0))):
        normals = per_corner(smooth_normals(places, corners, np.full(4, 4), crease, groups)).reshape(4, 4, 3)
        ridge = normals[:2, [0, 1]]
        np.testing.assert_allclose(ridge, np.broadcast_to(ridge[:1, :1] * (0, 1, 0), ridge.shape), atol=1e-15)
        np.testing.assert_allclose(normals[2:], -normals[:2, ::-1], atol=1e-15)


def test_faces_of_opposite_winding_are_not_joined():
    """A fold whose one side shows its back: their sum would be near zero."""
    places = np.array([[0, 0, 0], [0, 0, 1], [1, 0.1, 0], [1, 0.1, 1], [-1, 0.1, 0], [-1, 0.1, 1]], dtype=float)
    corners = np.array([0, 1, 3, 2, 0, 1, 5, 4])
    assert smooth_normals(places, corners, np.array([4, 4]), None, np.array([1, 1])) is None
    assert smooth_normals(places, corners, np.array([4, 4]), np.radians(179.0)) is None


def test_polygons_without_area_and_isolated_corners():
    places = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.2], [0, -1, 0.2], [np.nan] * 3])
    corners, counts = np.array([0, 1, 3, 1, 0, 4, 0, 1, 2, 0, 1]), np.array([3, 3, 3, 2, 0])
    normals = per_corner(smooth_normals(places, corners, counts, np.radians(60.0)))
    assert np.isfinite(normals).all()
    np.testing.assert_allclose(np.linalg.norm(normals[:6], axis=1), 1.0, atol=1e-15)


def test_polygons_without_an_edge_have_no_smooth_normals():
    places, corners, counts = np.zeros((2, 3)), np.array([0, 1, 0, 1, 1, 1]), np.array([2, 4])
    assert smooth_normals(places, corners, counts, np.radians(60.0)) is None
    assert smooth_normals(places, corners, counts, None, np.ones(2, dtype=np.int64)) is None


def test_many_polygons_at_one_edge_are_creases():
    """A million pairs would be found otherwise."""
    angle = np.linspace(0, np.pi, 2000)
    places = np.concatenate([[[0, 0, 0], [0, 0, 1]], np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    fans = np.stack([np.arange(2000) % 2, 1 - np.arange(2000) % 2, np.arange(2, 2002)], axis=1)
    assert smooth_normals(places, fans.ravel(), np.full(2000, 3), np.radians(30.0)) is None


def test_representatives_are_the_lowest_of_each_part(rng):
    """Against a search from each vertex."""
    for _ in range(50):
        start, end = rng.integers(0, 60, (2, 40))
        found = representatives(start, end, 60)
        beside = {k: set() for k in range(60)}
        for a, b in zip(start.tolist(), end.tolist(), strict=True):
            beside[a].add(b)
            beside[b].add(a)
        for vertex in range(60):
            seen, todo = {vertex}, [vertex]
            while todo:
                new = beside[todo.pop()] - seen
                seen |= new
                todo += new
            assert found[vertex] == min(seen)
