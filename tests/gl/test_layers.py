"""Blended surfaces: composited in closed form, per pixel and sample, over an opaque image that does not know them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.gl import layers
from glshadow.scenes import shapes

from ..pairwise import mostly

SIZE = (64, 64)
PLAN = gs.OrthographicCamera((0.0, 10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=8.0)
EYE = gs.PerspectiveCamera((0.3, 9.0, 4.0), (0.0, 0.0, 0.0), fov_y=40.0)
SUN = gs.DirectionalLight(direction=(0.4, -1.0, 0.2), intensity=0.7)
ALL = ("image", "visibility", "linear", "alpha", "depth", "triangle", "node", "normal", "position", "transmittance")
OPAQUE = tuple(name for name in ALL if name not in ("image", "linear", "alpha", "transmittance"))
ROUNDING = 2e-6
"""Relative: a few roundings of float32 for each of 20 layers."""
COLORS = (
    (0.8, 0.2, 0.1, 0.3),
    (0.1, 0.7, 0.3, 0.6),
    (0.2, 0.1, 0.9, 0.45),
    (0.9, 0.9, 0.2, 0.15),
    (0.3, 0.6, 0.6, 0.8),
)


def material(color: Sequence[float], **more: object) -> gs.Material:
    settings = {"alpha_mode": gs.AlphaMode.BLEND, "double_sided": True, **more}
    return gs.Material(color=tuple(color), **settings)  # type: ignore[arg-type]


def pane(
    color: Sequence[float], height: float, side: float = 4.0, name: str = "pane", x: float = 0.0, **more: object
) -> gs.Node:
    corner, across, along = (x - 0.5 * side, height, 0.5 * side), (side, 0.0, 0.0), (0.0, 0.0, -side)
    return gs.Node(gs.Mesh(*shapes.rectangle(corner, across, along), material=material(color, **more)), name=name)


def ground(white: float = 1.0, side: float = 40.0) -> gs.Node:
    return pane((white, white, white, 1.0), 0.0, side, "ground", alpha_mode=gs.AlphaMode.OPAQUE)


def over(colors: Sequence[Sequence[float]], behind: Array | float) -> Array:
    """Colours from top to bottom, straight alpha, over what is behind."""
    result = np.broadcast_to(np.asarray(behind, dtype=np.float64), (3,))
    for color in reversed(colors):
        result = color[3] * np.asarray(color[:3]) + (1.0 - color[3]) * result
    return result


def plain(renderer: gs.Renderer, nodes: Sequence[gs.Node], camera: gs.Camera = PLAN, **more: object) -> gs.Frame:
    """A frame in which each surface has its own colour."""
    settings = {"ambient": 1.0, "outputs": ("linear", "image", "alpha", "node"), "samples": 1, **more}
    return renderer.render(gs.Scene(tuple(nodes)), camera, [], SIZE, **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize("samples", [1, 4, 16])
@pytest.mark.parametrize("white", [1.0, 0.0])
@pytest.mark.parametrize("count", [1, 2, 5, 20])
def test_panes_over_a_plane(renderer: gs.Renderer, count: int, white: float, samples: int) -> None:
    colors = [COLORS[k % len(COLORS)] for k in range(count)]
    panes = [pane(color, 2.0 - 0.05 * k) for k, color in enumerate(colors)]
    shuffled = [panes[k] for k in np.random.default_rng(count).permutation(count)]
    frame = plain(renderer, [*shuffled[: count // 2], ground(white), *shuffled[count // 2 :]], samples=samples)
    inside = frame.linear[18:46, 18:46]
    np.testing.assert_allclose(inside, np.broadcast_to(over(colors, white), inside.shape), rtol=ROUNDING, atol=1e-7)
    np.testing.assert_array_equal(frame.linear[:14], white)
    assert (frame.node == count // 2).all()
    np.testing.assert_array_equal(frame.alpha, 1.0)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("camera", [PLAN, EYE], ids=["orthographic", "perspective"])
def test_order_in_the_scene_does_not_matter(renderer: gs.Renderer, camera: gs.Camera, order: tuple[int, ...]) -> None:
    panes = [pane(color, 2.0 - 0.3 * k) for k, color in enumerate(COLORS[:3])]
    first = plain(renderer, [ground(), *panes], camera)
    frame = plain(renderer, [ground(), *(panes[k] for k in order)], camera)
    np.testing.assert_array_equal(frame.linear, first.linear)
    np.testing.assert_array_equal(frame.image, first.image)


def test_intersecting_panes_are_sorted_per_pixel(renderer: gs.Renderer) -> None:
    rise = 0.5
    turned = gs.Mesh(
        *shapes.rectangle((-2, 1 - 2 * rise, 2), (4, 4 * rise, 0), (0, 0, -4)), material=material(COLORS[0])
    )
    frame = plain(renderer, [ground(), gs.Node(turned), pane(COLORS[1], 1.0)])
    inside = frame.linear[18:46, 18:46]
    left = np.broadcast_to(over((COLORS[1], COLORS[0]), 1.0), (28, 14, 3))
    right = np.broadcast_to(over((COLORS[0], COLORS[1]), 1.0), (28, 14, 3))
    np.testing.assert_allclose(inside, np.concatenate([left, right], axis=1), rtol=ROUNDING)


@pytest.mark.parametrize("count", [2, 3, 9])
def test_coincident_panes_are_all_there(renderer: gs.Renderer, count: int) -> None:
    """Instances of one mesh, and equal meshes, at one place: none of them hides another."""
    one = pane(COLORS[0], 1.0)
    copies = [one] * count
    equal = [pane(COLORS[0], 1.0, name=f"equal {k}") for k in range(count)]
    for panes in (copies, equal, [*copies[:1], *equal[1:]]):
        frame = plain(renderer, [ground(0.0), *panes])
        expected = (1.0 - (1.0 - COLORS[0][3]) ** count) * np.asarray(COLORS[0][:3])
        inside = frame.linear[18:46, 18:46]
        np.testing.assert_allclose(inside, np.broadcast_to(expected, inside.shape), rtol=ROUNDING)


def test_each_pixel_of_a_pane_is_one_layer(renderer: gs.Renderer) -> None:
    """No pixel on the diagonal of a rectangle is covered twice, and none is left out."""
    for camera in (PLAN, EYE, replace(PLAN, up=(1.0, 0.0, -1.0))):
        frame = plain(renderer, [ground(0.0), pane((1.0, 1.0, 1.0, 0.5), 1.0)], camera)
        assert set(np.unique(frame.linear)) == {0.0, 0.5}


@pytest.mark.parametrize("samples", [4, 16])
def test_edge_has_the_mean_of_its_samples(renderer: gs.Renderer, samples: int) -> None:
    """The pane's edges cross pixels, between samples: those outside show the plane."""
    pixel = 8.0 / SIZE[0]
    frame = plain(renderer, [ground(0.0), pane((1.0, 1.0, 1.0, 0.5), 1.0, 20.8 * pixel)], samples=samples)
    white = [pane((1.0, 1.0, 1.0, 1.0), 1.0, 20.8 * pixel, alpha_mode=gs.AlphaMode.OPAQUE)]
    covered = plain(renderer, [ground(0.0), *white], samples=samples)
    np.testing.assert_array_equal(frame.linear, 0.5 * covered.linear)
    # .4 of a pixel is covered: one of two columns, two of four
    assert set(np.unique(frame.linear).tolist()) == {0.0, 0.125, 0.25, 0.5}


