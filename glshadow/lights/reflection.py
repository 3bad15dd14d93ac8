"""How materials reflect light from one direction: Lambert's law and GGX, as of glTF 2.0, in float64. Twin: glsl/lib/reflection.glsl

The microfacets' distribution is GGX (Walter et al. 2007, equation 33), their shadowing Smith's, of both directions together (Heitz 2014),
their Fresnel term Schlick's: glTF 2.0, appendix B. What one bounce between them loses is made up for by a factor (Turquin 2019, "Practical
Multiple Scattering Compensation for Microfacet Models", equation 16), so that a white metal in a uniform surrounding is white at any
roughness.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from glshadow.core.spaces import Array

LEAST_ROUGHNESS = 0.045
"""Below it the highlight of a light without size would be too small to be seen; as Filament and three.js have it."""
DIELECTRIC = 0.04
"""Reflectance at normal incidence of what is not metallic: an index of refraction of 1.5."""
_POINTS = 32  # along the radius and the turn of the disc
TABLE = 32
"""Rows and columns of `albedo_table`."""


def reflected(color: Array, metallic: Array, roughness: Array, normal: Array, to_eye: Array, to_light: Array) -> Array:
    """Light that surfaces send to the eye, relative to that of a light of the same strength which a white matte surface faces.

    Parameters
    ----------
    color : (..., 3) float64
        Base colour, linear.
    metallic, roughness : (...) float64
    normal, to_eye, to_light : (..., 3) float64
        Unit vectors.

    Returns
    -------
    (..., 3) float64
    """
    rough = np.maximum(roughness, LEAST_ROUGHNESS)
    cos_light = np.maximum(_dot(normal, to_light), 0.0)
    cos_eye = np.maximum(_dot(normal, to_eye), 0.0)
    half = to_eye + to_light
    half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-30)
    square = rough**4
    base = DIELECTRIC + (color - DIELECTRIC) * metallic[..., None]
    grazing = (1.0 - np.clip(_dot(to_eye, half), 0.0, 1.0))[..., None] ** 5
    single = np.pi * _distribution(square, normal, half) * _shadowing(square, cos_light, cos_eye)
    lost = 1.0 / albedo(rough, cos_eye) - 1.0
    specular = (base + (1.0 - base) * grazing) * (1.0 + base * lost[..., None]) * single[..., None]
    diffuse = color * (1.0 - metallic[..., None]) * (1.0 - DIELECTRIC - (1.0 - DIELECTRIC) * grazing)
    return np.asarray((diffuse + specular) * cos_light[..., None])


def albedo(roughness: Array, cosine: Array) -> Array:
    """Share of uniform light that one bounce at perfectly reflecting microfacets returns, interpolated in `albedo_table`."""
    table, last = albedo_table(), TABLE - 1
    row, column = np.clip(roughness, 0.0, 1.0) * last, np.clip(cosine, 0.0, 1.0) * last
    i, j = np.minimum(row.astype(np.int64), last - 1), np.minimum(column.astype(np.int64), last - 1)
    f, g = row - i, column - j
    low = table[i, j] * (1.0 - g) + table[i, j + 1] * g
    high = table[i + 1, j] * (1.0 - g) + table[i + 1, j + 1] * g
    return np.asarray(low * (1.0 - f) + high * f)


@cache
def albedo_table() -> Array:
    """(TABLE, TABLE) float64: the albedo by roughness and by the cosine to the eye, both from 0 to 1."""
    return np.asarray(split_albedo_table().sum(axis=-1))


@cache
def split_albedo_table() -> Array:
    """(TABLE, TABLE, 2) float64: factor of the reflectance at normal incidence and what is added to it (Karis 2013); the sum is the albedo.

    An integral over half vectors by the visible share of the distribution: with the normals that the eye sees (Heitz 2018), what is left to
    average is the light's shadowing given the eye's.
    """
    cosine = np.maximum(np.linspace(0.0, 1.0, TABLE), 1e-3)[:, None, None]
    grazing = (1.0 - cosine[:, 0, 0]) ** 5
    table = np.tile(np.stack([1.0 - grazing, grazing], axis=-1), (TABLE, 1, 1))
    middle = (np.arange(_POINTS) + 0.5) / _POINTS
    # the wide tail of the distribution is at the rim of the disc, where the radii are therefore dense
    inwards = 1.0 - middle
    radius, weight = np.sqrt(1.0 - inwards**4)[:, None], (4.0 * inwards**3)[:, None]
    turn = np.pi * middle[None, :]  # half the disc: the other half mirrors it
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    for i in range(1, TABLE):
        alpha = max(i / (TABLE - 1), LEAST_ROUGHNESS) ** 2
        half = _visible_normals(alpha, cosine, x, y)
        toward = half[0] * np.sqrt(1.0 - cosine**2) + half[2] * cosine
        down = 2.0 * toward * half[2] - cosine  # the light's cosine
        eye, light = _lambda(alpha, cosine), _lambda(alpha, np.maximum(down, 1e-9))
        share = np.where(down > 0.0, weight * (1.0 + eye) / (1.0 + eye + light), 0.0)
        added = share * (1.0 - np.clip(toward, 0.0, 1.0)) ** 5
        table[i] = np.stack([(share - added).mean(axis=(1, 2)), added.mean(axis=(1, 2))], axis=-1)
    return table


def _visible_normals(alpha: float, cosine: Array, x: Array, y: Array) -> Array:
    """Half vectors (3, ...) by the share in which an eye at this cosine sees them, from points of a disc (Heitz 2018, listing 1)."""
    side, up = alpha * np.sqrt(1.0 - cosine**2), cosine
    length = np.hypot(side, up)
    side, up = side / length, up / length  # the eye's direction over the stretched surface; across it lies the y axis
    share = 0.5 * (1.0 + up)
    along = (1.0 - share) * np.sqrt(np.maximum(1.0 - y * y, 0.0)) + share * x
    out = np.sqrt(np.maximum(1.0 - along * along - y * y, 0.0))
    found = np.stack(
        [
            alpha * (out * side - along * up),
            np.broadcast_to(alpha * y, out.shape),
            np.maximum(out * up + along * side, 0.0),
        ]
    )
    return np.asarray(found / np.sqrt((found * found).sum(axis=0)))


def _lambda(alpha: float, cosine: Array) -> Array:
    """Smith's function of GGX."""
    tangent2 = 1.0 / (cosine * cosine) - 1.0
    return np.asarray(0.5 * (np.sqrt(1.0 + alpha * alpha * tangent2) - 1.0))


def _distribution(square: Array, normal: Array, half: Array) -> Array:
    """GGX, with the sine by a cross product: one minus the squared cosine would cancel in a narrow highlight."""
    across = np.cross(normal, half)
    return np.asarray(square / (np.pi * (_dot(across, across) + square * _dot(normal, half) ** 2) ** 2))


def _shadowing(square: Array, cos_light: Array, cos_eye: Array) -> Array:
    """Smith's height-correlated term, divided by four times both cosines."""
    eye = cos_light * np.sqrt(square + (1.0 - square) * cos_eye**2)
    light = cos_eye * np.sqrt(square + (1.0 - square) * cos_light**2)
    return np.asarray(0.5 / np.maximum(eye + light, 1e-6))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-1))
