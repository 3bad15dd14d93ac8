"""An image depends on its arguments alone, not on earlier frames; triangle lists that do not fit affect only their own light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import translation
from glshadow.gl.resources import ResourceCache
from glshadow.gl.techniques.grown import Grown
from glshadow.gl.techniques.listed import Listed
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

from ..pairwise import mostly
from .test_casters import CAMERA, ground, leaf, leaves, placed

SIZE = (96, 64)
CAMERAS = (CAMERA, replace(CAMERA, position=(-4.0, 2.5, 5.0)))
SETS = 40
SEED = 5


@pytest.fixture(scope="module")
def scene() -> Scene:
    ball = Mesh(*shapes.icosphere(2, 0.5))
    pane = Mesh(
        *shapes.rectangle((-0.6, 0.0, 0.6), (1.2, 0.0, 0.0), (0.0, 0.0, -1.2)),
        material=Material((0.9, 0.3, 0.2, 0.5), alpha_mode=AlphaMode.BLEND),
    )
    nodes = (
        Node(ball, translation((-0.8, 0.9, 0.1)), "a"),
        Node(ball, translation((0.8, 1.5, -0.3)), "b"),
        Node(Mesh(*shapes.box((0.6, 0.9, 0.4))), translation((0.2, 0.45, 1.2)), "box"),
        Node(leaf(leaves(8, 6)), placed(-1.2, 1.7, -0.8, 1), "leaf"),
        Node(pane, translation((1.0, 2.2, 0.6)), "pane"),
    )
    return Scene((ground(), *nodes), CAMERA, name="some of everything")


def lights() -> list[Light]:
    """Lights of all kinds, with and without a size, exact and mapped: a cache key might confuse any two that share data."""
    few, dithered = (gs.Shadow(filter=gs.Exact(light_samples=16, dither=dither)) for dither in (False, True))
    maps = [
        gs.Shadow(filter=kind, resolution=resolution)
        for kind, resolution in ((gs.Pcf(1), 256), (gs.Hard(), 128), (gs.Evsm(), 128), (gs.LightSamples(4), 128))
    ]
    both = gs.Shadow(faces=gs.Faces.BOTH)
    place, over = (1.2, 5.0, -0.8), (-0.3, 3.2, 0.4)
    suns = [
        gs.DirectionalLight(direction=(-0.4, -1.0, 0.3), angle=angle, shadow=shadow)
        for angle, shadow in (
            (0.0, gs.Shadow()),
            (5.0, few),
            (40.0, few),
            (5.0, maps[0]),
            (5.0, maps[3]),
            (0.0, maps[2]),
        )
    ]
    spots = [
        gs.SpotLight(position=place, direction=aim, inner_angle=20.0, outer_angle=30.0, radius=radius, shadow=shadow)
        for aim, radius, shadow in (
            ((-1.2, -5.0, 0.8), 0.0, gs.Shadow()),
            ((-0.2, -5.0, 0.1), 0.0, maps[1]),
            ((-1.2, -5.0, 0.8), 0.2, few),
            ((-1.2, -5.0, 0.8), 0.0, both),
        )
    ]
    points = [
        gs.PointLight(position=over, radius=radius, shadow=shadow)
        for radius, shadow in (
            (0.0, gs.Shadow()),
            (1.5, few),
            (0.1, dithered),
            (0.0, maps[0]),
            (2.0, maps[0]),
            (3.0, few),
        )
    ]
    panels = [
        gs.RectLight(position=over, direction=aim, width=width, height=0.4, up=up, shadow=few)
        for aim, width, up in (
            ((0.0, -1.0, 0.0), 0.6, (0.0, 0.0, 1.0)),
            ((0.3, -1.0, 0.2), 0.6, (0.0, 0.0, 1.0)),
            ((0.3, -1.0, 0.2), 0.6, (1.0, 0.0, 1.0)),
            ((0.0, -1.0, 0.0), 5.0, (0.0, 0.0, 1.0)),
        )
    ]
    return [*suns, *spots, *points, *panels, gs.SkyLight(shadow=few)]


Drawn = tuple[np.ndarray, np.ndarray, list[dict[str, Any]]]


def drawn(
    renderer: Renderer,
    scene: Scene,
    camera: gs.PerspectiveCamera,
    chosen: list[Light],
    size: tuple[int, int] = SIZE,
    samples: int = 1,
) -> Drawn:
    frame = renderer.render(scene, camera, chosen, size, samples=samples)
    # only the number of draws may depend on what is cached
    return frame.image, frame.visibility, [{**used.as_dict(), "draws": 0} for used in frame.used]


def forget(renderer: Renderer) -> None:
    """Drop all that a renderer caches, except compiled programs, which take longer than a frame."""
    old = renderer._cache
    assert old is not None
    with renderer._context:
        renderer._cache = ResourceCache(renderer._context)
        old.programs, renderer._cache.programs = renderer._cache.programs, old.programs
        old.release()


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("sets", [0, pytest.param(SETS, marks=pytest.mark.exhaustive)])
def test_image_is_independent_of_earlier_frames(scene: Scene, sets: int) -> None:
    """Every set of lights once, and further ones with a transparent surface, which doubles the time; tests/gl/test_layers.py has others."""
    scene = scene if sets else Scene(scene.nodes[:-1], CAMERA, name="some of everything")
    rng = np.random.default_rng(SEED)
    known = lights()
    first = [*rng.permutation(len(known)), *rng.integers(0, len(known), max(0, sets - len(known)))]
    jobs = [
        (
            CAMERAS[rng.integers(2)],
            [known[number], *(known[k] for k in rng.integers(0, len(known), rng.integers(2)))],
            SIZE if rng.integers(3) else (80, 48),
        )
        for number in first
    ]
    jobs = [(*job, 4 if len(job[1]) == 1 and not rng.integers(4) else 1) for job in jobs]
    with Renderer("egl") as kept, Renderer("egl") as fresh:
        for renderer in (kept, fresh):
            # so small that the lists of area lights do not fit
            caps = replace(renderer._context.caps, max_storage_block=1 << 20, max_texture_buffer_size=1 << 16)
            renderer._context.caps = caps
        found = [drawn(kept, scene, *job) for job in jobs]
        assert any("entries for its size" in used["why"] for _, _, each in found for used in each)
        # in reverse order, so that the uniforms kept by programs differ too
        for (image, visibility, used), job in zip(reversed(found), reversed(jobs), strict=True):
            forget(fresh)
            expected = drawn(fresh, scene, *job)
            assert used == expected[2], str(job)
            np.testing.assert_array_equal(image, expected[0], str(job))
            np.testing.assert_array_equal(visibility, expected[1], str(job))


def test_rotated_spot_redraws_its_translucent_casters(scene: Scene) -> None:
    """After the rotation the spot sees translucent casters through another part of its map."""
    one, other = (
        gs.SpotLight(position=(1.6, 5.0, 1.2), direction=aim, inner_angle=15.0, outer_angle=20.0)
        for aim in ((-1.0, -3.0, -1.0), (0.0, -3.0, 0.0))
    )
    with Renderer("egl") as renderer:
        before = drawn(renderer, scene, CAMERA, [one])
        image, visibility, used = drawn(renderer, scene, CAMERA, [other])
        forget(renderer)
        expected = drawn(renderer, scene, CAMERA, [other])
    assert (before[0] != expected[0]).any()
    assert used == expected[2]
    np.testing.assert_array_equal(image, expected[0])
    np.testing.assert_array_equal(visibility, expected[1])


# -- lights whose triangle lists do not fit

SUN = gs.DirectionalLight(direction=(-0.4, -1.0, 0.3))
LAMP = gs.PointLight(position=(0.3, 2.6, 0.2))
SIZED: dict[str, Light] = {
    "sun": replace(SUN, angle=10.0),
    "lamp": replace(LAMP, radius=0.3),
    "panel": gs.RectLight(
        position=(-0.3, 3.2, 0.4), direction=(0.0, -1.0, 0.0), width=1.0, height=0.5, up=(0.0, 0.0, 1.0)
    ),
}
REASON = r"Exact\(\) needs \d+ list entries even on its coarsest grid"

Refuse = Callable[[Callable[[Light], bool]], None]


@pytest.fixture
def refuse(monkeypatch: pytest.MonkeyPatch) -> Refuse:
    """Make the triangle lists of the given lights never fit."""
    build = Listed._build

    def refusing(refused: Callable[[Light], bool]) -> None:
        monkeypatch.setattr(
            Listed,
            "_build",
            lambda self, programs, scene, light: not refused(light) and build(self, programs, scene, light),
        )

    return refusing


def mean_of(renderer: Renderer, scene: Scene, points: tuple[Light, ...], shadow: gs.Shadow) -> np.ndarray:
    """The mean visibility over a light's sample points, each rendered as a light of its own."""
    one = [
        renderer.render(scene, None, [replace(each, shadow=shadow)], SIZE, samples=1).visibility[0] for each in points
    ]
    return np.mean(np.stack(one).astype(np.float64), axis=0)


