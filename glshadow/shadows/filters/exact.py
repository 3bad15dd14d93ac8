"""Exact: shadow rays tested against the scene's triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

from glshadow.core.setting import flag, setting, shown, whole
from glshadow.errors import SettingsError
from glshadow.shadows.filters.filter import Filter, Needs


@dataclass(frozen=True, init=False, repr=False)
class Exact(Filter):
    """Tests each receiver's shadow ray against the triangles between it and the light. No shadow map, no bias.

    Triangles are sorted into per-cell lists as seen from the light. The lists are built on the GPU with OpenGL 4.3, otherwise on the CPU
    (`Used.why` reports it); the image is the same.

    For a light that has a size, many of its points are tested: the visible share of the light, without noise.

    Parameters
    ----------
    light_samples : int
        Points of a light that has a size, 16 to 1024.
    dither : bool
        Rotate the points from pixel to pixel: noise instead of the steps of few points.
    interpolate : bool
        Test the points at every second pixel of each second row, and interpolate between pixels on the same surface where they differ by
        at most a quarter of the light. A frame takes little more than half of the time; what is narrower than two pixels may be lost from a
        penumbra.

    References
    ----------
    Wyman, Hoetzlein, Lefohn 2015, "Frustum-Traced Raster Shadows: Revisiting Irregular Z-Buffers", I3D; Story 2015, "Hybrid
    Ray-Traced Shadows", GDC.
    """

    light_samples: int = setting(
        whole(16, 1024), 64, kw_only=True, help="points of a light that has a size, 16 to 1024"
    )
    dither: bool = setting(flag(), False)
    interpolate: bool = setting(flag(), False)

    spelling = "exact"
    elsewhere = "antialiasing is set for the whole image: render(..., samples=16), --samples 16"
    terse = True
    needs = Needs.TRIANGLES
    summary = "shadow rays tested against the triangles, no map"
    source = "Wyman, Hoetzlein, Lefohn 2015"
    fails = "slow where hundreds of slivers share a cell; without OpenGL 4.3 the CPU builds the lists"

    def __repr__(self) -> str:
        usual = type(self)()
        said = [
            f"{name}={getattr(self, name)}"
            for name in ("light_samples", "dither", "interpolate")
            if getattr(self, name) != getattr(usual, name)
        ]
        return f"Exact({', '.join(said)})"

    @property
    def points_of_light(self) -> int:
        """`light_samples`."""
        return self.light_samples

    @property
    def dithers(self) -> bool:
        """`dither`."""
        return self.dither

    @property
    def interpolates(self) -> bool:
        """`interpolate`."""
        return self.interpolate

    def __init__(
        self, samples: Any = None, *, light_samples: int = 64, dither: bool = False, interpolate: bool = False
    ) -> None:
        if samples is not None:
            raise SettingsError(f"Exact takes no samples, got {shown(samples)}; {self.elsewhere}")
        object.__setattr__(self, "light_samples", light_samples)
        object.__setattr__(self, "dither", dither)
        object.__setattr__(self, "interpolate", interpolate)
        self.__post_init__()

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Fewer light samples than the default, and more."""
        return (cls(light_samples=16), cls(light_samples=256))
