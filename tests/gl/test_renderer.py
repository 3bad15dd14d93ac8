"""Renderer: its outputs, how lights add up, and the hard cases of frames and ranges (HARD N17 to N26 by name)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshadow import image
from glshadow import scenes as builtin
from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.outputs import NAMES as OUTPUTS
from glshadow.core.spaces import CLIP_SPACES, Array, translation
from glshadow.errors import GlshadowError, GlshadowWarning, MissingOutput, SceneError, SettingsError
from glshadow.frame import Frame, decoded
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.once import render
from glshadow.renderer import Renderer
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.bias import NoBias, SlopeScaledBias
from glshadow.shadows.filters import Hard, Pcf
from glshadow.shadows.fits import SceneFit, ViewFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, Shadow

from ..exact.compare import shone
from ..tolerances import PICTURE_CHANNELS, PICTURE_SHARE, WEIGHT

SIZE = (96, 64)
ATLAS = 4096.0 * 2.0**-24  # weights: a tile at another place of the atlas rounds positions, in texels, differently
TARGETS = pytest.mark.parametrize("target", list(Target), ids=lambda target: target.value)
ABOVE = PerspectiveCamera((0.0, 9.0, 0.001), (0.0, 0.0, 0.0))  # image right is +x, image bottom is +z


def node(name: str, solid: shapes.Solid, matrix: Array | None = None, **material: Any) -> Node:
    uv = material.pop("uv", None)
    return Node(Mesh(*solid, uv=uv, material=Material(**material)), np.eye(4) if matrix is None else matrix, name)


def ground(half: float = 4.0, level: float = 0.0) -> shapes.Solid:
    return shapes.rectangle((-half, level, half), (2.0 * half, 0.0, 0.0), (0.0, 0.0, -2.0 * half))


def box_scene(*more: Node) -> Scene:
    """A box of 1 x 1 x 1 on a ground of 8 x 8, seen from above."""
    return Scene((node("ground", ground()), node("box", shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))), *more), ABOVE)


def sun(x: float = -1.0, y: float = -1.0, z: float = 0.0, **shadow: Any) -> DirectionalLight:
    return DirectionalLight(direction=(x, y, z), shadow=Shadow(resolution=512, **shadow))


def dark_points(frame: Frame, light: int = 0) -> Array:
    """World points (N, 3) of dark pixels that the light shines on."""
    assert frame.visibility is not None
    assert frame.depth is not None
    dark = frame.visibility[light] < 0.5
    rays = pixel_rays(frame.camera, frame.size)[dark]
    points = np.asarray(frame.camera.position) + rays * frame.depth[dark][:, None].astype(np.float64)
    return points[frame.lights[light].shines_on(points)]


def assert_same_image(a: Frame, b: Frame, share: float = PICTURE_SHARE) -> None:
    assert a.image is not None
    assert b.image is not None
    assert a.visibility is not None
    assert b.visibility is not None
    np.testing.assert_array_equal(np.isnan(a.visibility).mean() > 0.99, False)
    different = (np.abs(a.image.astype(int) - b.image.astype(int)) > PICTURE_CHANNELS).any(axis=-1)
    assert different.mean() <= share, f"{different.sum()} pixels differ"
    same = np.isclose(a.visibility, b.visibility, atol=1.0 / 255.0, equal_nan=True)
    assert (~same).mean() <= share, f"visibility of {(~same).sum()} pixels differs"


# -- outputs


def test_shapes_and_types(renderer: Renderer) -> None:
    frame = renderer.render(box_scene(), lights=[sun(), sun(0.5)], size=SIZE, outputs=OUTPUTS, samples=1)
    w, h = SIZE
    expected = {
        "image": ((h, w, 3), np.uint8),
        "visibility": ((2, h, w), np.float32),
        "linear": ((h, w, 3), np.float32),
        "depth": ((h, w), np.float32),
        "depth_metric": ((h, w), np.float32),
    }
    for name, (shape, dtype) in expected.items():
        output = getattr(frame, name)
        assert output.shape == shape, name
        assert output.dtype == dtype, name
        assert output.flags.c_contiguous or name in ("image", "linear")
    assert frame.shadow_maps is not None
    assert [stored.shape for stored in frame.shadow_maps] == [(1, 512, 512)] * 2
    assert frame.timings is not None
    assert {"surface", "shadow", "resolve", "read"} <= set(frame.timings)
    assert all(seconds >= 0.0 for seconds in frame.timings.values())


@pytest.mark.parametrize("name", OUTPUTS)
def test_only_requested_outputs_are_returned(renderer: Renderer, name: str) -> None:
    frame = renderer.render(box_scene(), lights=[sun()], size=SIZE, outputs=(name,), samples=1)
    assert tuple(frame.outputs) == (name,)
    for other in set(OUTPUTS) - {name}:
        assert not hasattr(frame, other)
        with pytest.raises(MissingOutput, match=f'this frame has no "{other}": render it with outputs=.*"{name}"'):
            getattr(frame, other)


def test_rows_run_from_the_top(renderer: Renderer) -> None:
    high = node("high", shapes.box((0.5, 0.5, 0.5), (0.0, 2.0, 0.0)), color=(1.0, 0.0, 0.0, 1.0))
    low = node("low", shapes.box((0.5, 0.5, 0.5), (0.0, -2.0, 0.0)), color=(0.0, 0.0, 1.0, 1.0))
    camera = PerspectiveCamera((0.0, 0.0, 8.0), (0.0, 0.0, 0.0))
    frame = renderer.render(
        Scene((high, low), camera), lights=[], size=SIZE, ambient=1.0, background=0, outputs=OUTPUTS, samples=1
    )
    assert frame.image is not None
    assert frame.depth is not None
    red, blue = frame.image[..., 0] > 128, frame.image[..., 2] > 128
    assert red[: SIZE[1] // 2].any()
    assert not red[SIZE[1] // 2 :].any()
    assert blue[SIZE[1] // 2 :].any()
    assert not blue[: SIZE[1] // 2].any()
    np.testing.assert_array_equal(np.isfinite(frame.depth), red | blue)


@pytest.mark.parametrize(("x", "z"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_shadow_falls_away_from_the_light(renderer: Renderer, kind: str, x: float, z: float) -> None:
    position = (4.0 * x, 4.0, 4.0 * z)
    light: Light = {
        "sun": sun(-x, -1.0, -z),
        "spot": SpotLight(position=position, direction=(-x, -1.0, -z), outer_angle=40),
        "point": PointLight(position=position),
    }[kind]
    frame = renderer.render(box_scene(), lights=[light], size=SIZE, outputs=("visibility", "depth"), samples=1)
    points = dark_points(frame)
    fallen = points[points[:, 1] < 0.01]
    assert len(fallen) > 50
    along = fallen @ np.array([x, 0.0, z])
    assert along.max() < 0.55  # the foot of the box, and half a texel
    assert along.min() < -1.3
    across = fallen @ np.array([z, 0.0, x])
    assert np.abs(across).max() < 0.9


def test_shadow_map_rows_run_from_the_top(renderer: Renderer) -> None:
    """Row 0 of a stored map is v = 1, the side that the view's y axis points to."""
    scene = Scene((node("ground", ground()), node("box", shapes.box((0.5, 0.5, 0.5), (2.5, 0.3, 1.5)))), ABOVE)
    shadow = Shadow(resolution=64, fit=SceneFit(), bias=NoBias())  # the derived bias culls the ground
    light = DirectionalLight(direction=(0.0, -1.0, 0.0), shadow=shadow)
    frame = renderer.render(scene, lights=[light], size=SIZE, outputs=("shadow_maps",), samples=1)
    assert frame.shadow_maps is not None
    stored, view = frame.shadow_maps[0][0], frame.used[0].views[0]
    box = view.uvz_from_world @ np.array([2.5, 0.55, 1.5, 1.0])
    column, row = int(box[0] * 64), 63 - int(box[1] * 64)
    assert stored[row, column] == pytest.approx(box[2], abs=0.02)
    assert stored[row, column] < stored[63 - row, column] - 0.02


