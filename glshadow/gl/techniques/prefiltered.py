"""Prefiltered: a light's moment shadow map, filtered before it is sampled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.derive.used import Used
from glshadow.gl.driver.context import GLContext
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.caster import Map
from glshadow.gl.passes.moments import Moments
from glshadow.gl.techniques.mapped import Mapped, stored_values


class Prefiltered(Mapped):
    """One light's shadow map and its prefiltered moments."""

    def __init__(self, context: GLContext) -> None:
        super().__init__(context)
        self._moments = Moments(context)
        self._depths: Map | None = None

    def update(self, frame: FrameContext) -> Used:
        """Draw the map and compute its moments."""
        used = super().update(frame)
        self._depths = self.map
        if self.map is not None:
            self.map = self._moments.filled(frame.programs, self.map)
        return used

    def stored(self) -> NDArray[np.float32]:
        """The map of depths from which the moments are computed."""
        return super().stored() if self._depths is None else stored_values(self._depths)

    def release(self) -> None:
        """Free the GPU memory."""
        self._moments.release()
        super().release()
