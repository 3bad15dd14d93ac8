"""DirectionMaps: many small shadow maps, one for each direction of a sky or environment light, sampled in one pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from glshadow.core.setting import optional, setting, whole
from glshadow.errors import SettingsError
from glshadow.shadows.filters.filter import Needs, SizeFilter

MOST = 256
"""Directions of a scene that is not large: their sum is within 0.004 of that of 1,024."""
LEAST = 32
FEW, OF_FEW = 1024, 1024
"""A sky over no more triangles than this has this many directions: on wide flat walls 256 of them show steps."""
TRIANGLES = 1 << 27
"""Triangles, counted once for each direction, that are drawn for a light unless the count is given."""


@dataclass(frozen=True)
class DirectionMaps(SizeFilter):
    """One small shadow map for each of many directions of a light, in one atlas; one pass samples them all.

    For a sky or environment light, or a directional light with an angle; the latter's penumbra is a mean over its maps, whose resolution
    should be a few hundred texels.

    Each pixel of a 2 x 2 block samples a quarter of the maps, of 1024 maps a sixteenth; visibility is the mean over the pixel and its
    neighbours on the same surface. Of a sky or environment what is near a receiver is tested by rays: all triangles of a scene of up to
    4,096, of others the large ones.
    The maps cover all casters, not what the camera sees: they are drawn again only if the scene or the light changes.

    Parameters
    ----------
    count : int, optional
        Directions, 1 to 1024. None: 256; fewer, but at least 32, for a scene of more than 520,000 triangles; 1024 of a sky over
        no more than 1,024 triangles.

    References
    ----------
    Pharr, Green 2004, "Ambient Occlusion", GPU Gems, chapter 17; Ritschel et al. 2008, "Imperfect Shadow Maps for Efficient Computation of
    Indirect Illumination", SIGGRAPH Asia: many small maps in one texture; Keller, Heidrich 2001, "Interleaved Sampling", EGRW.
    """

    count: int | None = setting(optional(whole(1, 1024)), None, help="directions, 1 to 1024")

    spelling = "directionmaps"
    needs = Needs.DIRECTIONS
    snippet = "lib/directionmaps.glsl"
    summary = "COUNT small maps of the directions of a sky, an environment or a wide sun, sampled in one pass"
    source = "Pharr, Green 2004"
    fails = "loses what is smaller than a texel, 1/128 of the scene"
    resolution = 128

    @property
    def points_of_light(self) -> int:
        """`count`, or the most of it."""
        return self.count or MOST

    def check_light(self, name: str) -> None:
        """Refuses all but a directional light that has a size, which does not call this."""
        raise SettingsError(
            f"{self!r} is for light from many directions, that of SkyLight, EnvironmentLight and DirectionalLight(angle=): for another "
            f"{name} use Exact() or LightSamples()"
        )

    def of_scene(self, triangles: int, per_channel: bool = False) -> Self:
        """With `count`, or a multiple of four that suits the scene. `per_channel`: the light is an image."""
        if self.count is not None:
            return self
        if triangles <= FEW and not per_channel:
            return type(self)(OF_FEW)
        return type(self)(min(max(TRIANGLES // max(triangles, 1) // 4 * 4, LEAST), MOST))
