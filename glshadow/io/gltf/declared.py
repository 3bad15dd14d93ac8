"""Notes vertices that are far outside the range that a glTF file declares."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array
from glshadow.io.gltf.document import Document


def check_declared(document: Document, accessor: int, positions: Array, where: str) -> None:
    """Note coordinates far outside the accessor's own min and max: a sign of data read from a wrong offset."""
    given = document.item("accessors", accessor, where)
    try:
        low, high = (np.asarray(given[key], dtype=np.float64) for key in ("min", "max"))
    except (KeyError, TypeError, ValueError):
        return
    if (
        low.shape != (3,)
        or high.shape != (3,)
        or given.get("normalized")
        or not np.isfinite([*low, *high]).all()
        or not np.isfinite(positions).all()
    ):
        return
    slack = 1e-3 * float(np.abs([low, high]).max()) + float((high - low).max())
    outside = int(((positions < low - slack) | (positions > high + slack)).any(axis=1).sum())
    if outside:
        document.notes.append(
            f"{where}: {outside} of {len(positions)} vertices are far outside the range {low.tolist()} to "
            f"{high.tolist()} that the file declares"
        )
