"""Visibility from the GPU against the float64 twin, every pixel, on maps of 3 x 3 to 64 x 64 texels.

The twin computes the minimum and the maximum visibility that limited precision allows. Every pixel must lie between,
and almost everywhere the two are the same number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.spaces import CLIP_SPACES, Array, ClipSpace
from glshadow.frame import Frame
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.bias import (
    Bias,
    ClipBias,
    ConstantBias,
    NoBias,
    NormalOffsetBias,
    ReceiverPlaneBias,
    SlopeScaledBias,
)
from glshadow.shadows.filters import Filter, Hard, Pcf
from glshadow.shadows.fits import SceneFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, Shadow
from scripts.shaders.variants import MAPPED

from .. import model
from ..pairwise import every_pair
from ..tolerances import WEIGHT, precision

SIZE = (72, 54)
CAMERA = PerspectiveCamera(position=(1.4, 3.2, 3.2), target=(-0.1, 0.3, 0.0))
REACH = 12.0  # of the scene and the camera, world units
# a rotated disc is noise: its twin is the disc without rotation
FILTERS: tuple[Filter, ...] = tuple(each for each in MAPPED if not getattr(each, "rotate", False))
DERIVED, CASTER = ReceiverPlaneBias(), SlopeScaledBias(1.1, 4.0)
BIASES: tuple[Bias, ...] = (
    DERIVED,
    ConstantBias(0.08),
    NormalOffsetBias(1.5),
    ClipBias(0.02),
    ClipBias(0.02, caster=False),
    NoBias(),
)
KINDS = ("directional", "spot", "point")
DEPTH, METRIC = Target.DEPTH32F, Target.R32F


def named(value: Any) -> str:
    return value.value if isinstance(value, Target) else str(value)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A ground, a box that stands on it, and a tilted plate above."""
    plate = shapes.rectangle((-1.6, 1.1, 1.2), (1.3, 0.2, 0.1), (0.1, 0.3, -1.1))
    ground = shapes.rectangle((-2.5, 0.0, 2.5), (5.0, 0.0, 0.0), (0.0, 0.0, -5.0))
    solids = (ground, shapes.box((0.9, 1.3, 0.8), (0.5, 0.65, -0.4)), plate)
    return Scene(tuple(Node(Mesh(*solid), np.eye(4), f"part {i}") for i, solid in enumerate(solids)), CAMERA)


def light_of(kind: str, shadow: Shadow) -> Light:
    if kind == "directional":
        return DirectionalLight(direction=(-0.55, -0.8, 0.25), shadow=shadow)
    if kind == "spot":
        return SpotLight(position=(2.2, 3.8, -0.9), direction=(-0.5, -1.0, 0.2), outer_angle=48, shadow=shadow)
    # near is given: the derived one is so close that all window depths but reversed ones end within a few roundings of far
    return PointLight(position=(1.7, 2.9, -1.3), near=0.6, far=7.0, shadow=shadow)


def settings(resolution: int, kernel: Filter, bias: Bias, target: Target, **more: Any) -> Shadow:
    common = {"fit": SceneFit(), "faces": Faces.BOTH} | more
    return Shadow(resolution=resolution, filter=kernel, bias=bias, target=target, **common)


@pytest.fixture(scope="module")
def hits(scene: Scene) -> tuple[Array, Array, Array]:
    return model.first_hits(CAMERA, SIZE, triangles_of(scene))


def triangles_of(scene: Scene) -> Array:
    return np.concatenate([node.mesh.positions[node.mesh.triangles] for node in scene.nodes])