def test_visibility_is_nan_without_surface(renderer: Renderer) -> None:
    camera = PerspectiveCamera((0.0, 1.5, 9.0), (0.0, 1.5, 0.0))
    frame = renderer.render(box_scene(), camera, [sun()], SIZE, background=(0.2, 0.4, 0.6), outputs=OUTPUTS, samples=1)
    assert frame.visibility is not None
    assert frame.depth is not None
    assert frame.image is not None
    assert frame.linear is not None
    assert frame.depth_metric is not None
    nothing = np.isnan(frame.visibility[0])
    assert 0.1 < nothing.mean() < 0.9
    np.testing.assert_array_equal(nothing, np.isinf(frame.depth))
    np.testing.assert_array_equal(nothing, frame.depth_metric == 1.0)
    assert (frame.image[nothing] == np.round(np.array([0.2, 0.4, 0.6]) * 255.0)).all()
    np.testing.assert_allclose(
        frame.linear[nothing], np.broadcast_to(srgb_decoded([0.2, 0.4, 0.6]), (nothing.sum(), 3)), rtol=1e-6
    )
    inside = frame.visibility[0][~nothing]
    assert ((inside >= 0.0) & (inside <= 1.0 + WEIGHT)).all()


def srgb_decoded(color: Sequence[float]) -> Array:
    value = np.asarray(color)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def test_unlit_side_is_dark(renderer: Renderer) -> None:
    """0 where N.L <= 0 for the geometric normal, whatever the map holds and whether or not there is one."""
    scene = builtin.ball(elevation=20.0).scene
    for shadow in (Shadow(resolution=512), None):
        light = replace(scene.lights[0], shadow=shadow)
        frame = renderer.render(
            scene, lights=[light], size=SIZE, outputs=("visibility", "depth", "linear"), ambient=0.0, samples=1
        )
        assert frame.visibility is not None
        assert frame.depth is not None
        assert frame.linear is not None
        hit = np.isfinite(frame.depth)
        points = np.asarray(frame.camera.position) + pixel_rays(frame.camera, SIZE)[hit] * frame.depth[hit][:, None]
        cosine = (points / np.linalg.norm(points, axis=1, keepdims=True) * light.to_light(points)[0]).sum(axis=1)
        away = cosine < -0.02  # a facet's normal is within a degree of the radius
        assert away.any()
        assert (frame.visibility[0][hit][away] == 0.0).all()
        assert (frame.linear[hit][away] == 0.0).all()


def test_thin_sheet_lit_from_behind(renderer: Renderer) -> None:
    """N16: a two-sided sheet is dark on the side away from the light, and lit on the other."""
    scene = Scene((node("sheet", ground(), double_sided=True),))
    light = sun(0.3, 1.0, 0.2)
    above = renderer.render(scene, ABOVE, [light], SIZE, samples=1)
    below = renderer.render(scene, PerspectiveCamera((0.0, -9.0, 0.001), (0.0, 0.0, 0.0)), [light], SIZE, samples=1)
    assert np.nanmax(above.visibility) == 0.0
    assert np.nanmin(below.visibility) > 1.0 - WEIGHT


# -- sums of lights


@pytest.mark.parametrize("strength", [0.0, 0.35, 1.0])
def test_strength(renderer: Renderer, strength: float) -> None:
    light = sun(strength=strength)
    full, none = sun(), replace(light, shadow=None)
    outputs = ("linear", "visibility")
    scaled, dark, open_ = (
        renderer.render(box_scene(), lights=[each], size=SIZE, ambient=0.05, outputs=outputs, samples=1)
        for each in (light, full, none)
    )
    np.testing.assert_array_equal(scaled.visibility, dark.visibility)
    expected = (1.0 - strength) * open_.linear + strength * dark.linear
    np.testing.assert_allclose(scaled.linear, expected, atol=1e-6)


def test_light_without_shadow(renderer: Renderer) -> None:
    frame = renderer.render(
        box_scene(), lights=[replace(sun(), shadow=None)], size=SIZE, outputs=("visibility", "shadow_maps"), samples=1
    )
    used = frame.used[0]
    assert (used.views, used.filter, used.bias, used.target, used.clip, used.draws) == ((), None, None, None, None, 0)
    assert frame.shadow_maps is not None
    assert frame.shadow_maps[0].size == 0
    assert set(np.unique(frame.visibility[~np.isnan(frame.visibility)])) <= {0.0, 1.0}


def many_lights() -> list[Light]:
    lights: list[Light] = [sun(-1.0), sun(0.7, -1.0, 0.4, target=Target.R32F), sun(0.0, -1.0, -1.0, filter=Hard())]
    for i in range(3):
        angle = 2.0 * i
        where = (3.0 * np.cos(angle), 3.0, 3.0 * np.sin(angle))
        lights.append(
            PointLight(position=where, color=(1.0, 0.4, 0.2 * i), intensity=0.3, shadow=Shadow(resolution=256))
        )
    where = (-2.5, 3.5, 2.0)
    cone = Shadow(resolution=256, filter=Pcf(2), target=Target.DEPTH16)
    lights.append(SpotLight(position=where, direction=(2.5, -3.5, -2.0), intensity=0.5, outer_angle=35, shadow=cone))
    lights.append(SpotLight(position=where, direction=(1.0, -3.5, -2.0), intensity=0.2, outer_angle=25, shadow=None))
    return lights