@pytest.mark.parametrize("samples", [1, 4])
def test_pane_before_an_opaque_edge(renderer: gs.Renderer, samples: int) -> None:
    """Behind a pane the mean over samples of the opaque edge is that without it, seen through the pane."""
    box = gs.Node(
        gs.Mesh(*shapes.box((1.7, 0.6, 1.3), (0.1, 0.3, 0.05)), material=gs.Material(color=(0.1, 0.4, 0.2, 1.0)))
    )
    color = COLORS[0]
    bare = plain(renderer, [ground(), box], EYE, samples=samples)
    frame = plain(renderer, [ground(), box, pane(color, 3.0, 8.0)], EYE, samples=samples)
    inside = frame.linear[16:48, 16:48]
    expected = color[3] * np.asarray(color[:3]) + (1.0 - color[3]) * bare.linear[16:48, 16:48]
    np.testing.assert_allclose(inside, expected, rtol=ROUNDING)


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("light", [SUN, gs.PointLight(position=(1.0, 5.0, 1.0)), gs.RectLight(position=(0.0, 5.0, 0.0))],
                         ids=["sun", "point", "panel"])  # fmt: skip
def test_alpha_0_equals_absent(renderer: gs.Renderer, light: gs.Light, samples: int) -> None:
    """To the bit: a helper's box that reaches far beyond the model, and contains the eye."""
    box = gs.Node(gs.Mesh(*shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))), name="box")
    helper = gs.Node(gs.Mesh(*shapes.box((90.0, 90.0, 90.0)), material=material((1.0, 0.0, 0.0, 0.0))), name="helper")
    empty = np.zeros((2, 2, 4), dtype=np.uint8)
    card = replace(
        pane(COLORS[0], 1.0, 3.0).mesh,
        uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]),
        material=material(COLORS[0], texture=empty),
    )
    vertices = replace(pane(COLORS[0], 2.0, 3.0).mesh, colors=np.zeros((4, 4)))
    bare = gs.Scene((pane((1, 1, 1, 1), 0.0, 6.0, alpha_mode=gs.AlphaMode.OPAQUE), box))
    scene = gs.Scene((*bare.nodes, helper, gs.Node(card, name="card"), gs.Node(vertices, name="vertices")))
    assert scene.camera == bare.camera
    np.testing.assert_array_equal(scene.bounds, bare.bounds)
    first, second = (renderer.render(each, None, [light], SIZE, outputs=ALL, samples=samples) for each in (bare, scene))
    assert (first.near, first.far) == (second.near, second.far)
    for name in ALL:
        np.testing.assert_array_equal(getattr(second, name), getattr(first, name), err_msg=name)
    truth = gs.trace(scene, None, [light], SIZE, samples=1)
    assert (truth.triangle == gs.trace(bare, None, [light], SIZE, samples=1).triangle).all()


