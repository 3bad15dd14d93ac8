"""EnvironmentLight: closed forms of its irradiance, its directions and its shadows; what it refuses."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.cli import values
from glshadow.core.equirectangular import reduced, solid_angles
from glshadow.core.spaces import Array
from glshadow.image import write
from glshadow.lights import Light
from glshadow.scenes import shapes

SIZE = (96, 54)
OUTPUTS = ("linear", "visibility", "triangle", "position", "normal")
CELL = np.pi / 128
"""Of the irradiance table, radians."""


@pytest.fixture(scope="module")
def normals() -> Array:
    found = np.random.default_rng(7).normal(size=(4000, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    return np.concatenate([found / np.linalg.norm(found, axis=1, keepdims=True), axes])


def image_of(rows: int, texels: dict[tuple[int, int], tuple[float, float, float]], rest: float = 0.0) -> Array:
    image = np.full((rows, 2 * rows, 3), rest)
    for place, color in texels.items():
        image[place] = color
    return image


def dome(rows: int = 2) -> Array:
    """White above the horizon."""
    image = np.zeros((rows, 2 * rows, 3))
    image[: rows // 2] = 1.0
    return image


def centre(row: Any, column: Any, rows: int) -> Array:
    """Direction to the middle of a texel."""
    down, around = np.pi * (row + 0.5) / rows, np.pi * (column + 0.5) / rows - np.pi
    return np.array([np.sin(down) * np.sin(around), np.cos(down), -np.sin(down) * np.cos(around)])


# -- irradiance, in float64


@pytest.mark.parametrize("shape", [(1, 1), (2, 4), (64, 128), (700, 900)])
def test_uniform_map_lights_every_normal_by_its_radiance(normals: Array, shape: tuple[int, int]) -> None:
    """A white furnace. The texels that the horizon crosses count by their mean direction: short by less than (CELL / 2)^2 / 2."""
    light = gs.EnvironmentLight(np.full((*shape, 3), (0.5, 1.0, 2.0)))
    found = light.irradiance(normals, normals) / np.array([0.5, 1.0, 2.0])
    np.testing.assert_allclose(found, 1.0, atol=CELL**2 / 8)


@pytest.mark.parametrize("rows", [2, 64, 512])
def test_white_dome_is_a_sky_light(normals: Array, rows: int) -> None:
    light, sky = gs.EnvironmentLight(dome(rows)), gs.SkyLight()
    expected = sky.irradiance(normals, normals)
    np.testing.assert_allclose(light.irradiance(normals, normals), expected[:, None] * np.ones(3), atol=CELL**2 / 8)
    up = np.array([[0.0, 1.0, 0.0]])
    np.testing.assert_allclose(light.irradiance(up, up), 1.0, rtol=1e-12)
    for count in (16, 64, 256):
        own, known = (np.array([each.place[:3] for each in given.hard_lights(count)]) for given in (light, sky))
        np.testing.assert_allclose(own, known, atol=1e-12)
        colors = np.array([each.color for each in light.hard_lights(count)])
        np.testing.assert_allclose(colors, 1.0 / count, rtol=1e-12)


@pytest.mark.parametrize(("row", "column"), [(40, 300), (130, 0), (200, 511)])
def test_one_texel_is_a_sun(normals: Array, row: int, column: int) -> None:
    """The kink where the sun sets is interpolated between normals CELL apart, in both directions; a texel counts by its moment."""
    rows = 256
    radiance = np.array([3e4, 2e4, 1e4])
    light = gs.EnvironmentLight(image_of(rows, {(row, column): tuple(radiance)}))
    towards = centre(row, column, rows)
    solid = solid_angles((rows, 2 * rows))[row]
    expected = np.maximum(normals @ towards, 0.0)[:, None] * radiance * solid / np.pi
    np.testing.assert_allclose(light.irradiance(normals, normals), expected, atol=0.4 * CELL * expected.max())
    away = np.abs(normals @ towards) > 2.0 * CELL
    np.testing.assert_allclose(
        light.irradiance(normals, normals)[away],
        expected[away],
        atol=(CELL**2 / 4 + (np.pi / rows) ** 2 / 12) * expected.max(),
    )
    suns = light.hard_lights(64)
    places = np.array([sun.place[:3] for sun in suns])
    assert np.arccos(np.clip(places @ towards, -1.0, 1.0)).max() < np.pi / rows
    np.testing.assert_allclose(
        np.sum([sun.color for sun in suns], axis=0), radiance / (radiance @ [0.2126, 0.7152, 0.0722])
    )


def test_light_is_conserved_in_each_channel(rng: np.random.Generator) -> None:
    image = rng.random((300, 500, 3)) ** 8
    image[40, 77], image[200, 9] = (9e3, 5e3, 100.0), (10.0, 200.0, 8e3)
    light = gs.EnvironmentLight(image)
    assert light.image.radiance.shape == (300, 500, 3)
    flux = (image.astype(np.float32).astype(np.float64) * solid_angles(image.shape)[:, None, None]).sum(axis=(0, 1))
    for count in (16, 64, 1024):
        colors = np.array([each.color for each in light.hard_lights(count)])
        assert len(colors) <= count
        np.testing.assert_allclose(colors.sum(axis=0), flux / (flux @ [0.2126, 0.7152, 0.0722]), rtol=1e-9)
    small = reduced(image, 128, 100)
    np.testing.assert_allclose((small * solid_angles(small.shape)[:, None, None]).sum(axis=(0, 1)),
                               (image * solid_angles(image.shape)[:, None, None]).sum(axis=(0, 1)), rtol=1e-12)  # fmt: skip


def test_random_directions_follow_the_luminance(rng: np.random.Generator) -> None:
    image = np.zeros((16, 32, 3))
    image[3, 4], image[10, 20] = (1.0, 1.0, 1.0), (0.0, 3.0, 0.0)
    light = gs.EnvironmentLight(image)
    weight = (image @ [0.2126, 0.7152, 0.0722])[[3, 10], [4, 20]] * solid_angles((16, 32))[[3, 10]]
    aims = np.concatenate([aim for aim, _ in light.aims(np.zeros((50, 3)), 64, rng)])
    near = np.array([(aims @ centre(*place, 16) > np.cos(np.pi / 16)).mean() for place in ((3, 4), (10, 20))])
    assert near.sum() == 1.0
    np.testing.assert_allclose(near, weight / weight.sum(), atol=1.0 / 64)  # one stratum of 64


# -- axes


def test_centre_is_towards_minus_z_and_turn_is_counterclockwise() -> None:
    ahead = gs.EnvironmentLight(image_of(63, {(31, 62): (1.0, 1.0, 1.0), (31, 63): (1.0, 1.0, 1.0)}))
    for turn, expected in ((0.0, (0, 0, -1)), (90.0, (-1, 0, 0)), (-90.0, (1, 0, 0)), (180.0, (0, 0, 1))):
        places = np.array([each.place[:3] for each in replace(ahead, turn=turn).hard_lights(8)])
        np.testing.assert_allclose(places.mean(axis=0), expected, atol=0.02)
    right = gs.EnvironmentLight(image_of(63, {(31, 94): (1.0, 1.0, 1.0)}))  # three quarters from the left
    assert right.hard_lights(1)[0].place[0] > 0.99
    tall = gs.EnvironmentLight(
        image_of(63, {(31, 62): (1.0, 1.0, 1.0), (31, 63): (1.0, 1.0, 1.0)}), direction=(0, 0, -1)
    )
    np.testing.assert_allclose(np.mean([each.place[:3] for each in tall.hard_lights(8)], axis=0), (0, 1, 0), atol=0.02)


def test_turn_equals_the_turned_scene(normals: Array, rng: np.random.Generator) -> None:
    light = gs.EnvironmentLight(rng.random((32, 64, 3)) ** 4)
    angle = np.radians(37.0)
    about_y = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    turned = replace(light, turn=37.0)
    np.testing.assert_allclose(
        turned.irradiance(normals, normals @ about_y.T), light.irradiance(normals, normals), atol=1e-12
    )
    np.testing.assert_allclose(turned.axes @ about_y, light.axes, atol=1e-12)
    assert light.turned(about_y, np.zeros(3)).turn == pytest.approx(37.0)
    tilt = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.turned(tilt, np.zeros(3)).axes @ tilt, turned.axes, atol=1e-12)


# -- shadows


def block() -> gs.Scene:
    """A white ground with a white box on it."""
    return gs.scenes.box().scene


def test_shadow_of_a_white_dome_is_that_of_the_sky(renderer: gs.Renderer) -> None:
    shadow = gs.Shadow(filter=gs.DirectionMaps(256))  # by default a sky over few triangles has more directions
    light, sky = gs.EnvironmentLight(dome(), shadow=shadow), gs.SkyLight(shadow=shadow)
    own, known = (renderer.render(block(), None, [each], SIZE, outputs=OUTPUTS, ambient=0.0) for each in (light, sky))
    np.testing.assert_allclose(own.visibility, known.visibility, atol=1e-5, equal_nan=True)  # float32 sums of 64
    np.testing.assert_allclose(own.linear, known.linear, atol=CELL**2 / 8 + 1e-5)
    assert np.nanmin(own.visibility) < 0.9


def test_shadow_of_one_texel_is_that_of_a_sun(renderer: gs.Renderer) -> None:
    rows, row, column = 512, 140, 400
    towards = centre(row, column, rows)
    light = gs.EnvironmentLight(image_of(rows, {(row, column): (1e5, 1e5, 1e5)}))
    sun = gs.DirectionalLight(direction=tuple(-towards))
    own, known = (renderer.render(block(), None, [each], SIZE, outputs=OUTPUTS, samples=1) for each in (light, sun))
    surface = known.triangle >= 0
    differing = np.abs(own.visibility[0] - known.visibility[0])[surface] > 1e-6
    assert differing.mean() < 0.02  # the penumbra of a third of a degree
    assert 0.02 < (known.visibility[0][surface] == 0.0).mean() < 0.9


@pytest.mark.parametrize("filter", [None, gs.Exact()], ids=["default", "exact"])
def test_each_of_two_suns_alone_lights_the_shadow_of_the_other(renderer: gs.Renderer, filter: gs.Filter | None) -> None:
    """Exactly its colour: each channel has its own share."""
    rows, texels = 256, {(60, 150): (2e4, 0.0, 0.0), (70, 380): (0.0, 1e4, 3e4)}
    light = gs.EnvironmentLight(image_of(rows, texels), shadow=gs.Shadow(filter=filter))
    suns = []
    for place, color in texels.items():
        flux = np.array(color) * solid_angles((rows, 2 * rows))[place[0]] / np.pi
        suns.append(gs.DirectionalLight(direction=tuple(-centre(*place, rows)), color=tuple(flux)))
    own = renderer.render(block(), None, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    both = renderer.render(block(), None, suns, SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    # up to the sun's kink in the table, and but for pixels in the penumbra of a texel
    close = np.abs(own.linear - both.linear).max(axis=-1) < 0.4 * CELL * both.linear.max()
    surface = both.triangle >= 0
    assert close[surface].mean() > 0.97
    for shaded, lit in ((0, 1), (1, 0)):
        alone = surface & (both.visibility[shaded] == 0.0) & (both.visibility[lit] == 1.0) & close
        assert alone.sum() > 20
        dark = own.linear[alone][:, [0] if shaded == 0 else [1, 2]]
        assert (dark == 0.0).all()


@pytest.mark.parametrize("smooth", [False, True])
def test_furnace_on_a_ball(renderer: gs.Renderer, smooth: bool) -> None:
    """A white ball in a uniform white map is white: every normal, with its own shadow."""
    solid = shapes.icosphere(4, 1.0)
    normals = shapes.vertex_normals(solid) if smooth else None
    ball = gs.Mesh(*solid, normals=normals, material=gs.Material(color=(1.0, 1.0, 1.0, 1.0)))
    camera = gs.PerspectiveCamera(position=(0.4, 1.0, 2.5), target=(0.0, 0.0, 0.0))
    scene = gs.Scene((gs.Node(ball, np.eye(4), "ball"),), camera)
    for shadow, error in ((None, CELL**2 / 8 + 1e-5), (gs.Shadow(), 0.01)):
        light = gs.EnvironmentLight(np.ones((8, 16, 3)), shadow=shadow)
        frame = renderer.render(scene, camera, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
        surface = frame.triangle >= 0
        assert surface.sum() > 1000
        np.testing.assert_allclose(frame.linear[surface], 1.0, atol=error)


@pytest.mark.parametrize("filter", [None, gs.Exact(light_samples=16)], ids=["default", "exact"])
def test_visibility_is_that_of_the_light_whatever_the_base_colour(
    renderer: gs.Renderer, filter: gs.Filter | None
) -> None:
    """Also where all nodes have one colour, which passes then take for a part of the light's."""
    texels = {(60, 150): (2e4, 0.0, 0.0), (70, 380): (0.0, 1e4, 3e4)}
    light, scene = gs.EnvironmentLight(image_of(256, texels), shadow=gs.Shadow(filter=filter)), block()
    seen = []
    for color in ((1.0, 1.0, 1.0, 1.0), (0.9, 0.05, 0.4, 1.0)):
        nodes = tuple(
            replace(node, mesh=gs.Mesh(node.mesh.positions, node.mesh.triangles, material=gs.Material(color=color)))
            for node in scene.nodes
        )
        seen.append(renderer.render(gs.Scene(nodes, scene.camera), None, [light], SIZE, samples=1).visibility)
    np.testing.assert_array_equal(*seen)
    assert len(np.unique(seen[0][np.isfinite(seen[0])])) > 2


