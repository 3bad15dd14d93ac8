"""Used: the settings that were really used for one light's shadow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from glshadow.core.spaces import ClipSpace
from glshadow.shadows.bias import Bias
from glshadow.shadows.filters import Filter
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces
from glshadow.shadows.view import ShadowView


@dataclass(frozen=True)
class Used:
    """The settings that were really used for one light, every None resolved.

    Parameters
    ----------
    views : tuple of ShadowView
        Matrices, window, near and far, tile; empty for a light that casts nothing or lights nothing visible.
    why : str
        Reason of the filter's choice.
    filter, bias, target, clip, faces
        As in Shadow. None throughout for a light without a shadow; faces None: back faces culled for closed meshes.
    draws : int
        Meshes drawn into its maps in this frame.
    links : int
        Exact: entries of the light's triangle lists.
    fallbacks : tuple of str
        Every request that could not be met, with its reason.
    """

    views: tuple[ShadowView, ...] = ()
    filter: Filter | None = None
    bias: Bias | None = None
    target: Target | None = None
    clip: ClipSpace | None = None
    faces: Faces | None = None
    draws: int = 0
    fallbacks: tuple[str, ...] = ()
    links: int = 0
    why: str = ""

    @property
    def texel(self) -> tuple[float, float] | None:
        """Size of a texel of the first view: world units for a directional light, tangents (at distance 1) otherwise."""
        return self.views[0].texel if self.views else None

    def as_dict(self) -> dict[str, Any]:
        """As JSON-compatible values."""
        return {
            "filter": repr(self.filter),
            "why": self.why,
            "bias": repr(self.bias),
            "target": self.target.value if self.target else None,
            "clip": str(self.clip) if self.clip else None,
            "faces": self.faces.value if self.faces else "auto",
            "draws": self.draws,
            "links": self.links,
            "fallbacks": list(self.fallbacks),
            "views": [
                {
                    "face": view.face,
                    "tile": list(view.tile),
                    "resolution": view.resolution,
                    "window": list(view.window),
                    "near": view.near,
                    "far": view.far,
                    "texel": list(view.texel),
                    "clip_from_world": view.clip_from_world.tolist(),
                }
                for view in self.views
            ],
        }