FILTERS: dict[str, gs.Shadow | None] = {
    "derived": gs.Shadow(), "map": gs.Shadow(filter=gs.Pcf(1)), "cascades": gs.Shadow(filter=gs.Pcf(1), fit=gs.Cascades(3)),
    "moments": gs.Shadow(filter=gs.Msm()), "none": None,
}  # fmt: skip


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("filter", list(FILTERS))
def test_opaque_outputs_do_not_know_what_blends(renderer: gs.Renderer, filter: str, samples: int) -> None:
    box = gs.Node(gs.Mesh(*shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))), name="box")
    light = replace(SUN, shadow=FILTERS[filter])
    bare = gs.Scene((ground(side=12.0), box), EYE)
    blended = [pane(COLORS[0], 1.5, 2.0), pane(COLORS[1], 8.9, 0.5, "near"), pane(COLORS[2], -20.0, 90.0, "far")]
    scene = gs.Scene((*bare.nodes, *blended), EYE)
    first, second = (renderer.render(each, EYE, [light], SIZE, outputs=ALL, samples=samples) for each in (bare, scene))
    assert (first.near, first.far) == (second.near, second.far)
    for name in OPAQUE:
        np.testing.assert_array_equal(getattr(second, name), getattr(first, name), err_msg=name)
    assert (first.linear != second.linear).any()


@pytest.mark.parametrize("camera", [PLAN, EYE], ids=["orthographic", "perspective"])
def test_opaque_surface_hides_panes_behind_it(renderer: gs.Renderer, camera: gs.Camera) -> None:
    bare, frame = (
        plain(renderer, [ground(0.3), *panes], camera)
        for panes in ((), [pane(c, -0.5 - k, 20.0) for k, c in enumerate(COLORS)])
    )
    for name in ("linear", "image", "alpha"):
        np.testing.assert_array_equal(getattr(frame, name), getattr(bare, name), err_msg=name)


def test_what_blends_comes_first_in_the_scene(renderer: gs.Renderer) -> None:
    """Triangles and nodes keep their numbers in the scene, and the reference counts alike."""
    scene = gs.Scene((pane(COLORS[0], 1.0), ground(), pane(COLORS[0], 2.0, name="other")), EYE, (SUN,))
    frame = renderer.render(scene, size=SIZE, outputs=("triangle", "node"), samples=1)
    truth = gs.trace(scene, size=SIZE, samples=1)
    assert set(np.unique(frame.node)) == {1}
    assert set(np.unique(frame.triangle)) == {2, 3}
    assert (frame.triangle == truth.triangle).mean() > 0.98  # the diagonal belongs to either
    np.testing.assert_array_equal(frame.node, truth.node)