def test_lights_add_up(renderer: Renderer) -> None:
    """Eight lights of all kinds: the linear image is the sum of theirs, and each keeps the visibility it has alone."""
    lights, outputs = many_lights(), ("linear", "visibility", "image")
    together = renderer.render(
        box_scene(), lights=lights, size=SIZE, ambient=0.02, outputs=outputs, samples=1, tone="none"
    )
    assert together.visibility is not None
    assert together.linear is not None
    total = renderer.render(box_scene(), lights=[], size=SIZE, ambient=0.02, outputs=outputs, samples=1).linear.astype(
        np.float64
    )
    for i, light in enumerate(lights):
        alone = renderer.render(box_scene(), lights=[light], size=SIZE, ambient=0.0, outputs=outputs, samples=1)
        np.testing.assert_allclose(together.visibility[i], alone.visibility[0], atol=ATLAS)
        total += alone.linear
    lit = ~np.isnan(together.visibility[0])
    np.testing.assert_allclose(together.linear[lit], total[lit], rtol=1e-5, atol=1e-6)
    encoded = np.clip(total, 0.0, 1.0)
    encoded = np.where(encoded <= 0.0031308, 12.92 * encoded, 1.055 * np.maximum(encoded, 1e-8) ** (1.0 / 2.4) - 0.055)
    assert np.abs(together.image[lit].astype(float) - 255.0 * encoded[lit]).max() < 1.0


def test_order_of_lights_does_not_matter(renderer: Renderer) -> None:
    lights = many_lights()[:4]
    a = renderer.render(box_scene(), lights=lights, size=SIZE, samples=1)
    b = renderer.render(box_scene(), lights=lights[::-1], size=SIZE, samples=1)
    np.testing.assert_allclose(a.visibility, b.visibility[::-1], atol=ATLAS)
    assert np.abs(a.image.astype(int) - b.image.astype(int)).max() <= PICTURE_CHANNELS


def test_no_light_at_all(renderer: Renderer) -> None:
    scene = Scene((node("ground", ground(), color=(0.5, 0.25, 1.0, 1.0)),), ABOVE)
    frame = renderer.render(scene, lights=[], size=SIZE, ambient=(0.2, 0.4, 0.8), outputs=OUTPUTS, samples=1)
    assert frame.visibility is not None
    assert frame.visibility.shape == (0, SIZE[1], SIZE[0])
    assert frame.used == ()
    assert frame.shadow_maps == ()
    surface = np.isfinite(frame.depth)
    np.testing.assert_allclose(frame.linear[surface], np.broadcast_to([0.1, 0.1, 0.8], (surface.sum(), 3)), rtol=1e-6)
    assert (frame.image[surface] == frame.image[surface][0]).all()


def test_lambert_shading(renderer: Renderer) -> None:
    scene = Scene((node("ground", ground(), color=(0.5, 0.25, 1.0, 1.0)),), ABOVE)
    light = DirectionalLight(direction=(1.0, -2.0, 0.5), color=(1.0, 0.5, 0.25), intensity=0.7)
    frame = renderer.render(scene, lights=[light], size=SIZE, ambient=0.1, outputs=("linear", "depth"), samples=1)
    cosine = 2.0 / np.sqrt(1.0 + 4.0 + 0.25)
    expected = np.array([0.5, 0.25, 1.0]) * (0.1 + 0.7 * cosine * np.array([1.0, 0.5, 0.25]))
    surface = np.isfinite(frame.depth)
    np.testing.assert_allclose(frame.linear[surface], np.broadcast_to(expected, (surface.sum(), 3)), rtol=1e-5)


def test_cone_range_and_falloff_are_intensity(renderer: Renderer) -> None:
    light = SpotLight(position=(0.0, 3.0, 0.0), inner_angle=10, outer_angle=30, range=3.3, falloff=2.0, intensity=4.0)
    scene = Scene((node("ground", ground()),), ABOVE)
    frame = renderer.render(
        scene, lights=[light], size=SIZE, ambient=0.0, outputs=("linear", "visibility", "depth"), samples=1
    )
    surface = np.isfinite(frame.depth)
    points = np.asarray(ABOVE.position) + pixel_rays(ABOVE, SIZE)[surface] * frame.depth[surface][:, None].astype(float)
    towards, distance = light.to_light(points)
    inner, outer = np.cos(np.radians([10.0, 30.0]))
    x = np.clip((towards[:, 1] - outer) / (inner - outer), 0.0, 1.0)
    window = np.maximum(1.0 - (distance / 3.3) ** 4, 0.0) ** 2
    expected = 4.0 * towards[:, 1] * x * x * (3.0 - 2.0 * x) * window / distance**2
    np.testing.assert_allclose(frame.linear[surface][:, 0], expected, atol=2e-5)
    np.testing.assert_array_equal(frame.visibility[0][surface][x > 1e-4], 1.0)
    np.testing.assert_array_equal(frame.visibility[0][surface][towards[:, 1] < outer - 1e-6], 0.0)


# -- casters and receivers


def checker(cells: int = 8) -> np.ndarray:
    """Opaque and transparent squares, 8 texels each."""
    texels = np.kron(np.indices((cells, cells)).sum(axis=0) % 2, np.ones((8, 8), dtype=int))
    pixels = np.full((*texels.shape, 4), 255, dtype=np.uint8)
    pixels[..., 3] = texels * 255
    return pixels


UV = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def sheet_scene(mode: AlphaMode, cutoff: float = 0.5) -> Scene:
    """A sheet of 2 x 2 with a checker of holes, one above the ground."""
    solid = shapes.rectangle((-1.0, 1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0))
    sheet = node("sheet", solid, uv=UV, texture=checker(), alpha_mode=mode, cutoff=cutoff, double_sided=True)
    below = PerspectiveCamera((2.5, 3.0, 5.5), (1.5, 0.0, 0.0))
    return Scene((node("ground", ground(5.0)), sheet), below)


