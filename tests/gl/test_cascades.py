"""Several maps of one directional light, and one in perspective: correct at every distance, no seams, stable under a moving camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.scenes import shapes

SIZE = (256, 144)
CAMERA = gs.PerspectiveCamera(position=(0.0, 1.7, 4.0), target=(0.0, 1.0, -10.0), fov_y=45.0)
SUN = gs.DirectionalLight(direction=(0.8, -0.6, 0.0))
FITS: tuple[gs.Fit, ...] = (
    gs.Cascades(), gs.Cascades(2), gs.Cascades(8), gs.Cascades(4, by_depth=True), gs.Cascades(3, 0.5, 0.3, stable=True), gs.Lispsm(),
)  # fmt: skip


@pytest.fixture(scope="module")
def posts() -> gs.Scene:
    """Posts of 1.2 m on a ground, from in front of the camera to 120 m away (N35)."""
    ground = gs.Mesh(*shapes.rectangle((-80, 0, 10), (160, 0, 0), (0, 0, -200)))
    post = gs.Mesh(*shapes.box((0.2, 1.2, 0.2), (0.0, 0.6, 0.0)))
    nodes = [gs.Node(ground, np.eye(4), "ground")]
    for number, z in enumerate(np.geomspace(2.0, 122.0, 20)):
        place = np.eye(4)
        place[:3, 3] = (-1.0 if number % 2 else 1.0) * 0.15 * z, 0.0, 4.0 - z
        nodes.append(gs.Node(post, place, f"post {number}"))
    return gs.Scene(tuple(nodes), CAMERA)


def light(fit: gs.Fit | None, filter: gs.Filter | None = None, **more: object) -> gs.DirectionalLight:
    shadow = gs.Shadow(filter=filter or gs.Hard(), fit=fit, **more)  # type: ignore[arg-type]
    return replace(SUN, shadow=shadow)


def errors(frame: gs.Frame, truth: gs.Truth) -> Array:
    tested = (truth.cosine[0] > 1e-3) & ~np.isnan(frame.visibility[0])
    return np.asarray(np.abs(frame.visibility[0] - truth.visibility[0])[tested])


@pytest.mark.parametrize("fit", FITS, ids=str)
def test_shadow_lengths_are_exact(renderer: gs.Renderer, posts: gs.Scene, fit: gs.Fit) -> None:
    """Of near and far posts, to a pixel and a texel."""
    frame = renderer.render(posts, None, [light(fit)], SIZE, outputs=("visibility", "position", "triangle"), samples=1)
    truth = gs.trace(posts, None, [light(fit)], SIZE, surface=frame.triangle, samples=1)
    assert len(frame.used[0].views) == getattr(fit, "count", 1)
    compared = 0
    for node in posts.nodes[1:]:
        foot = node.world_from_mesh[:3, 3]
        away = float(CAMERA.position[2] - foot[2])
        pixel = 2.0 * np.tan(np.radians(22.5)) / SIZE[1] * away
        ours, exact = _dark_until(frame, frame.visibility[0], foot), _dark_until(frame, truth.visibility[0], foot)
        if np.isnan(exact) or pixel > 0.1:
            continue
        texel = max(max(view.texel) for view in frame.used[0].views)
        assert abs(ours - exact) < 1.5 * pixel + min(texel, 0.15)
        compared += 1
    assert compared >= 6


def _dark_until(frame: gs.Frame, visibility: Array, foot: Array) -> float:
    """How far from a post's centre the ground is dark, along x."""
    places = frame.position.astype(np.float64)
    ground = (
        (np.abs(places[..., 1]) < 1e-3) & (np.abs(places[..., 2] - foot[2]) < 0.08) & (places[..., 0] > foot[0] + 0.15)
    )
    ground &= places[..., 0] < foot[0] + 4.0
    dark = ground & (visibility < 0.5)
    return float(places[..., 0][dark].max() - foot[0]) if dark.any() else float("nan")


