"""Filter: what every technique says of itself, so that nothing else needs to know which there are."""

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
"""(texel (N, 2), from the corner of its tile; place (N, 2) where the receiver's plane is evaluated, texels from the receiver) -> outcome
(K, N) of the comparison, 1 = lit, in K versions."""


class Needs(Enum):
    """What a filter asks of a light; `glshadow.gl.techniques` has what provides it."""

    COMPARISON = "comparison"  # whether a receiver lies before or behind what a shadow map stores
    MOMENTS = "moments"  # means of something of depth, taken before it is asked
    TRIANGLES = "triangles"  # the triangles themselves: no map


class Filter(Spelled):
    """How one receiver is answered for. Each technique is one subclass, in a file of its own.

    Attributes
    ----------
    needs : Needs
    snippet : str
        What fills the slot <filter> of a light with a map; none for filters without one.
    encoding, channels : str, int
        What a map of means stores of a depth, and in how many numbers; none for filters that compare.
    summary : str
        In a few words, for help and tables.
    source : str
        Who published it.
    fails : str
        Where it fails, in a few words, for tables.
    """

    needs: ClassVar[Needs]
    snippet: ClassVar[str] = ""
    encoding: ClassVar[str] = ""
    channels: ClassVar[int] = 0
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""
    fails: ClassVar[str] = ""

    @property
    def radius(self) -> float:
        """Half the width of its soft edge, in texels: by how much measured errors belong to the edge."""
        return 0.0

    @property
    def points_of_light(self) -> int:
        """How many points of a light that has a size it asks; 0: it knows only points."""
        return 0

    @property
    def obeys_size(self) -> bool:
        """Whether a light that has a size gets a soft shadow."""
        return self.points_of_light > 0

    @property
    def dithers(self) -> bool:
        """Whether a light's points are to be turned from pixel to pixel."""
        return False

    @property
    def reads_depths(self) -> bool:
        """Whether it must know what a map stores, not only how it compares."""
        return False

    @property
    def of_a_point(self) -> Filter:
        """How each of these points is asked."""
        return self

    @property
    def slack_texels(self) -> float:
        """How far, in texels per axis, the map's sample may lie from where the plane is evaluated."""
        return 0.0

    @property
    def reach_texels(self) -> float:
        """How far from the receiver's own position the filter reads, in texels per axis."""
        return 0.0

    @property
    def has_map(self) -> bool:
        """Whether resolution, bias, target and clip mean anything to it."""
        return self.needs is not Needs.TRIANGLES

    def defines(self) -> Mapping[str, int | str]:
        """Defines of its snippet."""
        return {}

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The float64 twin of its snippet.

        Parameters
        ----------
        position : (N, 2) float64
            Receivers on the map, texels from the corner of its tile: (0.5, 0.5) is the centre of texel [0, 0].
        compare : Compare

        Returns
        -------
        (K, N) float64
        """
        raise SettingsError(f"{self} has no comparison of depths")

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Settings that together make every program text it has."""
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
        """Settings that a study and a plan try besides, for lights that have a size."""
        return ()

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """Settings of which the hard cases demand that they show no artefact."""
        return (cls(),)


class StudiedFilter(Filter):
    """Base of filters that a study shows and a plan does not need: another one is as right for less. See `fails`."""

    @classmethod
    def rungs(cls) -> tuple[Self, ...]:
        """None."""
        return ()

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """As usual."""
        return (cls(),)

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """None."""
        return ()


class SizeFilter(Filter):
    """Base of filters that are made for lights that have a size: what is done for all lights leaves them out."""

    @property
    def obeys_size(self) -> bool:
        """In one way or another."""
        return True

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """None that go with every light, bias and dialect."""
        return ()

    @classmethod
    def rungs(cls) -> tuple[Self, ...]:
        """None: see `soft`."""
        return ()

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """None: the hard cases' lights are points."""
        return ()


def weighted(compare: Compare, terms: Any) -> Array:
    """Sum of weight (N,) x comparison over terms (weight, texel, place)."""
    total: Any = 0.0
    for weight, texel, place in terms:
        total = total + weight * compare(texel, place)
    return np.asarray(total)