def test_weak_and_missing_shadows(renderer: gs.Renderer, rng: np.random.Generator) -> None:
    light = gs.EnvironmentLight(rng.random((8, 16, 3)) ** 3)
    full, half, none = (
        renderer.render(block(), None, [replace(light, shadow=each)], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
        for each in (gs.Shadow(), gs.Shadow(strength=0.5), None)
    )
    np.testing.assert_allclose(half.linear, 0.5 * (full.linear + none.linear), atol=1e-5)
    assert (none.linear + 1e-6 >= full.linear).all()


def test_samples_and_catcher(renderer: gs.Renderer, rng: np.random.Generator) -> None:
    """Multisampled pixels are shaded by the same light; a catcher shows the luminance of its shadow."""
    light = gs.EnvironmentLight(rng.random((8, 16, 3)) ** 3)
    one, four = (
        renderer.render(block(), None, [light], SIZE, outputs=("linear", "visibility"), samples=each) for each in (1, 4)
    )
    assert np.abs(one.linear - four.linear).mean() < 0.01
    scene = block()
    nodes = tuple(replace(node, catches=number == 0) for number, node in enumerate(scene.nodes))
    caught = renderer.render(gs.Scene(nodes, scene.camera), None, [light], SIZE, background=None, samples=1)
    assert caught.image[..., 3].min() == 0


def test_visibility_equals_rays(renderer: gs.Renderer) -> None:
    image = np.full((32, 64, 3), (0.2, 0.4, 1.0))
    image[16:] = 0.05
    image[9, 40] = (600.0, 500.0, 300.0)
    light = gs.EnvironmentLight(image, shadow=gs.Shadow(filter=gs.Exact(light_samples=256)))
    frame = renderer.render(block(), None, [light], SIZE, outputs=OUTPUTS, samples=1)
    truth = gs.trace(block(), None, [light], SIZE, light_samples=512, surface=frame.triangle, samples=1)
    difference = (frame.visibility[0] - truth.visibility[0])[frame.triangle >= 0]
    assert abs(difference.mean()) < 0.01
    assert np.abs(difference).mean() < 0.02
    assert np.abs(difference).max() < 0.25  # a sun's penumbra by a dozen directions


def test_filter_with_a_map(renderer: gs.Renderer) -> None:
    light = gs.EnvironmentLight(dome(), shadow=gs.Shadow(filter=gs.Pcf(1), resolution=256))
    frame = renderer.render(block(), None, [light], SIZE, samples=1)
    assert frame.used[0].filter == gs.LightSamples(64, of=gs.Pcf(1))


# -- reflections


def ball_of(metallic: float, roughness: float) -> tuple[gs.Scene, gs.PerspectiveCamera]:
    """A white ball of a material."""
    solid = shapes.icosphere(4, 1.0)
    material = gs.Material(color=(1.0, 1.0, 1.0, 1.0), metallic=metallic, roughness=roughness)
    ball = gs.Mesh(*solid, normals=shapes.vertex_normals(solid), material=material)
    camera = gs.PerspectiveCamera(position=(0.4, 1.0, 2.5), target=(0.0, 0.0, 0.0))
    return gs.Scene((gs.Node(ball, np.eye(4), "ball"),), camera), camera


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_furnace_of_materials(renderer: gs.Renderer, metallic: float, roughness: float) -> None:
    """White, whatever the material."""
    scene, camera = ball_of(metallic, roughness)
    light = gs.EnvironmentLight(np.ones((8, 16, 3)), shadow=None)
    frame = renderer.render(scene, camera, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    surface = frame.triangle >= 0
    np.testing.assert_allclose(frame.linear[surface], 1.0, atol=0.01)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.8])
