"""The rounded surface over smooth meshes: closed forms of its points, and which normals are refused."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.geometry.smooth import FADE, heights, lift, pack_octahedral, sides, unit_vectors
from glshadow.scenes.shapes import icosphere

RNG = np.random.default_rng(4)


def _ball(subdivisions):
    positions, triangles = icosphere(subdivisions, 1.0)
    corners = unit_vectors(positions)[triangles]
    faces = unit_vectors(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    return corners, faces


def _unpacked(bits):
    """The decoding of lib/octahedral.glsl."""
    p = (np.stack([bits & 0xFFFF, bits >> 16], axis=-1).astype(np.int64) - 32768) / 32767.0
    z = 1.0 - np.abs(p).sum(axis=-1)
    fold = np.maximum(-z, 0.0)[..., None]
    return unit_vectors(np.concatenate([p - np.where(p < 0.0, -fold, fold), z[..., None]], axis=-1))


@pytest.mark.parametrize("subdivisions", [0, 1, 2, 3])
def test_points_of_a_ball_lie_outside_it_and_below_its_tangents(subdivisions):
    """So that no part of the ball is in between where the interpolated normal faces the light."""
    corners, faces = _ball(subdivisions)
    assert (sides(faces, corners) == 1).all()
    share = heights(corners, corners)[1]
    assert (share == 1.0).all()
    weights = RNG.dirichlet((1.0, 1.0, 1.0), len(corners))
    points = np.einsum("nk,nkj->nj", weights, corners)
    moved = points + lift(weights, points, corners, corners, share, np.full(len(corners), -1.0))
    radius = np.linalg.norm(moved, axis=1)
    assert (radius >= 1.0).all()
    # the ball below the plane through the point and along its surface
    assert (np.einsum("nj,nj->n", moved, unit_vectors(np.einsum("nk,nkj->nj", weights, corners))) >= 1.0).all()


def test_an_arc():
    """Half-way between two vertices whose normals differ by 2 a: h = L sin(a) / 2 along each, L their distance."""
    angle, length = 0.3, 2.0
    corners = np.array([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 3.0]]])
    s, c = np.sin(angle), np.cos(angle)
    normals = np.array([[[-s, c, 0.0], [s, c, 0.0], [0.0, 1.0, 0.0]]])
    middle = np.array([[0.5, 0.5, 0.0]]), np.zeros((1, 3))
    for cosine, part in ((-0.5, 1.0), (0.0, 1.0), (0.5 * FADE, 0.5), (FADE, 0.0), (1.0, 0.0)):
        offset = lift(*middle, corners, normals, np.ones(1), np.array([cosine]))
        np.testing.assert_allclose(offset, [[0.0, part * 0.5 * length * s * c, 0.0]], atol=1e-15)
    # from inside, the same surface is concave
    assert not lift(*middle, corners, -normals, np.ones(1), np.array([-1.0])).any()


def test_no_point_is_moved_farther_than_its_height_bound():
    corners = RNG.normal(size=(2000, 3, 3)) * RNG.uniform(0.01, 1.0, (2000, 1, 3))
    faces = unit_vectors(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normals = unit_vectors(faces[:, None] + 0.4 * RNG.normal(size=(2000, 3, 3)))
    most, share = heights(corners, normals)
    for _ in range(20):
        weights = RNG.dirichlet((1.0, 1.0, 1.0), len(corners))
        points = np.einsum("nk,nkj->nj", weights, corners)
        for side in (1.0, -1.0):
            offset = lift(weights, points, corners, side * normals, share, np.full(len(corners), -1.0))
            assert (np.linalg.norm(offset, axis=1) <= most * (1.0 + 1e-12)).all()


def test_normals_that_describe_a_surface():
    """Inverted ones do; the triangle's own, those across a right angle, and those on both sides do not."""
    face = np.array([[0.0, 1.0, 0.0]])

    def tilted(*degrees):
        angles = np.radians(np.array(degrees))
        return np.stack([np.sin(angles), np.cos(angles), 0.0 * angles], axis=-1)[None]

    assert sides(face, tilted(20.0, -20.0, 0.0)) == 1
    assert sides(face, -tilted(20.0, -20.0, 0.0)) == -1
    assert sides(face, tilted(0.0, 0.0, 0.0)) == 0
    assert sides(face, tilted(0.02, 0.02, 0.0)) == 0
    assert sides(face, tilted(45.0, 0.0, 0.0)) == 0
    assert sides(face, tilted(20.0, 180.0, 0.0)) == 0
    assert sides(face, np.zeros((1, 3, 3))) == 0


def test_long_bevel_rises_by_half_its_width_at_most():
    """A strip of width w whose normals rotate along it: no point rises by more than w / 2."""
    corners = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [10.0, 0.0, 0.0]]])
    normals = unit_vectors(np.array([[[-0.5, 1.0, 0.0], [-0.5, 1.0, 0.0], [0.5, 1.0, 0.0]]]))
    most, share = heights(corners, normals)
    np.testing.assert_allclose(most, 0.05, rtol=1e-3)
    assert share < 0.02


def test_octahedral_round_trip():
    vectors = np.concatenate([unit_vectors(RNG.normal(size=(20000, 3))), np.eye(3), -np.eye(3)])
    back = _unpacked(pack_octahedral(vectors))
    # half a step of 1 / 32767 in x and y, both in z, on an octahedron whose faces are 1 / sqrt(3) away
    assert np.linalg.norm(back - vectors, axis=1).max() < np.sqrt(3.0 * 1.5) / 32767.0
    np.testing.assert_array_equal(back[-6:], vectors[-6:])
