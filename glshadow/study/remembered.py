"""A reference for studies: it caches its results, and traces rays for only a sample of very many pixels."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Self

import numpy as np

from glshadow.core.spaces import Array, Bools
from glshadow.reference.truth import Truth

# Pixels that one query traces, up to 48 rays each: two seconds. A good setting has fewer doubtful pixels at 1280 x 720. Bad settings
# have more, and the kinds of their wrong pixels are then known to about 1 / sqrt(SAMPLE).
SAMPLE = 8000


@dataclass(frozen=True, eq=False, repr=False)
class RememberedTruth(Truth):
    """Truth whose near_edge traces at most SAMPLE pixels; beyond that, each pixel takes the result of the nearest traced one.

    The sampled pixels depend on the query alone, not on earlier queries.
    """

    _answers: dict[tuple[int, bytes], tuple[Bools, Bools]] = field(default_factory=dict, repr=False)
    _sampled: list[int] = field(default_factory=list, repr=False)

    @classmethod
    def of(cls, truth: Truth) -> Self:
        """The same reference with a cache."""
        return cls(**{item.name: getattr(truth, item.name) for item in fields(Truth)})

    def sampled(self) -> bool:
        """Whether a result since the last call was based on a sample."""
        found = bool(self._sampled)
        self._sampled.clear()
        return found

    def near_edge(self, light: int, radius: Array | float, where: Bools | None = None) -> Bools:
        """As in Truth."""
        if where is None:
            return super().near_edge(light, radius, where)
        chosen = _sample(where)
        key = (light, np.asarray(radius, dtype=np.float64).tobytes())
        known, near = self._answers.setdefault(key, (np.zeros(where.shape, bool), np.zeros(where.shape, bool)))
        pending = chosen & ~known
        if pending.any():
            near |= super().near_edge(light, radius, pending)
            known |= pending
        if chosen is where:
            return np.asarray(near & where)
        from scipy.ndimage import distance_transform_edt

        self._sampled.append(int(where.sum()))
        row, column = distance_transform_edt(~chosen, return_distances=False, return_indices=True)
        return np.asarray(near[row, column] & where)


def _sample(where: Bools) -> Bools:
    """`where` itself, or SAMPLE of its pixels: those with the least hashed index, so that different queries share pixels."""
    rows = np.flatnonzero(where)
    if len(rows) <= SAMPLE:
        return where
    scrambled = rows.astype(np.uint64) * np.uint64(2654435761) % np.uint64(1 << 32)  # Knuth's multiplicative hash
    order = np.argsort(scrambled, kind="stable")
    result = np.zeros(where.shape, dtype=bool)
    result.ravel()[rows[order[:SAMPLE]]] = True
    return result
