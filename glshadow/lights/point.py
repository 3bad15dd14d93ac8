"""PointLight: light from a position in every direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from glshadow.core.spelling import vector
from glshadow.lights.light import Gizmo
from glshadow.lights.local import SphereLight


@dataclass(frozen=True, kw_only=True)
class PointLight(SphereLight):
    """Light from a position in every direction; parameters as for SpotLight."""

    spelling: ClassVar[str] = "point"
    usage: ClassVar[str] = "point:x,y,z"
    summary: ClassVar[str] = "every direction; radius, range and falloff as for spot"
    by_place: ClassVar[tuple[str, ...]] = ("position",)
    places: ClassVar[tuple[int, int]] = (1, 1)
    snippet: ClassVar[str] = "light/point.glsl"

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Read the position."""
        return {"position": vector(texts[0])}

    def gizmo(self, size: float, far: float) -> Gizmo:
        """Three lines along the world's axes."""
        return Gizmo(arms(np.asarray(self.position), size), rays=8)


def arms(place: np.ndarray[Any, np.dtype[np.float64]], size: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Segments (3, 2, 3) along the world's axes through a position (3,), for a scene of a size."""
    return np.asarray(place + 0.03 * size * np.stack([np.eye(3), -np.eye(3)], axis=1))
