"""Shadows thinner than a pixel: multisampled visibility is the mean over all samples, whatever other lights there are."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.gl.techniques.edges import Edges
from glshadow.gl.techniques.mapped import Mapped
from glshadow.lights import Light
from glshadow.scenes import shapes

from ..exact.test_casters import LIGHTS as LEAF_LIGHTS
from ..exact.test_casters import leaf, leaves, placed, scene_of
from ..pairwise import mostly

PITCH, PIXEL = 0.5 * 1.0137, 0.08  # of the wires, and of an image that is 150 pixels high
WIRES = (200, 150)
SUN = gs.DirectionalLight(direction=(-0.55, -0.8, -0.25))
SPOT = gs.SpotLight(position=(6.0, 9.0, 5.0), direction=(-6.0, -9.0, -5.0), inner_angle=44.0, outer_angle=45.0)
POINT = gs.PointLight(position=(0.5, 2.2, 0.8))


@pytest.fixture(scope="module")
def courtyard() -> gs.Scene:
    return gs.scenes.courtyard()


@pytest.fixture
def every(monkeypatch: pytest.MonkeyPatch) -> Any:
    """From here on every sample of every pixel is shaded, as if the silhouette edges did not fit into memory."""

    def switch() -> None:
        monkeypatch.setattr(Edges, "update", lambda *_: False)
        whole = {"GLS_EVERY": 1}
        monkeypatch.setattr(
            Mapped, "marking_receiver", lambda self, work: replace(self.receiver(work), collected=whole)
        )

    return switch


def wires(width: float, turned: float = 0.0) -> gs.Scene:
    """Long bars over a ground, seen from above."""
    bar = gs.Mesh(*shapes.box((width, width, 40.0)))
    axes = np.eye(4)
    axes[:3, :3] = [[np.cos(turned), 0, np.sin(turned)], [0, 1, 0], [-np.sin(turned), 0, np.cos(turned)]]

    def at(x: float) -> NDArray[np.float64]:
        moved = np.eye(4)
        moved[:3, 3] = (x, 3.0, 0.0)
        return axes @ moved

    ground = gs.Node(gs.Mesh(*shapes.rectangle((-40, 0, 40), (80, 0, 0), (0, 0, -80))), np.eye(4), "ground")
    nodes = [gs.Node(bar, at(-15.0 + i * PITCH), f"wire {i}") for i in range(60)]
    camera = gs.OrthographicCamera(position=(0, 1, 0.001), target=(0, 0, 0), up=(0, 0, -1), height=12)
    return gs.Scene((ground, *nodes), camera, (gs.DirectionalLight(direction=(0, -1, 0)),), "wires")


def lit_columns(width: float, columns: int) -> NDArray[np.float64]:
    """The fraction (200,) of a pixel's sample columns that lie under no wire."""
    x = 16.0 * (np.arange(WIRES[0] * columns) + 0.5) / (WIRES[0] * columns) - 8.0
    nearest = np.abs(x[:, None] + 15.0 - PITCH * np.arange(60)).min(axis=1)
    return np.asarray((nearest > 0.5 * width).reshape(WIRES[0], columns).mean(axis=1))


@pytest.mark.parametrize("pixels", [0.12, 0.25, 0.5, 1.0, 2.0])
def test_wires_darken_by_their_width(renderer: gs.Renderer, pixels: float) -> None:
    width = pixels * PIXEL
    for samples, tolerance in ((4, 0.01), (16, 0.003)):
        seen = renderer.render(wires(width), size=WIRES, samples=samples).visibility[0]
        np.testing.assert_allclose(seen, np.tile(lit_columns(width, int(samples**0.5)), (WIRES[1], 1)), atol=1e-6)
        # not along the sample columns: their number under a wire does not depend on chance
        turned = renderer.render(wires(width, 0.3), size=WIRES, samples=samples).visibility[0]
        assert abs(float(turned.mean()) - (1.0 - width / PITCH)) <= tolerance, samples


def disagreement(ours: gs.Frame, every: gs.Frame) -> NDArray[np.bool_]:
    """Pixels (H, W) whose means differ by more than a sample, where some light reaches them."""
    np.testing.assert_array_equal(np.isnan(ours.visibility), np.isnan(every.visibility))
    off = np.abs(np.nan_to_num(ours.visibility) - np.nan_to_num(every.visibility))
    return np.asarray((off > 1.01 / ours.samples).any(axis=0))


def leafy() -> gs.Scene:
    image = leaves(8, 6)
    nodes = (
        gs.Node(leaf(image), placed(-1.0, 1.0, 0.0, 1), "a"),
        gs.Node(leaf(image, 2.0), placed(1.0, 1.4, -0.5, 3), "b"),
    )
    return scene_of(*nodes, name="leaves")


