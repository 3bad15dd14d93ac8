"""Translucent casters: their colour on receivers behind them, by the formula; none on surfaces before them; visibility unchanged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.gl.passes.translucent import COARSER, LayersOfColor
from glshadow.scenes import shapes

SIZE = (160, 120)
RED, BLUE = (1.0, 0.1, 0.05, 0.6), (0.1, 0.2, 1.0, 0.3)
CAMERA = gs.OrthographicCamera((0.0, 10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=6.0)
LIGHTS: dict[str, gs.Light] = {
    "sun": gs.DirectionalLight(direction=(0.4, -1.0, 0.0)),
    "spot": gs.SpotLight(position=(-2.0, 6.0, 0.0), direction=(0.3, -1.0, 0.0), inner_angle=50.0, outer_angle=50.0),
    "point": gs.PointLight(position=(-2.0, 5.0, 0.2)),
}


def node(
    name: str, color: tuple[float, ...], x: float, height: float, side: float = 1.0, z: float = 0.0, **more: object
) -> gs.Node:
    material = gs.Material(color=color, alpha_mode=gs.AlphaMode.BLEND, double_sided=True, **more)  # type: ignore[arg-type]
    mesh = gs.Mesh(*shapes.rectangle((x, height, z + 0.5 * side), (side, 0, 0), (0, 0, -side)), material=material)
    return gs.Node(mesh, np.eye(4), name)


def ground() -> gs.Node:
    return gs.Node(gs.Mesh(*shapes.rectangle((-4, 0, 4), (8, 0, 0), (0, 0, -8))), np.eye(4), "ground")


def through(color: tuple[float, ...]) -> Array:
    alpha = color[3]
    return (1.0 - alpha) * (1.0 - alpha + alpha * np.asarray(color[:3]))


def tint(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light) -> tuple[Array, gs.Frame]:
    """What reaches the ground through translucent casters (H, W, 3); NaN where the ground is not seen or not lit. Where nothing covers the
    ground in the image, linear light divided by that without casters says the same."""
    outputs = ("linear", "node", "visibility", "position", "transmittance")
    settings = {"ambient": 0.0, "outputs": outputs, "samples": 1}
    frame = renderer.render(scene, CAMERA, [light], SIZE, **settings)  # type: ignore[arg-type]
    bare = renderer.render(gs.Scene((scene.nodes[0],)), CAMERA, [light], SIZE, **settings)  # type: ignore[arg-type]
    np.testing.assert_array_equal(frame.visibility, bare.visibility, "visibility has no colour")
    on = (frame.node == 0)[..., None] & (bare.linear > 1e-3)
    seen = np.where(on, frame.transmittance[0], np.nan)
    ratio = np.where(on, frame.linear / np.where(on, bare.linear, 1.0), np.nan)
    covered = np.zeros(on.shape[:2], dtype=bool)
    for each in scene.nodes[1:]:
        low, high = (each.mesh.bounds[k][[0, 2]] for k in range(2))
        place = frame.position[..., [0, 2]]
        covered |= ((place >= low - 0.1) & (place <= high + 0.1)).all(axis=-1)
    np.testing.assert_allclose(ratio[~covered], seen[~covered], atol=1e-3)  # of a texel
    return seen, frame


@pytest.mark.parametrize("filter", [None, gs.Pcf(1)], ids=["exact", "pcf"])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_receiver_behind_is_tinted(renderer: gs.Renderer, name: str, filter: gs.Filter | None) -> None:
    scene = gs.Scene((ground(), node("red", RED, -1.5, 1.0, z=-0.3), node("blue", BLUE, -1.5, 2.0, z=0.3)))
    light = replace(LIGHTS[name], shadow=gs.Shadow(filter=filter))
    seen, _ = tint(renderer, scene, light)
    known = ~np.isnan(seen[..., 0])
    for expected in (np.ones(3), through(RED), through(BLUE), through(RED) * through(BLUE)):
        near = np.abs(seen - expected).max(axis=-1) < 5e-3
        assert (near & known).sum() > 15, expected
    # only texels at borders differ
    all_of = [np.ones(3), through(RED), through(BLUE), through(RED) * through(BLUE)]
    gap = np.min([np.abs(seen - each).max(axis=-1) for each in all_of], axis=0)
    assert (gap[known] > 5e-3).mean() < 0.05


def test_tint_placement(renderer: gs.Renderer) -> None:
    """A light of slope 0.4: a caster at height 1 from x to x + 1 tints the ground from x + 0.4 to x + 1.4."""
    seen, frame = tint(renderer, gs.Scene((ground(), node("red", RED, -1.0, 1.0))), LIGHTS["sun"])
    places = frame.position
    red = np.abs(seen - through(RED)).max(axis=-1) < 5e-3
    pixel = 6.0 / SIZE[1]
    row = np.abs(places[..., 2]) < 0.4
    assert places[..., 0][red & row].max() == pytest.approx(0.4, abs=2 * pixel)  # its left end lies under the caster
    assert not red[places[..., 0] > 0.4 + 2 * pixel].any()


def test_casters_of_zero_and_full_alpha(renderer: gs.Renderer) -> None:
    clear, _ = tint(renderer, gs.Scene((ground(), node("clear", (0.2, 0.2, 0.2, 0.0), -1.0, 1.0))), LIGHTS["sun"])
    np.testing.assert_allclose(clear[~np.isnan(clear)], 1.0, atol=5e-3)
    # with an alpha of 1 it is a caster like all others
    scene = gs.Scene((ground(), node("dense", (0.9, 0.9, 0.9, 1.0), -1.0, 1.0)))
    frame = renderer.render(scene, CAMERA, [LIGHTS["sun"]], SIZE, outputs=("visibility", "transmittance"), samples=1)
    assert (frame.visibility[0] == 0.0).sum() > 100
    np.testing.assert_array_equal(frame.transmittance, 1.0)


def test_caster_tints_neither_itself_nor_what_is_before_it(renderer: gs.Renderer) -> None:
    """The upper pane, seen over the ground, is lit as it is alone; nothing behind it colours it."""
    upper = node("blue", BLUE, -1.5, 2.0, side=0.6)
    scene, alone = (gs.Scene((ground(), *rest, upper)) for rest in ((node("red", RED, -1.0, 1.0),), ()))
    for light in LIGHTS.values():
        settings = {"ambient": 0.0, "outputs": ("linear", "transmittance", "position"), "samples": 1}
        frame, bare = (renderer.render(each, CAMERA, [light], SIZE, **settings) for each in (scene, alone))  # type: ignore[arg-type]
        place = frame.position
        shown = (place[..., 0] > -1.45) & (place[..., 0] < -1.02) & (np.abs(place[..., 2]) < 0.25)
        shown &= (frame.transmittance[0] == bare.transmittance[0]).all(axis=-1)  # the ground behind it is lit alike
        assert shown.sum() > 50
        np.testing.assert_allclose(frame.linear[shown], bare.linear[shown], rtol=1e-5)


def test_texture_holes_have_no_tint(renderer: gs.Renderer) -> None:
    image = np.full((8, 8, 4), 255, dtype=np.uint8)
    image[:, :4, 3] = 0
    material = gs.Material(color=(1.0, 0.0, 0.0, 0.5), texture=image, alpha_mode=gs.AlphaMode.BLEND)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    mesh = gs.Mesh(*shapes.rectangle((-1, 1.0, 1), (2, 0, 0), (0, 0, -2)), uv=uv, material=material)
    seen, frame = tint(
        renderer, gs.Scene((ground(), gs.Node(mesh, np.eye(4), "half"))), gs.DirectionalLight(direction=(1, -1, 0))
    )
    red = np.abs(seen - through((1.0, 0.0, 0.0, 0.5))).max(axis=-1) < 5e-3
    places = frame.position
    assert red.sum() > 100
    assert places[..., 0][red].min() > 0.9, "the left half is empty: its shadow would begin at 0"


@pytest.mark.parametrize("samples", [1, 4])
def test_catcher_shows_what_translucent_casters_take_away(renderer: gs.Renderer, samples: int) -> None:
    """1 - (ambient + light * tint) / (ambient + light), of luminances; in the shadow of an opaque caster the tint changes nothing."""
    wall = gs.Node(gs.Mesh(*shapes.rectangle((0.1, 0.5, 0.0), (0.3, 0, 0), (0, 0, -0.6))))
    scene = gs.Scene((replace(ground(), catches=True), node("red", RED, -1.0, 1.0), wall))
    light = gs.DirectionalLight(direction=(1.0, -1.0, 0.0), intensity=0.9)
    outputs = ("alpha", "node", "visibility", "transmittance", "position")
    frame = renderer.render(
        scene, CAMERA, [light], SIZE, ambient=0.3, outputs=outputs, samples=samples, background=None
    )
    arriving = 0.9 / np.sqrt(2.0) * frame.visibility[0][..., None] * frame.transmittance[0]
    weights = np.array([0.2126, 0.7152, 0.0722])
    expected = 1.0 - (0.3 + arriving) @ weights / (0.3 + 0.9 / np.sqrt(2.0))
    place = frame.position[..., [0, 2]]
    # not on the borders of shadows, where a pixel's samples differ and the tint is that of its centre
    flat = np.ones(frame.alpha.shape, dtype=bool)
    for k in (-1, 1):
        for axis in (0, 1):
            flat &= (np.abs(np.roll(arriving, k, axis) - arriving) < 1e-3).all(axis=-1) & (
                np.roll(frame.node, k, axis) == 0
            )
    flat &= (frame.node == 0) & ((place < (-1.1, -0.6)) | (place > (0.05, 0.6))).any(axis=-1)  # without the pane itself
    tinted = flat & (frame.transmittance[0].min(axis=-1) < 0.9)
    assert (tinted & (frame.visibility[0] == 1)).sum() > 100
    assert (tinted & (frame.visibility[0] == 0)).sum() > 20
    np.testing.assert_allclose(frame.alpha[flat], expected[flat], atol=2e-3)  # of a texel's colour


def test_scene_without_translucent_casters_allocates_no_map() -> None:
    with gs.Renderer("egl") as fresh:
        fresh.render(gs.scenes.box().scene, None, None, SIZE, samples=1)
        assert all(glass._owned == [] for glass in fresh._cache.translucent_maps.values())
        fresh.render(gs.Scene((ground(), node("red", RED, -1.0, 1.0))), CAMERA, None, SIZE, samples=1)
        assert len(fresh._cache.translucent_maps[0]._owned) == 1


@pytest.mark.parametrize("light", [gs.RectLight(position=(0.0, 4.0, 0.0)), gs.SkyLight()], ids=["panel", "sky"])
def test_lights_without_tint_report_it(renderer: gs.Renderer, light: gs.Light) -> None:
    scene = gs.Scene((ground(), node("red", RED, -1.5, 1.0)))
    both = renderer.render(scene, CAMERA, [light, LIGHTS["sun"]], SIZE, outputs=("image",), samples=1)
    assert [any("untinted" in line for line in used.fallbacks) for used in both.used] == [True, False]
    bare = renderer.render(gs.Scene(scene.nodes[:1]), CAMERA, [light], SIZE, outputs=("image",), samples=1)
    assert not any("untinted" in line for line in bare.used[0].fallbacks)


def test_rotated_spot_redraws_its_tint() -> None:
    scene = gs.Scene((ground(), node("red", RED, -1.5, 1.0)))
    ways = [(1.0, -1.0, 0.0), (0.3, -1.0, 0.0)]
    spots = [replace(LIGHTS["spot"], direction=way, outer_angle=20.0, inner_angle=20.0) for way in ways]  # type: ignore[call-arg]
    with gs.Renderer("egl") as kept:
        for spot in spots:
            with gs.Renderer("egl") as fresh:
                expected = fresh.render(scene, CAMERA, [spot], SIZE, outputs=("linear",), samples=1).linear
            np.testing.assert_array_equal(
                kept.render(scene, CAMERA, [spot], SIZE, outputs=("linear",), samples=1).linear, expected
            )


def test_tint_works_with_multisampling(renderer: gs.Renderer) -> None:
    scene = gs.Scene((ground(), node("red", RED, -1.5, 1.0)))
    one, four = (
        renderer.render(scene, CAMERA, [LIGHTS["sun"]], SIZE, outputs=("linear",), samples=each).linear
        for each in (1, 4)
    )
    assert np.abs(one - four).mean() < 5e-3


def test_map_is_kept_while_the_camera_moves_and_finer_for_a_closer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[float] = []
    stacked = LayersOfColor.stacked

    def counted(self: LayersOfColor) -> object:
        drawn.append(max(self._views[0].texel))
        return stacked(self)

    monkeypatch.setattr(LayersOfColor, "stacked", counted)
    scene = gs.Scene((ground(), node("red", RED, -1.5, 1.0)))
    places = [(0.0, 10.0, 0.0), (0.2, 9.0, 0.1), (-0.3, 8.0, 0.2)]
    cameras: list[gs.Camera] = [gs.PerspectiveCamera(place, (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)) for place in places]
    closer = gs.OrthographicCamera((-0.6, 10.0, 0.0), (-0.6, 0.0, 0.0), (0.0, 0.0, -1.0), height=0.3)
    with gs.Renderer("egl") as kept:
        for camera in [*cameras, closer, *cameras]:
            frame = kept.render(scene, camera, [LIGHTS["sun"]], SIZE, outputs=("linear",), samples=1)
            many = len(drawn)
            with gs.Renderer("egl") as fresh:
                expected = fresh.render(scene, camera, [LIGHTS["sun"]], SIZE, outputs=("linear",), samples=1)
            np.testing.assert_array_equal(frame.linear, expected.linear)
            del drawn[many:]
    assert len(drawn) == 3, "for the first camera, for the closer one and after it"
    assert drawn[0] == drawn[2] > COARSER * drawn[1]


@pytest.mark.parametrize("light", ["sun", "point"])
def test_edge_of_a_tinted_shadow_is_the_mean_of_its_samples(renderer: gs.Renderer, light: str) -> None:
    """The edge runs through the middle of a column of pixels; no opaque shadow is near it, and visibility does not know the pane."""
    edge = -4.0 + 0.05 * 100.5
    lamp = LIGHTS[light]
    slope = 0.4 if isinstance(lamp, gs.DirectionalLight) else None
    height = 0.5
    if slope is None:  # on the way from the lamp to the edge
        x, y = lamp.position[0], lamp.position[1]  # type: ignore[attr-defined]
        slope = (edge - x) / y
    scene = gs.Scene((ground(), node("pane", RED, edge - slope * height - 1.0, height)))
    settings = {"ambient": 0.0, "outputs": ("linear", "visibility"), "samples": 4}
    frame = renderer.render(scene, CAMERA, [lamp], SIZE, **settings)  # type: ignore[arg-type]
    bare = renderer.render(gs.Scene((ground(),)), CAMERA, [lamp], SIZE, **settings)  # type: ignore[arg-type]
    np.testing.assert_array_equal(frame.visibility, bare.visibility)
    share = frame.linear[60, 99:102] / bare.linear[60, 99:102]
    np.testing.assert_allclose(share[0], through(RED), atol=0.02)
    np.testing.assert_allclose(
        share[1], 0.5 + 0.5 * through(RED), atol=0.1
    )  # a sample lies two texels of the map from the edge
    np.testing.assert_allclose(share[2], 1.0, atol=0.02)