def test_nothing_opaque(renderer: gs.Renderer) -> None:
    frame = renderer.render(gs.Scene((pane(COLORS[0], 0.0), pane(COLORS[1], 1.0))), PLAN, [SUN], SIZE, outputs=ALL, samples=1,
                            background=None, ambient=1.0)  # fmt: skip
    assert np.isinf(frame.depth).all()
    assert (frame.node == -1).all()
    assert (frame.triangle == -1).all()
    assert np.isnan(frame.visibility).all()
    assert np.isnan(frame.transmittance).all()
    assert np.isnan(frame.position).all()
    alpha = 1.0 - 0.7 * 0.4
    np.testing.assert_allclose(frame.alpha[18:46, 18:46], alpha, rtol=ROUNDING)
    np.testing.assert_array_equal(frame.alpha[:14], 0.0)


@pytest.mark.parametrize("samples", [1, 4])
def test_transparent_background(renderer: gs.Renderer, samples: int) -> None:
    """Premultiplied in floats, straight in bytes."""
    frame = plain(renderer, [pane(COLORS[0], 0.0), pane(COLORS[1], 1.0)], background=None, samples=samples)
    inside = frame.linear[18:46, 18:46]
    expected = np.append(over((COLORS[1], COLORS[0]), 0.0), 1.0 - 0.7 * 0.4)
    np.testing.assert_allclose(inside, np.broadcast_to(expected, inside.shape), rtol=ROUNDING)
    np.testing.assert_allclose(frame.alpha[18:46, 18:46], expected[3], rtol=ROUNDING)
    straight = np.rint(255.0 * gs_srgb(expected[:3] / expected[3]))
    np.testing.assert_array_equal(frame.image[18:46, 18:46, :3], np.broadcast_to(straight, (28, 28, 3)))
    np.testing.assert_array_equal(frame.image[18:46, 18:46, 3], np.rint(255.0 * expected[3]))
    color = plain(renderer, [pane(COLORS[0], 0.0), pane(COLORS[1], 1.0)], background=(1.0, 0.0, 0.0), samples=samples)
    np.testing.assert_allclose(
        color.linear, frame.linear[..., :3] + (1.0 - frame.linear[..., 3:]) * (1.0, 0.0, 0.0), atol=1e-6
    )
    np.testing.assert_allclose(color.alpha, frame.alpha, atol=1e-6)


def gs_srgb(linear: Array) -> Array:
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))


@pytest.mark.parametrize("samples", [1, 4])
def test_pane_half_in_the_shadow_of_a_box(renderer: gs.Renderer, samples: int) -> None:
    """A light of slope 1: the shadow of an edge at height 2.5, x = -1 falls on the pane at height 1 up to x = .5, a border of pixels."""
    light = gs.DirectionalLight(direction=(1.0, -1.0, 0.0))
    caster = gs.Node(
        gs.Mesh(*shapes.box((3.0, 0.5, 9.0), (-2.5, 2.25, 0.0)), material=gs.Material(color=(0.0, 0.0, 0.0, 1.0)))
    )
    color, up = COLORS[0], np.sqrt(0.5)
    pixels = (ground(0.0), caster, pane(color, 1.0, 3.9))
    frame = renderer.render(gs.Scene(pixels), PLAN, [light], SIZE, ambient=0.0, outputs=("linear",), samples=samples)
    rows = frame.linear[20:44]
    pixel = 8.0 / SIZE[0]
    border = round((0.5 + 4.0) / pixel)  # the caster hides the pane only left of x = -1
    np.testing.assert_array_equal(rows[:, 25:border], 0.0)
    lit = np.broadcast_to(color[3] * np.asarray(color[:3]) * up, rows[:, border:46].shape)
    np.testing.assert_allclose(rows[:, border:46], lit, rtol=2e-3)  # base colours have 11 bits


