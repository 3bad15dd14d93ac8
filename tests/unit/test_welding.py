"""Welded vertices, the edges between them and the triangles across those, on cases small enough to be searched one by one."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.geometry import welding
from glshadow.geometry.adjacency import NONE, TURNED, neighbours
from glshadow.geometry.welding import welded
from glshadow.scene.mesh import Mesh
from glshadow.scenes import shapes


def same(numbers: np.ndarray) -> np.ndarray:
    return numbers[:, None] == numbers


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("mix", [None, 0], ids=["hash", "hash of nothing"])
def test_one_number_for_each_position(monkeypatch: pytest.MonkeyPatch, kind: type, mix: int | None) -> None:
    """Also where all positions have one hash."""
    if mix is not None:
        monkeypatch.setattr(welding, "_MIX", np.uint64(mix))
    positions = np.random.default_rng(0).integers(-2, 3, (200, 3)).astype(kind) * kind(0.5)
    positions[::7] *= kind(-1.0)  # -0 among them
    number = welded(positions)
    np.testing.assert_array_equal(same(number), (positions[:, None] == positions).all(axis=2))
    assert sorted(set(number.tolist())) == list(range(number.max() + 1))


def test_neighbours_are_those_that_a_search_finds() -> None:
    random = np.random.default_rng(1)
    for _ in range(100):
        positions = random.integers(0, 2, (8, 3)).astype(np.float32)
        triangles = random.integers(0, 8, (random.integers(1, 12), 3)).astype(np.uint32)
        place = welded(positions)[triangles]
        edges = [(t, int(place[t, k]), int(place[t, (k + 1) % 3])) for t in range(len(place)) for k in range(3)]
        expected = []
        for t, start, end in edges:
            users = [other for other in edges if {other[1], other[2]} == {start, end}]
            others = [other for other in users if other[0] != t]
            alone = len(users) == 2 and len(others) == 1 and start != end
            expected.append((others[0][0] | (TURNED if others[0][1] == start else 0)) if alone else NONE)
        np.testing.assert_array_equal(neighbours(positions, triangles).ravel(), np.array(expected, dtype=np.uint32))


def test_every_part_of_a_closed_mesh_is_turned_outward() -> None:
    """Forty balls whose vertices and triangles are shuffled; then one of them is turned inside out, and one loses a triangle."""
    random = np.random.default_rng(2)
    ball, triangles = shapes.icosphere(1, 0.4)
    positions = np.concatenate([ball + np.array([k, 0.0, 0.0]) for k in range(40)])
    corners = np.concatenate([triangles + k * len(ball) for k in range(40)])
    to = random.permutation(len(positions))
    shuffled = np.zeros_like(positions)
    shuffled[to] = positions
    corners = random.permutation(to[corners])
    assert Mesh(shuffled, corners).closed
    of_one = np.isin(corners, to[7 * len(ball) : 8 * len(ball)]).all(axis=1)
    assert not Mesh(shuffled, np.where(of_one[:, None], corners[:, ::-1], corners)).closed
    assert not Mesh(shuffled, np.delete(corners, np.flatnonzero(of_one)[:1], axis=0)).closed
    assert not Mesh(shuffled, np.delete(corners, np.flatnonzero(of_one)[:2], axis=0)).closed