def test_reflection_equals_its_twin(renderer: gs.Renderer, roughness: float, rng: np.random.Generator) -> None:
    """A flat white metal shows the filtered image where it mirrors the eye's ray. The surface buffer holds a roughness in 254 steps."""
    material = gs.Material(color=(1.0, 1.0, 1.0, 1.0), metallic=1.0, roughness=roughness)
    floor = gs.Mesh(*shapes.rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), material=material)
    camera = gs.PerspectiveCamera(position=(0.4, 1.0, 2.5), target=(0.0, 0.0, 0.0))
    scene = gs.Scene((gs.Node(floor, np.eye(4), "floor"),), camera)
    light = gs.EnvironmentLight(rng.random((6, 12, 3)), shadow=None, turn=30.0)
    frame = renderer.render(scene, camera, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    surface = frame.triangle >= 0
    ray = frame.position[surface].astype(np.float64) - np.array(camera.position)
    mirrored = ray / np.linalg.norm(ray, axis=1, keepdims=True) * np.array([1.0, -1.0, 1.0])
    stored = np.full(len(ray), max(round(254 * roughness) / 254, 0.045))
    expected = light.image.reflection(mirrored @ light.axes.T, stored)
    np.testing.assert_allclose(frame.linear[surface], expected, atol=1e-3)
    assert np.ptp(expected) > 0.1


def test_mirror_shows_the_image_and_a_rough_one_its_lobe(normals: Array) -> None:
    rows = 128
    row, column = np.mgrid[:rows, : 2 * rows]
    towards = np.moveaxis(centre(row, column, rows), 0, -1)
    image = 1.0 + 0.5 * towards @ np.array([[1.0, 0.0, 0.3], [0.0, 1.0, 0.3], [0.0, 0.0, 0.3]])
    found = gs.EnvironmentMap(image)
    linear = 0.5 * normals @ np.array([[1.0, 0.0, 0.3], [0.0, 1.0, 0.3], [0.0, 0.0, 0.3]])
    np.testing.assert_allclose(found.reflection(normals, np.zeros(len(normals))), 1.0 + linear, atol=CELL**2)
    # the mean cosine of the lobe scales what is linear in the direction
    cosine = (np.arange(200000) + 0.5) / 200000
    for level in (2, 5, 7):
        alpha = (level / 7) ** 2
        lobe = cosine / ((0.5 + 0.5 * cosine) * (alpha**2 - 1.0) + 1.0) ** 2
        kept = (lobe * cosine).sum() / lobe.sum()
        rough = found.reflection(normals, np.full(len(normals), level / 7))
        np.testing.assert_allclose(
            rough, 1.0 + kept * linear, atol=2e-3
        )  # a lobe of a few texels is sampled at their middles


# -- what is given


def test_map_is_a_value(tmp_path: Path) -> None:
    image = np.random.default_rng(1).random((8, 16, 3)).astype(np.float32)
    light = gs.EnvironmentLight(image, intensity=2.0)
    same, other = gs.EnvironmentLight(image.copy(), intensity=2.0), gs.EnvironmentLight(image[::-1], intensity=2.0)
    assert light == same
    assert hash(light) == hash(same)
    assert light.geometry == same.geometry != other.geometry
    assert light != other
    for again in (pickle.loads(pickle.dumps(light)), copy.deepcopy(light)):
        assert again == light
        assert not again.image.radiance.flags.writeable
    image[:] = 0.0
    assert light == same
    assert "16 x 8" in repr(light)
    assert len(repr(light)) < 400
    assert gs.EnvironmentLight(light.image).image is light.image
    path = tmp_path / "sky.exr"
    write(path, np.asarray(light.image.radiance))
    assert gs.EnvironmentLight(path, intensity=2.0) == light
    assert values.light(f"environment:{path}:intensity=2") == light
    assert values.light(f"environment:{path}:turn=30") == gs.EnvironmentLight(str(path), turn=30.0)


def test_formats_of_files(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    image = np.random.default_rng(1).random((24, 40, 3)).astype(np.float32)
    tiled = oiio.ImageSpec(40, 24, 3, "float")
    tiled.tile_width = tiled.tile_height = 16
    for name, spec, close in (("a.exr", tiled, 0.0), ("b.hdr", oiio.ImageSpec(40, 24, 3, "float"), 0.01)):
        writer = oiio.ImageOutput.create(str(tmp_path / name))
        writer.open(str(tmp_path / name), spec)
        writer.write_image(image)
        writer.close()
        # RGBE: eight bits for the largest channel
        np.testing.assert_allclose(gs.EnvironmentMap(tmp_path / name).radiance, image, atol=close)
    write(tmp_path / "c.png", np.full((4, 8), 188, dtype=np.uint8))
    np.testing.assert_allclose(gs.EnvironmentMap(tmp_path / "c.png").radiance, 0.5029, atol=1e-4)
    for array in (np.full((4, 8, 3), 188, dtype=np.uint8), np.full((4, 8, 4), 188 * 257, dtype=np.uint16)):
        np.testing.assert_allclose(gs.EnvironmentMap(array).radiance, 0.5029, atol=1e-4)
    assert (gs.EnvironmentMap(np.full((4, 8, 3), 188)).radiance == 188.0).all()


def test_large_map_is_reduced(tmp_path: Path) -> None:
    image = np.zeros((600, 3000, 3), dtype=np.float32)
    image[100, 2000] = 3e5
    write(tmp_path / "large.exr", image)
    for given in (image, tmp_path / "large.exr"):
        light = gs.EnvironmentLight(given)
        assert light.image.radiance.shape == (512, 1024, 3)
        flux = (light.image.radiance * solid_angles((512, 1024))[:, None, None]).sum()
        np.testing.assert_allclose(flux, 9e5 * solid_angles((600, 3000))[100], rtol=1e-5)


BAD: list[tuple[Any, str]] = [
    (np.full((4, 8, 3), np.nan), "some of its texels are NaN"),
    (np.full((4, 8, 3), -1.0), "some of its texels are negative"),
    (np.full((4, 8, 3), np.inf), "some of its texels are infinite"),
    (np.full((4, 8, 3), 1e300), "infinite"),
    (np.zeros((4, 8)), "an image"),
    (np.zeros((0, 8, 3)), "an image"),
    (np.zeros((4, 8, 2)), "an image"),
    (np.zeros((4, 8, 3), dtype=complex), "an image"),
    (None, "an image"),
    ("", "a path"),
]


@pytest.mark.parametrize(("image", "words"), BAD, ids=map(str, range(len(BAD))))
def test_bad_images_are_refused(image: Any, words: str) -> None:
    with pytest.raises(gs.SettingsError, match=words):
        gs.EnvironmentLight(image)


def test_bad_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(gs.SceneError, match="not found"):
        gs.EnvironmentLight("nowhere.hdr")
    (tmp_path / "text.hdr").write_text("no image")
    with pytest.raises(gs.SceneError, match="cannot be read as an image"):
        gs.EnvironmentLight(tmp_path / "text.hdr")
    wide = np.ones((2, 2000, 3), dtype=np.float32)
    wide[1, 7] = -1.0
    write(tmp_path / "negative.exr", wide)
    with pytest.raises(gs.SettingsError, match="negative"):
        gs.EnvironmentLight(tmp_path / "negative.exr")
    write(tmp_path / "cut.exr", np.random.default_rng(0).random((64, 64, 3)).astype(np.float32))
    data = (tmp_path / "cut.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(data[: len(data) // 2])
    with pytest.raises(gs.SceneError, match="cannot be read as an image"):
        gs.EnvironmentLight(tmp_path / "cut.exr")


@pytest.mark.parametrize("given", [{"turn": np.nan}, {"turn": 1e9}, {"direction": (0, 1, 0)}, {"angle": 3.0}])
def test_bad_settings_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(gs.SettingsError, match=next(iter(given))):
        gs.EnvironmentLight(np.ones((1, 2, 3)), **given)


@pytest.mark.parametrize("radiance", [0.0, 1e-40, 3e38])
def test_black_and_extreme_maps(renderer: gs.Renderer, radiance: float) -> None:
    light: Light = gs.EnvironmentLight(np.full((2, 4, 3), radiance))
    frame = renderer.render(block(), None, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    surface = frame.triangle >= 0
    assert np.isfinite(frame.linear[surface]).all()
    assert np.isfinite(frame.visibility[0][surface]).all()
    gs.trace(block(), None, [light], (16, 9), light_samples=4, samples=1)