def shadow_area(renderer: Renderer, scene: Scene, light: Light) -> float:
    """Area in world units of the ground in shadow, seen from straight below through the ground."""
    camera = PerspectiveCamera((3.0, 12.0, 0.001), (3.0, 0.0, 0.0), fov_y=30.0)
    size = (400, 400)
    frame = renderer.render(scene, camera, [light], size, outputs=("visibility", "depth"), samples=1)
    on_ground = np.isclose(frame.depth, 12.0, atol=1e-3)
    pixel = (2.0 * 12.0 * np.tan(np.radians(15.0)) / size[1]) ** 2
    return float((1.0 - frame.visibility[0][on_ground]).sum() * pixel)


@pytest.mark.parametrize("cutoff", [0.25, 0.5, 0.75])
def test_masked_sheet_casts_half_a_shadow(renderer: Renderer, cutoff: float) -> None:
    """N14. The light moves the shadow by 3, beside the sheet."""
    light = DirectionalLight(direction=(3.0, -1.0, 0.0), shadow=Shadow(resolution=1024))
    masked = shadow_area(renderer, sheet_scene(AlphaMode.MASK, cutoff), light)
    assert shadow_area(renderer, sheet_scene(AlphaMode.OPAQUE), light) == pytest.approx(4.0, rel=0.02)
    # an edge between squares moves by up to half a texture texel (1/64 of the sheet's side) with the cutoff; 112 edges of 0.25
    assert masked == pytest.approx(2.0, abs=2 * 112 * 0.25 * (2.0 / 128) * abs(cutoff - 0.5) * 2 * 0.5 + 0.06)


def test_masked_sheet_has_holes_for_the_camera(renderer: Renderer) -> None:
    scene = sheet_scene(AlphaMode.MASK)
    camera = PerspectiveCamera((0.0, 6.0, 0.001), (0.0, 0.0, 0.0), fov_y=20.0)
    frame = renderer.render(scene, camera, [], (200, 200), outputs=("depth",), samples=1)
    over = np.abs(np.asarray(camera.position) + pixel_rays(camera, (200, 200)) * 5.0)[..., [0, 2]].max(axis=-1) < 0.99
    assert np.isclose(frame.depth[over], 5.0, atol=1e-3).mean() == pytest.approx(0.5, abs=0.02)
    assert (np.isclose(frame.depth[over], 5.0, atol=1e-3) | np.isclose(frame.depth[over], 6.0, atol=1e-3)).all()


def test_blended_sheet_casts_nothing(renderer: Renderer) -> None:
    light = DirectionalLight(direction=(3.0, -1.0, 0.0), shadow=Shadow(resolution=512))
    assert shadow_area(renderer, sheet_scene(AlphaMode.BLEND), light) == pytest.approx(0.0, abs=1e-3)


def test_scene_in_which_nothing_casts(renderer: Renderer) -> None:
    scene = Scene((replace(node("ground", ground()), casts=False),), ABOVE)
    frame = renderer.render(scene, lights=[sun()], size=SIZE, outputs=("visibility", "shadow_maps"), samples=1)
    assert np.nanmin(frame.visibility) == 1.0
    assert frame.used[0].draws == 0


def test_mirrored_node(renderer: Renderer) -> None:
    """A matrix with a negative determinant reverses the winding: neither camera nor light may cull the wrong side."""
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    solid = shapes.box((1.0, 1.0, 1.0), (0.8, 0.5, 0.3))
    there = shapes.box((1.0, 1.0, 1.0), (-0.8, 0.5, 0.3))
    for light in (sun(0.6, -1.0, 0.4), PointLight(position=(2.0, 4.0, 1.0))):
        a = renderer.render(
            Scene((node("ground", ground()), node("box", solid, mirror)), ABOVE), lights=[light], size=SIZE, samples=1
        )
        b = renderer.render(
            Scene((node("ground", ground()), node("box", there)), ABOVE), lights=[light], size=SIZE, samples=1
        )
        assert_same_image(a, b)


def test_mirrored_sheet_keeps_its_front(renderer: Renderer) -> None:
    """Mirrored, a sheet still faces up: with a light above, only its front casts when only fronts are drawn."""
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    scene = Scene((node("ground", ground()), node("sheet", ground(0.8, level=1.0), mirror)))
    below = PerspectiveCamera((4.0, 0.5, 4.0), (0.0, 0.0, 0.0))
    dark = {}
    for faces in Faces:
        frame = renderer.render(
            scene, below, [sun(0.1, -1.0, 0.1, faces=faces)], SIZE, outputs=("visibility", "depth"), samples=1
        )
        dark[faces] = (dark_points(frame)[:, 1] < 0.01).sum()
    assert dark[Faces.BACK] == 0
    assert dark[Faces.FRONT] == dark[Faces.BOTH] > 20


def test_instances_share_one_mesh(renderer: Renderer) -> None:
    mesh = Mesh(*shapes.box((0.5, 0.5, 0.5), (0.0, 0.25, 0.0)))
    instances = [Node(mesh, translation((i - 2.0, 0.0, 0.5 * i - 1.0)), f"box {i}") for i in range(5)]
    scene = Scene((node("ground", ground()), *instances), ABOVE)
    frame = renderer.render(scene, lights=[sun()], size=SIZE, samples=1)
    gpu = renderer._cache.scene.thing
    assert gpu is not None
    assert len({id(each) for each in gpu.meshes}) == 2
    copies = [node(f"copy {i}", shapes.box((0.5, 0.5, 0.5), (i - 2.0, 0.25, 0.5 * i - 1.0))) for i in range(5)]
    assert_same_image(
        frame, renderer.render(Scene((scene.nodes[0], *copies), ABOVE), lights=[sun()], size=SIZE, samples=1)
    )


def test_moved_scene(renderer: Renderer) -> None:
    scene = box_scene()
    renderer.render(scene, lights=[sun()], size=SIZE, samples=1)
    moved = scene.moved({"box": translation((1.5, 0.0, -1.0))})
    frame = renderer.render(moved, lights=[sun()], size=SIZE, outputs=("visibility", "depth", "image"), samples=1)
    there = Scene((scene.nodes[0], node("box", shapes.box((1.0, 1.0, 1.0), (1.5, 0.5, -1.0)))), ABOVE)
    assert_same_image(frame, renderer.render(there, lights=[sun()], size=SIZE, samples=1))
    assert moved.nodes[1].mesh is scene.nodes[1].mesh
    points = dark_points(frame)
    assert np.abs(points[:, 2] + 1.0).max() < 0.7


