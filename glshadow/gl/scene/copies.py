"""Nodes of a scene that coincide with others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.welding import welded

if TYPE_CHECKING:
    from glshadow.gl.scene.geometry import GpuScene


def copies_of(scene: GpuScene, matrices: Array) -> NDArray[np.bool_]:
    """Nodes (N,) that coincide with another one and need not be drawn, see `GpuScene.copies`."""
    copies = np.zeros(len(scene.nodes), dtype=bool)
    seen: set[tuple[object, ...]] = set()
    # only nodes whose box coincides with another's
    place = welded(matrices[:, :3, 3])
    crowded = np.bincount(place)[place] > 1
    order = np.argsort(scene.mesh_number, kind="stable")  # the first one drawn wins, as in the depth test
    for i in order[crowded[order]].tolist():
        gpu, node, casts = scene.meshes[i], scene.nodes[i], bool(scene.casts[i])
        if gpu.cut_out or scene.blends[i]:
            continue
        key = (gpu.shape, matrices[i].tobytes(), casts, node.receives, node.catches, gpu.closed, gpu.culls)
        copies[i] = key in seen
        seen.add(key)
    return copies
