"""A truth that remembers: settings of one resolution and filter ask about nearly the same pixels."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.reference.trace import Truth

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RememberedTruth(Truth):
    """Answers near_edge from what it was asked before; the answers are Truth's own."""

    _answers: dict[tuple[int, bytes], tuple[Bools, Bools]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, truth: Truth) -> Self:
        """The same truth with a memory."""
        return cls(**{item.name: getattr(truth, item.name) for item in fields(Truth)})

    def near_edge(self, light: int, radius: Array | float, where: Bools | None = None) -> Bools:
        """As Truth's."""
        if where is None:
            return super().near_edge(light, radius, where)
        key = (light, np.asarray(radius, dtype=np.float64).tobytes())
        shape = self.triangle.shape
        known, near = self._answers.setdefault(key, (np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)))
        asked = where & ~known
        if asked.any():
            near |= super().near_edge(light, radius, asked)
            known |= asked
        return np.asarray(near & where)
