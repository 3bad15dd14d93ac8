"""Area lights: exact visible fractions by closed forms and rays, deterministic, and used only where they were requested."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.reference.points import count_points
from glshadow.scenes import shapes

from ..pairwise import mostly

SIZE = (160, 120)
OUTPUTS = ("visibility", "triangle", "image")
LIGHTS: dict[str, gs.Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), angle=8.0),
    "spot": gs.SpotLight(position=(4.0, 6.0, 4.0), direction=(-4.0, -6.0, -4.0), outer_angle=40.0, radius=0.3),
    "point": gs.PointLight(position=(1.5, 3.0, 1.0), radius=0.2),
}


AT_EDGES = 3
"""Pixels off by more than one point: an edge passes closer than float32 resolves (0 to 15 at 640 x 360: docs/soft.md)."""


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


@pytest.mark.parametrize("model", ["box", "courtyard", "masked"])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_every_sample_point_is_visible_as_rays_say(renderer: gs.Renderer, name: str, model: str) -> None:
    scene = masked() if model == "masked" else getattr(gs.scenes, model)()
    scene = getattr(scene, "scene", scene)
    light, compute = LIGHTS[name], renderer.info["compute"]
    if not compute and name != "sun":
        pytest.skip(
            "without compute passes a lamp's points are those of a ball, not of the disc that each surface sees"
        )
    if isinstance(light, gs.PointLight) and model == "courtyard":
        light = replace(
            light, position=(-3.0, 3.2, 2.0)
        )  # not next to the torus: all of its 65,536 triangles would be near it
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    share = frame.visibility[0] * 64.0
    expected = count_points(gs.trace(scene, None, [light], SIZE, surface=frame.triangle, samples=1), light, 64)
    gap = np.abs(share - expected)[~np.isnan(expected)]
    np.testing.assert_allclose(share[~np.isnan(share)], np.round(share[~np.isnan(share)]), atol=1e-4)
    # a ray that passes an edge closer than float32 resolves may be decided either way; at alpha cut-outs, 1 in 3000 is
    assert (gap > 0.5).sum() <= (20 if model == "masked" else 6)
    assert (gap > 1.5).sum() <= AT_EDGES
    assert ((expected > 0.5) & (expected < 63.5)).sum() > 100
    assert "64 points of the light" in frame.used[0].why
    assert ("one after another" in frame.used[0].why) != compute
    assert frame.used[0].fallbacks == ()


def masked() -> gs.Scene:
    """A cut-out leaf, twice, over a floor: triangles with holes."""
    alpha = np.full((32, 32, 4), 255, dtype=np.uint8)
    y, x = np.mgrid[:32, :32]
    alpha[..., 3] = np.where((x % 8 < 4) ^ (y % 8 < 4), 255, 0)
    material = gs.Material(texture=alpha, alpha_mode=gs.AlphaMode.MASK, double_sided=True)
    positions, triangles = shapes.rectangle((-1, 0, -1), (2, 0, 0), (0, 0, 2))
    leaf = gs.Mesh(positions, triangles, uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), material=material)
    floor = gs.Mesh(*shapes.rectangle((-4, 0, 4), (8, 0, 0), (0, 0, -8)))
    nodes = [gs.Node(floor, np.eye(4), "floor")]
    for number, height in enumerate((0.8, 1.3)):
        place = np.eye(4)
        place[:3, 3] = 0.3 * number, height, 0.2 * number
        nodes.append(gs.Node(leaf, place, f"leaf {number}"))
    return gs.Scene(tuple(nodes))


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("radius", [0.6, 2.0])
def test_light_that_intersects_geometry_matches_rays(renderer: gs.Renderer, radius: float) -> None:
    """The light's sphere reaches through the box, and below the horizon of nearby surfaces."""
    scene = gs.scenes.box().scene
    light = gs.PointLight(position=(1.2, 1.5, 0.4), radius=radius)
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    expected = count_points(gs.trace(scene, None, [light], SIZE, surface=frame.triangle, samples=1), light, 64)
    gap = np.abs(frame.visibility[0] * 64.0 - expected)[~np.isnan(expected)]
    assert (gap > 1.5).sum() <= AT_EDGES
    # where a light touches the surface, whole fans of sample points lie in its plane: some are decided either way
    assert (gap > 0.5).sum() <= 4 * AT_EDGES


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("height", [0.0, 0.05, 0.19])
def test_light_that_lies_in_the_floor_is_cut(renderer: gs.Renderer, height: float) -> None:
    """There is no edge where the floor cuts the light; the part below must still be blocked."""
    scene = gs.scenes.box().scene
    light = gs.PointLight(position=(3.0, height, 3.0), radius=0.2)
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    expected = count_points(gs.trace(scene, None, [light], SIZE, surface=frame.triangle, samples=1), light, 64)
    gap = np.abs(frame.visibility[0] * 64.0 - expected)[~np.isnan(expected)]
    assert (gap > 1.5).sum() <= AT_EDGES
    assert (expected[~np.isnan(expected)] < 64).sum() > 300


