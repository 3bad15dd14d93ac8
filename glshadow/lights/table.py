"""LightTable: numbers that a light's snippet reads from a texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LightTable:
    """A filtered texture, kept on the GPU as long as this object is alive.

    Parameters
    ----------
    texels : (H, W, 3) float32
        Row 0 is at v = 0.
    repeat : bool
        Whether columns repeat beyond the border; rows never do.
    """

    texels: NDArray[np.float32]
    repeat: bool = False
