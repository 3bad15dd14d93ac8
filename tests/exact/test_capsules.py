"""Balls and tubes against closed forms and a float64 tracer: surfaces, shadows, and both on each other."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.derive.lists import MOST_DOUBLINGS
from glshadow.gl.passes.samples import Samples
from glshadow.gl.techniques import listed
from tests.exact.capsule_rays import Elements, elements_of, entry, visible

SIZE = (64, 48)
UP = np.array([0.0, 1.6, 0.0])
ROUNDING = 2e-5
"""Of the scene's size. float32 rays, ends and distances are each some 2^-24 of the largest distance off, which is up to ten times the
scene; where a ray grazes a surface the point moves by the root of that, and a shadow's border with it."""


def _ground(half: float = 20.0) -> gs.Node:
    corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
    return gs.Node(gs.Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), name="ground", ground=True)


def _visibility(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light, size: tuple[int, int] = SIZE) -> gs.Frame:
    return renderer.render(
        scene, lights=[light], size=size, samples=1, outputs=("visibility", "triangle", "position", "normal")
    )


def test_vertical_shadows_of_balls_are_discs(renderer: gs.Renderer) -> None:
    places = np.array([[k % 5 * 1.3 - 2.6, 0.4 + 0.2 * (k % 3), k // 5 * 1.3 - 2.6] for k in range(25)])
    radius = np.linspace(0.1, 0.5, 25)
    scene = gs.Scene(
        [gs.Points(places, radius), _ground()],
        camera=gs.PerspectiveCamera((7.0, 6.0, 9.0), (0.0, 0.0, 0.0)),
        name="discs",
    )
    frame = _visibility(renderer, scene, gs.DirectionalLight(direction=(0.0, -1.0, 0.0)), (320, 200))
    floor = frame.triangle >= 25
    origins, rays = scene.camera.rays((320, 200))
    at = origins - rays * (origins[..., 1:2] / rays[..., 1:2])
    away = np.linalg.norm(at[..., None, ::2] - places[:, ::2], axis=-1) - radius
    sure = floor & (np.abs(away).min(axis=-1) > 1e-5)
    dark = (away < 0.0).any(axis=-1)
    assert (sure & dark).sum() > 800
    assert sure.sum() > 0.999 * floor.sum()
    assert np.array_equal(frame.visibility[0][sure], 1.0 - dark[sure])


def test_shadow_of_a_tube_is_a_stadium(renderer: gs.Renderer) -> None:
    a, b, radius = np.array([-2.0, 1.0, -1.0]), np.array([1.5, 1.0, 2.0]), 0.3
    scene = gs.Scene(
        [gs.Lines([a, b], radius=radius), _ground()],
        camera=gs.PerspectiveCamera((6.0, 5.0, -7.0), (0.0, 0.0, 0.0)),
        name="stadium",
    )
    frame = _visibility(renderer, scene, gs.DirectionalLight(direction=(0.0, -1.0, 0.0)), (320, 200))
    origins, rays = scene.camera.rays((320, 200))
    at = (origins - rays * (origins[..., 1:2] / rays[..., 1:2]))[..., ::2]
    along = (b - a)[::2]
    share = np.clip((at - a[::2]) @ along / (along @ along), 0.0, 1.0)
    away = np.linalg.norm(at - a[::2] - share[..., None] * along, axis=-1) - radius
    sure = (frame.triangle >= 1) & (np.abs(away) > 1e-5)
    assert (sure & (away < 0.0)).sum() > 500
    assert np.array_equal(frame.visibility[0][sure], (away >= 0.0)[sure])


def test_normals_and_positions_are_those_of_the_ball(renderer: gs.Renderer) -> None:
    centre = np.array([0.3, 1.0, -0.2])
    scene = gs.Scene([gs.Points([centre], 0.8), _ground()], camera=gs.PerspectiveCamera((3.0, 3.0, 4.0), tuple(centre)))
    frame = _visibility(renderer, scene, gs.DirectionalLight(direction=(-1.0, -1.0, 0.0)))
    ball = frame.triangle == 0
    assert ball.sum() > 100
    outward = (frame.position[ball] - centre) / 0.8
    assert np.allclose(np.linalg.norm(outward, axis=1), 1.0, rtol=0.0, atol=1e-12)
    assert np.allclose(frame.normal[ball], outward, rtol=0.0, atol=1e-6)  # float32
    lit = outward @ np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    sure = np.abs(lit) > 1e-4
    assert np.array_equal(frame.visibility[0][ball][sure], (lit > 0.0)[sure])


@pytest.mark.parametrize("kind", ["directional", "spot", "point"])
def test_equal_balls_at_one_place_look_like_one(renderer: gs.Renderer, kind: str) -> None:
    rng = np.random.default_rng(3)
    places = rng.uniform(-1.0, 1.0, (12, 3)) + UP
    camera = gs.PerspectiveCamera((3.0, 3.0, 4.0), (0.0, 1.0, 0.0))
    once = gs.Scene([gs.Points(places, 0.3), _ground()], camera=camera)
    thrice = gs.Scene([gs.Points(np.concatenate([places] * 3), 0.3), _ground()], camera=camera)
    one, three = (_visibility(renderer, each, _light(kind), (200, 150)) for each in (once, thrice))
    # where one ball is dark behind its own horizon, another one decides by rounding within a pixel of it
    assert _differing(one, three) < 1e-4
    bent = np.array([[-1.0, 0.5, 0.0], [0.0, 0.9, 0.3], [1.0, 0.5, -0.3]])
    joint = gs.Scene([gs.Lines(bent, radius=0.2), _ground()], camera=camera)
    ball = gs.Scene([gs.Lines(bent, radius=0.2), gs.Points(bent[1:2], 0.2), _ground()], camera=camera)
    one, three = (_visibility(renderer, each, _light(kind), (200, 150)) for each in (joint, ball))
    assert _differing(one, three) < 1e-4


def _differing(one: gs.Frame, other: gs.Frame) -> float:
    same = (one.visibility == other.visibility) | np.isnan(one.visibility) & np.isnan(other.visibility)
    return 1.0 - float(same.mean())


def _light(kind: str) -> gs.Light:
    if kind == "directional":
        return gs.DirectionalLight(direction=(-0.6, -1.0, 0.3))
    if kind == "spot":
        return gs.SpotLight(position=(2.5, 4.0, 1.0), direction=(-2.5, -4.0, -1.0), outer_angle=35.0)
    return gs.PointLight(position=(0.6, 3.2, 0.4))


def random_scene(seed: int) -> tuple[gs.Scene, gs.Light]:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 14))
    places = rng.uniform(-1.5, 1.5, (count, 3)) + UP
    radius = 10.0 ** rng.uniform(-2.0, -0.3, count)
    turn = np.eye(4)
    angle, scale = rng.uniform(0.0, 6.0), float(rng.uniform(0.5, 1.3))
    turn[:3, :3] = scale * np.array(
        [[np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0], [-np.sin(angle), 0.0, np.cos(angle)]]
    )
    nodes = [gs.Node(gs.Points(places, radius), turn, "balls")]
    if seed % 2:
        ends = rng.uniform(-1.5, 1.5, (6, 3)) + UP
        nodes.append(
            gs.Node(gs.Lines(ends, rng.integers(0, 6, (5, 2)), 10.0 ** rng.uniform(-2.0, -0.7, 5)), name="tubes")
        )
    if seed % 3:
        corners = rng.uniform(-1.5, 1.5, (9, 3)) + UP
        nodes.append(gs.Node(gs.Mesh(corners, np.arange(9).reshape(3, 3)), name="triangles"))
    nodes.insert(int(rng.integers(0, len(nodes) + 1)), _ground(6.0))
    eye = (*rng.uniform(-4.0, 4.0, 1), rng.uniform(1.0, 6.0), rng.uniform(4.0, 7.0))
    camera: gs.Camera = gs.PerspectiveCamera(eye, (0.0, 1.0, 0.0))
    if seed % 5 == 0:
        camera = gs.OrthographicCamera(eye, (0.0, 1.0, 0.0), height=6.0)
    return gs.Scene(nodes, camera=camera, name=f"scene {seed}"), _light(("directional", "spot", "point")[seed % 3])


def first_hit(elements: Elements, origins: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    along = np.stack([entry(elements, k, origins, rays) for k in range(len(elements.radius))])
    first = along.argmin(axis=0)
    nearest = along.min(axis=0)
    return np.where(np.isfinite(nearest), first, -1), nearest


def wrong_pixels(renderer: gs.Renderer, seed: int) -> tuple[int, int, int]:
    """Pixels that show another element, and that have another visibility, than float64 finds within rounding; and pixels compared."""
    scene, light = random_scene(seed)
    frame = _visibility(renderer, scene, light)
    elements = elements_of(scene)
    origins, rays = (np.ascontiguousarray(each).reshape(-1, 3) for each in scene.camera.rays(SIZE))
    shown = frame.triangle.ravel()
    size = 8.0
    rng = np.random.default_rng(seed)
    jitters = [np.zeros(3), *(ROUNDING * size * rng.normal(size=(24, 3)))]
    first, _ = first_hit(elements, origins, rays)
    rows = np.flatnonzero(first != shown)
    for jitter in jitters[1:]:
        near, _ = first_hit(elements, origins[rows] + jitter, rays[rows])
        rows = rows[near != shown[rows]]
    seen = np.flatnonzero((first == shown) & (shown >= 0))
    along = first_hit(elements, origins[seen], rays[seen])[1]
    points = origins[seen] + along[:, None] * rays[seen]
    found = frame.visibility[0].ravel()[seen] > 0.5
    mistaken = np.flatnonzero(visible(elements, light, shown[seen], points, rays[seen], size) != found)
    for jitter in jitters[1:]:
        moved = visible(elements, light, shown[seen][mistaken], points[mistaken] + jitter, rays[seen][mistaken], size)
        mistaken = mistaken[moved != found[mistaken]]
    return len(rows), len(mistaken), len(seen)


@pytest.mark.parametrize("seed", [*range(24), *(pytest.param(k, marks=pytest.mark.exhaustive) for k in range(24, 500))])
def test_random_scenes_agree_with_rays(renderer: gs.Renderer, seed: int) -> None:
    other, mistaken, compared = wrong_pixels(renderer, seed)
    assert compared > 20
    assert (other, mistaken) == (0, 0)


@pytest.mark.parametrize("exponent", [-40, -20, 27])
def test_scale_by_a_power_of_two_changes_no_bit(renderer: gs.Renderer, exponent: int) -> None:
    rng = np.random.default_rng(5)
    ends = rng.uniform(-1.5, 1.5, (30, 3)) + UP
    light = gs.PointLight(position=(0.6, 3.2, 0.4))

    def shown(scale: float) -> gs.Frame:
        turn = np.diag([scale, scale, scale, 1.0])
        nodes = [gs.Node(gs.Lines(ends, radius=0.03), turn), gs.Node(_ground(6.0).mesh, turn)]
        camera = gs.PerspectiveCamera(
            tuple(scale * np.array([3.0, 3.0, 5.0])), tuple(scale * np.array([0.0, 1.0, 0.0]))
        )
        moved = gs.PointLight(position=tuple(scale * np.array(light.position)))
        return _visibility(renderer, gs.Scene(nodes, camera=camera), moved)

    one, other = shown(1.0), shown(2.0**exponent)
    assert (one.triangle < 29).sum() > 100
    assert np.array_equal(one.triangle, other.triangle)
    assert np.array_equal(one.visibility, other.visibility, equal_nan=True)
    assert np.array_equal(one.normal, other.normal, equal_nan=True)


@pytest.mark.parametrize("parallel", [False, True])
def test_ball_far_smaller_than_a_pixel_is_seen_where_it_covers_the_centre(
    renderer: gs.Renderer, parallel: bool
) -> None:
    eye, target = (0.3, 0.2, 5.0), (0.0, 0.1, 0.0)
    camera = (
        gs.OrthographicCamera(eye, target, height=3.0) if parallel else gs.PerspectiveCamera(eye, target, fov_y=40.0)
    )
    origins, rays = camera.rays(SIZE)
    depth = np.random.default_rng(2).uniform(2.0, 8.0, (SIZE[1], SIZE[0], 1))
    places = (origins + depth * rays).reshape(-1, 3)
    scene = gs.Scene([gs.Points(places, 1e-4)], camera=camera)  # 1/500 pixel at the nearest
    frame = _visibility(renderer, scene, _light("directional"))
    assert np.array_equal(frame.triangle.ravel(), np.arange(len(places)))


@pytest.mark.parametrize("kind", ["directional", "spot", "point"])
def test_finer_lists_change_no_bit(renderer: gs.Renderer, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    rng = np.random.default_rng(8)
    nodes = [
        gs.Node(gs.Points(rng.normal(size=(3000, 3)) * 0.5 + UP, 10.0 ** rng.uniform(-2.5, -1.0, 3000))),
        gs.Node(gs.Lines(rng.normal(size=(40, 3)) * 0.7 + UP, radius=0.01)),
    ]
    camera = gs.PerspectiveCamera((3.0, 3.0, 5.0), (0.0, 1.0, 0.0))
    found, cells = [], []
    for finer in range(MOST_DOUBLINGS + 1):
        monkeypatch.setattr(listed, "doublings", lambda *_, finer=finer: finer)
        scene = gs.Scene([*nodes, _ground()], camera=camera)
        found.append(_visibility(renderer, scene, _light(kind), (200, 150)))
        cells.append(found[-1].used[0].links)
    assert cells[0] < cells[1] < cells[2]
    assert all(np.array_equal(found[0].visibility, each.visibility, equal_nan=True) for each in found[1:])
    assert 0.05 < (found[0].visibility == 0.0).mean() < 0.95


@pytest.mark.parametrize("kind", ["directional", "spot", "point"])
def test_pixels_that_are_shaded_once_have_the_visibility_of_all_samples(
    renderer: gs.Renderer, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Thin tubes and small balls, whose shadows pass between the middles of pixels."""
    rng = np.random.default_rng(6)
    nodes = [
        gs.Node(gs.Points(rng.uniform(-1.0, 1.0, (40, 3)) + UP, 10.0 ** rng.uniform(-2.5, -0.7, 40))),
        gs.Node(gs.Lines(rng.uniform(-1.0, 1.0, (9, 3)) + UP, radius=0.003)),
        gs.Node(gs.Mesh(rng.uniform(-1.5, 1.5, (18, 3)) + UP, np.arange(18).reshape(6, 3))),
    ]
    scene = gs.Scene([*nodes, _ground()], camera=gs.PerspectiveCamera((4.0, 3.0, 5.0), (0.0, 0.6, 0.0)))
    collect, counts = Samples._collect, []
    monkeypatch.setattr(Samples, "_collect", lambda *given: counts.append(collect(*given)) or counts[-1])
    found = []
    for once in (True, False):
        monkeypatch.setattr(listed.Listed, "marks_capsules", once)
        found.append(
            renderer.render(scene, lights=[_light(kind)], size=(200, 150), samples=4, outputs=("visibility", "linear"))
        )
    assert counts[0] < 0.6 * counts[1]
    assert np.array_equal(found[0].visibility, found[1].visibility, equal_nan=True)
    between = (found[0].visibility > 0.0) & (found[0].visibility < 1.0)
    assert between.sum() > 300
    # a flat surface is shaded at one place instead of four, between which the angle of a light with a position and its cone change
    assert np.abs(found[0].linear - found[1].linear).mean() < 2e-3


def test_every_ball_of_a_large_cloud_has_its_number(renderer: gs.Renderer) -> None:
    """More balls than one draw call takes."""
    count = 270
    x, z = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    places = np.stack([x.ravel(), 0.0 * x.ravel(), z.ravel()], axis=1)
    camera = gs.OrthographicCamera((262.0, 10.0, 262.0), (262.0, 0.0, 262.0), up=(0.0, 0.0, -1.0), height=12.0)
    scene = gs.Scene([gs.Points(places, 0.4)], camera=camera, name="cloud")
    frame = renderer.render(
        scene, size=SIZE, samples=1, outputs=("triangle", "visibility"), lights=[_light("directional")]
    )
    origins, _ = camera.rays(SIZE)
    across = np.rint(origins[..., ::2]).astype(int)
    away = np.linalg.norm(origins[..., ::2] - across, axis=-1)
    number = np.where((away < 0.4) & (across < count).all(axis=-1), count * across[..., 0] + across[..., 1], -1)
    sure = np.abs(away - 0.4) > 1e-4  # float32 at 270 units
    assert number.max() > 1 << 16
    assert np.array_equal(frame.triangle[sure], number[sure])


@pytest.mark.parametrize("samples", [1, 4])
def test_no_lights_are_a_black_light(renderer: gs.Renderer, samples: int) -> None:
    scene = gs.Scene(
        [
            gs.Points([[0.0, 0.6, 0.0]], radius=0.5),
            gs.Lines([[-1.0, 0.4, 0.0], [1.0, 0.4, 1.0]], radius=0.1),
            _ground(1.0),
        ],
        camera=gs.PerspectiveCamera((1.0, 2.0, 4.0), (0.0, 0.3, 0.0)),
        name="dark",
    )
    dark, black = (
        renderer.render(scene, lights=lights, size=SIZE, samples=samples, outputs=("linear", "alpha", "node"))
        for lights in ([], [gs.DirectionalLight(intensity=0.0)])
    )
    assert all((dark.node == node).any() for node in range(3))
    assert np.abs(dark.linear - black.linear).max() < 1e-6  # float32 roundings of the hit, in the axes of another light
    assert np.array_equal(dark.alpha, black.alpha)
