"""Orthographic and calibrated cameras: depth in closed form, shadows against rays, and images that follow from each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, project
from glshadow.frame import Frame
from glshadow.geometry.ranges import view_depth
from glshadow.renderer import Renderer
from glshadow.scenes import shapes

from ..tolerances import POSITION_ROUNDINGS, UNIT

SIZE = (160, 90)
SNAP = 1.0 / 256.0  # pixels: where a rasteriser puts a vertex
PLAN = gs.OrthographicCamera((5.0, 4.0, 6.3), (0.1, 0.4, 0.0), height=5.0)
OFF_CENTRE = replace(PLAN, principal=(0.31, 0.64), pixel_aspect=1.3)
CALIBRATED = gs.IntrinsicsCamera(150.0, 140.0, 65.3, 60.1, (5.0, 4.0, 6.3), (0.1, 0.4, 0.0))
CAMERAS = {"orthographic": PLAN, "off-centre": OFF_CENTRE, "calibrated": CALIBRATED}
LIGHTS = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, -0.25)),
    "spot": gs.SpotLight(position=(3.0, 5.0, 2.0), direction=(-3.0, -5.0, -2.0), outer_angle=50.0),
    "point": gs.PointLight(position=(1.3, 3.1, 1.9)),
}


@pytest.fixture(scope="module", params=[True, False], ids=["0..1", "-1..1"])
def either(request: pytest.FixtureRequest) -> Iterator[Renderer]:
    """With and without glClipControl."""
    with Renderer("egl") as renderer:
        renderer._context.caps = replace(renderer._context.caps, clip_control=request.param)
        yield renderer


@pytest.fixture(scope="module")
def courtyard() -> gs.Scene:
    return gs.scenes.courtyard()


@pytest.fixture(scope="module")
def table() -> gs.Scene:
    """A box of 1 x 1 x 1 on a ground of 8 x 8."""
    floor = shapes.rectangle((-4.0, 0.0, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -8.0))
    cube = shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0))
    return gs.Scene((gs.Node(gs.Mesh(*floor), np.eye(4), "floor"), gs.Node(gs.Mesh(*cube), np.eye(4), "cube")), PLAN)


def table_depth(camera: gs.Camera) -> tuple[Array, Array]:
    """View depth (H, W) of the table scene, infinite outside it, and which surface: 0 none, 1 floor, 2 to 4 faces of the box."""
    origin, ray = camera.rays(SIZE)
    with np.errstate(divide="ignore", invalid="ignore"):
        floor = -origin[..., 1] / ray[..., 1]
        at = np.abs(origin + ray * floor[..., None])
        floor[(floor <= 0.0) | (np.maximum(at[..., 0], at[..., 2]) > 4.0)] = np.inf
        slabs = np.stack([(np.array(side) - origin) / ray for side in ((-0.5, 0.0, -0.5), (0.5, 1.0, 0.5))])
    enter, leave = slabs.min(axis=0), slabs.max(axis=0).min(axis=-1)
    cube = np.where(enter.max(axis=-1) < leave, enter.max(axis=-1), np.inf)
    surface = np.where(cube < floor, 2 + enter.argmax(axis=-1), np.where(np.isfinite(floor), 1, 0))
    return np.minimum(floor, cube), surface


def inner(surface: Array) -> Array:
    """Pixels (H, W) whose 3 x 3 neighbours show the same surface: elsewhere a snapped vertex may reveal another one."""
    padded = np.pad(surface, 1, mode="edge")
    around = [padded[i : i + surface.shape[0], j : j + surface.shape[1]] for i in range(3) for j in range(3)]
    return np.all([each == surface for each in around], axis=0)


@pytest.mark.parametrize("name", CAMERAS)
def test_depth_in_closed_form(either: Renderer, table: gs.Scene, name: str) -> None:
    camera = CAMERAS[name]
    frame = either.render(table, camera, [], SIZE, outputs=("depth", "depth_metric"), samples=1)
    expected, surface = table_depth(camera)
    sure = inner(surface)
    assert {0, 1, 2, 3, 4} == set(np.unique(surface[sure]))
    np.testing.assert_array_equal(np.isfinite(frame.depth)[sure], np.isfinite(expected)[sure])
    seen = sure & np.isfinite(expected)
    # Snapping moves a surface by as much as its depth changes over that distance; the rest is rounding: of the buffer, of its
    # inputs (4 steps), and of the output.
    finite = np.where(np.isfinite(expected), expected, 0.0)
    bound = 2.0 * SNAP * np.abs(np.gradient(finite)).max(axis=0) + 8.0 * UNIT * (frame.far + finite)
    if camera.is_perspective and not either.info["clip_control"]:
        bound += 4.0 * UNIT * finite**2 / frame.near
    assert (np.abs(frame.depth[seen] - expected[seen]) < bound[seen]).all()
    if not camera.is_perspective:  # the metric of a directional light's map, in either clip convention
        metric = (frame.depth[seen] - frame.near) / (frame.far - frame.near)
        np.testing.assert_allclose(frame.depth_metric[seen], metric, atol=4.0 * UNIT)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", CAMERAS)
def test_exact_shadows_match_rays(renderer: Renderer, courtyard: gs.Scene, name: str, light: str) -> None:
    scene, camera = courtyard, CAMERAS[name]
    lit = [replace(LIGHTS[light], shadow=gs.Shadow(filter=gs.Exact()))]
    frame = renderer.render(scene, camera, lit, (320, 180), outputs=("visibility", "triangle"), samples=1)
    truth = gs.trace(scene, camera, lit, (320, 180), surface=frame.triangle, samples=1)
    assert (0, "Listed") in renderer._cache.techniques
    asked = (truth.cosine[0] > 1e-3) & truth.reached[0]  # below, rounding decides which side of the surface is lit
    assert asked.sum() > 5000
    wrong = asked & (np.abs(frame.visibility[0] - truth.visibility[0]) > 0.5)
    # closer to an edge than float32 resolves in a scene of 20 x 20
    # on a smooth mesh a facet that faces away shadows points above it along lines that are as flat: 16 bits of a normal move their ends
    towards, _ = lit[0].to_light(truth.position)
    turned = (truth.normal * towards).sum(axis=-1) < 0.01
    assert not (wrong & ~turned & ~truth.near_edge(0, POSITION_ROUNDINGS * UNIT * 20.0, wrong)).any()
    assert wrong.sum() <= 2


@pytest.mark.parametrize("name", CAMERAS)
def test_no_filter_has_acne_or_leaks(either: Renderer, courtyard: gs.Scene, name: str) -> None:
    camera = CAMERAS[name]
    bare = [LIGHTS["sun"], LIGHTS["point"]]
    truth = gs.trace(courtyard, camera, bare, (320, 180), samples=1)
    for kind in (gs.Hard(), gs.Pcf(1), gs.Pcf(3), gs.Exact()):
        lit = [replace(light, shadow=gs.Shadow(filter=kind)) for light in bare]
        frame = either.render(courtyard, camera, lit, (320, 180), outputs=("visibility", "triangle"), samples=1)
        error = gs.measure(frame, truth)
        assert (error.acne, error.leak) == (0.0, 0.0), kind
        # 3 pixels, and in perspective too: only 16 directions around a pixel are searched for an edge
        assert error.grain < 1e-4, kind
        assert error.counted > 0.5
        assert error.edge < 2e-3, kind


def test_samples_lie_inside_their_pixel(renderer: Renderer, courtyard: gs.Scene) -> None:
    """The mean of 16 samples is closer to that of 6 x 6 rays than the value at the pixel's centre, and unbiased."""
    lights = [replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Exact()))]
    frames = [renderer.render(courtyard, OFF_CENTRE, lights, SIZE, samples=samples) for samples in (1, 16)]
    truth = gs.trace(courtyard, OFF_CENTRE, lights, SIZE, samples=36)
    edge = (truth.visibility[0] > 0.0) & (truth.visibility[0] < 1.0) & inner(truth.triangle)
    assert edge.sum() > 100
    middle, mean = (frame.visibility[0][edge] - truth.visibility[0][edge] for frame in frames)
    assert np.abs(mean).mean() < 0.05  # 16 points: a step of 1 / 16
    assert np.abs(mean).mean() < 0.25 * np.abs(middle).mean()
    assert abs(mean.mean()) < 0.02


