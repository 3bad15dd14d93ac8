"""Welded vertices, edges and adjacent triangles, on cases small enough for an exhaustive search."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.geometry import adjacency, welding
from glshadow.geometry.adjacency import NONE, TURNED, neighbours
from glshadow.geometry.welding import welded, welded_corners
from glshadow.scene.mesh import Mesh
from glshadow.scenes import shapes


def same(numbers: np.ndarray) -> np.ndarray:
    return numbers[:, None] == numbers


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("mix", [None, 1 << 60, 0], ids=["hash", "hash of few", "hash of nothing"])
def test_one_number_for_each_position(monkeypatch: pytest.MonkeyPatch, kind: type, mix: int | None) -> None:
    """Also if some positions have the same hash, or all do."""
    if mix is not None:
        monkeypatch.setattr(welding, "MIX", np.uint64(mix))
    positions = np.random.default_rng(0).integers(-2, 3, (200, 3)).astype(kind) * kind(0.5)
    positions[::7] *= kind(-1.0)  # -0 among them
    number = welded(positions)
    np.testing.assert_array_equal(same(number), (positions[:, None] == positions).all(axis=2))
    assert sorted(set(number.tolist())) == list(range(number.max() + 1))


def searched(corners: np.ndarray) -> np.ndarray:
    """The result of `neighbours`, by a dictionary of all edges."""
    users: dict[frozenset[int], list[tuple[int, int, int]]] = {}
    for t, triangle in enumerate(corners.tolist()):
        for start, end in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            users.setdefault(frozenset((start, end)), []).append((t, start, end))
    across = np.full(corners.shape, NONE, dtype=np.uint32)
    for t, triangle in enumerate(corners.tolist()):
        for k, (start, end) in enumerate(zip(triangle, triangle[1:] + triangle[:1], strict=True)):
            others = [each for each in users[frozenset((start, end))] if each[0] != t]
            if len(users[frozenset((start, end))]) == 2 and len(others) == 1 and start != end:
                across[t, k] = others[0][0] | (TURNED if others[0][1] == start else 0)
    return across


def closed_by_search(corners: np.ndarray, positions: np.ndarray) -> bool:
    """For separate convex parts: every edge has exactly one opposite edge, every part's volume is positive."""
    positions = positions[[len({*triangle}) == 3 for triangle in corners.tolist()]]
    corners = corners[[len({*triangle}) == 3 for triangle in corners.tolist()]]
    if len(corners) == 0 or (searched(corners) >= TURNED).any():
        return False
    part = corners[:, 0].copy()
    for _ in range(len(corners)):  # the lowest vertex number spreads over its part
        least = {v: int(part[(corners == v).any(axis=1)].min()) for v in np.unique(corners).tolist()}
        spread = np.array([min(least[v] for v in triangle) for triangle in corners.tolist()])
        if (spread == part).all():
            break
        part = spread
    volume = np.linalg.det(positions - positions.mean(axis=(0, 1)))
    return all(volume[part == each].sum() > 0.0 for each in np.unique(part))


def test_neighbours_match_an_exhaustive_search() -> None:
    """Few vertices, and therefore edges of no, one and many neighbours, degenerate triangles and coincident vertices."""
    random = np.random.default_rng(1)
    for _ in range(200):
        positions = random.integers(0, 2, (8, 3)).astype(np.float32)
        corners = welded_corners(positions, random.integers(0, 8, (random.integers(0, 12), 3)).astype(np.int32))
        np.testing.assert_array_equal(neighbours(corners), searched(corners))


@pytest.mark.parametrize("mix", [None, 0], ids=["hash", "hash of nothing"])
def test_neighbours_when_an_edge_exceeds_64_bits(monkeypatch: pytest.MonkeyPatch, mix: int | None) -> None:
    """Vertices of 31 bits each: the greater one is sorted by a hash only, which may be equal for several edges or for all."""
    if mix is not None:
        monkeypatch.setattr(adjacency, "MIX", np.uint64(mix))
    random = np.random.default_rng(3)
    for _ in range(50):
        names = random.integers(2**30, 2**31 - 1, 9).astype(np.int32)
        corners = names[random.integers(0, 9, (random.integers(1, 20), 3))]
        np.testing.assert_array_equal(neighbours(corners), searched(corners))


def test_neighbours_across_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches of three edges: runs of equal edges cross their borders."""
    _, triangles = shapes.icosphere(2, 1.0)
    random = np.random.default_rng(4)
    corners = random.permutation(np.concatenate([triangles, triangles[:7], triangles[3:9, ::-1]])).astype(np.int32)
    monkeypatch.setattr(adjacency, "_AT_ONCE", 3)
    np.testing.assert_array_equal(neighbours(corners), searched(corners))


def test_closed_and_neighbours_of_random_meshes() -> None:
    """Separate boxes and tetrahedra, some with a triangle less, one twice, one flipped, or all of them; duplicated vertices."""
    random = np.random.default_rng(5)
    found = []
    for _ in range(150):
        solids = [shapes.box((1.0, 1.0, 1.0), (3.0 * k, 0.0, 0.0)) for k in range(random.integers(1, 4))]
        positions, triangles = shapes.joined(solids)
        fault = random.choice(["none", "none", "less", "twice", "turned", "inside out", "degenerate"])
        some = random.integers(0, len(triangles))
        if fault == "less":
            triangles = np.delete(triangles, some, axis=0)
        elif fault == "twice":
            triangles = np.append(triangles, triangles[[some]], axis=0)
        elif fault == "turned":
            triangles[some] = triangles[some, ::-1]
        elif fault == "inside out":
            triangles[:12] = triangles[:12, ::-1]
        elif fault == "degenerate":
            triangles = np.append(triangles, triangles[[some]][:, [0, 0, 1]], axis=0)
        if random.random() < 0.5:  # every triangle has vertices of its own
            positions, triangles = positions[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
        to = random.permutation(len(positions))
        shuffled = np.zeros_like(positions)
        shuffled[to] = positions
        mesh = Mesh(shuffled, random.permutation(to[triangles]))
        place = np.unique(mesh.positions + 0.0, axis=0, return_inverse=True)[1].reshape(-1)[mesh.triangles]
        np.testing.assert_array_equal(mesh.neighbours, searched(place))
        assert mesh.closed == closed_by_search(place, mesh.positions[mesh.triangles])
        found.append(mesh.closed)
    assert 30 < sum(found) < 120


def test_every_part_of_a_closed_mesh_faces_outward() -> None:
    """Forty balls with shuffled vertices and triangles; then one of them is inverted, and one loses a triangle."""
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