CASES: dict[str, tuple[str, list[Light]]] = {
    "hard": ("courtyard", [SUN, SPOT, POINT]),
    "soft": ("courtyard", [replace(SUN, angle=0.5), replace(POINT, radius=0.02)]),
    "parallel": ("turned", [gs.DirectionalLight(direction=(0.1, -1, 0.2)), gs.PointLight(position=(0.3, 7.0, 0.2))]),
    "panel": ("turned", [gs.RectLight(position=(0, 9, 0), direction=(0, -1, 0), width=0.05, height=0.05)]),
    "cut out": ("leaves", list(LEAF_LIGHTS.values())[:2]),
    "map": (
        "turned",
        [gs.DirectionalLight(direction=(0.1, -1, 0.2), shadow=gs.Shadow(filter=gs.Pcf(1), resolution=4096))],
    ),
}


CELLS = mostly(
    product(CASES, (4, 16)), ("soft", 4), ("panel", 16), ("hard", 4), ("parallel", 16), ("cut out", 16), ("map", 4)
)


@pytest.mark.parametrize("cell", CELLS, ids=str)
def test_visibility_is_the_mean_of_every_sample(
    renderer: gs.Renderer, courtyard: gs.Scene, every: Any, cell: tuple[str, int]
) -> None:
    case, samples = cell
    which, lights = CASES[case]
    scene = {"courtyard": courtyard, "leaves": leafy(), "turned": wires(0.02, 0.3)}[which]
    size = (240, 135) if samples == 4 else (120, 68)
    ours = renderer.render(scene, None, lights, size, samples=samples)
    every()
    with gs.Renderer() as fresh:
        truth = fresh.render(scene, None, lights, size, samples=samples)
    # 20 of a million are less than one of these pixels
    assert disagreement(ours, truth).sum() <= 1


@pytest.mark.parametrize("samples", mostly([4, 16], 16))
def test_lights_do_not_affect_each_other(renderer: gs.Renderer, courtyard: gs.Scene, samples: int) -> None:
    """Nor those of the previous frame, which has the same camera."""
    lights: list[Light] = [
        replace(SUN, angle=1.0), SPOT, POINT, replace(SUN, shadow=gs.Shadow(filter=gs.Pcf(1), resolution=256)),
    ]  # fmt: skip
    size = (160, 90)
    for order in (lights, lights[::-1]):
        together = renderer.render(courtyard, None, order, size, samples=samples).visibility
        for seen, light in zip(together, order, strict=True):
            alone = renderer.render(courtyard, None, [light], size, samples=samples).visibility[0]
            np.testing.assert_array_equal(seen, alone)


def test_more_lights_than_a_mask_holds(renderer: gs.Renderer) -> None:
    scene = wires(0.02)
    lights = [gs.DirectionalLight(direction=(0.02 * i, -1, 0.05)) for i in range(33)]
    together = renderer.render(scene, None, lights, (40, 30), samples=4).visibility
    for number in (0, 1, 30, 31, 32):
        alone = renderer.render(scene, None, [lights[number]], (40, 30), samples=4).visibility[0]
        assert ((alone > 0.0) & (alone < 1.0)).any()
        np.testing.assert_array_equal(together[number], alone)