def test_without_compute_shaders(table: gs.Scene) -> None:
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Exact()))
    with Renderer("egl") as older:
        older._context.caps = replace(
            older._context.caps, compute=False, max_storage_block=0, texture_gather=False, version_code=330
        )
        frame = older.render(table, PLAN, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
    truth = gs.trace(table, PLAN, [light], SIZE, surface=frame.triangle, samples=1)
    asked = truth.cosine[0] > 1e-3
    assert (
        np.abs(frame.visibility[0] - truth.visibility[0])[asked] > 0.5
    ).sum() <= 3  # silhouettes within float32's rounding


@pytest.mark.parametrize("name", CAMERAS)
def test_maps_cover_the_visible_surfaces(renderer: Renderer, courtyard: gs.Scene, name: str) -> None:
    camera, fits = CAMERAS[name], (gs.ViewFit(), gs.SceneFit())
    lit = [replace(light, shadow=gs.Shadow(resolution=512, fit=fit)) for light in LIGHTS.values() for fit in fits]
    frame = renderer.render(courtyard, camera, lit, SIZE, samples=1)
    truth = gs.trace(courtyard, camera, lit, SIZE, samples=1)
    for reached, used in zip(truth.reached, frame.used, strict=True):
        points = truth.position[(truth.triangle >= 0) & reached]
        covered = np.zeros(len(points), dtype=bool)
        for view in used.views:
            clip = project(view.clip_from_world, points)
            covered |= (clip[:, 3] > 0.0) & (np.abs(clip[:, :2]) <= clip[:, 3:]).all(axis=1)
        assert covered.all()


def test_orthographic_is_perspective_from_far_away(renderer: Renderer, courtyard: gs.Scene) -> None:
    forward = np.array([-5.0, -3.6, -6.3])
    eye = np.array([0.1, 0.4, 0.0]) - 300.0 * forward
    distance = 300.0 * float(np.linalg.norm(forward))
    fov = float(np.degrees(2.0 * np.arctan(2.5 / distance)))
    far = gs.PerspectiveCamera(tuple(eye.tolist()), (0.1, 0.4, 0.0), fov_y=fov)
    near = gs.OrthographicCamera(tuple((eye + 295.0 * forward).tolist()), (0.1, 0.4, 0.0), height=5.0)
    lights = [replace(light, shadow=gs.Shadow(filter=gs.Exact())) for light in LIGHTS.values()]
    one, other = (
        renderer.render(courtyard, each, lights, (320, 180), outputs=("image",), samples=1).image
        for each in (far, near)
    )
    assert one is not None
    assert other is not None
    different = (np.abs(one.astype(int) - other.astype(int)) > 2).any(axis=-1).mean()
    assert different < 0.05  # edges, which move by up to half a pixel: the scene's depth is 1 / 250 of the distance


@pytest.mark.parametrize("name", ["orthographic", "calibrated"])
def test_principal_point_shifts_the_image(renderer: Renderer, table: gs.Scene, name: str) -> None:
    """By whole pixels: the same rays through other pixels."""
    camera = CAMERAS[name]
    if isinstance(camera, gs.IntrinsicsCamera):
        moved: gs.Camera = replace(camera, cx=camera.cx + 20.0, cy=camera.cy - 10.0)
    else:
        moved = replace(PLAN, principal=(0.5 + 20.0 / SIZE[0], 0.5 - 10.0 / SIZE[1]))
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Exact()))
    here, there = (
        renderer.render(table, each, [light], SIZE, outputs=("depth", "image"), samples=1) for each in (camera, moved)
    )
    _same(here, there, np.s_[10:, :-20], np.s_[:-10, 20:])


