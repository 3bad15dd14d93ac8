"""Pictures of materials against closed forms: samplers, unlit and emissive surfaces, normal and occlusion maps, metal and roughness."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.core.srgb import srgb_from_linear
from glshadow.geometry.tangents import face_tangents
from glshadow.lights.reflection import reflected
from glshadow.scenes import shapes

SIZE = (64, 64)
FRONT = gs.OrthographicCamera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), height=2.0)
HEAD_ON = gs.DirectionalLight(direction=(0.0, 0.0, -1.0))
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
PACKED = 3e-3
"""Colours are stored by 11 bits of their square root, emission by 9 bits of it: 2 / 1023 at 1; materials and normals by 8 and 16 bits."""


def square(material: gs.Material, turn: Array | None = None, **more: Any) -> gs.Scene:
    """A square of side 2 that faces the camera."""
    mesh = gs.Mesh(*shapes.rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), uv=UV, material=material, **more)
    return gs.Scene((gs.Node(mesh, np.eye(4) if turn is None else turn),))


def drawn(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light | None = HEAD_ON, **look: Any) -> Array:
    """Linear light (H, W, 3)."""
    lights = [] if light is None else [light]
    settings = {"ambient": 0.0, "background": (0, 0, 0), "samples": 1, "camera": FRONT} | look
    return renderer.render(scene, settings.pop("camera"), lights, SIZE, outputs=("linear",), **settings).linear


def of_case(models: Path, name: str) -> gs.Scene:
    return gs.load(models.parent / "cases" / "meant" / f"{name}.glb")


def texels(*row: tuple[int, int, int]) -> np.ndarray:
    return np.array([[(*each, 255) for each in row]], dtype=np.uint8)


@pytest.mark.parametrize("samples", [1, 4])
def test_files_with_one_right_picture(renderer: gs.Renderer, models: Path, samples: int) -> None:
    look: dict[str, Any] = {"ambient": 1.0, "background": (0, 0, 0), "samples": samples, "tone": "none"}
    red, green = [255, 0, 0], [0, 255, 0]
    # uv from -.5 to 1.5 over the texels red, green; clamped
    image = renderer.render(of_case(models, "wrap_clamp"), FRONT, [], SIZE, **look).image
    assert image[32, [2, 20, 30, 34, 44, 61]].tolist() == [red] * 3 + [green] * 3
    image = renderer.render(of_case(models, "filter_nearest"), FRONT, [], SIZE, **look).image
    assert np.unique(image[:, :31].reshape(-1, 3), axis=0).tolist() == [red]
    assert np.unique(image[:, 33:].reshape(-1, 3), axis=0).tolist() == [green]
    for name in ("unlit", "emissive"):
        for light in (None, HEAD_ON):
            shown = renderer.render(
                of_case(models, name), FRONT, [] if light is None else [light], SIZE, **{**look, "ambient": 0.0}
            ).image
            assert np.unique(shown).tolist() == [188], name


@pytest.mark.parametrize(
    ("wrap", "row"),
    [("repeat", "GRRGGR"), ("clamp", "RRRGGG"), ("mirror", "RRRGGG"), (("clamp", "repeat"), "RRRGGG")],
)
def test_wrapping_and_transform(renderer: gs.Renderer, wrap: Any, row: str) -> None:
    """u from -.25 to 1.25, six parts of a quarter."""
    place = np.array([[1.5, 0.0, -0.25], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    sampler = gs.Sampler(wrap, "nearest", "nearest", transform=place)
    found = drawn(renderer, square(gs.Material(texture=texels((255, 0, 0), (0, 255, 0)), sampler=sampler)))
    shown = "".join("RG"[int(found[32, k].argmax())] for k in (5, 16, 26, 37, 48, 58))
    assert shown == row


def test_two_sets_of_coordinates(renderer: gs.Renderer) -> None:
    second = UV[:, ::-1].copy()
    scene = square(
        gs.Material(texture=texels((255, 0, 0), (0, 255, 0)), sampler=gs.Sampler("clamp", "nearest", uv_set=1)),
        second_uv=second,
    )
    found = drawn(renderer, scene)
    assert found[60, 32].argmax() == 0  # v is now across: red below
    assert found[3, 32].argmax() == 1


def test_emission_is_added_once(renderer: gs.Renderer) -> None:
    emission = (0.25, 4.0, 1000.0)
    scene = square(gs.Material((0.5, 0.5, 0.5, 1.0), emission=emission))
    for lights in (0, 1, 3):
        for samples in (1, 4):
            frame = renderer.render(
                scene, FRONT, [HEAD_ON] * lights, SIZE, ambient=0.125, samples=samples, outputs=("linear", "visibility")
            )
            expected = np.array(emission) + 0.5 * (0.125 + lights)
            # each channel to half a step of 1 / 511 of the square root below the brightest
            np.testing.assert_allclose(frame.linear[32, 32], expected, atol=1100.0 / 511.0 * 0.05, rtol=2e-3)
    dim = drawn(renderer, square(gs.Material((0.0, 0.0, 0.0, 1.0), emission=(0.3, 0.2, 0.1))), None)
    np.testing.assert_allclose(dim[32, 32], (0.3, 0.2, 0.1), atol=1e-3)


def test_emission_map_and_unlit_texture(renderer: gs.Renderer) -> None:
    pixels = texels((255, 128, 64))
    lamp = gs.Material((0.0, 0.0, 0.0, 1.0), emission=(1.0, 1.0, 0.5), emission_map=pixels)
    sun = gs.Material(texture=pixels, unlit=True, color=(1.0, 1.0, 0.5, 1.0))
    for material in (lamp, sun):
        found = srgb_from_linear(drawn(renderer, square(material), None)[32, 32]) * 255.0
        np.testing.assert_allclose(found[:2], (255.0, 128.0), atol=0.5)
    assert not drawn(renderer, square(gs.Material(emission_map=pixels)), None).any(), "the factor is black"


def test_neighbours_are_as_they_would_be_alone(renderer: gs.Renderer) -> None:
    """What is matte beside a metal, a lamp and a normal map: within the rounding of colours."""
    matte = gs.Material((0.6, 0.3, 0.1, 1.0))
    positions, triangles = shapes.rectangle((-1, -1, 0), (1, 0, 0), (0, 2, 0))
    plain = gs.Node(gs.Mesh(positions, triangles, uv=UV, material=matte), np.eye(4), "plain")
    other = gs.Material(metallic=1.0, roughness=0.3, normal_map=texels((128, 128, 255)), emission=(1.0, 0.0, 0.0))
    beside = gs.Node(
        gs.Mesh(positions + np.array([1.0, 0.0, 0.0]), triangles, uv=UV, material=other), np.eye(4), "beside"
    )
    light = gs.DirectionalLight(direction=(0.5, -0.3, -1.0))
    alone = drawn(renderer, gs.Scene((plain,)), light, ambient=0.2)
    both = drawn(renderer, gs.Scene((plain, beside)), light, ambient=0.2)
    np.testing.assert_allclose(both[:, :31], alone[:, :31], atol=PACKED)
    assert (both[:, 33:, 0] >= 1.0).all()


def test_occlusion_scales_the_ambient_light_alone(renderer: gs.Renderer) -> None:
    pixels = texels((51, 0, 0))  # .2
    for strength, share in ((1.0, 0.2), (0.5, 0.6), (0.0, 1.0)):
        scene = square(gs.Material((0.5, 0.5, 0.5, 1.0), occlusion_map=pixels, occlusion_strength=strength))
        for light in (None, HEAD_ON):
            found = drawn(renderer, scene, light, ambient=0.4)[32, 32]
            np.testing.assert_allclose(found, 0.5 * (0.4 * share + (light is not None)), atol=PACKED)


TILTS = ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (-0.4, -0.3))


def tilted(x: float, y: float) -> np.ndarray:
    """One texel of a normal map."""
    normal = np.array([x, y, np.sqrt(1.0 - x * x - y * y)])
    return texels(tuple(np.rint(normal * 127.5 + 127.5).astype(int).tolist()))  # type: ignore[arg-type]


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("kind", ["flat", "smooth", "tangents"])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("instances", [1, 9])
def test_normal_maps(
    renderer: gs.Renderer, tilt: tuple[float, float], kind: str, mirrored: bool, instances: int
) -> None:
    """The Lambert term of the mapped normal, on a square that is turned, and mirrored: then its u runs to the left."""
    texel = tilted(*tilt)
    mapped = texel[0, 0, :3] / 127.5 - 1.0
    mapped /= np.linalg.norm(mapped)
    turn = np.eye(4)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    if mirrored:
        turn[:, 0] *= -1.0
    more: dict[str, Any] = {} if kind == "flat" else {"normals": np.tile([0.0, 0.0, 1.0], (4, 1))}
    if kind == "tangents":
        more["tangents"] = np.tile([1.0, 0.0, 0.0, 1.0], (4, 1))
    node = square(gs.Material(normal_map=texel), turn, **more).nodes[0]
    scene = gs.Scene(tuple(gs.Node(node.mesh, turn, receives=bool(k)) for k in range(instances)))
    light = gs.DirectionalLight(direction=(0.3, -0.4, -1.0))
    expected = (turn[:3, :3] @ mapped) @ light.to_light(np.zeros(3))[0]
    found = drawn(renderer, scene, light)
    np.testing.assert_allclose(found[32, 20:44], expected, atol=1e-3)  # a normal within 6.5e-5, colours by 11 bits
    frame = renderer.render(scene, FRONT, [light], SIZE, samples=1, outputs=("normal", "visibility"))
    assert np.abs(frame.normal[32, 20:44] - (0.0, 0.0, 1.0)).max() < 1e-7
    assert (frame.visibility[0, 32, 20:44] == 1.0).all()


def test_normal_map_from_behind(renderer: gs.Renderer) -> None:
    """Seen from behind, the whole normal is turned."""
    texel = tilted(0.5, 0.0)
    mapped = texel[0, 0, :3] / 127.5 - 1.0
    mapped /= np.linalg.norm(mapped)
    behind = gs.OrthographicCamera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), height=2.0)
    light = gs.DirectionalLight(direction=(0.3, 0.0, 1.0))
    for normals in ({}, {"normals": np.tile([0.0, 0.0, 1.0], (4, 1))}):
        found = drawn(renderer, square(gs.Material(normal_map=texel), **normals), light, camera=behind)
        np.testing.assert_allclose(found[32, 32], -mapped @ light.to_light(np.zeros(3))[0], atol=1e-3)


def sphere(material: gs.Material) -> gs.Scene:
    positions, triangles = shapes.icosphere(5, 0.9)
    normals = shapes.vertex_normals((positions, triangles))
    return gs.Scene((gs.Mesh(positions, triangles, normals, material=material),))


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("name", ["sun", "spot", "point", "perspective"])
def test_sphere_equals_the_twin(renderer: gs.Renderer, metallic: float, roughness: float, name: str) -> None:
    color = np.array([0.8, 0.4, 0.1])
    material = gs.Material((*color, 1.0), metallic=metallic, roughness=roughness)
    lights: dict[str, gs.Light] = {
        "sun": gs.DirectionalLight(direction=(-0.4, -0.7, -0.8), shadow=None),
        "spot": gs.SpotLight(position=(2, 3, 4), direction=(-2, -3, -4), outer_angle=40.0, shadow=None, falloff=1.0),
        "point": gs.PointLight(position=(-2.0, 2.0, 3.0), falloff=2.0, intensity=9.0, shadow=None),
    }
    light = lights.get(name, lights["sun"])
    camera = gs.PerspectiveCamera((1.0, 0.5, 3.0), (0, 0, 0), fov_y=40.0) if name == "perspective" else FRONT
    outputs = ("linear", "triangle", "position")
    frame = renderer.render(sphere(material), camera, [light], (96, 96), ambient=0.0, outputs=outputs, samples=1)
    spot = np.where((frame.triangle >= 0)[..., None], frame.position, np.nan)
    normal = spot / np.linalg.norm(spot, axis=-1, keepdims=True)
    # from pixel to pixel: NaN at the border
    change = np.max([np.linalg.norm(np.gradient(normal, axis=axis), axis=-1) for axis in (0, 1)], axis=0)
    seen = ~np.isnan(change)
    points, normals = spot[seen], normal[seen]
    directions = camera.rays((96, 96))[1][seen]
    to_eye = -directions / np.linalg.norm(directions, axis=1, keepdims=True)
    towards = light.to_light(points)[0]
    stored = (np.rint(np.sqrt(color) * (2047, 2047, 1023)) / (2047, 2047, 1023)) ** 2
    metal = np.full(len(points), np.rint(metallic * 255.0) / 255.0)
    rougher = 0.0 if material.rough else change[seen]
    rough = np.minimum(np.rint((roughness + rougher) * 254.0) / 254.0, 1.0) * np.ones(len(points))
    expected = reflected(np.tile(stored, (len(points), 1)), metal, rough, normals, to_eye, towards)
    expected *= (light.intensity * light.strength(points))[:, None]
    gap = np.abs(frame.linear[seen] - expected)
    # Vertex normals are interpolated over facets of 2 degrees and stored by 16 bits: 2e-4 radians off the sphere's. The roughness grows by
    # differences of a quad of pixels, here by central ones: a few per cent of its growth, a fifth of a lobe that it doubles.
    loose = 0.2 if roughness < 0.1 else 0.06 if roughness < 0.3 else 0.02
    facing = ((normals * towards).sum(axis=1) > 0.02) & ((normals * to_eye).sum(axis=1) > 0.3)
    assert facing.sum() > 2000
    assert (gap[facing] <= 2e-3 + loose * expected[facing]).mean() > 0.99
    assert gap[facing].mean() < 2e-3 + 0.1 * loose * expected[facing].mean()


@pytest.mark.parametrize("roughness", [0.3, 0.5, 1.0])
def test_white_furnace(renderer: gs.Renderer, roughness: float) -> None:
    """Light from all directions, by 3,000 directional lights of equal solid angles: a white metal sends back what arrives."""
    count, batch = 3000, 50
    k = np.arange(count) + 0.5
    z = 1.0 - k / count
    turn = np.pi * (1.0 + 5.0**0.5) * k
    directions = -np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    scene = square(gs.Material(metallic=1.0, roughness=roughness))
    camera = gs.OrthographicCamera((3.0, 0.0, 4.0), (0.0, 0.0, 0.0), height=0.5)
    total = np.zeros(3)
    for some in np.split(directions, range(batch, count, batch)):
        lights = [gs.DirectionalLight(direction=tuple(each), shadow=None) for each in some.tolist()]
        frame = renderer.render(scene, camera, lights, (8, 8), ambient=0.0, outputs=("linear",), samples=1)
        total += frame.linear[4, 4]
    # a hemisphere of radiance 1: each light stands for 2 pi / count steradians, and pi of them make an irradiance of 1
    np.testing.assert_allclose(total * 2.0 / count, 1.0, atol=0.01)


def test_ambient_light_reflects_the_base_colour(renderer: gs.Renderer) -> None:
    for metallic in (0.0, 1.0):
        scene = square(gs.Material((0.8, 0.4, 0.2, 1.0), metallic=metallic, roughness=0.3))
        found = drawn(renderer, scene, None, ambient=0.5)[32, 32]
        np.testing.assert_allclose(found, (0.4, 0.2, 0.1), atol=PACKED)


def test_metallic_roughness_map(renderer: gs.Renderer) -> None:
    """Green times the roughness, blue times metallic: the same as factors."""
    pixels = texels((7, 128, 64))
    light = gs.DirectionalLight(direction=(-0.3, 0.2, -1.0))
    mapped = gs.Material((0.8, 0.4, 0.2, 1.0), metallic=0.5, roughness=0.8, metallic_roughness_map=pixels)
    plain = gs.Material(
        (0.8, 0.4, 0.2, 1.0), metallic=0.5 * 64 / 255, roughness=0.8 * 128 / 255
    )  # roughness in 254 steps
    np.testing.assert_allclose(drawn(renderer, square(mapped), light), drawn(renderer, square(plain), light), atol=1e-6)


@pytest.mark.parametrize("kind", [gs.RectLight, gs.SkyLight])
def test_wide_lights_reach_glossy_surfaces(renderer: gs.Renderer, kind: type[gs.Light]) -> None:
    """A sky is reflected as light from everywhere, a rectangle about as by a lamp at its middle."""
    sky = kind is gs.SkyLight
    light = (
        gs.SkyLight(shadow=None)
        if sky
        else gs.RectLight(
            position=(0.0, 0.0, 9.0), direction=(0, 0, -1), up=(0, 1, 0), width=0.5, height=0.5, shadow=None
        )
    )
    found = drawn(renderer, square(gs.Material((0.5, 0.5, 0.5, 1.0), metallic=1.0, roughness=0.6)), light)[32, 32]
    matte = drawn(renderer, square(gs.Material((0.5, 0.5, 0.5, 1.0))), light)[32, 32]
    if sky:
        np.testing.assert_allclose(found, matte, atol=PACKED)
    else:
        color, one, up = np.full((1, 3), 0.5), np.ones(1), np.array([[0.0, 0.0, 1.0]])
        np.testing.assert_allclose(found, matte / 0.5 * reflected(color, one, 0.6 * one, up, up, up)[0], rtol=0.02)


def test_plain_scene_needs_nothing_more(renderer: gs.Renderer) -> None:
    """What no material asks for is neither compiled nor stored."""
    with gs.Renderer("egl") as fresh:
        fresh.render(gs.scenes.box().scene, None, None, SIZE, samples=1)
        cache = fresh._cache
        features = cache.scene._thing.features if hasattr(cache.scene, "_thing") else None
        assert features is None or not features.any
        assert all("GLS_MATERIAL" not in str(key) for key in cache.programs._programs)


@pytest.mark.parametrize("smooth", [False, True])
def test_edges_of_triangles_have_the_same_mapped_normal(renderer: gs.Renderer, smooth: bool) -> None:
    """A turned plane of small triangles: the pixels that are drawn again for their exact rays are shaded like all others."""
    texel = tilted(0.5, -0.2)
    mapped = texel[0, 0, :3] / 127.5 - 1.0
    mapped /= np.linalg.norm(mapped)
    count = 40
    v, u = np.meshgrid(np.linspace(0.0, 1.0, count + 1), np.linspace(0.0, 1.0, count + 1), indexing="ij")
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    # every triangle has another tangent
    uv, places = uv + np.random.default_rng(3).uniform(-0.3, 0.3, uv.shape) / count, uv
    positions = np.concatenate([3.0 * places - 1.5, np.zeros((len(uv), 1))], axis=1)
    a = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    b, c, d = a + 1, a + count + 2, a + count + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    turn = np.eye(4)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    normals = np.tile([0.0, 0.0, 1.0], (len(uv), 1)) if smooth else None
    material = gs.Material(normal_map=texel, metallic_roughness_map=texels((255, 255, 255)), roughness=0.9)
    scene = gs.Scene((gs.Node(gs.Mesh(positions, triangles, normals, uv, material=material), turn),))
    light = gs.DirectionalLight(direction=(0.3, -0.4, -1.0), shadow=None)
    found = drawn(renderer, scene, light)
    shown = renderer.render(scene, FRONT, [], SIZE, samples=1, outputs=("triangle",)).triangle
    tangents, _ = face_tangents(positions[triangles], uv.astype(np.float32).astype(np.float64)[triangles])
    third = np.cross([0.0, 0.0, 1.0], tangents[:, :3]) * tangents[:, 3:]
    normal = mapped[0] * tangents[:, :3] + mapped[1] * third + mapped[2] * np.array([0.0, 0.0, 1.0])
    flat = normal @ turn[:3, :3].T
    rough = np.full(len(flat), np.rint(0.9 * 254.0) / 254.0)
    shape = flat.shape
    up, towards = np.broadcast_to([0.0, 0.0, 1.0], shape), np.broadcast_to(light.to_light(np.zeros(3))[0], shape)
    expected = reflected(np.ones(shape), 0.0 * rough, rough, flat, up, towards)
    assert np.ptp(expected) > 0.2
    assert np.abs(found - expected[shown]).max() < PACKED