@pytest.mark.parametrize("filter", [gs.Pcf(1), gs.Evsm(), gs.Msm()], ids=str)
@pytest.mark.parametrize("fit", FITS[:5], ids=str)
def test_cascades_have_no_seams_and_no_acne(
    renderer: gs.Renderer, posts: gs.Scene, fit: gs.Fit, filter: gs.Filter
) -> None:
    """Except at edges everything is lit or dark as rays say, in every map and where one fades into the next."""
    frame = renderer.render(posts, None, [light(fit, filter)], SIZE, outputs=("visibility", "triangle"), samples=1)
    truth = gs.trace(posts, None, [light(fit)], SIZE, surface=frame.triangle, samples=1)
    assert gs.measure(frame, truth).acne == 0.0
    gap = errors(frame, truth)
    # stable maps are coarse: the last has texels of 0.3 m, over posts of 0.2
    stable = getattr(fit, "stable", False)
    assert (gap > 0.5).mean() < (0.016 if stable else 0.004)
    assert gap.mean() < (0.03 if stable else 0.012)


@pytest.mark.parametrize("fit", FITS, ids=str)
def test_ground_under_a_roof_is_dark_in_every_cascade(renderer: gs.Renderer, fit: gs.Fit) -> None:
    """Whichever map is sampled, near its border or in its blend zone: no pixel of the ground is lit."""
    ground = gs.Node(gs.Mesh(*shapes.rectangle((-80, 0, 10), (160, 0, 0), (0, 0, -200))), np.eye(4), "ground")
    roof = gs.Node(gs.Mesh(*shapes.rectangle((-120, 6, 50), (240, 0, 0), (0, 0, -280))), np.eye(4), "roof")
    frame = renderer.render(
        gs.Scene((ground, roof)), CAMERA, [light(fit)], SIZE, outputs=("visibility", "node", "depth"), samples=1
    )
    far = 100.0 if getattr(fit, "distance", 0.0) else np.inf
    under = (frame.node == 0) & (frame.depth < far)
    assert under.sum() > 5000
    assert (frame.visibility[0][under] == 0.0).all()


def test_bias_in_texels_scales_with_each_cascade(renderer: gs.Renderer, posts: gs.Scene) -> None:
    """1.5 texels along the normal prevent acne in every map; without a bias the ground is striped from near to far."""
    low = replace(SUN, direction=(0.9, -0.3, 0.2))
    truth = gs.trace(posts, None, [low], SIZE, samples=1)
    acne = {}
    for name, bias in (("offset", gs.NormalOffsetBias(1.5)), ("none", gs.NoBias())):
        lamp = replace(low, shadow=gs.Shadow(filter=gs.Hard(), fit=gs.Cascades(4), bias=bias, resolution=512))
        acne[name] = gs.measure(
            renderer.render(posts, None, [lamp], SIZE, outputs=("visibility",), samples=1), truth
        ).acne
    assert acne["offset"] < 1e-3
    assert acne["none"] > 0.1


def test_cascades_are_more_accurate_than_one_map() -> None:
    scene, size = gs.scenes.outdoors(), (320, 180)
    found = {}
    with gs.Renderer("egl") as renderer:
        truth = gs.trace(scene, size=size, samples=1)
        for fit in (None, gs.Lispsm(), gs.Cascades(2), gs.Cascades(4), gs.Cascades(8)):
            lamp = replace(scene.lights[0], shadow=gs.Shadow(filter=gs.Hard(), fit=fit, resolution=1024))
            found[str(fit)] = errors(
                renderer.render(scene, None, [lamp], size, outputs=("visibility",), samples=1), truth
            ).mean()
    one, warped, two, four, eight = found.values()
    assert warped < 0.5 * one, found
    assert two < 0.6 * one, found
    assert four < 0.6 * two, found
    assert eight < four, found


