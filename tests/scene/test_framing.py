"""The default camera of files: the projected hull fills the image's tighter axis and is in the middle, at every size."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.scene.framing import FILL, FOV, framing_camera, model_outline, turned

SIZES = [(1280, 720), (500, 500), (90, 400), (2000, 300)]
TOWARDS = np.array([0.5, 0.4, 0.7]) / np.linalg.norm([0.5, 0.4, 0.7])


def cloud(shape: tuple[float, float, float], seed: int = 0) -> Array:
    return np.random.default_rng(seed).normal(size=(300, 3)) * shape


def shares(camera: gs.PerspectiveCamera, points: Array, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Width and height of projected points over the image's, and how far off its centre they are, in image widths and heights."""
    left, right, bottom, top = camera.window(size)
    x, y, z = camera.view_from_world[:3, :3] @ points.T + camera.view_from_world[:3, 3:]
    assert (z < 0).all()
    u, v = (-x / z - left) / (right - left), (-y / z - bottom) / (top - bottom)
    return float(np.ptp(u)), float(np.ptp(v)), float(u.max() + u.min()) / 2 - 0.5, float(v.max() + v.min()) / 2 - 0.5


@pytest.mark.parametrize(
    "shape", [(1, 1, 1), (5, 0.1, 5), (0.01, 4, 0.01), (1e-9, 2e-9, 1e-9), (1e9, 1e8, 1e9)], ids=str
)
def test_hull_fills_the_tighter_axis_and_is_centred_at_every_size(shape: tuple[float, float, float]) -> None:
    points = cloud(shape) + 3 * np.array(shape)
    camera = framing_camera(points, TOWARDS)
    for size in SIZES:
        width, height, aside, above = shares(camera, points, size)
        # 1e-6: the rounding of a position many times as far as the model is large
        assert max(width, height) == pytest.approx(FILL, abs=1e-6)
        assert (aside, above) == pytest.approx((0, 0), abs=1e-6)


def test_field_of_view_in_a_usual_image_and_direction() -> None:
    for shape in ((1, 1, 1), (4, 1, 1), (1, 5, 1)):
        camera = framing_camera(cloud(shape), TOWARDS)
        bottom, top = camera.window((1600, 900))[2:]
        assert 2 * np.degrees(np.arctan((top - bottom) / 2)) == pytest.approx(FOV)
        np.testing.assert_allclose(camera.view_from_world[2, :3], TOWARDS, atol=1e-12)


def test_needle_along_the_view_stays_before_the_eye() -> None:
    points = np.linspace(-3, 3, 50)[:, None] * TOWARDS + 1e-4 * cloud((1, 1, 1))[:50]
    width, height, *_ = shares(framing_camera(points, TOWARDS), points, (1280, 720))
    assert max(width, height) == pytest.approx(FILL, abs=1e-6)


def test_a_turned_hull_holds_the_points_from_all_sides() -> None:
    points = cloud((3, 0.5, 1)) + np.array([7, 1, 2])
    camera = framing_camera(turned(points), TOWARDS)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    largest = 0.0
    for angle in np.linspace(0, 2 * np.pi, 50):
        turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
        width, height, *_ = shares(camera, (points - middle) @ turn.T + middle, (640, 360))
        largest = max(largest, width, height)
    # 72 sides and 100 slices: the hull is at most 2 % larger than the body
    assert 0.8 * FILL < largest <= FILL + 1e-3


def test_outline_has_instances_and_radii_and_no_ground() -> None:
    ball = gs.Points([[0, 0, 0]], radius=2.0)
    shifted = np.eye(4)
    shifted[0, 3] = 10
    scene = gs.load([gs.Node(ball), gs.Node(ball, shifted)], ground=True)
    points = model_outline(scene)
    # a hull of the balls that is at most 2 % of their radii larger, and 0.01 / 0.98 more
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [(-2, -2, -2), (12, 2, 2)], atol=0.06)


@pytest.mark.parametrize("size", [(640, 360), (360, 640)])
@pytest.mark.parametrize(
    "mesh",
    [
        gs.Points([[0, 0, 0]], radius=0.5),
        gs.Points([[0, 0, 0], [1, 0, 0]], radius=[3.0, 0.1]),
        gs.Points([[5, 0, 0], [-5, 0, 0]], radius=[0.1, 3.0]),
        gs.Lines([[0, 0, 0], [0, 0.5, 0]], [[0, 1]], radius=1.0),
    ],
    ids=["ball", "one in another", "two", "tube"],
)
def test_balls_and_tubes_fill_the_image(renderer: gs.Renderer, mesh: gs.Mesh, size: tuple[int, int]) -> None:
    node = renderer.render(gs.load(gs.Node(mesh)), size=size, samples=1, outputs="node").node
    rows, columns = np.nonzero(node == 0)
    share = max((np.ptp(columns) + 1) / size[0], (np.ptp(rows) + 1) / size[1])
    assert 0.96 * FILL < share < FILL + 2.5 / min(size)  # the hull's 3 %; whole pixels
    for place, length in ((columns, size[0]), (rows, size[1])):
        assert abs(place.min() + place.max() + 1 - length) < 0.02 * length


def test_key_light_falls_on_the_larger_side() -> None:
    """The camera sees +x and +z; the key comes from its left, and from the right where the side towards +x is the larger one."""
    for size, from_right in (((1, 1, 1), False), ((4, 4, 0.2), False), ((1, 2, 3), True), ((0.2, 4, 4), True)):
        low, high = -0.5 * np.array(size), 0.5 * np.array(size)
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (high - low) + low
        scene = gs.load(gs.Mesh(corners, np.array([[0, 1, 3], [4, 6, 7], [2, 5, 0]])))
        towards = -np.asarray(scene.lights[0].direction)  # type: ignore[attr-defined]
        right = scene.camera.view_from_world[0, :3]
        assert bool(towards @ right > 0) == from_right
        lit = towards[0] if from_right else towards[2]
        assert lit > 0.5


def test_fov_y_holds_for_images_at_least_as_wide_as_the_aspect() -> None:
    camera = gs.PerspectiveCamera((0, 0, 5), fov_y=40, aspect=2.0)
    tangent = np.tan(np.radians(20))
    assert camera.window((400, 200)) == pytest.approx((-2 * tangent, 2 * tangent, -tangent, tangent))
    assert camera.window((800, 200)) == pytest.approx((-4 * tangent, 4 * tangent, -tangent, tangent))
    assert camera.window((200, 200)) == pytest.approx((-2 * tangent, 2 * tangent, -2 * tangent, 2 * tangent))
    with pytest.raises(gs.SettingsError, match="aspect"):
        gs.PerspectiveCamera((0, 0, 5), aspect=0.0)


def test_orbit_frames_the_model_from_all_sides_unless_the_camera_is_given() -> None:
    plank = gs.Mesh(cloud((5, 1, 0.5)), np.arange(300).reshape(-1, 3))
    scene = gs.load(plank)
    points = model_outline(scene)
    for camera in gs.orbit(scene.turning_camera, 8):
        assert max(shares(camera, points, (640, 360))[:2]) <= FILL + 1e-3  # between two of the 72 sides
    own = gs.Scene([plank], gs.PerspectiveCamera((9, 9, 9)), look="studio")
    assert own.turning_camera is own.camera
