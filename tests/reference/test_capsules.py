"""The tracer on balls and tubes: closed forms, a tracer of other formulas, and frames."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import glshadow as gs
from glshadow.reference import capsules
from tests.exact.capsule_rays import elements_of, visible
from tests.exact.test_capsules import first_hit, random_scene

SIZE = (64, 48)
ROUNDING = 3e-6
"""Of the scene's size: PLANE_BOUND of the tracer, five times."""


def _ground(half: float = 6.0) -> gs.Mesh:
    corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
    return gs.Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def test_vertical_shadows_of_balls_are_discs() -> None:
    places = np.array([[k % 3 - 1.0, 0.4 + 0.2 * (k % 2), k // 3 - 1.0] for k in range(9)])
    radius = np.linspace(0.1, 0.45, 9)
    camera = gs.PerspectiveCamera((4.0, 3.0, 5.0), (0.0, 0.0, 0.0))
    scene = gs.Scene([gs.Points(places, radius), _ground()], camera=camera)
    truth = gs.trace(scene, lights=[gs.DirectionalLight(direction=(0.0, -1.0, 0.0))], size=(160, 100), samples=1)
    floor = truth.triangle >= 9
    away = np.linalg.norm(truth.position[..., None, ::2] - places[:, ::2], axis=-1) - radius
    sure = floor & (np.abs(away).min(axis=-1) > 1e-7)
    dark = (away < 0.0).any(axis=-1)
    assert (sure & dark).sum() > 150
    assert np.array_equal(truth.visibility[0][sure], 1.0 - dark[sure])
    ball = (truth.triangle >= 0) & ~floor
    outward = (truth.position - places[np.minimum(truth.triangle, 8)])[ball]
    assert np.allclose(np.linalg.norm(outward, axis=-1), radius[truth.triangle[ball]], rtol=0.0, atol=1e-12)
    assert np.allclose(truth.normal[ball], outward / radius[truth.triangle[ball], None], rtol=0.0, atol=1e-12)


def test_ball_covers_its_share_of_a_light() -> None:
    """On the axis, where it hides a cap of the light's cap: 1 - cos of both radii."""
    camera = gs.PerspectiveCamera((3.0, 2.0, 0.0), (0.0, 0.0, 0.0))
    scene = gs.Scene([gs.Points([[0.0, 2.0, 0.0]], 0.1), _ground()], camera=camera)
    light = gs.DirectionalLight(direction=(0.0, -1.0, 0.0), angle=10.0)
    truth = gs.trace(scene, lights=[light], size=(1, 1), samples=1, light_samples=4096)
    hidden = (1.0 - np.sqrt(1.0 - 0.05**2)) / (1.0 - np.cos(np.radians(5.0)))
    assert truth.visibility[0, 0, 0] == pytest.approx(1.0 - hidden, abs=2e-3)  # 4096 stratified rays


@pytest.mark.parametrize("seed", range(6))
def test_random_scenes_agree_with_other_formulas(seed: int) -> None:
    scene, light = random_scene(seed)
    truth = gs.trace(scene, lights=[light], size=SIZE, samples=1)
    elements, rng = elements_of(scene), np.random.default_rng(seed)
    origins, rays = (np.ascontiguousarray(each).reshape(-1, 3) for each in scene.camera.rays(SIZE))
    jitters = ROUNDING * 8.0 * rng.normal(size=(12, 3))
    shown = truth.triangle.ravel()
    rows = np.flatnonzero(first_hit(elements, origins, rays)[0] != shown)
    for jitter in jitters:
        rows = rows[first_hit(elements, origins[rows] + jitter, rays[rows])[0] != shown[rows]]
    assert len(rows) == 0
    seen = np.flatnonzero(shown >= 0)
    points, lit = truth.position.reshape(-1, 3)[seen], truth.visibility[0].ravel()[seen] > 0.5
    wrong = np.flatnonzero(visible(elements, light, shown[seen], points, rays[seen], 8.0) != lit)
    for jitter in jitters:
        k = seen[wrong]
        wrong = wrong[visible(elements, light, shown[k], points[wrong] + jitter, rays[k], 8.0) != lit[wrong]]
    assert len(seen) > 20
    assert len(wrong) == 0


def test_touching_balls_are_all_found() -> None:
    """On a lattice the sides of boxes around them would coincide."""
    grid = np.arange(8.0)
    places = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    scene = gs.Scene([gs.Points(places)], camera=gs.OrthographicCamera((20.0, 9.0, 3.2), (3.5, 3.5, 3.5), height=11.0))
    truth = gs.trace(scene, lights=[gs.DirectionalLight(direction=(-1.0, 0.0, 0.0))], size=SIZE, samples=1)
    origins, rays = (np.ascontiguousarray(each).reshape(-1, 3) for each in scene.camera.rays(SIZE))
    offset = origins[:, None] - places
    along = -(offset @ rays[0]) / (rays[0] @ rays[0])
    inside = 0.25 - np.linalg.norm(offset + along[..., None] * rays[:, None], axis=-1) ** 2
    near = np.where(inside > 0.0, along - np.sqrt(np.maximum(inside, 0.0) / (rays[0] @ rays[0])), np.inf)
    found = np.where(np.isfinite(near).any(axis=1), near.argmin(axis=1), -1)
    sure = np.abs(inside).min(axis=1) > 1e-9
    assert (found[sure] >= 0).sum() > 1000
    assert np.array_equal(truth.triangle.ravel()[sure], found[sure])


def test_tubes_in_one_box_are_all_found() -> None:
    """Diagonals of a square: the boxes around them are the same."""
    ends = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, -1.0, 0.0]])
    camera = gs.OrthographicCamera((0.01, 0.02, 5.0), (0.01, 0.02, 0.0), height=3.0)
    scene = gs.Scene([gs.Lines(ends, [[0, 1], [2, 3]], radius=0.2)], camera=camera)
    truth = gs.trace(scene, lights=[gs.DirectionalLight(direction=(0.0, 0.0, -1.0))], size=SIZE, samples=1)
    x, y = (camera.rays(SIZE)[0][..., k] for k in range(2))
    rising, falling = np.abs(x - y) / np.sqrt(2.0), np.abs(x + y) / np.sqrt(2.0)
    inner = np.maximum(np.abs(x), np.abs(y)) < 1.0  # without the round ends
    sure = inner & (np.minimum(np.abs(rising - 0.2), np.abs(falling - 0.2)) > 1e-6) & (np.abs(rising - falling) > 1e-6)
    found = np.where(np.minimum(rising, falling) > 0.2, -1, np.where(rising < falling, 0, 1))
    assert sure.sum() > 1000
    assert np.array_equal(truth.triangle[sure], found[sure])