def test_both_sides_are_lit_by_their_own_side(renderer: gs.Renderer) -> None:
    below = gs.OrthographicCamera((0.0, -10.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=8.0)
    up = gs.DirectionalLight(direction=(0.0, 1.0, 0.0))
    for camera, light, lit in ((PLAN, SUN, True), (PLAN, up, False), (below, up, True), (below, SUN, False)):
        frame = renderer.render(gs.Scene((pane(COLORS[0], 1.0),)), camera, [light], SIZE, ambient=0.0, outputs=("linear",),
                                background=(0.0, 0.0, 0.0), samples=1)  # fmt: skip
        assert (frame.linear[32, 32] > 0.0).all() == lit


def test_lower_pane_gets_the_light_of_the_upper_one(renderer: gs.Renderer) -> None:
    """Seen beside the upper pane, which lets tinted light through; neither tints itself, nor what is above it."""
    light = gs.DirectionalLight(direction=(1.0, -1.0, 0.0), intensity=0.5)
    upper, lower = pane(COLORS[0], 3.0, 2.0, x=-3.0), pane(COLORS[1], 1.0, 3.0)
    frame = renderer.render(
        gs.Scene((ground(0.0), upper, lower)), PLAN, [light], SIZE, ambient=0.0, outputs=("linear",), samples=1
    )
    alone = renderer.render(
        gs.Scene((ground(0.0), lower)), PLAN, [light], SIZE, ambient=0.0, outputs=("linear",), samples=1
    )
    ratio = frame.linear[28:36, 23:43] / alone.linear[28:36, 23:43]
    alpha, color = COLORS[0][3], np.asarray(COLORS[0][:3])
    through = (1.0 - alpha) * (1.0 - alpha + alpha * color)
    np.testing.assert_allclose(ratio[:, :8], np.broadcast_to(through, (8, 8, 3)), rtol=1e-5)
    np.testing.assert_allclose(ratio[:, -10:], 1.0, rtol=1e-5)


@pytest.mark.parametrize("count", mostly([1, 3, 6, 20], 1, 6))
@pytest.mark.parametrize("samples", [1, 4])
def test_transmittance_is_the_product(renderer: gs.Renderer, count: int, samples: int) -> None:
    color = COLORS[3]
    panes = [pane(color, 0.5 + 0.05 * k, 6.0) for k in range(count)]
    lights = [gs.DirectionalLight(direction=(0.0, -1.0, 0.0)), gs.PointLight(position=(0.0, 5.0, 0.0)), gs.SkyLight()]
    frame = renderer.render(gs.Scene((ground(side=7.0), *panes)), PLAN, lights, SIZE, outputs=("transmittance", "visibility"),
                            samples=samples)  # fmt: skip
    through = (1.0 - color[3]) * (1.0 - color[3] + color[3] * np.asarray(color[:3]))
    assert frame.transmittance.shape == (3, *SIZE[::-1], 3)
    assert frame.transmittance.dtype == np.float32
    np.testing.assert_allclose(frame.transmittance[:2, 32, 32], np.broadcast_to(through**count, (2, 3)), rtol=1e-5)
    np.testing.assert_array_equal(frame.transmittance[2][4:60, 4:60], 1.0)
    assert np.isnan(frame.transmittance[:, 0, 0]).all()
    bare = renderer.render(
        gs.Scene((ground(side=7.0),)), PLAN, lights, SIZE, outputs=("transmittance",), samples=samples
    )
    assert (bare.transmittance[:, 4:60, 4:60] == 1.0).all()


def test_transmittance_between_panes(renderer: gs.Renderer) -> None:
    """An opaque table between two panes gets the light of the upper one alone."""
    sun = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
    table = pane((1, 1, 1, 1), 1.0, 2.0, "table", alpha_mode=gs.AlphaMode.OPAQUE)
    scene = gs.Scene((ground(), pane(COLORS[0], 0.5), table, pane(COLORS[1], 2.0)))
    frame = renderer.render(scene, PLAN, [sun], SIZE, outputs=("transmittance",), samples=1)
    upper, lower = ((1.0 - c[3]) * (1.0 - c[3] + c[3] * np.asarray(c[:3])) for c in (COLORS[1], COLORS[0]))
    np.testing.assert_allclose(frame.transmittance[0, 32, 32], upper, rtol=1e-5)
    np.testing.assert_allclose(frame.transmittance[0, 20, 20], upper * lower, rtol=1e-5)


def test_transparent_texels_are_not_there(renderer: gs.Renderer) -> None:
    image = np.full((1, 8, 4), 255, dtype=np.uint8)
    image[:, :4, 3] = 0
    mesh = replace(
        pane((1, 1, 1, 1), 1.0).mesh,
        uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]),
        material=material((0.5, 0.5, 0.5, 1.0), texture=image),
    )
    frame = plain(renderer, [ground(), gs.Node(mesh)])
    np.testing.assert_array_equal(frame.linear[18:46, 18:29], 1.0)
    np.testing.assert_allclose(frame.linear[18:46, 35:46], 0.5, rtol=2e-3)


