"""What glossy surfaces reflect of an image of the surroundings: the image filtered for each roughness, in float64.

The reflected light is approximated by a product of two integrals (Karis 2013, "Real Shading in Unreal Engine 4", SIGGRAPH courses): the
image, averaged by the lobe of a surface that is seen along its normal, and the albedo of the lobe. Exact in uniform light.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from glshadow.core.equirectangular import solid_angles, vectors
from glshadow.core.spaces import Array
from glshadow.lights.reflection import LEAST_ROUGHNESS, split_albedo_table
from glshadow.lights.table import LightTable

LEVELS = 8
"""Of roughness, from 0 to 1."""


def filtered(sharp: Array, rest: Array, aims: Array, fluxes: Array) -> Array:
    """Images (LEVELS, H + 1, W, 3) of directions from the zenith to the nadir, those of both included, and from +z over +x.

    Parameters
    ----------
    sharp, rest : (H, W, 3) float64
        The image; the same without its bright texels.
    aims, fluxes : (N, 3) float64
        Directions to the bright texels; their radiance times their solid angles.
    """
    height, width = sharp.shape[:2]
    down, around = np.pi * np.arange(height + 1) / height, 2.0 * np.pi * np.arange(width) / width - np.pi
    nodes = vectors(np.cos(down)[:, None], np.sin(down)[:, None], around)
    beside = 0.5 * (sharp + np.roll(sharp, 1, axis=1))  # at the corners of texels, as the nodes are
    upper, lower = np.concatenate([beside[:1], beside]), np.concatenate([beside, beside[-1:]])
    levels = [0.5 * (upper + lower)]
    spectra = np.fft.rfft(rest * solid_angles(rest.shape)[:, None, None], axis=1)
    weights = np.fft.rfft(np.broadcast_to(solid_angles(rest.shape)[:, None], rest.shape[:2]), axis=1)
    middle = np.pi * (np.arange(height) + 0.5) / height
    turn = np.cos(2.0 * np.pi * (np.arange(width) - 0.5) / width)
    for level in range(1, LEVELS):
        alpha = max(level / (LEVELS - 1), LEAST_ROUGHNESS) ** 2
        sums, norms = [], []
        for each in down:
            cosine = np.cos(each) * np.cos(middle)[:, None] + np.sin(each) * np.sin(middle)[:, None] * turn
            lobe = np.fft.rfft(_lobe(alpha, cosine), axis=1)
            sums.append(np.einsum("rk,rkc->kc", lobe, spectra))
            norms.append((lobe * weights).sum(axis=0))
        norm = np.fft.irfft(np.array(norms), n=width, axis=1)
        image = np.maximum(np.fft.irfft(np.array(sums), n=width, axis=1), 0.0)
        for aim, flux in zip(aims, fluxes, strict=True):
            image += _lobe(alpha, nodes @ aim)[..., None] * flux
        levels.append(image / norm[..., None])
    found = np.array(levels)
    found[:, [0, -1]] = found[:, [0, -1]].mean(axis=2, keepdims=True)
    return found


def _lobe(alpha: float, cosine: Array) -> Array:
    """GGX of half vectors between a normal and a direction at this cosine, times the cosine; not normalised."""
    half = 0.5 + 0.5 * cosine  # its cosine, squared
    return np.asarray(np.maximum(cosine, 0.0) * (alpha / (half * (alpha * alpha - 1.0) + 1.0)) ** 2)


@cache
def split_table() -> LightTable:
    """The split albedo as a texture: columns by the cosine to the eye, rows by roughness."""
    table = split_albedo_table()
    return LightTable(np.concatenate([table, np.zeros_like(table[..., :1])], axis=-1).astype(np.float32))
