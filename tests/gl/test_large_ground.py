"""A ground of any size loses no shadow near the camera; a map that covers too much is reported."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.cameras import pixel_rays
from glshadow.scenes import shapes

SIZE = (320, 180)
CAMERA = gs.PerspectiveCamera((2.5, 1.6, 3.0), (0.0, 0.9, -2.0), fov_y=50.0)
SUN = (-0.5, -0.7, -0.35)
SIDES = (10.0, 100.0, 1e3, 1e4, 1e5)


def table() -> gs.Mesh:
    legs = [((0.05, 0.72, 0.05), (x, 0.36, z)) for x in (-0.55, 0.55) for z in (-0.3, 0.3)]
    parts = [((1.2, 0.04, 0.7), (0.0, 0.74, 0.0)), *legs, ((0.24, 0.015, 0.24), (0.2, 0.7675, 0.1))]
    return gs.Mesh(*shapes.joined([shapes.box(extents, at) for extents, at in parts]))


def ground(side: float, cells: int = 1) -> gs.Mesh:
    """A square at y = 0 of so many cells along each side, two triangles each."""
    steps = np.linspace(-0.5 * side, 0.5 * side, cells + 1)
    x, z = np.meshgrid(steps, steps)
    corner = np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)
    a, b, c, d = (corner.ravel() + k for k in (0, 1, cells + 2, cells + 1))
    triangles = np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, c, b], axis=1)])
    return gs.Mesh(np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1), triangles)


def scene_of(*meshes: gs.Mesh) -> gs.Scene:
    return gs.Scene(tuple(gs.Node(mesh, np.eye(4), f"part {i}") for i, mesh in enumerate(meshes)))


def visibility(scene: gs.Scene, shadow: gs.Shadow) -> tuple[np.ndarray, gs.Used]:
    with gs.Renderer() as renderer:
        frame = renderer.render(
            scene,
            CAMERA,
            [gs.DirectionalLight(direction=SUN, shadow=shadow)],
            SIZE,
            outputs=("visibility", "depth"),
            samples=1,
        )
    near = frame.depth < 6.0
    return np.where(near, frame.visibility[0], 1.0), frame.used[0]


@pytest.mark.parametrize("cells", [1, 100])
@pytest.mark.parametrize("filter", [gs.Pcf(1), gs.Hard(), gs.Disc(), gs.Exact()], ids=str)
def test_ground_size_does_not_change_the_shadow(filter: gs.Filter, cells: int) -> None:
    """The image near the camera equals that of the smallest ground, except for a pixel or two at edges."""
    first, used = visibility(scene_of(table(), ground(SIDES[0], cells)), gs.Shadow(filter=filter))
    assert (first < 0.5).sum() > 400
    for side in SIDES[1:]:
        seen, also = visibility(scene_of(table(), ground(side, cells)), gs.Shadow(filter=filter))
        assert (np.abs(seen - first) > 0.5).sum() <= 3, side
        if used.texel is not None:
            np.testing.assert_allclose(also.texel, used.texel, rtol=1e-3)


def test_map_that_covers_too_much_is_reported() -> None:
    """Hills shadow themselves: the map must cover them all."""
    hills = ground(1e5, 40)
    rough = gs.Mesh(
        hills.positions + np.random.default_rng(1).uniform(0, 30, (len(hills.positions), 1)) * (0, 1, 0),
        hills.triangles,
    )
    camera = gs.PerspectiveCamera((0.0, 31.8, 0.0), (100.0, 31.8, 0.0))
    with gs.Renderer() as renderer:
        with pytest.warns(gs.GlshadowWarning, match=r"a texel of the light's 2048 map is as wide as \d+ pixels"):
            renderer.render(
                scene_of(rough),
                camera,
                [gs.DirectionalLight(direction=SUN, shadow=gs.Shadow(filter=gs.Pcf()))],
                SIZE,
                samples=1,
            )
        renderer.render(
            scene_of(rough),
            camera,
            [gs.DirectionalLight(direction=SUN, shadow=gs.Shadow(filter=gs.Exact()))],
            SIZE,
            samples=1,
        )


def test_casters_without_visible_shadow_are_not_drawn() -> None:
    """The caster's shadow lies outside the view."""
    aside = gs.Mesh(table().positions + np.array([0.0, 0.0, 50.0]), table().triangles)
    frame_light = gs.DirectionalLight(direction=SUN, shadow=gs.Shadow(filter=gs.Pcf()))
    with gs.Renderer() as renderer:
        frame = renderer.render(scene_of(aside, ground(1e3)), CAMERA, [frame_light], SIZE, samples=1)
    assert frame.used[0].draws == 0
    assert np.nanmin(frame.visibility) == 1.0


