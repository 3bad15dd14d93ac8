"""Alpha of textures in float64, as the twin of what the GPU samples for alpha tests."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array
from glshadow.scene.mesh import Material
from glshadow.scene.texture import NEAREST


def texture_alpha(material: Material, uv: Array) -> Array:
    """Alpha (N,) of a material's texture at uv (N, 2), level 0, wrapped and magnified as its sampler says, as OpenGL samples it."""
    assert material.texture is not None
    sampler, (height, width) = material.sampler, material.texture.shape[:2]
    alpha = material.texture[::-1, :, 3].astype(np.float64) / 255.0  # v points up
    column, row = uv[:, 0] * width, uv[:, 1] * height
    if sampler.magnify == NEAREST:
        x, y = np.floor(column).astype(np.int64), np.floor(row).astype(np.int64)
        return np.asarray(alpha[sampler.indices(y, height, 1), sampler.indices(x, width, 0)])
    column, row = column - 0.5, row - 0.5
    x, y = np.floor(column).astype(np.int64), np.floor(row).astype(np.int64)
    fx, fy = column - x, row - y
    x0, x1 = (sampler.indices(x + k, width, 0) for k in (0, 1))
    y0, y1 = (sampler.indices(y + k, height, 1) for k in (0, 1))
    low = alpha[y0, x0] * (1.0 - fx) + alpha[y0, x1] * fx
    high = alpha[y1, x0] * (1.0 - fx) + alpha[y1, x1] * fx
    return np.asarray(low * (1.0 - fy) + high * fy)
