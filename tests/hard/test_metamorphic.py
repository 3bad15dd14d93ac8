"""N25, N26, N39: the same scene moved, scaled, rotated or tessellated differently must give the same shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array, transform, translation
from glshadow.lights import DirectionalLight, Light, PointLight
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import analytic, shapes
from glshadow.shadows.filters import Exact, Filter, Pcf
from glshadow.shadows.fits import SceneFit
from glshadow.shadows.shadow import Shadow

from .cases_contact import local_light_towards
from .judge import judge
from .registry import EXACT, THOROUGH, Picture, Technique, picture_of
from .solids import mapped

SIZE = (128, 128)
SHARE = 1e-3
"""Pixels that may differ: edges move over pixel and texel centres when coordinates are rounded differently."""

few = settings(max_examples=5, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True, database=None)

BUILT = analytic.box(30.0, 30.0)
SUN = BUILT.scene.lights[0]
POINT = local_light_towards(40.0, 6.0, (0.0, 0.0, 0.0))
SPOT = local_light_towards(40.0, 6.0, (0.0, 0.0, 0.0), spot=40.0)
LIGHTS = {"sun": SUN, "point light": POINT, "spot": SPOT}
FILTERS: dict[str, Filter] = {"default": Pcf(), "exact": Exact()}
lights = pytest.mark.parametrize("light", LIGHTS.values(), ids=list(LIGHTS))
filters = pytest.mark.parametrize("filter_", FILTERS.values(), ids=list(FILTERS))


def moved_camera(camera: PerspectiveCamera, matrix: Array) -> PerspectiveCamera:
    """A camera transformed by a similarity."""
    place = tuple(transform(matrix, camera.position)), tuple(transform(matrix, camera.target))
    up = matrix[:3, :3] @ np.asarray(camera.up)
    return replace(camera, position=place[0], target=place[1], up=tuple(up / np.linalg.norm(up)))


def moved_light(light: Light, matrix: Array) -> Light:
    changes = {}
    if not isinstance(light, PointLight):
        changes["direction"] = tuple(matrix[:3, :3] @ np.asarray(light.direction))
    if not isinstance(light, DirectionalLight):
        changes["position"] = tuple(transform(matrix, light.position))
    return replace(light, **changes)  # type: ignore[arg-type]


def picture(renderer: Renderer, scene: Scene, camera: PerspectiveCamera, light: Light, **options: object) -> Array:
    shadow = Shadow(resolution=1024, **options)  # type: ignore[arg-type]
    frame = renderer.render(
        scene, camera, [replace(light, shadow=shadow)], SIZE, ambient=0.1, samples=1
    )  # independent of the direction
    return frame.image.astype(np.int64)


def base(renderer: Renderer, light: Light, **options: object) -> Array:
    return picture(renderer, BUILT.scene, BUILT.scene.camera, light, **options)


def assert_same(ours: Array, theirs: Array, share: float = SHARE) -> None:
    differing = (np.abs(ours - theirs).max(axis=-1) > 1).mean()
    assert differing <= share, f"{differing:.3%} of the pixels differ"
    assert ours.min() < ours.max(), "a blank image"


def placed(renderer: Renderer, light: Light, matrix: Array, **options: object) -> Array:
    camera = moved_camera(BUILT.scene.camera, matrix)
    return picture(renderer, mapped(BUILT.scene, matrix), camera, moved_light(light, matrix), **options)


# -- N25


@lights
@filters
@pytest.mark.parametrize("far", [(1e7, 0.0, -1e7), (6e6, 0.0, 0.0), (1e9, 1e9, 1e9)], ids=str)
def test_n25_a_translated_scene_is_the_same(
    renderer: Renderer, light: Light, filter_: Filter, far: tuple[float, float, float]
) -> None:
    assert_same(placed(renderer, light, translation(far), filter=filter_), base(renderer, light, filter=filter_))


@seed(1)
@few
@given(st.tuples(*[st.floats(-1e8, 1e8)] * 3))
def test_n25_random_translation(renderer: Renderer, offset: tuple[float, float, float]) -> None:
    assert_same(placed(renderer, SUN, translation(offset)), base(renderer, SUN))


# -- N26


@lights
@filters
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e7])
def test_n26_a_scaled_scene_is_the_same(renderer: Renderer, light: Light, filter_: Filter, scale: float) -> None:
    matrix = np.diag([scale, scale, scale, 1.0])
    assert_same(placed(renderer, light, matrix, filter=filter_), base(renderer, light, filter=filter_))


@seed(2)
@few
@given(st.floats(-6.0, 7.0), st.sampled_from(list(FILTERS)))
def test_n26_random_scale(renderer: Renderer, exponent: float, name: str) -> None:
    matrix = np.diag([10.0**exponent] * 3 + [1.0])
    assert_same(placed(renderer, POINT, matrix, filter=FILTERS[name]), base(renderer, POINT, filter=FILTERS[name]))


@pytest.mark.parametrize("scale", [1e-6, 1e7])
@pytest.mark.parametrize("technique", THOROUGH, ids=lambda technique: technique.name)
def test_n26_no_mismatch_at_any_scale(renderer: Renderer, scale: float, technique: Technique) -> None:
    built = analytic.box(30.0, 30.0, (scale, 2.0 * scale, 1.5 * scale))
    outcome = judge(renderer, picture_of(f"box x {scale:g}", built, length=2.0 * scale), technique)
    assert outcome.mismatches == 0, str(outcome)


@lights
@pytest.mark.parametrize("far", [(1e7, 0.0, -1e7), (1e9, 1e9, 1e9)], ids=str)
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e7])
def test_n25_n26_the_exact_filter_has_no_mismatch_anywhere(
    renderer: Renderer, light: Light, far: tuple[float, float, float], scale: float
) -> None:
    """Scaled first, then moved as far as float64 still resolves the lengths: by 10^7 of the scaled scene's own size."""
    matrix = translation(np.array(far) * scale) @ np.diag([scale, scale, scale, 1.0])
    scene, camera = mapped(BUILT.scene, matrix), moved_camera(BUILT.scene.camera, matrix)
    outcome = judge(renderer, Picture("box far away", scene, moved_light(light, matrix), camera), EXACT)
    assert outcome.mismatches == 0, str(outcome)
    assert (outcome.judged & (outcome.truth.visibility[0] == 0.0)).any()


