"""Maps of many directions: every pixel against the float64 twin, against Exact() with the same directions, and kept from frame to frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, transform
from glshadow.derive.direction_maps import slack
from glshadow.gl.passes.readback import pixels
from glshadow.gl.techniques.directions import Directions
from glshadow.scenes import shapes

SIZE = (64, 36)
ALL = ("image", "visibility", "triangle", "position", "normal")
EXACT = gs.SkyLight(shadow=gs.Shadow(filter=gs.Exact(light_samples=64)))
CLOSE = gs.PerspectiveCamera((2.5, 3.0, 2.5), (0.0, 0.3, 0.0))
MOVED = gs.PerspectiveCamera((9.0, 6.0, 9.0), (0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture
def older() -> Iterator[gs.Renderer]:
    """Without compute passes: the caster pass draws all triangles."""
    with gs.Renderer() as renderer:
        renderer._context.caps = replace(renderer._context.caps, compute=False, max_storage_block=0)
        yield renderer


def sky(count: int | None = None, resolution: int | None = None) -> gs.SkyLight:
    return gs.SkyLight(shadow=gs.Shadow(filter=gs.DirectionMaps(count), resolution=resolution))


def technique(renderer: gs.Renderer) -> Directions:
    found = renderer._cache.techniques[0, "Directions"]
    assert isinstance(found, Directions)
    return found


def maps(renderer: gs.Renderer) -> Array:
    """Window depths (V, R, R), row 0 at the bottom."""
    own = technique(renderer)
    texture, views = own._atlas.texture, own.found.views if own.found else ()
    with renderer._context.drawing():
        image = pixels(texture, np.uint32 if own._atlas.in_bits else np.float32)
    image = np.ascontiguousarray(image).view(np.float32)[..., 0][::-1]
    return np.stack([image[y : y + v.resolution, x : x + v.resolution] for v in views for x, y in [v.tile]])


@pytest.mark.parametrize("compute", [True, False])
def test_visibility_matches_the_twin(
    renderer: gs.Renderer, older: gs.Renderer, monkeypatch: pytest.MonkeyPatch, compute: bool
) -> None:
    """Of the maps alone; of rays, see test_near_casters.

    A receiver on the border between two texels, or on the border of a shadow, may round to the other side: one of 16 directions then
    differs.
    """
    monkeypatch.setattr("glshadow.gl.techniques.directions.near_casters", lambda *_: None)
    drawn, scene = renderer if compute else older, gs.scenes.courtyard()
    frame = drawn.render(scene, None, [sky(16, 64)], SIZE, samples=1, outputs=ALL)
    stored, own = maps(drawn), technique(drawn)
    assert own.found is not None
    assert own._atlas.in_bits == compute
    there = frame.triangle >= 0
    points, normals = frame.position[there], frame.normal[there].astype(np.float64)
    seen = everything = 0.0
    for view, depths in zip(own.found.views, stored, strict=True):
        axes, (tx, ty) = view.view_from_world[:3, :3], view.texel
        cosine = normals @ axes[2]
        local = transform(view.view_from_world, points)
        place = (local[:, :2] - (view.window[0], view.window[2])) / (tx, ty)
        at = np.clip(np.floor(place), 0, view.resolution - 1).astype(int)
        aside = (at + 0.5 - place) * (tx, ty)
        lean = np.maximum(cosine, 1e-4)
        rise = ((normals @ axes[:2].T) * aside).sum(axis=1) / lean
        depth = rise - local[:, 2] - slack(lean, np.array(max(tx, ty)))
        lit = (2.0 * depths[at[:, 1], at[:, 0]] - 1.0) * own.found.radius >= np.minimum(depth, own.found.radius)
        weight = np.maximum(cosine, 0.0)
        seen, everything = seen + weight * lit, everything + weight
    expected = np.where(everything > 0.0, seen / np.maximum(everything, 1e-30), 0.0)
    wrong = np.abs(frame.visibility[0][there] - expected) > 1e-5
    assert wrong.mean() < 0.02


def test_convex_body_in_the_open_sees_all_of_the_sky(renderer: gs.Renderer) -> None:
    """No self-shadowing: its facets meet at less than 15 degrees."""
    scene = gs.Scene([gs.Node(gs.Mesh(*shapes.icosphere(3, 1.0)))])
    camera = gs.PerspectiveCamera((2.0, 2.5, 2.0), (0.0, 0.0, 0.0))
    frame = renderer.render(scene, camera, [sky()], SIZE, samples=1, outputs=ALL)
    top = (frame.triangle >= 0) & (frame.normal[..., 1] > 0.0)
    assert top.sum() > 200
    assert frame.visibility[0][top].min() > 0.995


def test_plain_floor_is_lit_by_all_of_the_sky_without_a_caster(renderer: gs.Renderer) -> None:
    scene = gs.Scene([gs.Node(gs.Mesh(*shapes.rectangle((-2.0, 0.0, 2.0), (4.0, 0.0, 0.0), (0.0, 0.0, -4.0))))])
    frame = renderer.render(scene, None, [sky()], SIZE, samples=1, outputs=ALL)
    assert (frame.visibility[0][frame.triangle >= 0] == 1.0).all()


def corner() -> gs.Scene:
    """A floor and two walls, 2 x 2 x 2."""
    sides = [
        ((-2.0, 0.0, 2.0), (4.0, 0.0, 0.0), (0.0, 0.0, -4.0)),
        ((-2.0, 0.0, -2.0), (4.0, 0.0, 0.0), (0.0, 2.0, 0.0)),
        ((-2.0, 0.0, 2.0), (0.0, 0.0, -4.0), (0.0, 2.0, 0.0)),
    ]
    return gs.Scene([gs.Node(gs.Mesh(*shapes.rectangle(*side))) for side in sides])


def error(scene: gs.Scene, camera: gs.Camera, frame: gs.Frame, share: float = 1.0) -> float:
    """Mean error of a one-sample frame, against 1,024 rays through all its pixels, or a random share of those that show triangles."""
    shape, surface = frame.triangle.shape, None
    if share < 1.0:
        chosen = np.random.default_rng(3).uniform(size=shape) < share
        surface = np.where(chosen, frame.triangle, -1)
    truth = gs.trace(scene, camera, [gs.SkyLight()], shape[::-1], surface=surface, light_samples=1024, samples=1)
    return float(np.nanmean(np.abs(frame.visibility[0] - truth.visibility[0])))


def test_corner_matches_rays_and_has_no_steps(renderer: gs.Renderer) -> None:
    """Between two pixels of the floor, light changes by .004; a direction is 1/256, one at the zenith twice that, and the mean over pixels
    halves its step. Of 128 directions: .0124."""
    camera = gs.OrthographicCamera((0.0, 10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=3.9)
    frame = renderer.render(corner(), camera, [sky()], (256, 256), samples=1, outputs=ALL)
    assert error(corner(), camera, frame, share=0.015) < 0.005
    for axis in (0, 1):
        steps = np.abs(np.diff(frame.visibility[0], axis=axis))
        # at the walls, light changes faster; now and then the shadows of two directions end at one pixel
        assert np.percentile(steps[16:, 16:-16], 99.0) < 0.004 + 1.5 / 256.0


CARD = gs.Mesh(
    *shapes.rectangle((-1.0, 1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0)),
    uv=np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
    material=gs.Material(
        texture=np.kron(np.eye(2, dtype=np.uint8)[..., None] * 255, np.ones((8, 8, 4), np.uint8)),
        alpha_mode=gs.AlphaMode.MASK,
        double_sided=True,
    ),
)
CASTERS = {
    "mask": [gs.Node(CARD), gs.Node(gs.Mesh(*shapes.icosphere(1, 0.2)))],
    "points": [gs.Node(gs.Points(np.array([[0.0, 0.8, 0.0], [0.8, 0.5, 0.3]]), radius=0.5))],
    "mirrored": [
        gs.Node(gs.Mesh(*shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))), np.diag([-1.0, 1.0, 1.0, 1.0])),
        gs.Node(
            gs.Mesh(*shapes.icosphere(3, 0.5)),
            np.array([[-1.0, 0, 0, 1], [0, 1, 0, 0.6], [0, 0, 1, 0.5], [0, 0, 0, 1]]),
        ),
    ],
}


@pytest.mark.parametrize("kind", CASTERS)
def test_every_kind_of_caster_casts(renderer: gs.Renderer, older: gs.Renderer, kind: str) -> None:
    """A texel is 1/30 of a unit: edges and contacts are off by a part of it."""
    floor = gs.Node(gs.Mesh(*shapes.rectangle((-2.0, 0.0, 2.0), (4.0, 0.0, 0.0), (0.0, 0.0, -4.0))))
    scene = gs.Scene([floor, *CASTERS[kind]])
    for drawer in (renderer, older):
        frame = drawer.render(scene, CLOSE, [sky()], (48, 27), samples=1, outputs=ALL)
        assert np.nanmean(frame.visibility[0]) < 0.93
        if kind == "points":  # which are not traced
            truth = renderer.render(scene, CLOSE, [EXACT], (48, 27), samples=1)
            assert np.nanmean(np.abs(frame.visibility - truth.visibility)) < 0.015  # of 64 directions
        else:
            assert error(scene, CLOSE, frame) < 0.006


@pytest.mark.parametrize("scene", [gs.scenes.courtyard(), gs.Scene(CASTERS["mirrored"])], ids=["courtyard", "mirrored"])
def test_compute_pass_and_caster_pass_draw_the_same_maps(
    renderer: gs.Renderer, older: gs.Renderer, scene: gs.Scene
) -> None:
    """Rasterisers round vertices to 1/256 texel, so that texels along edges may differ; depth is that of the same planes."""
    for drawer in (renderer, older):
        drawer.render(scene, None, [sky(8, 64)], SIZE, samples=1)
    ours, theirs = maps(renderer), maps(older)
    assert ((ours < 1.0).mean(axis=(1, 2)) > 0.05).all()
    assert (np.abs(ours - theirs) > 1e-3).mean() < 0.005


def test_white_dome_of_an_environment_is_a_sky(renderer: gs.Renderer) -> None:
    """Their directions are equal to 1e-12; those of a map that is black below the horizon, see test_environment."""
    image = np.zeros((2, 4, 3))
    image[0] = 1.0
    scene = gs.scenes.courtyard()
    frames = [
        renderer.render(scene, None, [light], SIZE, samples=1)
        for light in (sky(64, 64), gs.EnvironmentLight(image, shadow=sky(64, 64).shadow))
    ]
    difference = np.abs(frames[0].visibility - frames[1].visibility)
    assert (np.nan_to_num(difference) > 1e-4).mean() < 0.005


def test_maps_are_kept_while_scene_and_light_stay(renderer: gs.Renderer) -> None:
    scene = gs.scenes.courtyard()
    first = renderer.render(scene, None, [sky(32, 32)], SIZE, samples=4)
    kept = renderer.render(scene, MOVED, [sky(32, 32)], SIZE, samples=4)
    brighter = renderer.render(scene, MOVED, [replace(sky(32, 32), intensity=2.0)], SIZE, samples=4)
    assert (first.used[0].draws > 0, kept.used[0].draws, brighter.used[0].draws) == (True, 0, 0)
    turned = replace(sky(32, 32), direction=(0.1, -1.0, 0.0))
    assert renderer.render(scene, MOVED, [turned], SIZE, samples=4).used[0].draws > 0
    with gs.Renderer() as fresh:
        alone = fresh.render(scene, MOVED, [sky(32, 32)], SIZE, samples=4)
    np.testing.assert_array_equal(alone.image, kept.image)
    np.testing.assert_array_equal(alone.visibility, kept.visibility)


def test_what_was_used_is_reported(renderer: gs.Renderer) -> None:
    frame = renderer.render(gs.scenes.courtyard(), None, [gs.SkyLight()], SIZE, samples=1)
    assert frame.used[0].filter == gs.DirectionMaps(256)
    assert frame.used[0].why == "light from many directions; 256 maps of 128 x 128"
    assert frame.used[0].fallbacks == ()


def test_atlas_beyond_the_drivers_limit_is_refused(renderer: gs.Renderer) -> None:
    with pytest.raises(
        gs.SettingsError, match=r"16 maps of 8192 texels need an atlas of 32768 x 32768, the driver's limit is"
    ):
        renderer.render(gs.scenes.courtyard(), None, [sky(16, 8192)], SIZE, samples=1)


def test_a_sun_of_some_degrees_is_light_from_many_directions(renderer: gs.Renderer) -> None:
    scene, sun = gs.scenes.box().scene, gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), angle=8.0)
    small = gs.Shadow(filter=gs.DirectionMaps(64), resolution=512)
    frame = renderer.render(scene, lights=[replace(sun, shadow=small)], size=(320, 240), samples=1)
    exact = renderer.render(
        scene, lights=[replace(sun, shadow=gs.Shadow(filter=gs.Exact()))], size=(320, 240), samples=1
    )
    there = np.isfinite(exact.visibility[0])
    error = np.abs(frame.visibility[0] - exact.visibility[0])[there]
    penumbra = (np.abs(exact.visibility[0] - 0.5) < 0.45)[there]
    assert penumbra.sum() > 300
    # texels are a pixel wide here; what faces away from a part of the light is weighted by the cosine, which Exact() does not do
    assert error[penumbra].mean() < 0.04
    assert error.mean() < 0.004
    assert frame.used[0].why.endswith("64 maps of 512 x 512")
    assert frame.used[0].fallbacks == ()


def test_one_without_an_angle_and_a_lamp_are_refused_by_name(renderer: gs.Renderer) -> None:
    shadow = gs.Shadow(filter=gs.DirectionMaps(64))
    for light in (gs.DirectionalLight(shadow=shadow), gs.PointLight(position=(0, 5, 0), radius=0.3, shadow=shadow)):
        with pytest.raises(
            gs.SettingsError, match=r"SkyLight, EnvironmentLight and DirectionalLight\(angle=\).*use Exact"
        ):
            renderer.render(gs.scenes.box().scene, lights=[light], size=(16, 12))