@pytest.mark.parametrize("mode", list(gs.AlphaMode))
def test_transmission(renderer: gs.Renderer, mode: gs.AlphaMode) -> None:
    """A pane that transmits .75: a quarter of its diffuse light, and three quarters of what is behind, tinted."""
    color = np.array([0.9, 0.5, 0.2])
    glass = pane((*color, 1.0), 1.0, transmission=0.75, alpha_mode=mode)
    frame = plain(renderer, [ground(0.5), glass])
    np.testing.assert_allclose(frame.linear[32, 32], 0.25 * color + 0.75 * color * 0.5, rtol=2e-3)
    sun = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
    lit = renderer.render(
        gs.Scene((ground(), glass)), PLAN, [sun], SIZE, outputs=("transmittance", "visibility"), samples=1
    )
    np.testing.assert_allclose(lit.transmittance[0, 32, 32], 0.75 * color, rtol=1e-5)
    assert lit.visibility[0, 32, 32] == 1.0


@pytest.mark.parametrize("unlit", [False, True])
def test_what_is_transmitted_is_neither_scattered_nor_emitted(renderer: gs.Renderer, unlit: bool) -> None:
    solid = pane((*COLORS[0][:3], 1.0), 1.0, unlit=unlit, transmission=0.25, alpha_mode=gs.AlphaMode.OPAQUE)
    frame = plain(renderer, [ground(), solid])
    np.testing.assert_allclose(frame.linear[32, 32], COLORS[0][:3], rtol=5e-3)  # before white; RGB9E5


def test_transmission_map(renderer: gs.Renderer) -> None:
    image = np.full((1, 8, 4), 255, dtype=np.uint8)
    image[:, :4, 0] = 0
    mesh = replace(
        pane((1, 1, 1, 1), 1.0).mesh,
        uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]),
        material=material(
            (0.5, 0.5, 0.5, 1.0), transmission=1.0, transmission_map=image, alpha_mode=gs.AlphaMode.OPAQUE
        ),
    )
    frame = plain(renderer, [ground(0.2), gs.Node(mesh)])
    np.testing.assert_allclose(frame.linear[18:46, 18:29], 0.5, rtol=2e-3)
    np.testing.assert_allclose(frame.linear[18:46, 35:46], 0.1, rtol=3e-3)  # blue has 10 bits


def test_catcher_does_not_blend(renderer: gs.Renderer) -> None:
    catcher = replace(pane(COLORS[0], 0.0, 20.0), catches=True)
    frame = renderer.render(
        gs.Scene((catcher,)), PLAN, [SUN], SIZE, outputs=("node", "alpha"), background=None, samples=1
    )
    assert (frame.node == 0).all()
    np.testing.assert_allclose(frame.alpha, 0.0, atol=1e-6)


def test_opaque_blend_material_is_opaque(renderer: gs.Renderer) -> None:
    """BLEND without any alpha below 1 is a caster and a surface like all others."""
    scene = [ground(), pane((0.2, 0.2, 0.2, 1.0), 1.0)]
    frame = renderer.render(gs.Scene(tuple(scene)), PLAN, [SUN], SIZE, outputs=("node", "visibility"), samples=1)
    assert set(np.unique(frame.node)) == {0, 1}
    assert (frame.visibility == 0.0).any()