# -- N39


def rotation(x: float, y: float, z: float) -> Array:
    matrix = np.eye(4)
    for axis, angle in enumerate((x, y, z)):
        i, j = [k for k in range(3) if k != axis]
        turn = np.eye(4)
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
        matrix = matrix @ turn
    return matrix


@seed(3)
@few
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.sampled_from(list(LIGHTS)))
def test_n39_a_turned_scene_is_the_same(renderer: Renderer, angles: tuple[float, float, float], name: str) -> None:
    # Another map, with other texels: only points away from edges are equal; a texel is a third of a pixel here.
    light, matrix = LIGHTS[name], rotation(*angles)
    assert_same(placed(renderer, light, matrix), base(renderer, light), share=0.02)
    assert_same(placed(renderer, light, matrix, filter=Exact()), base(renderer, light, filter=Exact()))


@lights
@filters
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_n39_a_mirrored_scene_is_the_same(renderer: Renderer, light: Light, filter_: Filter, axis: int) -> None:
    flip = np.eye(4)
    flip[axis, axis] = -1.0
    mirrored = placed(renderer, light, flip, filter=filter_)
    share = SHARE if isinstance(filter_, Exact) else 0.02
    # a camera does not mirror: the image is flipped
    assert_same(mirrored[:, ::-1], base(renderer, light, filter=filter_), share=share)