@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_faces(renderer: Renderer, kind: str) -> None:
    """Closed meshes cast the same whichever sides are drawn; of an open sheet only the drawn side casts."""
    light: Light = {
        "sun": sun(0.5, -1.0, 0.3),
        "spot": SpotLight(position=(-2.0, 5.0, -1.0), direction=(2.0, -5.0, 1.0), outer_angle=40),
        "point": PointLight(position=(-2.0, 5.0, -1.0)),
    }[kind]
    frames = {}
    for faces in (None, *Faces):
        shadow = replace(light.shadow, faces=faces, resolution=1024)
        frames[faces] = renderer.render(box_scene(), lights=[replace(light, shadow=shadow)], size=SIZE, samples=1)
    assert_same_image(frames[None], frames[Faces.BOTH], share=0.0)
    assert_same_image(frames[Faces.FRONT], frames[Faces.BOTH], share=0.0)
    assert_same_image(frames[Faces.BACK], frames[Faces.BOTH], share=0.02)  # the foot of the box: its bottom casts too
    lid = node("lid", ground(1.0, level=1.5))  # faces up, open
    areas = {}
    for faces in (None, *Faces):
        shadow = replace(light.shadow, faces=faces, resolution=512)
        scene = Scene((node("ground", ground()), lid))
        camera = PerspectiveCamera((4.0, 1.2, 4.0), (0.0, 0.0, 0.0))
        frame = renderer.render(
            scene, camera, [replace(light, shadow=shadow)], SIZE, outputs=("visibility", "depth"), samples=1
        )
        areas[faces] = (dark_points(frame)[:, 1] < 0.01).sum()
    assert areas[Faces.BACK] == 0
    assert areas[None] == areas[Faces.BOTH] == areas[Faces.FRONT] > 50


def test_light_inside_a_closed_box(renderer: Renderer) -> None:
    """N22: the outside is dark: the box around the light is not culled, and the near plane does not clip it."""
    for half in (0.5, 0.05):
        shell = node("shell", shapes.box((2 * half, 2 * half, 2 * half), (0.0, 1.0, 0.0)))
        frame = renderer.render(
            Scene((node("ground", ground()), shell), ABOVE),
            lights=[PointLight(position=(0, 1, 0))],
            size=SIZE,
            samples=1,
        )
        assert np.nanmax(frame.visibility) == 0.0
    inside = PerspectiveCamera((0.0, 1.0, 0.3), (0.0, 0.8, -1.0), fov_y=70.0)
    shell = node("shell", shapes.box((1.0, 1.0, 1.0), (0.0, 1.0, 0.0)))
    frame = renderer.render(
        Scene((node("ground", ground()), shell)), inside, [PointLight(position=(0, 1, 0))], SIZE, samples=1
    )
    assert np.nanmin(frame.visibility) > 0.5
    assert np.nanmean(frame.visibility) > 0.99


# -- fits, ranges and maps that end


def test_fits_agree_away_from_edges(renderer: Renderer) -> None:
    closer = replace(ABOVE, position=(0.5, 4.0, 0.5), target=(0.5, 0.0, 0.4))
    frames = [
        renderer.render(
            box_scene(), closer, [sun(0.6, -1.0, 0.4, fit=fit)], SIZE, outputs=("visibility", "depth"), samples=1
        )
        for fit in (ViewFit(), SceneFit())
    ]
    a, b = (frame.visibility[0] for frame in frames)
    certain = np.ones_like(a, dtype=bool)
    for axis in (0, 1):
        for step in (-1, 1):
            certain &= np.isclose(np.roll(a, step, axis), a, atol=WEIGHT)
    assert certain.mean() > 0.4
    np.testing.assert_allclose(a[certain], b[certain], atol=WEIGHT)
    seen, whole = (np.array(frame.used[0].texel) for frame in frames)
    assert (seen <= whole * (1.0 + 1e-9)).all()  # equal if both are fitted to the casters' shadow


def test_scene_fit_does_not_depend_on_the_camera(renderer: Renderer) -> None:
    maps = []
    for camera in (ABOVE, PerspectiveCamera((3.0, 2.0, 6.0), (1.0, 0.0, 0.0), fov_y=20.0)):
        frame = renderer.render(box_scene(), camera, [sun(fit=SceneFit())], SIZE, outputs=("shadow_maps",), samples=1)
        maps.append(frame.shadow_maps[0])
    np.testing.assert_array_equal(*maps)


@TARGETS
@pytest.mark.parametrize("clip", CLIP_SPACES, ids=str)
@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_receivers_beyond_far_are_lit(renderer: Renderer, kind: str, clip: Any, target: Target) -> None:
    """N17: a plane that crosses the far plane, no caster: completely lit in every format and convention."""
    shadow = Shadow(resolution=256, target=target, clip=clip)
    light: Light = {
        "sun": DirectionalLight(direction=(-1.0, -1.0, -0.2), near=-1.0, far=1.0, shadow=shadow),
        "spot": SpotLight(
            position=(-4.0, 2.0, 0.0), direction=(1.0, -0.5, 0.0), outer_angle=70, near=1.0, far=4.0, shadow=shadow
        ),
        "point": PointLight(position=(-1.0, 2.0, 0.0), near=1.0, far=3.0, shadow=shadow),
    }[kind]
    scene = Scene((node("ground", ground()),), ABOVE)
    frame = renderer.render(scene, lights=[light], size=SIZE, outputs=("visibility", "position"), samples=1)
    assert np.nanmin(frame.visibility[0][shone(frame)]) > 1.0 - WEIGHT


@TARGETS
def test_beyond_far_and_nothing_in_reach(renderer: Renderer, target: Target) -> None:
    """N17: everything is beyond far."""
    shadow = Shadow(resolution=64, target=target)
    light = SpotLight(position=(0.0, 10.0, 0.0), outer_angle=50, near=1.0, far=5.0, shadow=shadow)
    scene = Scene((node("ground", ground()),), ABOVE)
    frame = renderer.render(scene, lights=[light], size=SIZE, outputs=("visibility", "position"), samples=1)
    assert np.nanmin(frame.visibility[0][shone(frame)]) > 1.0 - WEIGHT


def test_caster_before_near_still_casts(renderer: Renderer) -> None:
    """N23, N24: a caster nearer than the near plane is clamped to it, not clipped."""
    high = node("high", shapes.box((1.0, 0.1, 1.0), (0.0, 50.0, 0.0)))
    light = DirectionalLight(direction=(0.0, -1.0, 0.0), near=-2.0, far=1.0, shadow=Shadow(resolution=512))
    camera = PerspectiveCamera((0.0, 9.0, 0.001), (0.0, 0.0, 0.0))
    frame = renderer.render(
        Scene((node("ground", ground()), high)), camera, [light], SIZE, outputs=("visibility", "depth"), samples=1
    )
    assert np.abs(dark_points(frame)[:, [0, 2]]).max() == pytest.approx(0.5, abs=0.12)


