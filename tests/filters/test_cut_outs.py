"""The filtered shadow of a cut-out is as dark as its solid fraction, whether texels are smaller than its holes or far larger."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

SIDE, REPEATS = 64, 6  # texels of the image, and how often the leaf repeats it
SUN = gs.DirectionalLight(direction=(1.0, -1.0, 0.0))
SIZE = (192, 192)


def leaf_over_ground() -> tuple[gs.Scene, gs.Camera, float]:
    """A leaf of side 2 at height 2 whose shadow fills a square of the ground, a camera above that square, and the solid fraction."""
    image = np.full((SIDE, SIDE, 4), 255, dtype=np.uint8)
    image[..., 3] = np.random.default_rng(8).integers(0, 256, (SIDE, SIDE))
    positions, triangles = shapes.rectangle((-3.0, 2.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0))
    uv = (np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * REPEATS).astype(np.float32)
    material = gs.Material((1.0, 1.0, 1.0, 1.0), image, gs.AlphaMode.MASK, 0.5, double_sided=True)
    leaf = gs.Mesh(positions, triangles, uv=uv, material=material)
    ground = gs.Mesh(*shapes.rectangle((-4.0, 0.0, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -8.0)))
    scene = gs.Scene((gs.Node(ground, np.eye(4), "ground"), gs.Node(leaf, np.eye(4), "leaf")))
    # the shadow covers x and z from -1 to 1; the image its middle
    camera = gs.OrthographicCamera((0.0, 6.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=1.6)
    # bilinear between texels, repeated: the same samples of every texel's square
    alpha = image[..., 3].astype(np.float64)
    f = (np.arange(16) + 0.5)[:, None] / 16.0
    rows = np.stack([alpha * (1.0 - each) + np.roll(alpha, -1, axis=0) * each for each in f])
    both = np.stack([rows * (1.0 - each) + np.roll(rows, -1, axis=2) * each for each in f])
    return scene, camera, float((both / 255.0 >= 0.5).mean())


@pytest.mark.parametrize("resolution", [256, 1024, 4096])
@pytest.mark.parametrize(
    "filter", [gs.Hard(), gs.Pcf(2), gs.Gaussian(2), gs.Vsm(2), gs.Evsm(2), gs.Msm(2), gs.Exact()], ids=str
)
def test_mean_shadow_equals_the_solid_fraction(renderer: gs.Renderer, filter: gs.Filter, resolution: int) -> None:
    """The coarsest map has about 4,000 texels in the leaf, each solid or not: a deviation of 0.008; of 37,000 pixels less."""
    scene, camera, solid = leaf_over_ground()
    assert 0.4 < solid < 0.6
    size = {} if isinstance(filter, gs.Exact) else {"resolution": resolution}
    light = gs.DirectionalLight(direction=SUN.direction, shadow=gs.Shadow(filter=filter, fit=gs.SceneFit(), **size))
    frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility",), samples=1)
    if isinstance(filter, gs.Vsm):  # slopes add depths: the bound is loose
        assert 1.0 - solid - 0.024 < frame.visibility.mean() < 0.8
        return
    assert frame.visibility.mean() == pytest.approx(1.0 - solid, abs=0.024)
    if resolution == 256 and isinstance(filter, gs.Pcf):
        assert 0.05 < frame.visibility.std() < 0.35, "holes much finer than the filter are grey"


@pytest.mark.parametrize("kind", [gs.Evsm, gs.Msm])
def test_mip_maps_reduce_noise_of_sub_pixel_holes(renderer: gs.Renderer, kind: type[gs.Evsm] | type[gs.Msm]) -> None:
    """Holes of a tenth of a pixel: without mip maps each pixel shows the texel at its centre, with them the fraction of light."""
    scene, camera, solid = leaf_over_ground()
    seen = {}
    for mip_maps in (False, True):
        shadow = gs.Shadow(filter=kind(0, mip_maps=mip_maps), fit=gs.SceneFit(), resolution=1024)
        light = gs.DirectionalLight(direction=SUN.direction, shadow=shadow)
        seen[mip_maps] = renderer.render(
            scene, camera, [light], (48, 48), outputs=("visibility",), samples=1
        ).visibility
    # eight texels of 0.002 are half a pixel's 0.033, and some ten holes
    assert seen[True].std() < 0.4 * seen[False].std()
    assert seen[True].mean() == pytest.approx(1.0 - solid, abs=0.05)


def test_mip_maps_are_closer_to_the_pixel_mean(renderer: gs.Renderer) -> None:
    scene = gs.scenes.courtyard()
    assert scene.lights is not None
    truth = gs.trace(scene, None, scene.lights, (160, 90), samples=16)
    known = truth.reached[0] & (truth.alpha == 1.0)
    errors = {}
    for mip_maps in (False, True):
        light = gs.DirectionalLight(
            direction=scene.lights[0].direction,  # type: ignore[union-attr]
            shadow=gs.Shadow(filter=gs.Msm(mip_maps=mip_maps)),
        )
        frame = renderer.render(scene, None, [light], (160, 90), outputs=("visibility",), samples=1)
        errors[mip_maps] = float(np.abs(frame.visibility[0] - truth.visibility[0])[known].mean())
    assert errors[True] < 0.95 * errors[False], errors


@pytest.mark.parametrize("filter", [gs.Exact(), gs.Pcf(0)], ids=str)
@pytest.mark.parametrize(
    ("wrap", "solid"),
    [("repeat", (0, 1, 0, 1)), ("clamp", (1, 1, 0, 0)), ("mirror", (1, 1, 0, 0)), (("mirror", "repeat"), (1, 1, 0, 0))],
)
@pytest.mark.parametrize("placed", ["uv", "second", "transform"])
def test_shadow_follows_the_sampler(
    renderer: gs.Renderer, filter: gs.Filter, wrap: str | tuple[str, str], solid: tuple[int, ...], placed: str
) -> None:
    """Two texels, solid and not, over u from -.5 to 1.5: four quarters of the leaf, and of its shadow, and of what the camera sees."""
    image = np.full((1, 2, 4), 255, dtype=np.uint8)
    image[0, 1, 3] = 0
    positions, triangles = shapes.rectangle((-3.0, 2.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0))
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], dtype=np.float32)
    wide = unit * (2.0, 1.0) - (0.5, 0.0)
    matrix = np.array([[2.0, 0.0, -0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) if placed == "transform" else None
    sampler = gs.Sampler(wrap, "nearest", "nearest", uv_set=int(placed == "second"), transform=matrix)
    material = gs.Material(texture=image, alpha_mode=gs.AlphaMode.MASK, sampler=sampler)
    leaf = gs.Mesh(
        positions,
        triangles,
        uv=wide if placed == "uv" else unit,
        second_uv=wide if placed == "second" else None,
        material=material,
    )
    ground = gs.Mesh(*shapes.rectangle((-4.0, 0.0, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -8.0)))
    scene = gs.Scene((gs.Node(ground, name="ground"), gs.Node(leaf, name="leaf")))
    camera = gs.OrthographicCamera((0.0, 6.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=6.4)
    light = gs.DirectionalLight(direction=SUN.direction, shadow=gs.Shadow(filter=filter))
    frame = renderer.render(scene, camera, [light], (64, 64), outputs=("visibility", "node"), samples=1)
    truth = gs.trace(scene, camera, [light], (64, 64), samples=1)
    columns = [-0.75, -0.25, 0.25, 0.75]
    at = [int(32 + 10 * x) for x in columns]
    assert (frame.visibility[0, 32, at] == 0.0).tolist() == [bool(each) for each in solid]
    assert (truth.visibility[0, 32, at] == 0.0).tolist() == [bool(each) for each in solid]
    at = [int(32 + 10 * (x - 2.0)) for x in columns]
    assert (frame.node[32, at] == 1).tolist() == [bool(each) for each in solid]
    assert (truth.node[32, at] == 1).tolist() == [bool(each) for each in solid]
