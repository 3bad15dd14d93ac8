"""The tests' own tracer: against every triangle one by one, and against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes.shapes import box, rectangle
from tests.tracer import Array, Tracer, View


def _every(corners: Array, o: Array, d: Array, own: int) -> tuple[int, float]:
    """The nearest triangle by solving o + t d = a + u (b - a) + v (c - a) for each."""
    best, nearest = -1, np.inf
    for number, (a, b, c) in enumerate(corners):
        matrix = np.stack([-d, b - a, c - a], axis=1)
        if number == own or np.linalg.det(matrix) == 0.0:
            continue
        t, u, v = np.linalg.solve(matrix, o - a)
        if u >= 0.0 and v >= 0.0 and u + v <= 1.0 and 0.0 < t < nearest:
            best, nearest = number, float(t)
    return best, nearest


def test_nearest_triangles_are_those_of_every_triangle_one_by_one(rng: np.random.Generator) -> None:
    corners = rng.normal(size=(300, 1, 3)) + rng.normal(size=(300, 3, 3)) * rng.choice([0.05, 0.5], (300, 1, 1))
    origins, directions, own = rng.normal(size=(400, 3)), rng.normal(size=(400, 3)), rng.integers(-1, 300, 400)
    found, far = Tracer(corners).trace(origins, directions, own=own)
    assert (found >= 0).sum() > 100
    for k in range(400):
        number, distance = _every(corners, origins[k], directions[k], int(own[k]))
        assert found[k] == number
        assert number < 0 or far[k] == pytest.approx(distance, rel=1e-9)


def test_a_box_on_a_ground_has_the_shadow_of_its_projection() -> None:
    ground = gs.Mesh(*rectangle((-10.0, 0.0, 10.0), (20.0, 0.0, 0.0), (0.0, 0.0, -20.0)))
    lifted = gs.Mesh(*box((1.0, 1.0, 1.0), (0.0, 1.0, 0.0)))
    scene = gs.Scene((gs.Node(ground, np.eye(4), "ground"), gs.Node(lifted, np.eye(4), "box")))
    camera = gs.OrthographicCamera(position=(0.0, 9.0, 0.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), height=8.0)
    view = View(scene, camera, (64, 64))
    seen = view.visibility(towards=(1.0, 1.0, 0.0))  # a shadow of x - y from -1 to +1, moved by the height 0.5 to 1.5
    x, z = ((np.arange(64) + 0.5) / 64 - 0.5) * 8.0, ((np.arange(64) + 0.5) / 64 - 0.5) * 8.0
    ground_seen = view.triangle.reshape(64, 64) < 2
    dark = (x[None, :] > -2.0) & (x[None, :] < 0.0) & (np.abs(z[:, None]) < 0.5)
    np.testing.assert_array_equal(seen[ground_seen], np.where(dark, 0.0, 1.0)[ground_seen])
    assert ((seen == 1.0) & ~ground_seen).sum() > 0
