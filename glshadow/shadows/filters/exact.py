"""Exact: the triangles themselves are asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

from glshadow.core.setting import flag, setting, shown, whole
from glshadow.errors import SettingsError
from glshadow.shadows.filters.filter import Filter, Needs


@dataclass(frozen=True, init=False, repr=False)
class Exact(Filter):
    """No map: each receiver asks the triangles themselves, sorted by where they lie seen from the light. Needs no bias.

    The lists of triangles are built on the GPU where OpenGL 4.3 is, else on the CPU (`Used.why` says so); the picture is the same.

    A light that has a size is asked at many points of it: the share of the light that is seen, without noise.

    Parameters
    ----------
    light_samples : int
        Points of a light that has a size, 16 to 1024.
    dither : bool
        Turn them from pixel to pixel: noise instead of the steps of few points.

    References
    ----------
    Wyman, Hoetzlein, Lefohn 2015, "Frustum-Traced Raster Shadows: Revisiting Irregular Z-Buffers", I3D; Story 2015, "Hybrid
    Ray-Traced Shadows", GDC.
    """

    light_samples: int = setting(
        whole(16, 1024), 64, kw_only=True, help="points of a light that has a size, 16 to 1024"
    )
    dither: bool = setting(flag(), False)

    spelling = "exact"
    elsewhere = (
        "antialiasing belongs to the picture, all lights and silhouettes at once: render(..., samples=16), --samples 16"
    )
    terse = True
    needs = Needs.TRIANGLES
    summary = "no map: tests shadow rays against the triangles"
    source = "Wyman, Hoetzlein, Lefohn 2015"
    fails = "long lists where hundreds of slivers share a cell; without OpenGL 4.3 the CPU builds the lists"

    def __repr__(self) -> str:
        usual = type(self)()
        said = [
            f"{name}={getattr(self, name)}"
            for name in ("light_samples", "dither")
            if getattr(self, name) != getattr(usual, name)
        ]
        return f"Exact({', '.join(said)})"

    @property
    def points_of_light(self) -> int:
        """As many as was said."""
        return self.light_samples

    @property
    def dithers(self) -> bool:
        """As was said."""
        return self.dither

    def __init__(self, samples: Any = None, *, light_samples: int = 64, dither: bool = False) -> None:
        if samples is not None:
            raise SettingsError(f"Exact takes no samples, got {shown(samples)}; {self.elsewhere}")
        object.__setattr__(self, "light_samples", light_samples)
        object.__setattr__(self, "dither", dither)
        self.__post_init__()

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Fewer points than usual, and more."""
        return (cls(light_samples=16), cls(light_samples=256))
