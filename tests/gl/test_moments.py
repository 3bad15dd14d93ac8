"""Prefiltered (moment) shadow maps against float64: their contents, and the visibility of every pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.core.spaces import Array, transform
from glshadow.gl.passes.readback import pixels
from glshadow.gl.techniques import Prefiltered
from glshadow.shadows.bias import FACET_SLOPE
from glshadow.shadows.filters.moments import MomentFilter, spread
from scripts.shaders import variants

from ..pairwise import mostly

SIZE = (240, 136)
SCENE = gs.scenes.courtyard()
LIGHTS: dict[str, gs.Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, 0.25)),
    "spot": gs.SpotLight(position=(2.2, 3.8, -0.9), direction=(-0.5, -1.0, 0.2), outer_angle=48),
    "point": gs.PointLight(position=(1.7, 2.9, -1.3)),
}
MOMENTS = [each for each in variants.MOMENTS if isinstance(each, MomentFilter)]
DTYPES = {"f4": np.float32, "f2": np.float16, "nu2": np.uint16}
PRECISIONS = {"f4": 2.0**-22, "f2": 2.0**-9, "nu2": 2.0**-15}
"""Relative error of a mean of (2 R + 1)^2 that is rounded after each of two passes; relative to the maximum (exp: to itself)."""


def rendered(
    renderer: gs.Renderer, kind: gs.Filter, light: gs.Light, resolution: int = 256
) -> tuple[gs.Frame, Prefiltered]:
    lamp = replace(light, shadow=gs.Shadow(filter=kind, resolution=resolution, fit=gs.SceneFit()))
    outputs = ("visibility", "position", "normal", "triangle", "shadow_maps")
    frame = renderer.render(SCENE, None, [lamp], SIZE, outputs=outputs, samples=1)
    source = renderer._cache.techniques[0, "Prefiltered"]
    assert isinstance(source, Prefiltered)
    return frame, source


def even_depth(view: gs.ShadowView, window: Array) -> Array:
    """Depth from 0 at near to 1 at far, from stored window depth by the projection's own matrix."""
    matrix = view.clip_from_view
    ndc = window if view.clip.zero_to_one else 2.0 * window - 1.0
    # ndc = (m22 z + m23) / (m32 z + m33)
    z = (matrix[2, 3] - ndc * matrix[3, 3]) / (ndc * matrix[3, 2] - matrix[2, 2])
    return np.clip((-z - view.near) / (view.far - view.near), 0.0, 1.0)


def box_filtered(kind: MomentFilter, depth: Array) -> Array:
    """(R, R, components): stored values averaged over the filter's box; clamped at the border."""
    stored = kind.encoded(depth.ravel()).reshape(*depth.shape, -1)
    padded = np.pad(stored, ((kind.radius,) * 2, (kind.radius,) * 2, (0, 0)), mode="edge")
    width = 2 * kind.radius + 1
    windows = np.lib.stride_tricks.sliding_window_view(padded, (width, width), axis=(0, 1))
    return np.asarray(windows.mean(axis=(-2, -1)))


def tile_of(renderer: gs.Renderer, source: Prefiltered, number: int) -> NDArray[np.float64]:
    """A view's tile of the prefiltered map (R, R, components), row 0 at v = 1."""
    assert source.map is not None
    view, texture = source.map.views[number], source.map.atlas.texture
    kind = source.map.filter
    assert isinstance(kind, MomentFilter)
    with renderer._context.drawing():
        whole = pixels(texture, DTYPES[kind.precision]).astype(np.float64)
    whole = whole / 65535.0 if kind.precision == "nu2" else whole
    x, y = view.tile
    return whole[len(whole) - y - view.resolution : len(whole) - y, x : x + view.resolution]