@TARGETS
def test_receivers_outside_the_map_are_lit(renderer: Renderer, target: Target) -> None:
    """N18: only the caster's shadow; no border, streak or copy. The spot's map ends within the ground."""
    light = SpotLight(
        position=(0.0, 4.0, 0.0), inner_angle=10, outer_angle=20, shadow=Shadow(resolution=128, target=target)
    )
    frame = renderer.render(box_scene(), lights=[light], size=SIZE, outputs=("visibility", "position"), samples=1)
    within = shone(frame)
    points = frame.position[within & (frame.visibility[0] < 0.5)]
    assert len(points) > 20
    # the top of the box at height 1, seen from height 4
    assert np.abs(points[:, [0, 2]]).max() < 4.0 / 3.0 * 0.5 + 0.15
    edge = within & (
        np.hypot(frame.position[..., 0], frame.position[..., 2]) > 1.2
    )  # the cone ends at 1.46, the map beyond
    assert edge.sum() > 100
    assert frame.visibility[0][edge].min() > 1.0 - WEIGHT


@TARGETS
def test_nothing_behind_a_spot(renderer: Renderer, target: Target) -> None:
    """N19: back-projected through w <= 0, the plane behind would show a mirrored shadow, or a lit patch."""
    caster = node("caster", shapes.rectangle((-0.5, -0.5, -2.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    front = node("front", shapes.rectangle((-6.0, -6.0, -4.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0)))
    behind = node("behind", shapes.rectangle((-6.0, -6.0, 4.0), (0.0, 12.0, 0.0), (12.0, 0.0, 0.0)))
    scene = Scene((caster, front, behind))
    shadow = Shadow(resolution=512, target=target)
    light = SpotLight(position=(0.0, 0.0, 0.0), direction=(0, 0, -1), inner_angle=29.9, outer_angle=30, shadow=shadow)
    back = PerspectiveCamera((0.1, 0.1, 0.0), (0.1, 0.1, 4.0), fov_y=80.0)
    frame = renderer.render(
        scene, back, [light], SIZE, ambient=0.0, outputs=("linear", "visibility", "image"), samples=1
    )
    assert (frame.linear == 0.0).all()
    assert np.nanmax(frame.visibility) == 0.0  # facing the light, no caster known, and outside its cone
    ahead = PerspectiveCamera((0.0, 0.0, -2.1), (0.0, 0.0, -4.0), fov_y=120.0)
    frame = renderer.render(
        scene, ahead, [light], (200, 200), ambient=0.0, outputs=("linear", "visibility", "depth"), samples=1
    )
    points = np.asarray(ahead.position) + pixel_rays(ahead, (200, 200)) * 1.9
    square, disc = np.abs(points[..., :2]).max(axis=-1), np.hypot(points[..., 0], points[..., 1])
    assert (frame.visibility[0][square < 0.97] == 0.0).all()
    assert (frame.visibility[0][(square > 1.03) & (disc < 2.2)] > 1.0 - WEIGHT).all()
    assert (frame.linear[disc > 2.32] == 0.0).all()
    assert (frame.linear[(disc < 2.25) & (square > 1.03)] > 0.0).all()


@pytest.mark.parametrize("angle", [90.0, 90.5, 180.0])
def test_cone_of_half_space_is_refused(angle: float) -> None:
    """N20."""
    with pytest.raises(SettingsError, match=r"outer_angle must be a finite number in \(0, 90\)"):
        SpotLight(position=(0, 0, 0), outer_angle=angle)


@pytest.mark.parametrize("angle", [80.0, 87.0, 89.9])
def test_widest_cones(renderer: Renderer, angle: float) -> None:
    light = SpotLight(position=(0.0, 3.0, 0.0), inner_angle=angle - 1.0, outer_angle=angle)
    frame = renderer.render(box_scene(), lights=[light], size=SIZE, outputs=("visibility", "depth"), samples=1)
    points = dark_points(frame)
    fallen = points[points[:, 1] < 0.01]
    assert np.abs(fallen[:, [0, 2]]).max() < 0.75 + 0.4
    assert len(fallen) > 20


@pytest.mark.parametrize("target", [None, Target.R32F, Target.DEPTH16])
@pytest.mark.parametrize("kernel", [Hard(), Pcf(1), Pcf(3)], ids=str)
def test_room_without_seams(renderer: Renderer, kernel: Any, target: Target | None) -> None:
    """N21: a point light off the centre, so that the borders between its six faces cross the walls; all lit, also on the borders."""
    scene = builtin.room().scene
    lamp = np.array([0.3, 0.15, -0.2])
    light = PointLight(position=tuple(lamp), shadow=Shadow(filter=kernel, target=target))
    for view in (None, PerspectiveCamera((-0.7, 0.5, -0.8), (0.6, -0.3, 0.9), fov_y=90.0)):
        frame = renderer.render(scene, view, [light], (320, 240), outputs=("visibility", "depth"), samples=1)
        points = np.asarray(frame.camera.position) + pixel_rays(frame.camera, frame.size) * frame.depth[
            ..., None
        ].astype(float)
        # beside a concave edge the kernel also samples the other wall, which is nearer than the receiver's extended plane
        second = np.sort(1.0 - np.abs(points), axis=-1)[..., 1]
        band = (kernel.radius + 1.0) * np.sqrt(2.0) * light_texel(frame) * np.abs(points - lamp).max(axis=-1)
        inner = second > band / np.cos(np.radians(60.0))
        border = np.sort(np.abs(points - lamp), axis=-1)
        assert (inner & (border[..., 2] - border[..., 1] < 0.02)).sum() > 100, "no pixel on a border between faces"
        assert frame.visibility[0][inner].min() > 1.0 - WEIGHT
        assert (frame.visibility[0] <= 0.5).mean() < 1e-3


def light_texel(frame: Frame) -> float:
    texel = frame.used[0].texel
    assert texel is not None
    return max(texel)


def test_rods_across_face_borders(renderer: Renderer) -> None:
    """N21: shadows of rods are continuous where they cross from face to face."""
    analytic = builtin.room(rods=True)
    lights = [replace(light, shadow=Shadow(filter=Pcf())) for light in analytic.scene.lights]
    frame = renderer.render(analytic.scene, None, lights, (320, 240), outputs=("visibility", "depth"), samples=1)
    points = np.asarray(frame.camera.position) + pixel_rays(frame.camera, frame.size) * frame.depth[..., None].astype(
        float
    )
    wall = np.isclose(np.abs(points).max(axis=-1), 1.0, atol=1e-4)
    own = np.abs(points).argmax(axis=-1)
    normal = -np.take_along_axis(np.sign(points), own[..., None], -1) * np.eye(3)[own]
    exact = analytic.exact(points, normal)
    band = 2.5 * np.sqrt(2.0) * light_texel(frame) * 2.0  # N21's walls are seen under at most 55 degrees
    steps = [np.array(step) * band for step in np.ndindex(3, 3, 3)]
    near_edge = np.zeros(wall.shape, dtype=bool)
    for step in steps:
        near_edge |= analytic.exact(points + step - band, normal) != exact
    counted = wall & ~near_edge
    wrong = counted & (np.abs(frame.visibility[0] - exact) > 0.5)
    assert counted.mean() > 0.7
    assert (exact[counted] == 0.0).sum() > 200
    assert not wrong.any(), f"{wrong.sum()} of {counted.sum()} pixels"


MAP = Shadow(filter=Pcf())


def test_faces_without_receivers_are_skipped(renderer: Renderer) -> None:
    below = renderer.render(
        box_scene(), lights=[PointLight(position=(0.0, 3.0, 0.0), shadow=MAP)], size=SIZE, samples=1
    )
    assert 3 in {view.face for view in below.used[0].views}
    assert 2 not in {view.face for view in below.used[0].views}, "nothing lies above the light"
    far = renderer.render(
        box_scene(), lights=[PointLight(position=(0.0, 100.0, 0.0), shadow=MAP)], size=SIZE, samples=1
    )
    assert [view.face for view in far.used[0].views] == [3]


def test_light_that_reaches_nothing_seen(renderer: Renderer) -> None:
    light = SpotLight(position=(0.0, 5.0, 0.0), direction=(0.0, 1.0, 0.0), shadow=MAP)
    frame = renderer.render(
        box_scene(),
        lights=[light],
        size=SIZE,
        outputs=("visibility", "shadow_maps", "linear"),
        ambient=0,
        background=0,
        samples=1,
    )
    assert frame.used[0].views == ()
    assert frame.used[0].draws == 0
    assert (frame.linear == 0.0).all()


# -- the same image


def scaled(analytic: builtin.AnalyticScene, scale: float, offset: Array) -> tuple[Scene, PerspectiveCamera, Light]:
    scene = analytic.scene
    matrix = translation(offset) @ np.diag([scale, scale, scale, 1.0])
    nodes = tuple(replace(each, world_from_mesh=matrix @ each.world_from_mesh) for each in scene.nodes)
    camera, light = scene.camera, scene.lights[0]

    def place(point: Sequence[float]) -> tuple[float, ...]:
        return tuple(np.asarray(point) * scale + offset)

    camera = replace(camera, position=place(camera.position), target=place(camera.target))
    if not isinstance(light, DirectionalLight):
        light = replace(light, position=place(light.position))
    return Scene(nodes, camera, (light,)), camera, light


CASES = {
    "N1 wall": builtin.wall,
    "N10 box": builtin.box,
    "N4 lamp": lambda: builtin.plates(gap=1.0, lamp_height=4.0),
}


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e7])
@pytest.mark.parametrize("case", CASES)
def test_scale_changes_nothing(renderer: Renderer, case: str, scale: float) -> None:
    """N26."""
    analytic = CASES[case]()
    unit, _, _ = scaled(analytic, 1.0, np.zeros(3))
    other, _, _ = scaled(analytic, scale, np.zeros(3))
    assert_same_image(
        renderer.render(unit, size=(240, 160), samples=1), renderer.render(other, size=(240, 160), samples=1)
    )


@pytest.mark.parametrize("offset", [(1e7, 0.0, -1e7), (6e6, 1e6, 0.0), (1e5, 0.0, 3.0)], ids=str)
@pytest.mark.parametrize("case", CASES)
def test_translation_changes_nothing(renderer: Renderer, case: str, offset: Any) -> None:
    """N25."""
    analytic = CASES[case]()
    unit, _, _ = scaled(analytic, 1.0, np.zeros(3))
    other, _, _ = scaled(analytic, 1.0, np.asarray(offset))
    assert_same_image(
        renderer.render(unit, size=(240, 160), samples=1), renderer.render(other, size=(240, 160), samples=1)
    )


def test_baked_far_away(renderer: Renderer) -> None:
    """Vertices that are themselves far from zero keep their float64 precision."""
    solids = {"ground": ground(), "box": shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))}
    offset = np.array([1e6, 0.0, -1e6])
    scene = Scene(tuple(node(name, (positions + offset, faces)) for name, (positions, faces) in solids.items()))
    camera = replace(ABOVE, position=tuple(np.asarray(ABOVE.position) + offset), target=tuple(offset))
    assert_same_image(
        renderer.render(box_scene(), lights=[sun()], size=SIZE, samples=1),
        renderer.render(scene, camera, [sun()], SIZE, samples=1),
    )