def test_larger_image_of_a_calibrated_camera_shows_more(renderer: Renderer, table: gs.Scene) -> None:
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Exact()))
    small, large = (
        renderer.render(table, CALIBRATED, [light], size, outputs=("depth", "image"), samples=1)
        for size in (SIZE, (200, 120))
    )
    _same(small, large, np.s_[:, :], np.s_[:90, :160])


def _same(one: Frame, other: Frame, part: tuple[slice, ...], counterpart: tuple[slice, ...]) -> None:
    """Equal except for rounding, which decides a few pixels at edges."""
    a, b = one.depth[part], other.depth[counterpart]
    both = np.isfinite(a) & np.isfinite(b)
    assert both.mean() > 0.3
    assert (np.isfinite(a) != np.isfinite(b)).mean() < 2e-3
    assert (np.abs(a[both] - b[both]) > 1e-4).mean() < 2e-3
    different = np.abs(one.image[part].astype(int) - other.image[counterpart].astype(int)) > 1
    assert different.any(axis=-1).mean() < 5e-3


def test_behind_an_orthographic_camera(renderer: Renderer, table: gs.Scene) -> None:
    """Surfaces behind the camera are seen only if a near plane is given there, both in the image and by rays."""
    inside = gs.OrthographicCamera((0.0, 0.5, 0.0), (-1.0, 0.3, -0.4), height=1.5)
    light = [replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Exact()))]
    for camera in (inside, replace(inside, near=-3.0), replace(inside, near=-3.0, far=-0.2)):
        frame = renderer.render(table, camera, light, SIZE, outputs=("depth",), samples=1)
        truth = gs.trace(table, camera, light, SIZE, samples=1)
        seen = np.isfinite(frame.depth)
        assert (seen != (truth.triangle >= 0)).mean() < 0.01
        both = seen & (truth.triangle >= 0)
        depth = view_depth(camera, truth.position[both])
        assert (np.abs(frame.depth[both] - depth) > 1e-4).mean() < 0.01
        nearest = 0.0 if camera.near is None else camera.near
        assert frame.depth[seen].min() >= nearest - 1e-5
        assert frame.depth[seen].max() <= (camera.far or 9.0) + 1e-5