@pytest.mark.parametrize("name", list(LIGHTS))
@pytest.mark.parametrize("kind", MOMENTS, ids=str)
def test_map_holds_box_filtered_moments(renderer: gs.Renderer, kind: MomentFilter, name: str) -> None:
    frame, source = rendered(renderer, kind, LIGHTS[name])
    for number, view in enumerate(frame.used[0].views):
        depth = even_depth(view, frame.shadow_maps[0][number].astype(np.float64))
        expected = box_filtered(kind, depth)
        inner = np.s_[kind.radius : -kind.radius or None, kind.radius : -kind.radius or None]
        found, expected = tile_of(renderer, source, number)[inner], expected[inner]
        # exp's relative error: its exponent times the rounding of depth, a few 2^-24 that a local light's unprojection enlarges
        relative = PRECISIONS[kind.precision] + 180.0 * 2.0**-20
        scale = np.maximum(np.abs(expected), 1e-30) if "esm" in kind.spelling or "evsm" in kind.spelling else 1.0
        if kind.precision == "f2":
            scale = np.maximum(scale, 2.0**-14 / PRECISIONS["f2"])  # smaller values are stored in fewer bits
        assert (np.abs(found - expected) / scale).max() < relative


@pytest.mark.parametrize("name", ["sun", "spot"])
@pytest.mark.parametrize("kind", [each for each in MOMENTS if not each.mip_maps], ids=str)
def test_every_pixel_matches_float64(renderer: gs.Renderer, kind: MomentFilter, name: str) -> None:
    frame, source = rendered(renderer, kind, LIGHTS[name])
    view = frame.used[0].views[0]
    means = tile_of(renderer, source, 0)[::-1]
    seen = frame.triangle >= 0
    points = frame.position[seen].astype(np.float64)
    normals = frame.normal[seen].astype(np.float64) @ view.view_from_world[:3, :3].T
    local = transform(view.view_from_world, points)
    away = -local[:, 2]
    sun = name == "sun"
    xy = local[:, :2] if sun else local[:, :2] / away[:, None]
    texel = (xy - np.array([view.window[0], view.window[2]])) / np.array(view.texel)
    below = normals[:, 2] if sun else (normals * local).sum(axis=-1)
    slope = normals[:, :2] * np.array(view.texel) / below[:, None]  # of distance along the view, or of 1 / distance
    slope = slope if sun else -slope * away[:, None] ** 2
    per_unit = 1.0 / (view.far - view.near)
    guard = kind.reach_texels + 1.0
    inside = ((texel > guard) & (texel < view.resolution - guard)).all(axis=1) & (below * (1 if sun else -1) > 1e-2)
    inside &= LIGHTS[name].strength(points) > 1e-4  # beyond a cone visibility is 0
    base = np.floor(texel - 0.5).astype(int)
    f = texel - 0.5 - base
    base = np.clip(base, 0, view.resolution - 2)
    sampled = sum(
        (np.where(i, f[:, :1], 1.0 - f[:, :1]) * np.where(j, f[:, 1:], 1.0 - f[:, 1:]))
        * means[base[:, 1] + j, base[:, 0] + i]
        for i in (0, 1)
        for j in (0, 1)
    )
    deviation, extent = spread(kind.radius, slope * per_unit)
    facet = FACET_SLOPE * kind.reach_texels * max(view.texel)  # rise between facets under the derived bias
    own = np.minimum(((away - facet if sun else away * (1.0 - facet)) - view.near) * per_unit, 1.0)
    expected = kind.lit(own, np.asarray(sampled), deviation, extent)
    found = frame.visibility[0][seen].astype(np.float64)
    gap = np.abs(found - expected)[inside]
    assert inside.sum() > 1000
    assert ((expected > 0.02) & (expected < 0.98))[inside].sum() > 10
    # three depths may be in an order that a rounding decides
    assert np.quantile(gap, 0.98) < 0.02
    assert np.median(gap) < 1e-3