def surface(frame: Frame, hits: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Per pixel the world point (H, W, 3) on its triangle, the normal facing the camera, and whether it is certain."""
    triangles, (expected, which, border) = triangles_of(frame.scene), hits
    certain = ~border & np.isfinite(expected) & np.isfinite(frame.depth)
    depth = np.where(certain, frame.depth, 1.0).astype(np.float64)
    ray = pixel_rays(frame.camera, frame.size)
    points = np.asarray(frame.camera.position) + ray * depth[..., None]
    edges = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normal = normals[which]
    points -= normal * ((points - triangles[which, 0]) * normal).sum(axis=-1, keepdims=True)
    normal = np.where((normal * ray).sum(axis=-1, keepdims=True) > 0.0, -normal, normal)
    return points, normal, certain


Checker = Callable[[Light, float], None]


@pytest.fixture
def check(renderer: Renderer, scene: Scene, hits: tuple[Array, Array, Array]) -> Checker:
    return partial(_check, renderer, scene, hits)


def _check(
    renderer: Renderer, scene: Scene, hits: tuple[Array, Array, Array], light: Light, least_known: float
) -> None:
    frame = renderer.render(scene, lights=[light], size=SIZE, outputs=("visibility", "depth", "shadow_maps"), samples=1)
    used = frame.used[0]
    assert used.target is not None
    assert used.bias is not None
    assert used.filter is not None
    seen = frame.visibility[0].astype(np.float64)
    points, normals, certain = surface(frame, hits)
    assert certain.mean() > 0.6
    cosine = (normals * light.to_light(points)[0]).sum(axis=-1)
    assert (seen[certain & (cosine < -1e-6)] == 0.0).all()
    tested = certain & (cosine > 1e-4)
    assert not np.isnan(seen[tested]).any()
    allowed = precision(used.views[0].resolution, used.views[0].projection != "orthographic", REACH)
    if used.target is DEPTH and used.clip == ClipSpace(True, reversed=True):
        # floats round relative to their size, and 0 is far: the stored value bounds the error
        allowed = replace(allowed, stored=allowed.stored * float(frame.shadow_maps[0].max()))
    triangles = triangles_of(scene)
    if used.bias.certain:
        triangles = triangles[len(scene.nodes[0].mesh.triangles) :]  # the ground shadows nothing, and is not drawn
    stored = model.cast(used.views, triangles, used.target, used.bias, allowed)
    low, high = model.receive(stored, light, points[tested], normals[tested], used.filter, used.bias, allowed)
    found = seen[tested]
    slack = WEIGHT + 4.0 * allowed.texels  # a weight changes by as much as the position; two axes, two sides
    wrong = (found < low - slack) | (found > high + slack)
    assert not wrong.any(), (
        f"{wrong.sum()} of {wrong.size} pixels beyond the twin, worst {np.maximum(low - found, found - high).max():.3g}"
    )
    known = (high - low <= slack).mean()
    assert known >= least_known, f"the twin is certain of {known:.1%} of the pixels"
    if used.views[0].resolution > 8:
        assert found.min() < 1.0 - slack, "all is lit: the test shows nothing"


# Share of pixels for which the twin must be certain. Others sample a texel that a triangle's edge may or may not
# cover, or a comparison within rounding of a tie. Larger kernels and smaller maps meet more edges.
@pytest.mark.parametrize("kernel", FILTERS, ids=named)
# stored values do not depend on the kind of light: metrics with one kind only
@pytest.mark.parametrize(("kind", "target"), [*((kind, DEPTH) for kind in KINDS), (KINDS[1], METRIC)], ids=named)
def test_filters(check: Checker, kind: str, target: Target, kernel: Filter) -> None:
    check(light_of(kind, settings(64, kernel, DERIVED, target)), 0.5)


@every_pair(kind=KINDS, target=(DEPTH, METRIC), kernel=(Hard(), Pcf(1)), bias=BIASES)
def test_biases(check: Checker, kind: str, target: Target, kernel: Filter, bias: Bias) -> None:
    # without a bias a surface that faces the light is one single tie
    check(light_of(kind, settings(48, kernel, bias, target)), 0.4 if bias == NoBias() else 0.5)


@every_pair(kind=KINDS, target=(Target.DEPTH16, Target.DEPTH24, Target.DEPTH32F), clip=CLIP_SPACES)
def test_slope_scaled(check: Checker, kind: str, target: Target, clip: Any) -> None:
    # ties: 1.1 slopes are just short of what a bilinear tap needs
    check(light_of(kind, settings(64, Pcf(0), CASTER, target, clip=clip)), 0.4)


@every_pair(kind=KINDS, target=list(Target), clip=CLIP_SPACES)
def test_every_format_and_convention(check: Checker, kind: str, target: Target, clip: Any) -> None:
    check(light_of(kind, settings(32, Pcf(1), DERIVED, target, clip=clip)), 0.3)


@every_pair(kind=KINDS, target=(DEPTH, METRIC), kernel=(Hard(), Pcf(0), Pcf(1)), resolution=(3, 5, 8, 13, 33))
def test_tiny_maps(check: Checker, kind: str, target: Target, kernel: Filter, resolution: int) -> None:
    if kind == "point" and resolution < 2 * kernel.reach_texels + 1:
        resolution = 2 * int(kernel.reach_texels) + 1  # a smaller tile cannot hold the guard band of its neighbours
    light = light_of(kind, settings(resolution, kernel, ConstantBias(0.05), target))
    check(light, 0.3 if resolution > 8 else 0.05)


# how a texel is compared does not depend on the light, except for reversed depth
@pytest.mark.parametrize(
    ("kind", "kernel"), [*((KINDS[0], each) for each in FILTERS), *((kind, Pcf(1)) for kind in KINDS[1:])], ids=named
)
def test_all_comparison_paths_agree(renderer: Renderer, scene: Scene, kind: str, kernel: Filter) -> None:
    """Gathered raw depths, gathered comparisons and single comparisons give the same numbers, depth reversed or not."""
    context = renderer._context
    own = context.caps
    for clip in CLIP_SPACES[2:]:
        light = light_of(kind, settings(64, kernel, DERIVED, DEPTH, clip=clip))
        frames = []
        try:
            for change in ({}, {"software": False}, {"texture_gather": False}):
                context.caps = replace(own, **change)
                frames.append(renderer.render(scene, lights=[light], size=SIZE, samples=1))
        finally:
            context.caps = own
        for other in frames[1:]:
            # a sum of many taps may be taken in another order
            np.testing.assert_allclose(frames[0].visibility, other.visibility, rtol=0, atol=WEIGHT)
            np.testing.assert_array_equal(frames[0].image, other.image)