def test_stable_cascades_do_not_flicker(renderer: gs.Renderer, posts: gs.Scene) -> None:
    """The camera moves by 0.37 texels of the first map: texels that both maps cover are equal bit for bit (N35)."""
    fit = gs.Cascades(3, stable=True, distance=150.0)
    first = renderer.render(posts, CAMERA, [light(fit)], SIZE, outputs=("shadow_maps",), samples=1)
    step = 0.37 * first.used[0].views[0].texel[0]
    fixed = 0
    for k in range(1, 4):
        by = k * step * np.array([0.6, 0.0, 0.8])
        camera = replace(
            CAMERA,
            position=tuple((np.asarray(CAMERA.position) + by).tolist()),
            target=tuple((np.asarray(CAMERA.target) + by).tolist()),
        )
        frame = renderer.render(posts, camera, [light(fit)], SIZE, outputs=("shadow_maps",), samples=1)
        for number, (before, after) in enumerate(zip(first.used[0].views, frame.used[0].views, strict=True)):
            x, y = np.round(np.subtract(after.window, before.window)[[0, 2]] / before.texel).astype(int)
            old, new = first.shadow_maps[0][number][::-1], frame.shadow_maps[0][number][::-1]
            height, width = old.shape
            common_old = old[max(y, 0) : height + min(y, 0), max(x, 0) : width + min(x, 0)]
            common_new = new[max(-y, 0) : height + min(-y, 0), max(-x, 0) : width + min(-x, 0)]
            # a vertex moved by whole texels differs by a rounding
            np.testing.assert_allclose(common_new, common_old, rtol=0.0, atol=1e-6 if x or y else 0.0)
            fixed += (x, y) == (0, 0)
    assert fixed >= 3


