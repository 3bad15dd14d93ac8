"""Places of vertices: float32, and in the fourth number what that cuts off."""

from __future__ import annotations

import numpy as np

from glshadow.gl.scene.world import _round


def test_eight_more_bits_of_each_coordinate_are_kept(rng: np.random.Generator) -> None:
    points = rng.normal(size=(5000, 3)) * 10.0 ** rng.uniform(-6.0, 6.0, (5000, 1))
    points[:3] = [[0.0, 0.0, 0.0], [1.0 - 2.0**-25, 1.0 + 2.0**-24, -2.0], [0.0, -1.0 - 2.0**-24, 0.0]]
    places = np.zeros((len(points), 4), dtype=np.float32)
    _round(places, points)
    np.testing.assert_array_equal(places[:, :3], points.astype(np.float32))
    # as lib/ray_triangle.glsl reads it
    largest = np.abs(places[:, :3]).max(axis=1, keepdims=True)
    unit = (largest.view(np.uint32) & 0x7F800000).view(np.float32).astype(np.float64) * 2.0**-31
    bits = places[:, 3].astype(np.uint32)[:, None] >> np.array([0, 8, 16], dtype=np.uint32) & 255
    rest = (bits - 128.0) * unit
    # half a unit of the eight bits; one where the rest is half a unit of float32, 128 of them, and 127 is the most
    assert (np.abs(places[:, :3] + rest - points) <= np.where(bits == 255, 1.0, 0.5) * unit).all()