@pytest.mark.parametrize("samples", mostly([1, 4], 1))
def test_frame_depends_on_its_arguments_alone(samples: int) -> None:
    scenes = [gs.Scene((ground(), *(pane(c, 1.0 + k) for k, c in enumerate(COLORS[:n])))) for n in (3, 0, 1)]
    lights = [SUN, gs.PointLight(position=(1.0, 6.0, 0.0))]
    settings = {"outputs": ALL, "samples": samples}
    with gs.Renderer("egl") as fresh:
        expected = fresh.render(scenes[0], EYE, lights, SIZE, **settings)  # type: ignore[arg-type]
    with gs.Renderer("egl") as kept:
        for k in (1, 0, 2, 0, 0):
            frame = kept.render(scenes[k], EYE, lights, SIZE, **settings)  # type: ignore[arg-type]
            if k == 0:
                for name in ALL:
                    np.testing.assert_array_equal(getattr(frame, name), getattr(expected, name), err_msg=name)


@pytest.mark.parametrize("samples", [1, 4])
def test_parts_of_the_image_join(renderer: gs.Renderer, monkeypatch: pytest.MonkeyPatch, samples: int) -> None:
    """An image in parts, of which the last overlap, is that in one: a part's own projection is rounded differently, by less than a step."""
    scene = gs.Scene((ground(), *(pane(c, 1.0 + k, 2.0 + k, str(k)) for k, c in enumerate(COLORS[:3]))))
    whole = renderer.render(scene, EYE, [SUN], SIZE, outputs=("linear",), samples=samples).linear
    for most in (5000, 1000, 48):
        monkeypatch.setattr(layers, "MOST_SAMPLES", most)
        parts = renderer.render(scene, EYE, [SUN], SIZE, outputs=("linear",), samples=samples).linear
        assert (np.abs(parts - whole).max(axis=-1) > 1e-5).mean() < 2e-3, most


@pytest.mark.parametrize(
    "light",
    [
        gs.PointLight(position=(1.0, 5.0, 1.0), radius=0.5, shadow=gs.Shadow(filter=gs.Exact(light_samples=16))),
        gs.RectLight(position=(0.0, 5.0, 0.0)),
        gs.SkyLight(),
        gs.DirectionalLight(
            direction=(0.4, -1.0, 0.2), angle=5.0, shadow=gs.Shadow(filter=gs.LightSamples(8, of=gs.Pcf(1)))
        ),
        replace(SUN, shadow=gs.Shadow(filter=gs.Pcf(1), fit=gs.Cascades(2))),
        gs.SpotLight(
            position=(0.0, 6.0, 0.0), direction=(0.0, -1.0, 0.0), outer_angle=40.0, shadow=gs.Shadow(filter=gs.Evsm())
        ),
    ],
    ids=["soft", "panel", "sky", "map many times", "cascades", "moments"],
)
def test_layers_are_shaded_as_opaque_surfaces(renderer: gs.Renderer, light: gs.Light) -> None:
    """Panes of alpha .5 over black, of which the lower is seen beside the upper, against the same panes drawn opaque."""
    box = gs.Node(
        gs.Mesh(*shapes.box((0.8, 0.8, 0.8), (0.2, 3.0, 0.0)), material=gs.Material(color=(0.5, 0.5, 0.5, 1.0))),
        name="box",
    )
    frames = []
    for alpha in (1.0, 0.5):
        panes = (pane((0.8, 0.8, 0.8, alpha), 1.0, 3.0, x=-0.2), pane((0.8, 0.8, 0.8, alpha), 0.5, 3.0, x=3.1))
        panes = tuple(replace(each, casts=False) for each in panes)
        scene = gs.Scene((ground(0.0), box, *panes))
        frames.append(renderer.render(scene, PLAN, [light], SIZE, ambient=0.1, outputs=("linear", "node"), samples=1))
    opaque, half = frames
    shown = opaque.node >= 2
    ratio = half.linear[shown] / opaque.linear[shown]
    off = np.abs(ratio - 0.5).max(axis=-1) > 1e-3
    assert shown.sum() > 700
    assert off.mean() < 0.03, "texels at the borders of shadows: these maps are fitted to other surfaces"


