"""Fits with several views, or one in perspective: splits, lattices and matrices against their formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, ClipSpace, project, transform
from glshadow.shadows.fit_request import DepthTiles, FitRequest
from glshadow.shadows.fitted import _texels, cascades, split

CAMERA = gs.PerspectiveCamera(position=(0.0, 1.7, 0.0), target=(0.0, 1.2, -10.0), fov_y=50.0)
SUN = gs.DirectionalLight(direction=(0.6, -0.7, -0.1))
BOX = np.array([[i, j, k] for i in (-60.0, 60.0) for j in (0.0, 8.0) for k in (-200.0, 10.0)])
SIZE = (320, 180)


def asked(
    camera: gs.PerspectiveCamera = CAMERA, light: gs.Light = SUN, near: float = 2.0, far: float = 180.0
) -> FitRequest:
    """A ground at y = 0 that the camera sees from near to far."""
    axes = camera.view_from_world[:3, :3]
    y = np.geomspace(near, far, 40)
    rays = np.array([[-0.3, 0.0, -1.0], [0.3, 0.0, -1.0], [-0.3, 0.0, -1.0], [0.3, 0.0, -1.0]])
    world = np.broadcast_to(rays @ axes, (len(y), 4, 3)).copy()
    world[..., 1] = -1.7 / y[:, None]  # the ray through (x, -1.7 / depth) hits the ground
    starts = np.broadcast_to(np.asarray(camera.position), world.shape)
    depth_tiles = DepthTiles(starts, world, y, y * 1.03)
    corners = BOX[None]
    boxes = (np.stack([BOX.min(axis=0), BOX.max(axis=0)])[None], np.eye(4)[None])
    return FitRequest(
        light,
        corners,
        boxes,
        [BOX],
        BOX,
        camera,
        SIZE,
        1.0,
        200.0,
        ClipSpace(True, False),
        1024,
        2,
        depth_tiles=depth_tiles,
    )


def test_splits_match_zhangs_formula() -> None:
    near, far, count = 2.0, 162.0, 4
    share = np.arange(count + 1) / count
    even, ratio = near + (far - near) * share, near * (far / near) ** share
    for weight in (0.0, 0.4, 1.0):
        found = split(gs.Cascades(count, weight), near, far)
        np.testing.assert_allclose(found, weight * ratio + (1.0 - weight) * even, rtol=1e-12)
        assert (found[0], found[-1]) == (near, far)
    np.testing.assert_allclose(split(gs.Cascades(count, 1.0), near, far, perspective=False), even)


@pytest.mark.parametrize("count", [1, 3, 8])
def test_every_visible_point_lies_in_its_map(count: int) -> None:
    given = asked()
    assert given.depth_tiles is not None
    views = cascades(given, gs.Cascades(count)).views
    assert len(views) == count
    assert len({(view.near, view.far) for view in views}) == 1
    for view in views:
        assert view.cascade is not None
        points = given.depth_tiles.between(view.cascade.start, view.cascade.end)
        uvz = project(view.uvz_from_world, points)
        texel = uvz[:, :2] * view.resolution
        assert (texel >= view.inset).all()
        assert (texel <= view.resolution - view.inset).all()
        assert (uvz[:, 2] >= 0.0).all()
        assert (uvz[:, 2] <= 1.0).all()


def test_near_texels_are_small() -> None:
    views = cascades(asked(), gs.Cascades(4)).views
    sizes = [max(view.texel) for view in views]
    assert sizes == sorted(sizes)
    assert sizes[0] < sizes[-1] / 10.0


def moved(camera: gs.PerspectiveCamera, by: Array) -> gs.PerspectiveCamera:
    return replace(
        camera,
        position=tuple((np.asarray(camera.position) + by).tolist()),
        target=tuple((np.asarray(camera.target) + by).tolist()),
    )


def test_stable_maps_move_by_whole_texels() -> None:
    """Wherever the camera moves and looks, the lattice of their texels stays, and so does their size."""
    settings = gs.Cascades(3, stable=True, distance=150.0)
    first = cascades(asked(), settings).views
    turned = replace(CAMERA, target=(7.0, 0.4, -6.0))
    for camera in (moved(CAMERA, np.array([0.013, 0.0, 0.004])), moved(CAMERA, np.array([3.3, 0.2, -7.9])), turned):
        for before, after in zip(first, cascades(asked(camera), settings).views, strict=True):
            assert after.texel == before.texel
            np.testing.assert_array_equal(after.view_from_world, before.view_from_world)
            assert (after.near, after.far) == (before.near, before.far)
            steps = np.subtract(after.window, before.window)[[0, 2]] / before.texel
            np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_stable_maps_cover_their_slices() -> None:
    for view in cascades(asked(), gs.Cascades(3, stable=True, distance=150.0)).views:
        assert view.cascade is not None
        left, right, bottom, top = CAMERA.window(SIZE)
        corners = [
            (x * d, y * d, -d)
            for d in (view.cascade.start, view.cascade.end)
            for x in (left, right)
            for y in (bottom, top)
        ]
        world = np.array(corners) @ CAMERA.view_from_world[:3, :3] + np.asarray(CAMERA.position)
        texel = project(view.uvz_from_world, world)[:, :2] * view.resolution
        assert (texel >= view.inset).all()
        assert (texel <= view.resolution - view.inset).all()


@pytest.mark.parametrize("psm", [False, True])
def test_perspective_map_covers_the_view_and_keeps_light_straight(psm: bool) -> None:
    given = asked()
    assert given.depth_tiles is not None
    (view,) = gs.Lispsm(psm).fitted(given).views
    assert view.warp is not None
    points = given.depth_tiles.between(2.0, 180.0)
    inside = points[(np.abs(points[:, 0]) < 50.0)]
    uvzw = project(view.uvz_from_world, inside)
    assert (uvzw[:, 3] > 0.0).all()
    texel = uvzw[:, :2] / uvzw[:, 3:] * view.resolution
    assert (texel >= view.inset - 1e-6).all()
    assert (texel <= view.resolution - view.inset + 1e-6).all()
    depth = uvzw[:, 2] / uvzw[:, 3]
    assert (depth >= 0.0).all()
    assert (depth <= 1.0).all()
    # along the light nothing moves on the map, and depth grows linearly
    along = inside[:1] + np.linspace(-3.0, 3.0, 7)[:, None] * np.asarray(SUN.direction)
    there = project(view.uvz_from_world, along)
    np.testing.assert_allclose(
        there[:, :2] / there[:, 3:], np.broadcast_to(uvzw[0, :2] / uvzw[0, 3], (7, 2)), atol=1e-12
    )
    steps = np.diff(there[:, 2] / there[:, 3])
    assert (steps > 0.0).all()
    np.testing.assert_allclose(steps, steps[0], rtol=1e-9)


def test_light_along_the_view_gets_no_perspective() -> None:
    light = replace(SUN, direction=tuple((-CAMERA.view_from_world[2, :3]).tolist()))
    (view,) = gs.Lispsm().fitted(asked(light=light)).views
    assert view.warp is None


@pytest.mark.parametrize(
    ("kind", "given"), [(gs.Cascades, {"count": 9}), (gs.Cascades, {"split": 1.1}), (gs.Cascades, {"blend": 0.6}), (gs.Lispsm, {"psm": 1})]
)  # fmt: skip
def test_settings_are_checked(kind: type[gs.Fit], given: dict[str, float]) -> None:
    with pytest.raises(gs.SettingsError, match=f"{kind.__name__} {next(iter(given))} must be"):
        kind(**given)


def test_perspective_is_used_only_where_it_shrinks_visible_texels() -> None:
    """Lights from along the view to across it: never worse than without perspective, and once it is not used although it could be."""
    forward = -CAMERA.view_from_world[2, :3]
    across = np.cross(forward, (0.0, 1.0, 0.0))
    warps = []
    for angle in np.radians([0.5, 2.0, 5.0, 10.0, 30.0, 60.0, 90.0]):
        aim = np.cos(angle) * forward + np.sin(angle) * (0.6 * across + np.array([0.0, -0.8, 0.0]))
        given = asked(light=replace(SUN, direction=tuple(aim.tolist())))
        assert given.depth_tiles is not None
        (view,), (plain,) = (
            each.views for each in (gs.Lispsm(psm=True).fitted(given), cascades(given, gs.Cascades(1)))
        )
        local = transform(view.view_from_world, given.depth_tiles.between(2.0, 180.0))
        depth = np.maximum(
            -(given.depth_tiles.between(2.0, 180.0) - np.asarray(CAMERA.position)) @ CAMERA.view_from_world[2, :3], 1e-9
        )
        warps.append(view.warp is not None)
        if view.warp is not None:
            assert _texels(view, local, depth) < _texels(plain, local, depth)
    assert warps[-1]
    assert not all(warps)