def remeshed(change: object) -> Scene:
    nodes = tuple(replace(node, mesh=change(node.mesh)) for node in BUILT.scene.nodes)  # type: ignore[operator]
    return replace(BUILT.scene, nodes=nodes)


def permuted(mesh: Mesh) -> Mesh:
    order = np.random.default_rng(6).permutation(len(mesh.triangles))
    return replace(mesh, triangles=np.roll(mesh.triangles[order], 1, axis=1))


def duplicated(mesh: Mesh) -> Mesh:
    return replace(mesh, triangles=np.concatenate([mesh.triangles, mesh.triangles]))


def subdivided(mesh: Mesh) -> Mesh:
    positions, triangles = mesh.positions, mesh.triangles.astype(np.int64)
    for _ in range(3):
        positions, triangles = shapes._quartered(positions, triangles)
    return Mesh(positions, triangles.astype(np.int32), material=mesh.material)


@lights
@filters
@pytest.mark.parametrize("change", [permuted, duplicated, subdivided])
def test_n39_same_surface_with_another_tessellation(
    renderer: Renderer, light: Light, filter_: Filter, change: object
) -> None:
    scene = remeshed(change)
    assert_same(picture(renderer, scene, scene.camera, light, filter=filter_), base(renderer, light, filter=filter_))


@seed(4)
@few
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.sampled_from(list(LIGHTS)))
def test_n39_another_caster_is_never_brighter(renderer: Renderer, place: tuple[float, float, float], name: str) -> None:
    light = LIGHTS[name]
    positions, triangles = shapes.box((0.5, 0.5, 0.5), (place[0], 3.5 + 0.1 * abs(place[1]), place[2]))
    scene = replace(BUILT.scene, nodes=(*BUILT.scene.nodes, Node(Mesh(positions, triangles), np.eye(4), "more")))
    outputs = ("visibility", "triangle")
    for filter_ in FILTERS.values():
        lit = [replace(light, shadow=Shadow(resolution=1024, fit=SceneFit(), filter=filter_))]
        with_it = renderer.render(scene, scene.camera, lit, SIZE, outputs=outputs, samples=1)
        without = renderer.render(BUILT.scene, scene.camera, lit, SIZE, outputs=outputs, samples=1)
        seen = (with_it.triangle == without.triangle) & (without.triangle >= 0)  # type: ignore[operator]
        brighter = (with_it.visibility[0] > without.visibility[0] + 0.5) & seen
        assert brighter.mean() <= SHARE  # another fit: edges move by a texel


@lights
@filters
def test_n39_a_caster_off_every_light_path_changes_nothing(renderer: Renderer, light: Light, filter_: Filter) -> None:
    pictures = []
    for x in (40.0, 47.0):
        positions, triangles = shapes.box((0.5, 0.5, 0.5), (x, -30.0, 3.0))  # below the ground, out of sight
        node = Node(Mesh(positions, triangles), np.eye(4), "aside")
        scene = replace(BUILT.scene, nodes=(*BUILT.scene.nodes, node))
        pictures.append(picture(renderer, scene, scene.camera, light, filter=filter_))
    assert np.abs(pictures[0] - pictures[1]).max() <= 1  # positions are relative to the centre of the scene's box


def test_n39_swapped_lights_give_the_same_picture(renderer: Renderer) -> None:
    chosen = [replace(light, intensity=0.3, shadow=Shadow(resolution=512)) for light in LIGHTS.values()]
    frames = [
        renderer.render(BUILT.scene, None, order, SIZE, outputs=("visibility", "image"), samples=1)
        for order in (chosen, chosen[::-1])
    ]
    np.testing.assert_allclose(frames[0].visibility, frames[1].visibility[::-1], rtol=0.0, atol=1e-4)  # other tiles
    images = [frame.image.astype(np.int64) for frame in frames]
    assert np.abs(images[0] - images[1]).max() <= 1  # sums in another order round differently
