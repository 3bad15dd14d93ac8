"""Filter: the base class of all shadow techniques, with every property that other modules need."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.core.spelling import Spelled
from glshadow.errors import SettingsError

Compare = Callable[[NDArray[np.int64], Array], Array]
"""(texel (N, 2), from the corner of its tile; position (N, 2) where the receiver's plane is evaluated, texels from the receiver) ->
result (K, N) of the comparison, 1 = lit, in K versions."""


class Needs(Enum):
    """What a filter needs for a light; `glshadow.gl.techniques` provides it."""

    COMPARISON = "comparison"  # whether a receiver is in front of or behind what a shadow map stores
    MOMENTS = "moments"  # prefiltered means of functions of depth
    DIRECTIONS = "directions"  # such comparisons in one map for each of many directions
    TRIANGLES = "triangles"  # the scene's triangles: no shadow map


class Filter(Spelled):
    """Shadow technique for one receiver. Each technique is a subclass in a file of its own.

    Attributes
    ----------
    needs : Needs
    resolution : int
        Texels along each side of a map, if the light does not say.
    snippet : str
        GLSL file for the slot <filter> of a light with a shadow map; empty for filters without one.
    encoding, channels : str, int
        What a prefiltered map stores of a depth, and in how many channels; empty for filters that compare.
    summary : str
        A short description for help and tables.
    source : str
        Authors and year of publication.
    fails : str
        Known artefacts, for tables.
    """

    needs: ClassVar[Needs]
    resolution: ClassVar[int] = 2048
    snippet: ClassVar[str] = ""
    encoding: ClassVar[str] = ""
    channels: ClassVar[int] = 0
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""
    fails: ClassVar[str] = ""

    @property
    def radius(self) -> float:
        """Half the width of the soft edge, in texels: within it, measured errors belong to the edge."""
        return 0.0

    @property
    def points_of_light(self) -> int:
        """Number of sample points on a light that has a size. 0: the filter supports only point lights."""
        return 0

    @property
    def obeys_size(self) -> bool:
        """Whether a light that has a size gets a soft shadow."""
        return self.points_of_light > 0

    @property
    def dithers(self) -> bool:
        """Whether the light's sample points are rotated from pixel to pixel."""
        return False

    @property
    def interpolates(self) -> bool:
        """Whether the light's sample points are tested at some pixels only, and interpolated between them."""
        return False

    @property
    def reads_depths(self) -> bool:
        """Whether it reads stored depths, not only the results of comparisons."""
        return False

    @property
    def of_a_point(self) -> Filter:
        """The filter for each sample point of the light."""
        return self

    def check_light(self, name: str) -> None:
        """Raise SettingsError if the filter does not serve lights of a kind that one direction or position describes."""

    def of_scene(self, triangles: int, per_channel: bool = False) -> Filter:
        """The filter for a scene whose casters have this many triangles. `per_channel`: of a light that differs by channel."""
        return self

    @property
    def slack_texels(self) -> float:
        """How far, in texels per axis, the sampled texel may be from where the plane is evaluated."""
        return 0.0

    @property
    def reach_texels(self) -> float:
        """How far from the receiver's own position the filter reads, in texels per axis."""
        return 0.0

    @property
    def has_map(self) -> bool:
        """Whether the filter uses a shadow map, and thus resolution, bias, target and clip."""
        return self.needs is not Needs.TRIANGLES

    def defines(self) -> Mapping[str, int | str]:
        """Defines of its snippet."""
        return {}

    def visibility(self, position: Array, compare: Compare) -> Array:
        """Visibility: the float64 twin of its snippet.

        Parameters
        ----------
        position : (N, 2) float64
            Receivers on the map, texels from the corner of its tile: (0.5, 0.5) is the centre of texel [0, 0].
        compare : Compare

        Returns
        -------
        (K, N) float64
        """
        raise SettingsError(f"{self} does not compare depths")

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Settings that together cover every variant of its shader."""
        return (cls(),)

    @classmethod
    def rungs(cls) -> tuple[Self, ...]:
        """Settings that a plan tries, cheapest first."""
        return (cls(),)

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """Settings that a study tries."""
        return cls.rungs()

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Settings that studies and plans also try, for lights that have a size."""
        return ()

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """Settings that must not show an artefact in the hard cases."""
        return (cls(),)


class StudiedFilter(Filter):
    """Base of filters for studies only: plans leave them out because another filter is as accurate at lower cost. See `fails`."""

    @classmethod
    def rungs(cls) -> tuple[Self, ...]:
        """None."""
        return ()

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """The default settings."""
        return (cls(),)

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """None."""
        return ()


class SizeFilter(Filter):
    """Base of filters for lights that have a size; tables and tests for all lights leave them out."""

    @property
    def obeys_size(self) -> bool:
        """Always true."""
        return True

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """None: no variant works with every light, bias and dialect."""
        return ()

    @classmethod
    def rungs(cls) -> tuple[Self, ...]:
        """None: see `soft`."""
        return ()

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """None: the hard cases use point lights."""
        return ()


def weighted(compare: Compare, terms: Any) -> Array:
    """Sum of weight (N,) x comparison over terms (weight, texel, position)."""
    total: Any = 0.0
    for weight, texel, place in terms:
        total = total + weight * compare(texel, place)
    return np.asarray(total)
