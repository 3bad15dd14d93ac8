"""Outputs of a frame, as one table: content, type, value where there is no surface, and channels in an EXR file."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.setting import one_of, several, shown
from glshadow.errors import SettingsError


class Of(Enum):
    """What an output describes: a pixel's mean, a pixel's centre, or the frame."""

    MEAN = "the mean over a pixel's samples"
    CENTRE = "the pixel's centre"
    FRAME = "the frame"


@dataclass(frozen=True)
class Output:
    """One output.

    Parameters
    ----------
    name : str
    of : Of
    dtype : numpy dtype, or None for an output that is not a single array
    shape : str
    holds : str
        One sentence on the content.
    nothing : str
        Value where there is no surface.
    channels : tuple of str
        Names in an EXR file; those of outputs per light are numbered.
    traced : bool
        Whether rays on the CPU find it, and not the GPU: "all" does not name it.
    """

    name: str
    of: Of
    dtype: Any
    shape: str
    holds: str
    nothing: str
    channels: tuple[str, ...] = ()
    traced: bool = False


OUTPUTS = (
    Output("image", Of.MEAN, np.uint8, "(H, W, 3)", "sRGB; (H, W, 4) with straight alpha over a transparent background", "background"),
    Output("visibility", Of.MEAN, np.float32, "(lights, H, W)", "share of the light that arrives: 1 lit, 0 occluded or facing away", "NaN",
           ("visibility",)),
    Output("linear", Of.MEAN, np.float32, "(H, W, 3)", "light, not exposed; (H, W, 4) premultiplied over a transparent background",
           "background, decoded", ("R", "G", "B", "A")),
    Output("alpha", Of.MEAN, np.float32, "(H, W)",
           "share of the samples that see a surface, what blends by its alpha; on a catcher, its shadow's share",
           "0", ("A",)),
    Output("transmittance", Of.CENTRE, np.float32, "(lights, H, W, 3)",
           "share of each light's red, green and blue that translucent casters let through to the surface; 1 where there are none", "NaN",
           ("transmittance.R", "transmittance.G", "transmittance.B")),
    Output("depth", Of.CENTRE, np.float32, "(H, W)", "distance along the camera's view direction", "infinity", ("Z",)),
    Output("depth_metric", Of.CENTRE, np.float32, "(H, W)", "(s z + min_z) / (min_z + max_z) of the camera", "1", ("depth_metric",)),
    Output("triangle", Of.CENTRE, np.int32, "(H, W)", "triangle index, counted over the scene's nodes in order", "-1", ("triangle",)),
    Output("node", Of.CENTRE, np.int32, "(H, W)", "index of the node in `scene.nodes`", "-1", ("node",)),
    Output("normal", Of.CENTRE, np.float32, "(H, W, 3)", "unit normal of the triangle's visible side, world axes", "NaN",
           ("N.X", "N.Y", "N.Z")),
    Output("position", Of.CENTRE, np.float64, "(H, W, 3)", "world coordinates of the surface", "NaN", ("P.X", "P.Y", "P.Z")),
    Output("blocker", Of.CENTRE, np.int32, "(lights, H, W)",
           "index in `scene.nodes` of the node that keeps each light's centre from the surface, the first from there; -1 lit", "-1",
           ("blocker",), traced=True),
    Output("blocker_distance", Of.CENTRE, np.float32, "(lights, H, W)", "from the surface to it, world units; infinity where lit", "NaN",
           ("blocker_distance",), traced=True),
    Output("shadow_maps", Of.FRAME, None, "per light (V, R, R)", "the shadow maps as stored", ""),
    Output("timings", Of.FRAME, None, "mapping", "seconds of each pass", ""),
)  # fmt: skip
NAMES = tuple(each.name for each in OUTPUTS)
DRAWN = tuple(each.name for each in OUTPUTS if not each.traced)
TRACED = tuple(each.name for each in OUTPUTS if each.traced)
CENTRES = tuple(each.name for each in OUTPUTS if each.of is Of.CENTRE and not each.traced)
ALL = "all"
FLOATS = ("linear", "depth", "visibility", "normal", "position", "node", "alpha")
"""Outputs that an .exr holds by default."""
STORED = tuple(each for each in DRAWN if each not in ("depth_metric", "shadow_maps", "timings"))
"""Outputs that an .npz holds by default."""


def holds_arrays(path: Path | None) -> bool:
    """Whether a frame's file holds its outputs as they are, and not an image to be looked at."""
    return path is not None and path.suffix.lower() in (".exr", ".npz")


def checked_outputs(outputs: Any) -> tuple[str, ...]:
    """Check the names of outputs: one name, several, or "all", which stands for what the GPU draws; others may be named beside it.

    Raises
    ------
    SettingsError
        For a name that is not in the table, or no names at all.
    """
    wanted = (outputs,) if isinstance(outputs, str) else outputs
    if isinstance(wanted, list | tuple) and any(isinstance(each, str) and each == ALL for each in wanted):
        wanted = [*DRAWN, *(each for each in wanted if each not in (ALL, *DRAWN))]
    try:
        names: tuple[str, ...] = several(one_of(*NAMES), "outputs")("outputs", wanted)
    except SettingsError:
        names = ()
    if not names:
        raise SettingsError(f'outputs must be some of {", ".join(NAMES)}, or "{ALL}", got {shown(outputs)}')
    return names