def test_perspective_map_covers_every_shadow_from_any_direction(renderer: gs.Renderer) -> None:
    """Boxes on a ground, 300 cameras and lights: finite matrices, and dark wherever a pixel and its eight neighbours are."""
    ground = gs.Mesh(*shapes.rectangle((-10, 0, 10), (20, 0, 0), (0, 0, -20)))
    boxes = [gs.Mesh(*shapes.box((1.0, 1.0, 1.0), (x, 0.5, z))) for x, z in ((0, 0), (-6, -7), (5, 4), (8, -9))]
    scenes = [
        gs.Scene(tuple(gs.Node(mesh, np.eye(4), str(i)) for i, mesh in enumerate((ground, *some))), CAMERA)
        for some in (boxes[:1], boxes)
    ]
    generator, size, warped, compared = np.random.default_rng(0), (48, 32), 0, 0
    for number in range(300):
        away = generator.normal(size=3)
        away[1] = 0.3 * abs(away[1]) + 0.02
        position = generator.uniform(2.0, 20.0) * away / np.linalg.norm(away)
        target, fov_y = generator.uniform((-6, 0, -6), (6, 0.5, 6)), float(generator.uniform(20.0, 90.0))
        camera = gs.PerspectiveCamera(tuple(position.tolist()), tuple(target.tolist()), fov_y=fov_y)
        sun = replace(SUN, direction=tuple((generator.normal(size=3) * (1, 0, 1) - (0, 0.5, 0)).tolist()))
        seen = []
        for shadow in (gs.Shadow(filter=gs.Hard(), fit=gs.Lispsm()), gs.Shadow()):
            frame = renderer.render(
                scenes[number // 150], camera, [replace(sun, shadow=shadow)], size, outputs=("visibility",), samples=1
            )
            seen.append(frame.visibility[0])
            for view in frame.used[0].views:
                assert np.isfinite(view.clip_from_world).all()
                warped += view.warp is not None
        dark = (np.lib.stride_tricks.sliding_window_view(seen[1], (3, 3)) == 0.0).all(axis=(2, 3))
        assert not (seen[0][1:-1, 1:-1][dark] == 1.0).any(), (camera, sun.direction)
        compared += np.count_nonzero(dark)
    assert warped > 20
    assert compared > 1000


@pytest.mark.parametrize("target", [gs.Target.R32F, gs.Target.RGBA8, gs.Target.DEPTH16])
def test_in_every_kind_of_target(renderer: gs.Renderer, posts: gs.Scene, target: gs.Target) -> None:
    usual = renderer.render(posts, None, [light(gs.Cascades())], SIZE, outputs=("visibility",), samples=1).visibility[0]
    other = renderer.render(
        posts, None, [light(gs.Cascades(), target=target)], SIZE, outputs=("visibility",), samples=1
    )
    assert np.nanmean(np.abs(other.visibility[0] - usual)) < 2e-3


@pytest.mark.parametrize("clip", [gs.ClipSpace(False, False), gs.ClipSpace(True, True)], ids=str)
@pytest.mark.parametrize("fit", [gs.Cascades(), gs.Lispsm()], ids=str)
def test_in_every_clip_convention(renderer: gs.Renderer, posts: gs.Scene, fit: gs.Fit, clip: gs.ClipSpace) -> None:
    usual = renderer.render(posts, None, [light(fit)], SIZE, outputs=("visibility",), samples=1).visibility[0]
    other = renderer.render(posts, None, [light(fit, clip=clip)], SIZE, outputs=("visibility",), samples=1)
    assert np.nanmean(np.abs(other.visibility[0] - usual)) < 2e-3


@pytest.mark.parametrize("fit", [gs.Cascades(), gs.Lispsm()], ids=str)
def test_cascades_work_with_multisampling(renderer: gs.Renderer, posts: gs.Scene, fit: gs.Fit) -> None:
    frame = renderer.render(posts, None, [light(fit)], SIZE, outputs=("visibility",), samples=4)
    truth = gs.trace(posts, None, [light(fit)], SIZE, samples=4)
    assert errors(frame, truth).mean() < 0.01


@pytest.mark.parametrize(
    "lamp",
    [gs.SpotLight(position=(0, 5, 0), direction=(0, -1, -1)), gs.PointLight(position=(0, 5, 0))],
    ids=["spot", "point"],
)
@pytest.mark.parametrize("fit", [gs.Cascades(), gs.Lispsm()], ids=str)
def test_fits_that_a_light_lacks_are_reported(
    renderer: gs.Renderer, posts: gs.Scene, lamp: gs.Light, fit: gs.Fit
) -> None:
    shadow = gs.Shadow(filter=gs.Pcf(1), fit=fit)
    frame = renderer.render(posts, None, [replace(lamp, shadow=shadow)], SIZE, outputs=("visibility",), samples=1)
    assert any("only a directional light's map" in said for said in frame.used[0].fallbacks)
    plain = renderer.render(
        posts, None, [replace(lamp, shadow=gs.Shadow(filter=gs.Pcf(1)))], SIZE, outputs=("visibility",), samples=1
    )
    np.testing.assert_array_equal(frame.visibility, plain.visibility)


def test_unsupported_perspective_fits_are_refused(renderer: gs.Renderer, posts: gs.Scene) -> None:
    for more in ({"target": gs.Target.R32F}, {"bias": gs.NormalOffsetBias()}):
        frame = renderer.render(posts, None, [light(gs.Lispsm(), **more)], SIZE, outputs=("visibility",), samples=1)
        assert any("perspective" in said for said in frame.used[0].fallbacks)


def test_empty_view_is_no_error(renderer: gs.Renderer, posts: gs.Scene) -> None:
    away = replace(CAMERA, target=(0.0, 60.0, 4.1))
    for fit in FITS:
        with pytest.warns(gs.GlshadowWarning, match="nothing is in view"):
            renderer.render(posts, away, [light(fit)], SIZE, outputs=("visibility",), samples=1)


def test_scene_scaled_by_a_millionth_gives_the_same_image(renderer: gs.Renderer, posts: gs.Scene) -> None:
    for fit in (gs.Cascades(), gs.Lispsm()):
        for scale in (1e-6, 1e4):
            matrix = np.diag([scale, scale, scale, 1.0])
            nodes = tuple(gs.Node(n.mesh, matrix @ n.world_from_mesh, n.name) for n in posts.nodes)
            camera = replace(
                CAMERA,
                position=tuple((scale * np.asarray(CAMERA.position)).tolist()),
                target=tuple((scale * np.asarray(CAMERA.target)).tolist()),
            )
            usual = renderer.render(posts, CAMERA, [light(fit)], SIZE, outputs=("visibility",), samples=1).visibility[0]
            other = renderer.render(
                gs.Scene(nodes), camera, [light(fit)], SIZE, outputs=("visibility",), samples=1
            ).visibility[0]
            assert np.nanmean(np.abs(other - usual)) < 2e-3