def test_edge_grids_shrink_with_the_memory_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same images with one grid of edges, and with none, where every sample is shaded."""
    scene = wires(0.02, 0.3)
    pictures, grids = [], []
    fill = Edges._fill
    for limit in (1 << 23, 1 << 18, 1):  # list entries
        with gs.Renderer() as renderer, monkeypatch.context() as patch:

            def limited(self: Edges, *arguments: Any, limit: int = limit) -> bool:
                caps = self._context.caps
                self._context.caps = replace(caps, max_texture_buffer_size=limit)
                fits = fill(self, *arguments)
                self._context.caps = caps
                grids.append(self._grids if fits else 0)
                return fits

            patch.setattr(Edges, "_fill", limited)
            pictures.append(renderer.render(scene, None, None, (80, 60), samples=4).visibility)
    assert grids[0] == 4
    assert 0 < grids[1] < 4
    assert grids[2] == 0
    np.testing.assert_array_equal(pictures[1], pictures[0])
    np.testing.assert_array_equal(pictures[2], pictures[0])


def mean_of_four(renderer: gs.Renderer, scene: gs.Scene, light: Light, size: tuple[int, int]) -> NDArray[np.float32]:
    """Visibility (H, W) that 4 samples should have: the mean of 2 x 2 pixels of one sample each, at the same places; 0 for background."""
    width, height = size
    fine = renderer.render(scene, None, [light], (2 * width, 2 * height), samples=1).visibility[0]
    blocks = fine.reshape(height, 2, width, 2)
    return np.asarray(np.nansum(blocks, axis=(1, 3)) / np.maximum((~np.isnan(blocks)).sum(axis=(1, 3)), 1))


def sheet(corner: tuple[float, ...], side: tuple[float, ...], other: tuple[float, ...]) -> gs.Mesh:
    return gs.Mesh(*shapes.rectangle(corner, side, other))


def triangle(*corners: tuple[float, ...]) -> gs.Mesh:
    return gs.Mesh(corners, [[0, 1, 2]])


GROUND = sheet((-20, 0, 20), (40, 0, 0), (0, 0, -40))
ABOVE = gs.OrthographicCamera(position=(0, 9, 0), target=(0, 0, 0), up=(0, 0, -1), height=3)
OBLIQUE = gs.PerspectiveCamera(position=(-2, 4, 1), target=(-1.207751, -1.079034, -1.809782), fov_y=60)
# where no silhouette edge was found, with what should find it
MISSED: dict[str, tuple[gs.Scene, Light]] = {
    # a sheet that crosses the ground and is seen edge-on: the shadow starts where they cross
    "crossing": (
        gs.Scene((GROUND, sheet((0.03, -0.5, 1), (0, 0, -2), (0, 1, 0))), ABOVE),
        gs.DirectionalLight(direction=(1, -1, 0.1)),
    ),
    # the first sheet's edges lie beside a face of the point light's cube, in the plane of which their rows are
    "beside a face": (
        gs.Scene((GROUND, sheet((-1, 1, -3), (0, 4, 0), (0, 0, 2)), sheet((-0.3, 2, 0.4), (0.7, 0, 0.1), (0, 0, -0.5))), ABOVE),
        gs.PointLight(position=(0, 3, 0)),
    ),
    # seen so obliquely that the samples behind the one that is shown lie farther away than those before it
    "foreshortened": (
        gs.Scene((triangle((0, 2, 1), (3, -3, 0), (-1, 2, -3)), triangle((-1, 2, -3), (0, -2, -1), (1, -1, 1))), OBLIQUE),
        gs.DirectionalLight(direction=(0.6834, -0.3464, -0.6426)),
    ),
    "cone": (
        gs.Scene((GROUND,), ABOVE),
        gs.SpotLight(position=(0.2, 3, 0.1), direction=(0, -1, 0), inner_angle=20, outer_angle=25),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", list(MISSED))
def test_every_shadow_edge_is_found(renderer: gs.Renderer, case: str) -> None:
    scene, light = MISSED[case]
    size = (48, 36)
    found = np.nan_to_num(renderer.render(scene, None, [light], size, samples=4).visibility[0])
    expected = mean_of_four(renderer, scene, light, size)
    assert ((expected > 0.0) & (expected < 1.0)).sum() > 8
    assert (np.abs(found - expected) > 0.01).sum() == 0


def crossing_bodies(seed: int) -> tuple[gs.Scene, Light]:
    """Boxes with missing faces and loose triangles with corners on a lattice, which cross each other; no face holds the light."""
    rng = np.random.default_rng(seed)
    nodes = [sheet((-9, -3, 9), (18, 0, 0), (0, 0, -18))]
    for _ in range(rng.integers(3, 7)):
        if rng.random() < 0.6:
            positions, triangles = shapes.box(rng.integers(1, 3, 3).astype(float))
            positions, triangles = positions + rng.integers(-2, 3, 3), triangles[: -rng.integers(1, 6)]
        else:
            positions, triangles = rng.integers(-3, 4, (18, 3)), np.arange(18).reshape(6, 3)
        nodes.append(gs.Mesh(positions, triangles))
    position = rng.normal(size=3) * 2.0 + (0, 2, 6)
    orthographic = gs.OrthographicCamera(tuple(position), (0, 0, 0), height=8)
    camera = gs.PerspectiveCamera(tuple(position), (0, 0, 0), fov_y=60) if seed % 2 else orthographic
    place = tuple(rng.normal(size=3) * 2.0 + (0, 2, 0))
    light = gs.PointLight(position=place) if seed % 3 else gs.DirectionalLight(direction=tuple(-np.array(place)))
    return gs.Scene(nodes, camera), light


@pytest.mark.parametrize("seed", mostly([4, 9, 44, 53, 58, 86], 9, 53, 86))
def test_shadows_of_bodies_that_cross(renderer: gs.Renderer, seed: int) -> None:
    scene, light = crossing_bodies(seed)
    size = (48, 36)
    found = np.nan_to_num(renderer.render(scene, None, [light], size, samples=4).visibility[0])
    wrong = np.abs(found - mean_of_four(renderer, scene, light, size)) > 0.26
    assert wrong.sum() == 0  # more than one sample
