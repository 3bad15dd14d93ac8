"""N16, N18 to N20, N28, N29, N35, N37, N38: images, limits and inputs at the limits of what makes sense."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.errors import ResourceError, SceneError, SettingsError
from glshadow.lights import DirectionalLight, PointLight, SpotLight
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import analytic, shapes
from glshadow.shadows.filters import Exact, Hard, Pcf
from glshadow.shadows.fits import SceneFit, ViewFit
from glshadow.shadows.shadow import Shadow

from . import cases_fine, cases_views
from .judge import SAME, judge
from .registry import DEFAULT, THOROUGH, Picture, picture_of
from .solids import level, scene_of

SMALL = (64, 64)


def linear(renderer: Renderer, picture: Picture, ambient: float) -> Array:
    frame = renderer.render(
        picture.scene,
        picture.camera,
        [picture.light],
        picture.size,
        ambient=ambient,
        outputs=("linear", "visibility"),
        samples=1,
    )
    return np.where(np.isnan(frame.visibility[0])[..., None], np.nan, frame.linear)


# -- N16, N18, N19: irradiance in the image


def test_n16_no_light_on_the_back_whatever_the_shading_normal(renderer: Renderer) -> None:
    sun = DirectionalLight(direction=(0.9, 0.3, 0.0))  # from below
    camera = PerspectiveCamera((0.0, 2.0, 2.0), (0.0, 0.0, 0.0))
    for mesh in (Mesh(*level((-1.0, 1.0), (-1.0, 1.0))), cases_views.smooth_back()):
        picture = Picture("back", scene_of({"sheet": mesh}, camera, sun, "back"), sun, camera, size=SMALL)
        seen = linear(renderer, picture, 0.25)
        np.testing.assert_allclose(seen[~np.isnan(seen)], 0.25, rtol=1e-3)


def test_n18_nothing_is_lit_outside_a_spots_cone(renderer: Renderer) -> None:
    picture = cases_views.borders()[3]
    values = renderer.render(
        picture.scene, picture.camera, [picture.light], picture.size, outputs=("visibility",), samples=1
    ).visibility
    assert values is not None
    truth = judge(renderer, picture, DEFAULT).truth
    outside = ~truth.reached[0] & (truth.cosine[0] > 0.0)
    assert outside.any()
    assert (values[0][outside] == 0.0).mean() > 0.999  # but for pixels on its border: no copies, no streaks


def test_n19_nothing_is_lit_behind_a_spot(renderer: Renderer) -> None:
    for number, lit in ((0, True), (1, False)):
        seen = linear(renderer, cases_views.projections()[number], 0.0)
        assert (np.nan_to_num(seen) > 0.0).any() == lit


# -- N20


@pytest.mark.parametrize("across", [180.0, 181.0, 360.0])
def test_n20_a_cone_of_180_degrees_is_refused(across: float) -> None:
    with pytest.raises(SettingsError, match="outer_angle"):
        SpotLight(position=(0.0, 1.0, 0.0), outer_angle=0.5 * across)


# -- N28


@pytest.mark.parametrize(
    "direction",
    [(0, -1, 0), (1e-7, -1, 0), (0, -1e-20, 0), (0, -1e20, 0), (0.3e-20, -1e-20, 0), (0, -1, -1e-12)],
    ids=str,
)
def test_n28_directions_at_the_pole_and_of_any_length(
    renderer: Renderer, direction: tuple[float, float, float]
) -> None:
    steep = picture_of("plate", analytic.plates(0.5, 60.0), DirectionalLight(direction=direction), size=(96, 96))
    for technique in THOROUGH:
        outcome = judge(renderer, replace(steep, exact=None), technique)
        assert outcome.mismatches == 0, str(outcome)
        assert (outcome.judged & (outcome.truth.visibility[0] == 1.0)).any()


def test_n28_straight_up_lights_the_underside_only(renderer: Renderer) -> None:
    up = picture_of("plate", analytic.plates(0.5, 60.0), DirectionalLight(direction=(0.0, 1.0, 0.0)), size=SMALL)
    seen = linear(renderer, up, 0.0)
    np.testing.assert_array_equal(seen[~np.isnan(seen)], 0.0)


@pytest.mark.parametrize("direction", [(0, 0, 0), (np.nan, -1, 0), (0, -np.inf, 0)], ids=str)
def test_n28_n37_zero_and_non_finite_directions_raise(direction: tuple[float, float, float]) -> None:
    for make in (DirectionalLight, lambda direction: SpotLight(position=(0, 0, 0), direction=direction)):
        with pytest.raises(SettingsError, match="direction"):
            make(direction=direction)


# -- N29


def test_n29_empty_scene_raises() -> None:
    with pytest.raises(SceneError, match="nothing to render"):
        Scene(())
    point = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(SceneError, match="nothing to render"):
        Scene((Node(point, np.eye(4), "point"),))


@pytest.mark.parametrize("kind", ["one triangle", "one plane", "edge-on"])
def test_n29_flat_scenes(renderer: Renderer, kind: str) -> None:
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), np.array([[0, 1, 2]], dtype=np.int32)
    solid = {
        "one triangle": triangle,
        "one plane": level((-1.0, 1.0), (-1.0, 1.0)),
        "edge-on": shapes.joined(
            [shapes.rectangle((x, 0.0, -1.0), (0.0, 0.0, 2.0), (0.0, 1.0, 0.0)) for x in (-0.5, 0.5)]
        ),
    }[kind]
    camera = PerspectiveCamera((0.7, 1.5, 2.0), (0.2, 0.2, 0.0))
    for light in (DirectionalLight(direction=(0.0, -1.0, 0.0)), PointLight(position=(0.5, 5.0, 0.0))):
        picture = Picture(kind, scene_of({kind: solid}, camera, light, kind), light, camera, size=SMALL)
        for technique in THOROUGH:
            outcome = judge(renderer, picture, technique)
            assert outcome.mismatches == 0, str(outcome)
            assert (~np.isnan(outcome.truth.visibility[0])).any()


# -- N35


def test_n35_the_map_does_not_change_when_the_camera_moves_under_scene_fit(renderer: Renderer) -> None:
    picture = cases_fine.cascades()[0]
    maps, views = {}, {}
    for fit in (SceneFit(), ViewFit()):
        for number, shift in enumerate((0.0, 0.37)):
            light = replace(picture.light, shadow=Shadow(resolution=512, fit=fit))
            texel = 0.1
            camera = replace(
                picture.camera,
                position=tuple(np.asarray(picture.camera.position) + shift * texel),
                target=tuple(np.asarray(picture.camera.target) + shift * texel),
            )
            frame = renderer.render(picture.scene, camera, [light], SMALL, outputs=("shadow_maps",), samples=1)
            maps[fit, number], views[fit, number] = frame.shadow_maps[0], frame.used[0].views[0].clip_from_world
    np.testing.assert_array_equal(maps[SceneFit(), 0], maps[SceneFit(), 1])
    np.testing.assert_array_equal(views[SceneFit(), 0], views[SceneFit(), 1])
    assert not np.array_equal(views[ViewFit(), 0], views[ViewFit(), 1])


def test_n27_a_far_outlier_makes_scene_fit_coarse(renderer: Renderer) -> None:
    """A texel of 846 m at 2048, of 2 x 846 m at 1024: the diagonal of 1.4e6 m, seen at 30 degrees; ViewFit: millimetres."""
    picture = cases_fine.outliers()[0]
    texel = {}
    for fit in (SceneFit(), ViewFit()):
        light = replace(picture.light, shadow=Shadow(resolution=2048, fit=fit))
        used = renderer.render(picture.scene, picture.camera, [light], SMALL, samples=1).used[0]
        texel[fit] = max(used.texel or (0.0,))
    assert 400.0 < texel[SceneFit()] < 1700.0
    assert texel[ViewFit()] < 0.01


# -- N37


def test_n37_nan_is_refused(renderer: Renderer) -> None:
    bad = np.array([[0.0, 0.0, 0.0], [1.0, np.nan, 0.0], [0.0, 1.0, 0.0]])
    with pytest.raises(SceneError, match="not finite"):
        Mesh(bad, np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(SettingsError, match="position"):
        PointLight(position=(0.0, np.nan, 0.0))
    with pytest.raises(SettingsError, match="position"):
        PerspectiveCamera(position=(np.nan, 0.0, 1.0))
    with pytest.raises(SettingsError, match="ambient"):
        renderer.render(analytic.ball().scene, size=SMALL, ambient=np.nan, samples=1)


# -- N38


@pytest.mark.parametrize("resolution", [1, 2, 3, 5])
@pytest.mark.parametrize("light", ["sun", "spot", "point light"])
def test_n38_maps_of_a_few_texels(renderer: Renderer, resolution: int, light: str) -> None:
    chosen = {
        "sun": DirectionalLight(direction=(-0.5, -1.0, -0.2)),
        "spot": SpotLight(position=(3.0, 6.0, 1.0), direction=(-0.5, -1.0, -0.2), outer_angle=45.0),
        "point light": PointLight(position=(3.0, 6.0, 1.0)),
    }[light]
    built = analytic.plane(45.0)
    for filter_ in (Hard(), Pcf(1), Exact()):
        shadow = Shadow(resolution=resolution, filter=filter_)
        frame = renderer.render(
            built.scene, None, [replace(chosen, shadow=shadow)], SMALL, outputs=("visibility", "position"), samples=1
        )
        points = np.nan_to_num(frame.position.astype(np.float64))
        lit = frame.visibility[0][~np.isnan(frame.visibility[0]) & (chosen.strength(points) > 1e-4)]
        assert (np.abs(lit - 1.0) <= SAME).all(), f"{filter_}: least {lit.min()}"  # an empty plane is lit by any map


def test_n38_invalid_sizes_raise(renderer: Renderer) -> None:
    with pytest.raises(SettingsError, match="resolution"):
        Shadow(resolution=32768)
    for size in ((0, 0), (64, 0)):
        with pytest.raises(SettingsError, match="size"):
            renderer.render(analytic.ball().scene, size=size, samples=1)
    frame = renderer.render(analytic.ball().scene, size=(1, 1), samples=1)
    assert frame.image.shape == (1, 1, 3)


def test_n38_a_map_beyond_the_drivers_limit_is_a_named_error(renderer: Renderer) -> None:
    if renderer.info["max_texture_size"] > 16384:
        pytest.skip("optional: this driver has maps that large")
    point_light = PointLight(position=(0.0, 0.0, 0.0), shadow=Shadow(resolution=16384))  # six exceed one atlas
    with pytest.raises((ResourceError, SettingsError), match="limit"):
        renderer.render(analytic.room().scene, lights=[point_light], size=SMALL, samples=1)


# -- N40


def test_n40_a_near_plane_across_a_closed_caster_shows_its_inside(renderer: Renderer) -> None:
    built = analytic.box(30.0, 30.0, (2.0, 2.0, 2.0))
    camera = PerspectiveCamera((0.5, 4.0, 4.0), (0.0, 0.0, 0.0), near=4.0, far=40.0)
    frame = renderer.render(built.scene, camera, size=SMALL, outputs=("triangle",), samples=1)
    truth = trace(built.scene, camera, size=SMALL, samples=1)
    assert ((frame.triangle >= 2) != (truth.triangle >= 2)).mean() < 0.02  # triangles 0 and 1 are the ground