def test_far_from_the_origin(renderer: Renderer, table: gs.Scene) -> None:
    """The camera moves 1e5 units back along its view: the same rays, so the same image."""
    forward = np.subtract(PLAN.target, PLAN.position)
    away = replace(PLAN, position=tuple((np.asarray(PLAN.position) - 1e5 * forward).tolist()))
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Exact()))
    here, there = (
        renderer.render(table, each, [light], SIZE, outputs=("visibility", "image"), samples=1) for each in (PLAN, away)
    )
    assert (np.abs(here.image.astype(int) - there.image.astype(int)) > 1).any(axis=-1).mean() < 5e-3


def test_courtyard_without_clip_control_is_as_accurate(renderer: Renderer, courtyard: gs.Scene) -> None:
    """-1..1 depth from 1e-5 of far on had three times as many wrong pixels, acne and leaks among them."""
    scene, light = courtyard, gs.PointLight(position=(1.0, 4.0, 2.0), shadow=gs.Shadow(filter=gs.Pcf()))
    truth = gs.trace(scene, None, [light], (640, 360), samples=1)
    outputs = ("visibility", "triangle")
    fine = renderer.render(scene, None, [light], (640, 360), outputs=outputs, samples=1)
    with Renderer("egl") as older:
        older._context.caps = replace(older._context.caps, clip_control=False)
        coarse = older.render(scene, None, [light], (640, 360), outputs=outputs, samples=1)
        close = older.render(scene, replace(scene.camera, near=1e-3), [light], (640, 360), outputs=outputs, samples=1)
    assert coarse.near > 1.0  # no visible surface is nearer than 6
    ours, theirs = gs.measure(coarse, truth), gs.measure(fine, truth)
    assert (ours.acne, ours.leak, ours.grain) == (0.0, 0.0, 0.0)
    assert ours.wrong < 1.05 * theirs.wrong
    assert not any("nearer" in said or "near=" in said for said in coarse.used[0].fallbacks)
    assert any("near=0.001" in said for said in close.used[0].fallbacks)
    assert fine.used[0].fallbacks == ()