@pytest.mark.parametrize("scale", [1.0, 1e-6])
@pytest.mark.parametrize("half", [1e4, 1e6, 1e7])
def test_large_ground_clips_nothing_near(half: float, scale: float) -> None:
    """A box of 2 on a ground, 8 from the camera: every pixel shows its ray's hit, at its depth, and the shadow of a small ground.

    Depth has the closed form of planes. In float32 it is off by 1.5e-4 where vertices 1e7 away are clipped; a wall and another 1 % behind
    it, 9/10 of the way to the horizon, show whether that could swap two surfaces.
    """
    box = gs.Mesh(
        scale * shapes.box((2.0, 2.0, 2.0), (0.0, 1.0, 0.0))[0], shapes.box((2.0, 2.0, 2.0), (0.0, 1.0, 0.0))[1]
    )
    floor = gs.Mesh(
        *shapes.rectangle((-half * scale, 0, half * scale), (2 * half * scale, 0, 0), (0, 0, -2 * half * scale))
    )
    far, up = 0.9 * half * scale, 0.05 * half * scale
    walls = [gs.Mesh(*shapes.rectangle((-far, 0, -z), (2 * far, 0, 0), (0, up, 0))) for z in (far, 1.01 * far)]
    camera = gs.PerspectiveCamera((0.0, 1.7 * scale, 8.0 * scale), (0.0, 1.7 * scale, 0.0), fov_y=50.0)
    light = gs.DirectionalLight(direction=(-1.0, -0.7, 0.3))
    with gs.Renderer() as renderer:
        frame = renderer.render(
            scene_of(box, floor, *walls), camera, [light], SIZE, outputs=("node", "depth", "visibility"), samples=1
        )
    ray = pixel_rays(camera, SIZE)  # of unit view depth
    with np.errstate(divide="ignore"):
        ground = np.where(ray[..., 1] < 0.0, 1.7 * scale / -ray[..., 1], np.inf)
    front = np.where(np.abs(ray[..., :2] * 7.0 * scale + [0.0, 0.7 * scale]).max(axis=-1) < scale, 7.0 * scale, np.inf)
    wall = np.where(ray[..., 1] * (far + 8.0 * scale) < up - 1.7 * scale, far + 8.0 * scale, np.inf)
    depths = np.stack([front, ground, wall])
    expected = np.where(np.isfinite(depths.min(axis=0)), depths.argmin(axis=0), -1)
    assert np.isin(frame.node, (-1, 0, 1, 2)).all(), "the wall behind shows through"
    assert (frame.node != expected).sum() <= 4 * SIZE[0] / 100, "except for pixels at edges"
    same = (frame.node == expected) & (expected >= 0)
    assert set(np.unique(expected[same])) == {0, 1, 2}
    np.testing.assert_allclose(frame.depth[same], depths.min(axis=0)[same], rtol=2e-4)
    dark = (frame.visibility[0] == 0.0) & (frame.node == 1) & (frame.depth < 30.0 * scale)
    assert dark.sum() > 100
    assert frame.used[0].fallbacks == ()


@pytest.mark.parametrize("filter", [gs.Pcf(1), gs.Exact()], ids=str)
def test_local_light_over_a_large_ground_casts_shadows(filter: gs.Filter) -> None:
    """The same shadows as on a small ground: the light's near plane lies before the receivers, not behind them."""
    point_light = gs.PointLight(position=(0.4, 2.5, 0.3), shadow=gs.Shadow(filter=filter, resolution=512))
    seen = []
    with gs.Renderer() as renderer:
        for side in (10.0, 3e4):
            frame = renderer.render(
                scene_of(table(), ground(side)), CAMERA, [point_light], SIZE, outputs=("visibility", "depth"), samples=1
            )
            seen.append(np.where(frame.depth < 5.0, frame.visibility[0], 1.0))
    assert (seen[0] < 0.5).sum() > 200
    assert (np.abs(seen[1] - seen[0]) > 0.5).sum() <= 3