def test_metamorphic(renderer: Renderer) -> None:
    """N39: permuted, duplicated and subdivided triangles give the same image; another caster makes nothing brighter."""
    scene = box_scene()
    light = sun(0.6, -1.0, 0.4)
    frame = renderer.render(scene, lights=[light], size=SIZE, samples=1)
    mesh = scene.nodes[1].mesh
    middles = mesh.positions[mesh.triangles].mean(axis=1)
    fans = np.stack([np.roll(mesh.triangles, -k, axis=1) for k in range(3)], axis=1)
    fans[:, :, 2] = len(mesh.positions) + np.arange(len(mesh.triangles))[:, None]
    variants = {
        "permuted": (mesh.positions, mesh.triangles[::-1]),
        "duplicated": (mesh.positions, np.concatenate([mesh.triangles, mesh.triangles])),
        "subdivided": (np.concatenate([mesh.positions, middles]), fans.reshape(-1, 3)),
    }
    for solid in variants.values():
        other = Scene((scene.nodes[0], node("box", solid)), ABOVE)
        assert_same_image(frame, renderer.render(other, lights=[light], size=SIZE, samples=1))
    more = box_scene(node("more", shapes.box((0.4, 0.4, 0.4), (-1.5, 1.5, 1.0))))
    darker = renderer.render(more, lights=[light], size=SIZE, samples=1)
    brighter = darker.visibility > frame.visibility + 0.51
    on_new = np.abs(darker.image.astype(int) - frame.image.astype(int)).max(axis=-1) > 0
    assert not (brighter[0] & ~on_new).any()
    assert np.nanmean(darker.visibility) < np.nanmean(frame.visibility)


