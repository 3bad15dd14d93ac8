"""Visibility of points by rays in float64, in place of a renderer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow.reference.rays import Rays


class RayEyes:
    """What `Renderer.visibility` gives, by Embree with every decision in float64."""

    def __init__(self) -> None:
        self.calls = 0
        self.suns = 0

    def visibility(
        self, scene: gs.Scene, points: Any, lights: Any = None, normals: Any = None, triangles: Any = None
    ) -> NDArray[np.float32]:
        self.calls += 1
        self.suns += len(lights)
        rays = Rays(scene, scene.bounds.mean(axis=0))
        at = np.asarray(points, dtype=np.float64) - rays.origin
        found = np.zeros((len(lights), len(at)), dtype=np.float32)
        for light, row in zip(lights, found, strict=True):
            aims = np.broadcast_to(-np.asarray(light.direction), at.shape)
            open_to = (
                np.ones(len(at), dtype=bool) if normals is None else (np.asarray(normals) * aims).sum(axis=1) > 0.0
            )
            if triangles is None:
                blocked = rays.first_hits(at, aims, np.full(len(at), np.inf))[0] >= 0
            else:
                own = np.asarray(triangles, dtype=np.int32)
                blocked = rays.blocked(own, at, aims, np.full(len(at), np.inf))[0]
            row[:] = open_to & ~blocked
        return found
