"""Smooth meshes: shadow and shading end at the same place, for every kind of light and filter, and no light leaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glshadow.core.cameras import PerspectiveCamera
from glshadow.lights import DirectionalLight, PointLight, RectLight, SpotLight
from glshadow.reference.points import count_points
from glshadow.reference.trace import trace
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.filters import Evsm, Pcf
from glshadow.shadows.shadow import Shadow

SIZE = (160, 120)
AIM = (-1.0, -0.6, -0.3)
PLACE = (2.5, 1.5, 0.75)
CAMERA = PerspectiveCamera((0.3, 0.2, 4.0), (0.0, 0.0, 0.0), fov_y=35.0)
LIGHTS = {
    "sun": DirectionalLight(direction=AIM),
    "spot": SpotLight(position=PLACE, direction=AIM, outer_angle=30.0),
    "point": PointLight(position=PLACE),
    "soft sun": DirectionalLight(direction=AIM, angle=3.0),
}
FILTERS = {"exact": None, "pcf": Pcf(1), "evsm": Evsm()}
PAIRS = [
    ("sun", "exact"),
    ("spot", "exact"),
    ("point", "exact"),
    ("soft sun", "exact"),
    ("sun", "pcf"),
    ("point", "pcf"),
    ("sun", "evsm"),
]


def _ball(subdivisions, sign=1.0):
    solid = shapes.icosphere(subdivisions, 1.0)
    return Mesh(*solid, normals=np.float32(sign) * shapes.vertex_normals(solid))


def _scene(*meshes, matrices=None):
    places = matrices or [np.eye(4)] * len(meshes)
    return Scene(tuple(Node(mesh, place, f"n{k}") for k, (mesh, place) in enumerate(zip(meshes, places, strict=True))))


def _sheet(lean):
    """A square in y = 0 whose vertex normals lean outwards."""
    points = np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]])
    normals = points * lean + np.array([0.0, 1.0, 0.0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(points, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), normals=normals.astype(np.float32))


@pytest.mark.parametrize("subdivisions", [1, 2, 3])
@pytest.mark.parametrize(("name", "technique"), PAIRS)
def test_smooth_ball_is_lit_where_its_shading_is(renderer, subdivisions, name, technique):
    """Nothing blocks the light of a convex body's lit side. Tolerance: 2 of 255 levels, for what filters round. Flat
    shadowing, with facets facing away where the shading does not, would be off by up to 82."""
    light = replace(LIGHTS[name], shadow=Shadow(filter=FILTERS[technique]))
    scene = _scene(_ball(subdivisions))
    frame = renderer.render(scene, CAMERA, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
    truth = trace(scene, CAMERA, [light], SIZE, surface=frame.triangle, samples=1)
    seen = truth.triangle >= 0
    cosine = truth.cosine[0][seen]  # of the interpolated normal, where the point is shaded
    below = np.sin(np.radians(0.5 * getattr(light, "angle", 0.0)))  # where part of the light is below the horizon
    whole = cosine > below
    assert (255.0 * cosine[whole] * (1.0 - frame.visibility[0][seen][whole])).max() <= 2.0
    assert frame.visibility[0][seen][cosine < -below - 1e-3].max() == 0.0


def test_inverted_normals_give_the_same_shadow(renderer):
    first, second = (
        renderer.render(_scene(_ball(1, sign)), CAMERA, [LIGHTS["sun"]], SIZE, outputs=("visibility",), samples=1)
        for sign in (1.0, -1.0)
    )
    np.testing.assert_array_equal(first.visibility, second.visibility)


def test_normals_averaged_over_right_angles_are_ignored(renderer):
    """A cube with averaged normals has the shadow of its flat faces."""
    positions, triangles = shapes.box((1.0, 1.2, 0.9))
    flat = Mesh(positions, triangles)
    smooth = Mesh(positions, triangles, normals=shapes.vertex_normals((positions, triangles)))
    seen = [
        renderer.render(_scene(mesh), CAMERA, [LIGHTS["point"]], SIZE, outputs=("visibility",), samples=1)
        for mesh in (flat, smooth)
    ]
    np.testing.assert_array_equal(seen[0].visibility, seen[1].visibility)


@pytest.mark.parametrize("name", ["sun", "soft sun"])
def test_no_light_passes_through_a_sheet(renderer, name):
    """Its interpolated normals face a light that is below it: an open sheet stays dark, because it blocks its own light."""
    light = replace(LIGHTS[name], direction=(-1.0, 0.15, 0.0))
    camera = PerspectiveCamera((0.0, 3.0, 2.0), (0.0, 0.0, 0.0), fov_y=40.0)
    frame = renderer.render(_scene(_sheet(-0.5)), camera, [light], SIZE, outputs=("visibility",), samples=1)
    assert np.nanmax(frame.visibility) == 0.0


def test_ball_behind_another_is_dark(renderer):
    """Including the facets at its terminator, whose shadow rays start outside of it."""
    before = np.diag([3.0, 3.0, 3.0, 1.0])
    before[:3, 3] = -8.0 * np.array(AIM) / np.linalg.norm(AIM)
    scene = _scene(_ball(1), _ball(1), matrices=[np.eye(4), before])
    for technique in FILTERS:
        light = replace(LIGHTS["sun"], shadow=Shadow(filter=FILTERS[technique]))
        frame = renderer.render(scene, CAMERA, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
        own = (frame.triangle >= 0) & (frame.triangle < 80)
        assert own.sum() > 1000
        assert frame.visibility[0][own].max() < 1e-3


def _crowd(seed):
    """Intersecting ellipsoids of few facets, and a sheet."""
    rng = np.random.default_rng(seed)
    meshes, places = [_sheet(0.5)], [np.diag([1.5, 1.0, 1.5, 1.0])]
    for _ in range(4):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        place = np.eye(4)
        place[:3, :3] = turn * rng.uniform(0.3, 0.9, 3)
        place[:3, 3] = rng.uniform(-0.9, 0.9, 3)
        meshes.append(_ball(int(rng.integers(0, 3))))
        places.append(place)
    return _scene(*meshes, matrices=places)


@pytest.mark.parametrize("name", [*LIGHTS, "panel"])
def test_smooth_shadows_match_rays(renderer, name):
    """Rounded surfaces that shadow each other match float64, except for one or two pixels: normals rounded to 16 bits
    and float32 sums may decide differently there."""
    rect = RectLight(position=PLACE, direction=AIM, width=0.6, height=0.6)
    light = LIGHTS.get(name, rect)
    for seed in (0, 1) if name in ("sun", "point") else (0,):
        scene = _crowd(seed)
        frame = renderer.render(scene, CAMERA, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
        assert frame.used[0].fallbacks == ()
        truth = trace(scene, CAMERA, [light], SIZE, surface=frame.triangle, samples=1)
        seen = truth.triangle >= 0
        if name == "soft sun":
            count = frame.used[0].filter.points_of_light
            apart = np.abs(count_points(truth, light, count) / count - frame.visibility[0])[seen]
            assert (apart > 0.5 / count).sum() <= 20  # in most, one of its sample points
            assert apart.max() <= 2.0 / count
        elif name == "panel":
            soft = trace(scene, CAMERA, [light], SIZE, light_samples=64, surface=frame.triangle, samples=1)
            assert np.abs(soft.visibility[0] - frame.visibility[0])[seen].max() < 0.15
        else:
            assert (truth.visibility[0] != frame.visibility[0])[seen].sum() <= 2


def test_displaced_shading_point_is_shadowed_by_its_triangle(renderer):
    """A long bevel, whose shading points rise less than its normals lean: light from below its plane would pass through it."""
    light = replace(LIGHTS["sun"], direction=(-1.0, 0.15, 0.0))
    camera = PerspectiveCamera((0.0, 1.2, 0.8), (0.0, 0.0, 0.0), fov_y=60.0)
    sheet = _sheet(0.5)
    normals = np.where(np.arange(3) < 2, sheet.normals, np.float32(0.0))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    scene = _scene(replace(sheet, positions=sheet.positions * (1.0, 1.0, 0.1), normals=normals))
    frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
    truth = trace(scene, camera, [light], SIZE, surface=frame.triangle, samples=1)
    seen = truth.triangle >= 0
    assert (truth.visibility[0] != frame.visibility[0])[seen].sum() <= 2
    assert ((truth.cosine[0] > 0.0) & (frame.visibility[0] == 0.0))[seen].sum() > 100
