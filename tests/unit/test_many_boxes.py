"""Fits over thousands of boxes: shortcuts that must not change the result."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.geometry import fitting as fit

CLOUDS = {
    "round": lambda rng, n: rng.normal(size=(n, 2)),
    "long and slanted": lambda rng, n: rng.uniform(-1.0, 1.0, (n, 2)) @ [[100.0, 30.0], [0.0, 0.1]],
    "a lattice": lambda rng, n: np.stack(np.divmod(np.arange(n), 317), axis=1) @ [[3.0, 1.0], [-1.0, 2.0]],
    "a line, but for rounding": lambda rng, n: rng.uniform(size=(n, 1)) * [0.3, 0.7],
}  # fmt: skip


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("count", [500, fit._MANY + 1, 300_000])
def test_hull_contains_every_point(rng: np.random.Generator, name: str, count: int) -> None:
    points = CLOUDS[name](rng, count)
    hull = fit.convex_hull(points)
    extent = float(np.ptp(points, axis=0).max())
    side = np.roll(hull, -1, axis=0) - hull
    if name != "a line, but for rounding":
        inward = np.stack([-side[:, 1], side[:, 0]], axis=1) / np.linalg.norm(side, axis=1, keepdims=True)
        least = min(float(((points - corner) @ normal).min()) for corner, normal in zip(hull, inward, strict=True))
        assert least >= -2.0 * fit._NEAR * extent
        area = 0.5 * abs(float((hull[:, 0] * np.roll(hull[:, 1], -1) - hull[:, 1] * np.roll(hull[:, 0], -1)).sum()))
        assert area == pytest.approx(ConvexHull(points).volume, rel=1e-6)  # in the plane its "volume" is the area
    known = {tuple(row) for row in points.tolist()}
    assert all(tuple(row) in known for row in hull.tolist())


def clipped_one_by_one(bounds: Array, matrices: Array, frustum: fit.Frustum) -> list[Array]:
    """The visible part of every box, clipped individually even if it is wholly inside or outside."""
    low, high = bounds[:, 0], bounds[:, 1]
    pad = 1e-9 * np.maximum((high - low).max(axis=1, keepdims=True), np.abs(bounds).max(axis=(1, 2))[:, None] * 1e-3)
    low, high = low - pad, high + pad
    local = np.where(fit._CORNERS[None] == 0, low[:, None], high[:, None])
    linear, offset = matrices[:, :3, :3], matrices[:, :3, 3]
    corners = np.einsum("nij,nkj->nki", linear, local) + offset[:, None]
    return fit._clipped(corners, linear, offset, low, high, frustum)


def test_boxes_inside_and_outside_need_no_clipping(rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    count = 2000
    bounds = np.sort(rng.normal(size=(count, 2, 3)), axis=1)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] = 0.3 * rng.normal(size=(count, 3, 3))
    matrices[:, :3, 3] = rng.uniform(-8.0, 8.0, (count, 3))
    camera = PerspectiveCamera((2.0, 3.0, 9.0), (0.0, 0.0, 0.0), fov_y=40.0)
    frustum = fit.frustum_of(camera.window((96, 64)), 0.5, 14.0, camera.view_from_world)
    wanted = clipped_one_by_one(bounds, matrices, frustum)
    clipped: list[int] = []
    clip = fit._clipped
    monkeypatch.setattr(fit, "_clipped", lambda *args: clipped.append(len(args[0])) or clip(*args))
    monkeypatch.setattr(fit, "_BLOCK", 100)
    found = fit.visible_corners(bounds, matrices, frustum)
    assert 0 < sum(clipped) < count // 2
    assert max(clipped) <= 100
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, other)
    assert {len(points) for points in found} >= {0, 24}
