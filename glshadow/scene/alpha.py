"""The range of a mesh's alpha, by which it blends, is opaque, or is not there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from glshadow.scene.mesh import Mesh


def alpha_range(mesh: Mesh) -> tuple[float, float]:
    """Bounds of a mesh's alpha: of factor, vertices and texture, each by itself; 1 and 1 unless its material blends."""
    material = mesh.material
    if material.alpha_mode.value != "BLEND":
        return 1.0, 1.0
    low = high = material.color[3]
    if mesh.colors is not None and len(mesh.triangles):
        used = np.zeros(len(mesh.positions), dtype=bool)
        used[mesh.triangles.ravel()] = True
        alphas = mesh.colors[used, 3]
        low, high = low * float(alphas.min()), high * float(alphas.max())
    if material.texture is not None and mesh.placed_uv is not None:
        texels = material.texture[..., 3]
        low, high = low * (int(texels.min()) / 255.0), high * (int(texels.max()) / 255.0)
    return low, high
