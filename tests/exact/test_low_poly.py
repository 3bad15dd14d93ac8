"""Random scenes of few triangles against float64 rays: no caster of a visible shadow may be culled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.core.cameras import Camera
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

from ..tracer import Tracer, View, pixel_rays, scene_triangles
from .low_poly import camera, light, low_poly_scene

SIZE = (48, 32)
BAND = 1.0 / 64.0
"""Pixels: four times the distance by which GL moves a vertex. A pixel is skipped if its centre ray and four at that distance differ."""

Bools = NDArray[np.bool_]


def seen_from(view: View, each: Light) -> NDArray[np.float32]:
    """Float64 visibility (H, W) of a light without size."""
    if isinstance(each, gs.DirectionalLight):
        return view.visibility(towards=-np.asarray(each.direction))
    return view.visibility(position=each.position)


def in_cone(view: View, each: Light) -> Bools:
    """Pixels (H, W) whose surface lies in a spot light's cone."""
    result = np.ones(view.size[::-1], dtype=bool)
    if isinstance(each, gs.SpotLight):
        away = view.points - np.asarray(each.position)
        cosine = away @ np.asarray(each.direction) / np.linalg.norm(away, axis=1)
        result.ravel()[view.rows] = cosine > np.cos(np.radians(each.outer_angle)) + 1e-6
    return result


def stable_pixels(
    scene: Scene, viewer: Camera, near: float, lights: list[Light]
) -> tuple[NDArray[np.int32], list[Bools], list[View]]:
    """Triangles (H, W) at the pixel centres, for each light where all five rays agree, and the five views, the centre's first."""
    tracer = Tracer(scene_triangles(scene)[0])
    views = []
    for x, y in ((0.0, 0.0), (-BAND, -BAND), (BAND, -BAND), (-BAND, BAND), (BAND, BAND)):
        offset = (0.5 + x, 0.5 + y)
        origins, directions = pixel_rays(viewer, SIZE, offset)
        triangle, _ = tracer.trace(origins, directions, least=near)
        views.append(View(scene, viewer, SIZE, offset, triangle, tracer))
    triangles = np.stack([view.triangle.reshape(SIZE[::-1]) for view in views])
    same = (triangles == triangles[0]).all(axis=0)
    stable = []
    for each in lights:
        seen = np.stack([seen_from(view, each) for view in views])
        stable.append(same & (seen == seen[0]).all(axis=0) & in_cone(views[0], each))
    return np.where(same, triangles[0], -2), stable, views


def check(renderer: Renderer, seed: int) -> int:
    """Check one scene under three lights; returns how many pixels were compared."""
    rng = np.random.default_rng(seed)
    scene, viewer = low_poly_scene(rng), camera(rng)
    lights = [replace(light(rng), shadow=gs.Shadow(filter=gs.Exact())) for _ in range(3)]
    frame = renderer.render(scene, viewer, lights, SIZE, outputs=("visibility", "triangle"), samples=1)
    triangle, stable, views = stable_pixels(scene, viewer, frame.near, lights)
    wrong = int(((frame.triangle != triangle) & (triangle >= -1)).sum())
    assert wrong == 0, f"seed {seed}: {wrong} pixels show another triangle"
    for number, (each, where) in enumerate(zip(lights, stable, strict=True)):
        wrong = int((frame.visibility[number] != seen_from(views[0], each))[where].sum())
        assert wrong == 0, f"seed {seed}, {each}: {wrong} of {where.sum()} pixels"
    return sum(int(where.sum()) for where in stable)


@pytest.mark.filterwarnings("ignore:nothing is in view")
def test_no_shadow_is_missing(renderer: Renderer) -> None:
    assert sum(check(renderer, seed) for seed in range(40)) > 40_000


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.filterwarnings("ignore:nothing is in view")
def test_no_shadow_is_missing_in_460_more(renderer: Renderer) -> None:
    assert sum(check(renderer, seed) for seed in range(40, 500)) > 460_000


@pytest.mark.parametrize("low", [1e-2, 1e-3, 1e-5, 1e-6, 1e-7, 1e-8, 0.0, -1e-8])
def test_grazing_directional_light_decides_faces_by_the_exact_cosine(renderer: Renderer, low: float) -> None:
    """A directional light grazes a box's side. Lit: up to the edges, where float32 would let adjacent faces block. Dark: from behind."""
    box = Node(Mesh(*shapes.box((2.0, 2.0, 2.0))), np.eye(4), "box")
    ground = Node(Mesh(*shapes.rectangle((-9.0, -1.5, 9.0), (18.0, 0.0, 0.0), (0.0, 0.0, -18.0))), np.eye(4), "ground")
    scene = Scene((box, ground), gs.PerspectiveCamera((3.0, 3.0, 6.0), (0.0, 0.0, 0.0)))
    sun = gs.DirectionalLight(direction=(-1.0, -0.1, -low), shadow=gs.Shadow(filter=gs.Exact()))
    frame = renderer.render(scene, None, [sun], (160, 90), outputs=("visibility", "triangle"), samples=1)
    view = View(scene, scene.camera, (160, 90), triangle=frame.triangle)
    side = np.zeros((90, 160), dtype=bool)
    side.ravel()[view.rows] = view.normals[:, 2] > 0.5
    assert side.sum() > 500
    np.testing.assert_array_equal(frame.visibility[0][side], 1.0 if low > 0.0 else 0.0)