@pytest.mark.usefixtures("built_on_the_gpu")
def test_too_large_lights_are_sampled_point_by_point(renderer: gs.Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    from glshadow.gl.techniques import area

    scene, light = gs.scenes.box().scene, LIGHTS["sun"]
    usual = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    monkeypatch.setattr(area, "_PIXEL", 0)
    monkeypatch.setattr(area, "_TRIANGLE", 0)
    with gs.Renderer() as fresh:
        frame = fresh.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    assert "64 points of the light, one after another, for " in frame.used[0].why
    gap = np.abs(frame.visibility[0] - usual.visibility[0])[~np.isnan(usual.visibility[0])] * 64.0
    assert (gap > 1.5).sum() <= AT_EDGES


def test_lights_with_chosen_faces_are_sampled_point_by_point(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(faces=gs.Faces.BACK))
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    points = light.hard_lights(64)
    frames = [
        renderer.render(scene, None, [point], SIZE, outputs=("visibility",), samples=1).visibility[0]
        for point in points
    ]
    mean = np.mean(frames, axis=0, dtype=np.float64)
    known = ~np.isnan(mean)
    np.testing.assert_allclose(frame.visibility[0][known], mean[known], atol=1e-6)
    assert "one after another" in frame.used[0].why


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_scale_changes_nothing(renderer: gs.Renderer, scale: float) -> None:
    built = gs.scenes.box()
    scene, light = built.scene, LIGHTS["point"]
    matrix = np.diag([scale, scale, scale, 1.0])
    nodes = tuple(gs.Node(node.mesh, matrix @ node.world_from_mesh, node.name) for node in scene.nodes)
    assert isinstance(light, gs.PointLight)
    position = tuple((scale * np.array(light.position)).tolist())
    scaled = replace(light, position=position, radius=scale * light.radius)
    usual = renderer.render(gs.Scene(scene.nodes), None, [light], SIZE, outputs=OUTPUTS, samples=1)
    other = renderer.render(gs.Scene(nodes), None, [scaled], SIZE, outputs=OUTPUTS, samples=1)
    both = ~np.isnan(usual.visibility[0]) & ~np.isnan(other.visibility[0])
    gap = np.abs(usual.visibility[0] - other.visibility[0])[both] * 64.0
    assert both.sum() > 2500
    assert (gap > 1.5).sum() <= AT_EDGES


@pytest.mark.parametrize("name", mostly(LIGHTS, "spot", "point"))
def test_more_light_samples_are_closer_to_many_rays(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    errors, truth = {}, None
    for count in (16, 64, 256):
        light = replace(LIGHTS[name], shadow=gs.Shadow(filter=gs.Exact(light_samples=count)))
        frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
        truth = truth or gs.trace(scene, None, [light], SIZE, light_samples=1024, surface=frame.triangle, samples=1)
        tested = truth.reached[0] & (truth.cosine[0] > 0.05)
        errors[count] = float(np.abs(frame.visibility[0] - truth.visibility[0])[tested].mean())
    assert errors[64] < 0.7 * errors[16], errors
    assert errors[256] < 0.7 * errors[64], errors
    assert errors[256] < 3e-3, errors


def test_half_plane_under_a_directional_light(renderer: gs.Renderer) -> None:
    """The fraction of a disc beyond a straight edge: (acos x - x sqrt(1 - x^2)) / pi."""
    height, angle = 2.0, 6.0
    floor = gs.Mesh(*shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4)))
    roof = gs.Mesh(*shapes.rectangle((-40, height, 40), (40, 0, 0), (0, 0, -80)))  # over x < 0
    scene = gs.Scene((gs.Node(floor, np.eye(4), "floor"), gs.Node(roof, np.eye(4), "roof")))
    camera = gs.OrthographicCamera((0.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=0.05)
    for count in (64, 1024):
        sun = gs.DirectionalLight(
            direction=(0, -1, 0), angle=angle, shadow=gs.Shadow(filter=gs.Exact(light_samples=count))
        )
        frame = renderer.render(scene, camera, [sun], (128, 16), outputs=("visibility", "position"), samples=1)
        x = (frame.position[..., 0]) / (height * np.tan(np.radians(angle / 2.0)))
        inside = np.clip(-x, -1.0, 1.0)
        exact = (np.arccos(inside) - inside * np.sqrt(1.0 - inside**2)) / np.pi
        gap = np.abs(frame.visibility[0] - exact)
        assert (np.abs(x) < 1.0).mean() > 0.2
        assert gap.max() < 1.3 * count**-0.75
        assert gap.mean() < 0.4 * count**-0.75


@pytest.mark.parametrize("samples", mostly([4, 16], 16))
def test_multisampling_and_light_samples_combine(renderer: gs.Renderer, scene: gs.Scene, samples: int) -> None:
    lights = [LIGHTS["sun"], gs.DirectionalLight(direction=(0.5, -1.0, 0.3))]
    frame = renderer.render(scene, None, lights, SIZE, outputs=OUTPUTS, samples=samples)
    truth = gs.trace(scene, None, lights, SIZE, samples=samples, light_samples=512 // samples)
    known = ~np.isnan(frame.visibility[0]) & ~np.isnan(truth.visibility[0]) & (truth.cosine[0] > 0.05)
    assert np.abs(frame.visibility[0] - truth.visibility[0])[known].mean() < 4e-3
    assert np.abs(frame.visibility[1] - truth.visibility[1])[known].mean() < 2e-3


@pytest.mark.usefixtures("built_on_the_gpu")
def test_unchanged_frame_reuses_its_light_samples(
    renderer: gs.Renderer, scene: gs.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    from glshadow.gl.techniques.area import Area

    times, original = [], Area._classify

    def counted(*arguments: object) -> None:
        times.append(1)
        original(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Area, "_classify", counted)
    with gs.Renderer() as fresh:
        for _ in range(3):
            fresh.render(scene, None, [LIGHTS["sun"]], SIZE, samples=1)
        assert len(times) == 1
        fresh.render(scene, None, [replace(LIGHTS["sun"], angle=4.0)], SIZE, samples=1)
        assert len(times) == 2


def test_single_map_is_hard_for_area_lights(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Pcf()))
    frame = renderer.render(scene, None, [light], SIZE, samples=1)
    assert any("size is ignored" in said for said in frame.used[0].fallbacks)


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", mostly([*LIGHTS, "panel"], "spot", "point"))
def test_dither_turns_steps_into_noise(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    """The same visibility on average, a different set of points in each pixel, and the same image every time."""
    rect = gs.RectLight(position=(2.5, 3.0, 1.5), direction=(-2.5, -2.5, -1.5), width=0.8, height=0.4)
    light = LIGHTS.get(name, rect)
    lights = [replace(light, shadow=gs.Shadow(filter=gs.Exact(light_samples=16, dither=on))) for on in (False, True)]
    plain, noisy = (
        renderer.render(scene, None, [each], SIZE, outputs=OUTPUTS, samples=1).visibility[0] for each in lights
    )
    again = renderer.render(scene, None, [lights[1]], SIZE, outputs=("visibility",), samples=1).visibility[0]
    np.testing.assert_array_equal(again, noisy)
    soft = (plain > 0.0) & (plain < 1.0)
    assert (plain != noisy)[soft].mean() > 0.2
    assert abs((plain - noisy)[soft].mean()) < 0.02
    truth = gs.trace(scene, None, [light], SIZE, light_samples=256, samples=1).visibility[0]
    assert np.nanmean(np.abs(noisy - truth)) < 1.5 * np.nanmean(np.abs(plain - truth)) + 1e-3


def test_unavailable_dither_is_reported(renderer: gs.Renderer, scene: gs.Scene) -> None:
    sky = gs.SkyLight(shadow=gs.Shadow(filter=gs.Exact(dither=True)))
    used = renderer.render(scene, None, [sky], SIZE, samples=1).used[0]
    assert any("no dither" in said for said in used.fallbacks)


def test_measure_refuses_a_hard_reference_for_soft_shadows(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = LIGHTS["sun"]
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    with pytest.raises(gs.SettingsError, match=r"light 0 has a size.*light_samples=256"):
        gs.measure(frame, gs.trace(scene, None, [light], SIZE, samples=1))
    error = gs.measure(frame, gs.trace(scene, None, [light], SIZE, light_samples=256, samples=1))
    assert error.acne == error.leak == 0.0
    assert error.mean < 2e-3
    assert error.mean < error.penumbra < 0.02, "the reference's rays are as coarse as the sample points: 1 / sqrt(256)"
    assert error.p95 < 0.02
    assert "penumbra" in str(error)
    hard = renderer.render(
        scene, None, [replace(light, shadow=gs.Shadow(filter=gs.Hard()))], SIZE, outputs=OUTPUTS, samples=1
    )
    gs.measure(hard, gs.trace(scene, None, [light], SIZE, samples=1))  # hard against hard is fine