def test_each_layer_has_its_own_soft_shadow(renderer: gs.Renderer) -> None:
    """Panes behind each other, in the penumbra of a box, composited from images of each alone."""
    light = gs.PointLight(position=(1.0, 5.0, 1.0), radius=0.5, shadow=gs.Shadow(filter=gs.Exact(light_samples=16)))
    box = gs.Node(
        gs.Mesh(*shapes.box((0.8, 0.8, 0.8), (0.2, 3.0, 0.0)), material=gs.Material(color=(0.0, 0.0, 0.0, 1.0))),
        name="box",
    )
    panes = tuple(replace(pane((0.8, 0.8, 0.8, 0.5), height), casts=False) for height in (1.7, 1.0, 0.3))
    together, *alone = (
        renderer.render(
            gs.Scene((ground(0.0), box, *some)), PLAN, [light], SIZE, ambient=0.0, outputs=("linear",), samples=1
        ).linear
        for some in (panes, *((each,) for each in panes))
    )
    assert len(np.unique(np.round(alone[0][18:46, 18:46], 3))) > 10
    np.testing.assert_allclose(together, alone[0] + 0.5 * alone[1] + 0.25 * alone[2], atol=1e-6)


def test_pane_on_an_equal_opaque_mesh(renderer: gs.Renderer) -> None:
    """The same triangles, opaque and transparent, at the same place: both are seen."""
    shape = pane(COLORS[0], 1.0)
    solid = replace(
        shape,
        mesh=replace(shape.mesh, material=gs.Material(color=(0.2, 0.4, 0.6, 1.0), double_sided=True)),
        casts=False,
    )
    for nodes in ((ground(), shape, solid), (ground(), solid, shape)):
        frame = plain(renderer, nodes)
        expected = np.broadcast_to(over(COLORS[:1], (0.2, 0.4, 0.6)), (28, 28, 3))
        np.testing.assert_allclose(frame.linear[18:46, 18:46], expected, rtol=ROUNDING)


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("seed", [None, 3])
def test_decal_in_the_plane_of_a_wall(renderer: gs.Renderer, seed: int | None, samples: int) -> None:
    """Of other triangles than the wall, and of other depths by rounding: it is before the wall all over. Seen steeply and obliquely."""
    turn = np.eye(3) if seed is None else np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    across, along = turn[0], turn[1]
    normal = np.cross(across, along)
    middle = 0.17 * normal

    def flat(corner: Array, first: Array, second: Array, color: Sequence[float], **more: object) -> gs.Mesh:
        return gs.Mesh(*shapes.rectangle(middle + corner, first, second), material=material(color, unlit=True, **more))

    wall = flat(
        -30.0 * across - 30.0 * along, 60.0 * across, 60.0 * along, (0.0, 0.0, 1.0, 1.0), alpha_mode=gs.AlphaMode.OPAQUE
    )
    decal = flat(
        -0.6 * across - 0.7 * along, 1.3 * across + 0.2 * along, 1.4 * along - 0.2 * across, (1.0, 0.0, 0.0, 0.5)
    )
    for eye in (3.0 * normal + 0.8 * across, 0.4 * normal + 2.5 * across):
        camera = gs.PerspectiveCamera(tuple(middle + eye), tuple(middle), tuple(along + 0.01 * across), fov_y=40.0)
        alone = plain(renderer, [decal], camera, samples=samples, background=(0.0, 0.0, 0.0))
        both = plain(renderer, [wall, decal], camera, samples=samples)
        inside = alone.alpha == 0.5
        assert inside.sum() > 300
        np.testing.assert_allclose(
            both.linear[inside], np.broadcast_to((0.5, 0.0, 0.5), (inside.sum(), 3)), atol=2e-3
        )  # RGB9E5


def test_scene_that_does_not_blend_allocates_nothing() -> None:
    with gs.Renderer("egl") as fresh:
        fresh.render(gs.scenes.box().scene, None, None, SIZE)
        assert fresh._cache is not None
        kept = fresh._cache.layers
        assert (kept._scene.thing, kept._targets.thing, kept._any, len(kept._techniques)) == (None, None, None, 0)


def test_pane_out_of_view_draws_no_layer() -> None:
    with gs.Renderer("egl") as fresh:
        frame = fresh.render(gs.Scene((ground(), pane(COLORS[0], 1.0, x=90.0))), PLAN, [SUN], SIZE, outputs=ALL)
        assert fresh._cache is not None
        assert fresh._cache.layers._targets.thing is None
        bare = fresh.render(gs.Scene((ground(),)), PLAN, [SUN], SIZE, outputs=ALL)
        for name in ALL:
            np.testing.assert_array_equal(getattr(frame, name), getattr(bare, name), err_msg=name)