def test_frames_of_balls_and_tubes_are_measured(renderer: gs.Renderer) -> None:
    rng = np.random.default_rng(4)
    places = rng.uniform(-1.0, 1.0, (12, 3)) + np.array([0.0, 1.4, 0.0])
    nodes = [gs.Points(places, 0.25), gs.Lines(places[:6], radius=0.05), _ground()]
    scene = gs.Scene(nodes, camera=gs.PerspectiveCamera((4.0, 3.0, 5.0), (0.0, 1.0, 0.0)))
    lights = [gs.DirectionalLight(direction=(-0.5, -1.0, -0.3)), gs.PointLight(position=(0.3, 4.0, 0.5))]
    outputs = ("visibility", "triangle")
    frame = renderer.render(scene, lights=lights, size=(64, 48), samples=1, outputs=outputs)
    truth = gs.trace(scene, lights=lights, size=(64, 48), samples=1)
    error = gs.measure(frame, truth)
    assert error.wrong == 0.0
    assert error.all_wrong < 2e-3  # of all pixels: those within float32's rounding of a silhouette
    assert 0.2 < error.counted < 1.0
    same = gs.trace(scene, lights=lights, size=(64, 48), surface=frame.triangle)
    assert np.array_equal(same.triangle, frame.triangle)
    known = (truth.triangle == frame.triangle) & (truth.triangle >= 0)
    assert np.allclose(same.position[known], truth.position[known], rtol=0.0, atol=1e-9)
    again = pickle.loads(pickle.dumps(truth))
    near = known & (np.arange(64) == 32)
    assert np.array_equal(again.near_edge(0, 0.1, near), truth.near_edge(0, 0.1, near))


def test_nodes_that_do_not_cast_leave_no_shadow() -> None:
    camera = gs.PerspectiveCamera((4.0, 3.0, 5.0), (0.0, 0.0, 0.0))
    scene = gs.Scene([gs.Node(gs.Points([[0.0, 1.0, 0.0]], 0.5), casts=False), _ground()], camera=camera)
    truth = gs.trace(scene, lights=[gs.DirectionalLight(direction=(0.0, -1.0, 0.0))], size=SIZE, samples=1)
    assert (truth.visibility[0][truth.triangle > 0] == 1.0).all()
    assert (truth.triangle == 0).any()


def test_a_ray_through_too_many_is_a_named_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capsules, "MOST_BOXES", 3)
    places = np.stack([np.zeros(5), np.full(5, 1.0), -np.arange(5.0)], axis=1)
    scene = gs.Scene(
        [gs.Points(places, 0.1)], camera=gs.PerspectiveCamera((0.09, 1.09, 3.0), (0.09, 1.09, 0.0)), name="row"
    )
    with pytest.raises(
        gs.SceneError, match="row: a ray meets more than 3 sides of boxes around points or line segments"
    ):
        gs.trace(scene, size=(1, 1), samples=1)