@pytest.mark.parametrize("kind", mostly([gs.Vsm(), gs.Evsm(), gs.Msm()], gs.Vsm(), gs.Msm()), ids=str)
def test_prefiltered_maps_of_light_samples(renderer: gs.Renderer, kind: gs.Filter) -> None:
    """One prefiltered map per sample point; a light without size gives the same result with and without sample points."""
    scene, sun = gs.scenes.box().scene, gs.DirectionalLight(angle=20.0)
    many = gs.Shadow(filter=gs.LightSamples(16, of=kind))
    frame = renderer.render(scene, None, [replace(sun, shadow=many)], SIZE, outputs=("visibility",), samples=1)
    truth = gs.trace(scene, None, [sun], SIZE, light_samples=64, samples=1)
    assert np.nanmean(np.abs(frame.visibility - truth.visibility)) < 2e-3
    one, plain = (
        renderer.render(
            scene, None, [gs.DirectionalLight(shadow=each)], SIZE, outputs=("visibility",), samples=1
        ).visibility
        for each in (many, gs.Shadow(filter=kind))
    )
    np.testing.assert_array_equal(one, plain)


@pytest.mark.parametrize(
    "kind", [gs.Esm(), gs.Vsm(), gs.Evsm(), gs.Msm(), gs.Msm(hausdorff=True), gs.Evsm(4), gs.Msm(4)], ids=str
)
def test_derived_bias_leaves_no_acne(renderer: gs.Renderer, kind: gs.Filter) -> None:
    """With every kind of light, and a low directional light: no pixel more than percentage-closer filtering has."""
    lights: tuple[gs.Light, ...] = (*LIGHTS.values(), gs.DirectionalLight(direction=(-0.9, -0.2, -0.3)))
    for light in lights:
        truth = gs.trace(SCENE, None, [light], SIZE, samples=1)
        acne = []
        for each in (kind, gs.Pcf(1)):
            lamp = replace(light, shadow=gs.Shadow(filter=each, resolution=512))
            acne.append(
                gs.measure(renderer.render(SCENE, None, [lamp], SIZE, outputs=("visibility",), samples=1), truth).acne
            )
        assert acne[0] <= acne[1]


def test_reused_map_keeps_its_moments(renderer: gs.Renderer) -> None:
    first, source = rendered(renderer, gs.Vsm(2), LIGHTS["sun"])
    assert source.map is not None
    texture = source.map.atlas.texture
    again, same = rendered(renderer, gs.Vsm(2), LIGHTS["sun"])
    assert same is source
    assert same.map is not None
    assert same.map.atlas.texture is texture
    assert again.used[0].draws == 0
    np.testing.assert_array_equal(again.visibility, first.visibility)
    # another light takes over the atlas, then the first returns
    rendered(renderer, gs.Vsm(2), LIGHTS["spot"])
    third, _ = rendered(renderer, gs.Vsm(2), LIGHTS["sun"])
    np.testing.assert_array_equal(third.visibility, first.visibility)


@pytest.mark.parametrize("kind", [gs.Evsm(), gs.Msm(), gs.Vsm(), gs.Esm()], ids=str)
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_scale_changes_nothing(renderer: gs.Renderer, kind: gs.Filter, scale: float) -> None:
    scene = SCENE
    camera = scene.camera
    assert isinstance(camera, gs.PerspectiveCamera)
    light = gs.SpotLight(
        position=(2.2, 3.8, -0.9), direction=(-0.5, -1.0, 0.2), shadow=gs.Shadow(filter=kind, resolution=256)
    )
    matrix = np.diag([scale, scale, scale, 1.0])
    nodes = tuple(gs.Node(node.mesh, matrix @ node.world_from_mesh, node.name) for node in scene.nodes)
    there = replace(
        camera,
        position=tuple(scale * np.array(camera.position)),
        target=tuple(scale * np.array(camera.target)),
    )
    lamp = replace(light, position=tuple((scale * np.array(light.position)).tolist()))
    usual = renderer.render(
        gs.Scene(scene.nodes), camera, [light], SIZE, outputs=("visibility",), samples=1
    ).visibility[0]
    other = renderer.render(gs.Scene(nodes), there, [lamp], SIZE, outputs=("visibility",), samples=1).visibility[0]
    both = ~np.isnan(usual) & ~np.isnan(other)
    gap = np.abs(usual - other)[both]
    assert np.quantile(gap, 0.995) < 0.01