@pytest.mark.usefixtures("built_on_the_gpu")
def test_point_light_without_lists_changes_no_other_light(scene: Scene, refuse: Refuse) -> None:
    with Renderer("egl") as renderer:
        before = drawn(renderer, scene, CAMERA, [SUN])
    refuse(lambda light: isinstance(light, gs.PointLight))
    with Renderer("egl") as renderer:
        used = renderer.render(scene, None, [LAMP, SUN], SIZE, samples=1).used
        assert (used[0].filter, used[1].filter) == (gs.Pcf(1), gs.Exact())
        assert used[0].why.startswith("Exact() needs ")
        assert used[0].fallbacks == ()
        after = drawn(renderer, scene, CAMERA, [SUN])
    assert after[2] == before[2]
    np.testing.assert_array_equal(after[0], before[0])
    np.testing.assert_array_equal(after[1], before[1])


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", mostly(SIZED, "lamp"))
def test_area_light_without_lists_is_sampled_point_by_point(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def full(self: Grown, *_: object) -> bool:
        self.most = 123
        return False

    monkeypatch.setattr(Grown, "build", full)
    light = replace(SIZED[name], shadow=gs.Shadow(filter=gs.Exact(light_samples=16)))
    with Renderer("egl") as renderer:
        frame = renderer.render(scene, None, [light], SIZE, samples=1)
        expected = mean_of(renderer, scene, light.hard_lights(16), gs.Shadow(filter=gs.Exact()))
        again = renderer.render(scene, None, [light], SIZE, samples=1)
    used = frame.used[0]
    assert used.filter == light.shadow.filter
    assert used.why.startswith(
        "requested; 16 points of the light, one after another, for lists of 123 entries for its size, a buffer of this driver holds "
    )
    assert [line for line in used.fallbacks if "translucent" not in line] == []  # area lights have no tint
    np.testing.assert_array_equal(frame.visibility[0], expected.astype(np.float32))
    np.testing.assert_array_equal(again.visibility, frame.visibility)
    assert again.used[0] == replace(used, draws=0)


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("which", ["all points", "the last point"])
def test_area_light_without_any_lists_uses_as_many_maps(
    scene: Scene, refuse: Refuse, monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    """Also if only the lists of a late sample point do not fit. It is an error only if Exact() was requested by name."""
    monkeypatch.setattr(gs.Filter, "resolution", 128)
    light = SIZED["lamp"]
    last = light.hard_lights(64)[-1].position  # type: ignore[union-attr]
    refuse(
        lambda light: (
            isinstance(light, gs.PointLight) and (which == "all points" or light.radius or light.position == last)
        )
    )
    with Renderer("egl") as renderer:
        exact = replace(light, shadow=gs.Shadow(filter=gs.Exact()))
        with pytest.raises(gs.ResourceError, match=REASON):
            renderer.render(scene, None, [exact], SIZE, samples=1)
        frame = renderer.render(scene, None, [light], SIZE, samples=1)
        again = renderer.render(scene, None, [light], SIZE, samples=4)
        expected = renderer.render(
            scene, None, [replace(light, shadow=gs.Shadow(filter=gs.LightSamples()))], SIZE, samples=1
        )
    for used in (frame.used[0], again.used[0]):
        assert used.filter == gs.LightSamples()
        assert used.why.startswith("Exact() needs ")
        assert used.why.endswith("; 64 points of the light, one after another")
        assert [line for line in used.fallbacks if "translucent" not in line] == []  # area lights have no tint
    np.testing.assert_array_equal(frame.visibility, expected.visibility)


def test_map_setting_on_an_area_light_gives_many_maps(scene: Scene) -> None:
    """A setting that only maps have selects maps of the light's sample points, not a hard shadow."""
    light = replace(SIZED["sun"], shadow=gs.Shadow(resolution=128))
    with Renderer("egl") as renderer:
        used = renderer.render(scene, None, [light], SIZE, samples=1).used[0]
    assert used.filter == gs.LightSamples()
    assert used.why == "only a shadow map has resolution; 64 points of the light, one after another"
