"""Exact() against rays at the same points, and against every triangle in float64 where the two differ."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.derive.lists import distance_bound
from glshadow.frame import Frame
from glshadow.lights import Light
from glshadow.reference.aimed import AimedLight
from glshadow.reference.trace import trace
from glshadow.reference.truth import Truth
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.shadows.filters import Exact
from glshadow.shadows.shadow import Shadow

from .brute import blocked

SIZE = (640, 360)

LEAST_COSINE = 2e-6
"""N.L below which float32 cannot decide on which side of a face the light is: 16 roundings of 2^-24, doubled."""

WRONG = 3
"""Pixels of an image of 640 x 360: silhouettes within float32's rounding of a pixel's point."""


MOST_TESTED = 500
"""Disputed pixels that are tested against every triangle, evenly chosen: more than that fail anyway."""


@dataclass(frozen=True)
class Compared:
    """A frame and its traced reference.

    Attributes
    ----------
    disputed : (H, W) bool
        Surfaces in the light's reach, where the two differ.
    wrong : (H, W) bool
        Those where testing every triangle in float64, with the filter's own bound, shows that the frame is wrong.
    """

    frame: Frame
    truth: Truth
    disputed: NDArray[np.bool_]
    wrong: NDArray[np.bool_]

    @property
    def lit(self) -> float:
        """Share of the surfaces facing the light that are lit."""
        facing = self.truth.cosine[0] > 0.0
        return float(self.truth.visibility[0][facing].mean()) if facing.any() else 0.0

    def __str__(self) -> str:
        seen = int((self.truth.triangle >= 0).sum())
        return (
            f"{self.frame.scene.name}, {type(self.frame.lights[0]).__name__}: {int(self.disputed.sum())} of {seen} pixels differ from "
            f"rays, {int(self.wrong.sum())} of them are wrong, {self.lit:.1%} lit"
        )


def with_exact(light: Light, **settings: Any) -> Light:
    """The light with an exact shadow."""
    return replace(light, shadow=Shadow(filter=Exact(), **settings))


def shone(frame: Frame) -> NDArray[np.bool_]:
    """Where (H, W) the first light of a frame with positions shines, up to a hair before the border of its cone."""
    points = np.nan_to_num(frame.position.astype(np.float64))
    return np.asarray(frame.lights[0].strength(points) > 1e-4)


def compared(
    renderer: Renderer,
    scene: Scene,
    light: Light,
    camera: PerspectiveCamera | None = None,
    size: tuple[int, int] = SIZE,
    **settings: Any,
) -> Compared:
    """Render with Exact() and check every pixel."""
    light = with_exact(light, **settings)
    frame = renderer.render(scene, camera, [light], size, outputs=("visibility", "triangle"), samples=1)
    assert frame.used[0].fallbacks == ()
    truth = trace(scene, camera, [light], size, surface=frame.triangle, samples=1)
    seen = truth.triangle >= 0
    np.testing.assert_array_equal(np.isnan(frame.visibility[0]), ~seen)
    facing = seen & truth.reached[0] & (np.abs(np.where(seen, truth.cosine[0], 0.0)) > LEAST_COSINE)
    disputed = facing & (np.where(seen, frame.visibility[0], 0.0) != np.where(seen, truth.visibility[0], 0.0))
    return Compared(frame, truth, disputed, _wrong(frame, truth, disputed))


def _wrong(frame: Frame, truth: Truth, disputed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    light, rays = frame.lights[0], truth.rays
    rows = np.flatnonzero(disputed)
    rows = rows[:: 1 + len(rows) // MOST_TESTED]
    points, own = truth.position.reshape(-1, 3)[rows] - rays.origin, truth.triangle.ravel()[rows]
    tested = AimedLight(light, rays.origin).receivers(rays, own, points, truth.normal.reshape(-1, 3)[rows], False)
    reach = rays.size + float(np.abs(getattr(light, "position", rays.origin) - rays.origin).max())
    dark = (
        blocked(rays, light, own, tested.points, distance_bound(rays.size, reach), tested.lifted) & rays.receives[own]
    )
    dark |= ~tested.open_to(AimedLight(light, rays.origin).towards(tested.points)[0])
    result = np.zeros(disputed.shape, dtype=bool)
    result.ravel()[rows] = (frame.visibility[0].ravel()[rows] > 0.5) == dark
    return result