def test_deterministic(renderer: Renderer) -> None:
    """Bit for bit, also after other scenes, sizes, formats and lights on the same renderer, and in a new one."""
    scene, lights = box_scene(), many_lights()[:4]
    first = renderer.render(scene, lights=lights, size=SIZE, outputs=OUTPUTS, samples=1)
    renderer.render(builtin.room(rods=True).scene, size=(33, 17), samples=1)
    renderer.render(
        sheet_scene(AlphaMode.MASK), lights=[sun(target=Target.RGBA8, faces=Faces.BACK)], size=(128, 31), samples=1
    )
    renderer.render(scene, lights=[sun(bias=SlopeScaledBias())], size=(16, 300), outputs=("shadow_maps",), samples=1)
    again = [renderer.render(scene, lights=lights, size=SIZE, outputs=OUTPUTS, samples=1)]
    with Renderer("egl") as other:
        again.append(other.render(scene, lights=lights, size=SIZE, outputs=OUTPUTS, samples=1))
    for frame in again:
        for name in OUTPUTS:
            if name != "timings":
                for a, b in zip(getattr(first, name), getattr(frame, name), strict=True):
                    np.testing.assert_array_equal(a, b, err_msg=name)


# -- frames


def test_frame_outlives_its_renderer() -> None:
    with Renderer("egl") as renderer:
        frame = renderer.render(box_scene(), lights=[sun()], size=SIZE, outputs=OUTPUTS, samples=1)
        copy = frame.image.copy()
        renderer.render(builtin.ball().scene, size=SIZE, samples=1)
    np.testing.assert_array_equal(frame.image, copy)
    assert np.nansum(frame.visibility) > 0.0
    assert frame.used[0].as_dict()["views"][0]["resolution"] == 512


@pytest.mark.parametrize("ending", ["png", "tif", "jpg"])
def test_save_image(renderer: Renderer, tmp_path: Path, ending: str) -> None:
    frame = renderer.render(box_scene(), lights=[sun()], size=SIZE, samples=1)
    path = tmp_path / f"picture.{ending}"
    frame.save(path)
    read = image.read(path)[..., :3]
    assert read.shape == frame.image.shape
    difference = np.abs(read.astype(int) - frame.image.astype(int))
    assert difference.max() == 0 if ending != "jpg" else difference.mean() < 4.0


def test_save_exr(renderer: Renderer, tmp_path: Path) -> None:
    import OpenImageIO as oiio

    lights = [sun(), sun(0.5)]
    frame = renderer.render(
        box_scene(), lights=lights, size=SIZE, outputs=("linear", "visibility", "depth", "depth_metric"), samples=1
    )
    path = tmp_path / "channels.exr"
    frame.save(path)
    source = oiio.ImageInput.open(str(path))
    names = list(source.spec().channelnames)
    pixels = source.read_image("float")
    source.close()
    assert pixels.shape[:2] == (SIZE[1], SIZE[0])
    for channel, expected in {
        "visibility.0": frame.visibility[0],
        "visibility.1": frame.visibility[1],
        "Z": frame.depth,
        "depth_metric": frame.depth_metric,
    }.items():
        found = next(name for name in names if name.startswith(channel))
        np.testing.assert_array_equal(pixels[..., names.index(found)], expected)


def test_save_without_image(renderer: Renderer, tmp_path: Path) -> None:
    frame = renderer.render(box_scene(), lights=[sun()], size=SIZE, outputs=("visibility",), samples=1)
    with pytest.raises(SettingsError, match='this frame has no "image"'):
        frame.save(tmp_path / "picture.png")
    assert list(tmp_path.iterdir()) == []


def test_decoded_inverts_the_encoding() -> None:
    levels = np.arange(256, dtype=np.uint8)
    linear = decoded(levels).astype(np.float64)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1.0 / 2.4) - 0.055)
    np.testing.assert_allclose(encoded * 255.0, levels, atol=1e-3)


# -- refusals


@pytest.mark.parametrize("size", [(0, 0), (0, 10), (10, -1), (10.0, 10), (10,), (10, 10, 10)])
def test_wrong_size(renderer: Renderer, size: Any) -> None:
    with pytest.raises(SettingsError, match="size must be two integers"):
        renderer.render(box_scene(), size=size, samples=1)


def test_smallest_image(renderer: Renderer) -> None:
    frame = renderer.render(box_scene(), lights=[sun()], size=(1, 1), samples=1)
    assert frame.image.shape == (1, 1, 3)
    assert frame.visibility.shape == (1, 1, 1)


@pytest.mark.parametrize("outputs", [(), ("picture",), ("image", "normals")])
def test_wrong_outputs(renderer: Renderer, outputs: Any) -> None:
    with pytest.raises(SettingsError, match="outputs must be some of image, visibility"):
        renderer.render(box_scene(), size=SIZE, outputs=outputs, samples=1)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"camera": "above"}, SettingsError, "camera must be"),
        ({"lights": ["sun"]}, SettingsError, r"lights\[0\] must be"),
        ({"ambient": np.nan}, SettingsError, "ambient must be 3 finite numbers"),
        ({"background": (0.0, np.inf, 0.0)}, SettingsError, "background must be 3 finite numbers"),
    ],
)
def test_wrong_arguments(renderer: Renderer, arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        renderer.render(box_scene(), size=SIZE, **arguments)


def test_not_a_scene(renderer: Renderer) -> None:
    with pytest.raises(SceneError, match=r"a glshadow.Scene is needed .* got Mesh"):
        renderer.render(box_scene().nodes[0].mesh, samples=1)  # type: ignore[arg-type]


def test_released_renderer() -> None:
    renderer = Renderer("egl")
    renderer.release()
    renderer.release()
    with pytest.raises(GlshadowError, match="was released"):
        renderer.render(box_scene(), size=SIZE, samples=1)


def test_empty_view_warns(renderer: Renderer) -> None:
    away = PerspectiveCamera((0.0, 5.0, 20.0), (0.0, 5.0, 40.0))
    with pytest.warns(GlshadowWarning, match="nothing is in view"):
        frame = renderer.render(box_scene(), away, [sun()], SIZE, background=(1.0, 0.5, 0.0), samples=1)
    assert np.isnan(frame.visibility).all()
    assert (frame.image == [255, 128, 0]).all()


def test_one_call(tmp_path: Path) -> None:
    path = tmp_path / "out.png"
    frame = render(box_scene(), lights=[sun()], size=SIZE, path=path, samples=1)
    np.testing.assert_array_equal(image.read(path)[..., :3], frame.image)
