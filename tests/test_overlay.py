"""Overlays: everything is drawn where the camera's own formulas project it, and is hidden where it should be."""

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import CLIP_SPACES, project
from glshadow.frame import Frame, Used
from glshadow.lines import HIDDEN, Canvas
from glshadow.overlay import (
    EMPTY,
    GRID_COLOR,
    OVERLAYS,
    floor_height,
    frustum_edges,
    light_color,
    map_previews,
    overlay,
    required_outputs,
    round_step,
)
from glshadow.shadows.view import shadow_views

SIZE = (320, 180)
LIGHTS = (gs.DirectionalLight(direction=(-0.55, -0.8, -0.25)), gs.PointLight(position=(-2, 3, -1)))


@pytest.fixture(scope="module")
def frame():
    lights = [replace(light, shadow=gs.Shadow(resolution=256)) for light in LIGHTS]
    with gs.Renderer() as renderer:
        return renderer.render(
            gs.scenes.courtyard(), lights=lights, size=SIZE, outputs=required_outputs(OVERLAYS), samples=1
        )


def without(frame, name):
    return replace(frame, outputs={key: value for key, value in frame.outputs.items() if key != name})


def changed(frame, *names):
    return (overlay(frame, names) != frame.image).any(axis=-1)


LENSES = pytest.mark.parametrize("lens", [gs.PerspectiveCamera, gs.OrthographicCamera])


def flat_frame(depth=np.inf, value=0, position=(0.0, 0.0, 5.0), size=(200, 100), lens=gs.PerspectiveCamera):
    """A frame of one colour and one depth, made without OpenGL; the camera looks along -z."""
    camera = gs.PerspectiveCamera(position=position, target=(position[0], position[1], position[2] - 1.0), fov_y=60.0)
    if lens is gs.OrthographicCamera:
        camera = camera.through(lens, height=10.0 * np.tan(np.radians(30.0)))  # covers as much at distance 5
    return Frame(
        scene=gs.scenes.courtyard(), camera=camera, lights=(), size=size, near=0.1, far=100.0, used=(),
        outputs={"image": np.full((size[1], size[0], 3), value, np.uint8),
                 "depth": np.full((size[1], size[0]), depth, np.float32)},
    )  # fmt: skip


# -- the four overlays


def test_required_outputs():
    assert set(required_outputs(["map"])) == {"image", "shadow_maps"}
    assert set(required_outputs(["grid", "axes"])) == {"image", "depth"}
    assert required_outputs([]) == ()


def test_refusals(frame):
    with pytest.raises(gs.SettingsError, match=r"map, lights, axes, grid.*'sun'"):
        overlay(frame, ["sun"])
    with pytest.raises(gs.SettingsError, match="sequence"):
        overlay(frame, "map")
    with pytest.raises(gs.SettingsError, match='"shadow_maps"'):
        overlay(without(frame, "shadow_maps"), ["map"])
    with pytest.raises(gs.SettingsError, match='"image"'):
        Canvas(without(frame, "image"))


def test_frame_is_left_alone_and_result_repeats(frame):
    before = frame.image.copy()
    first = overlay(frame)
    assert first.shape == frame.image.shape
    assert first.dtype == np.uint8
    assert (frame.image == before).all()
    assert (first == overlay(frame)).all()
    assert not changed(frame).any()


def test_map_fills_squares_in_the_corner_and_nothing_else(frame):
    where = changed(frame, "map")
    assert not where[:, : SIZE[0] // 2 - 1].any()
    drawn = overlay(frame, ["map"])
    for number, used in enumerate(frame.used):
        # Each preview has a frame of the light's colour, one pixel wide: count its left edges in the top row
        rows = np.flatnonzero((drawn == light_color(number)).all(axis=-1).sum(axis=1) > 10)
        edge = (drawn[rows[0]] == light_color(number)).all(axis=-1)
        assert (np.diff(np.concatenate([[0], edge.astype(int)])) == 1).sum() == len(used.views)


def test_preview_is_brighter_nearer_the_light_in_every_format():
    light = gs.SpotLight(position=(0, 10, 0), direction=(0, -1, 0), outer_angle=40)
    for target in gs.Target:
        for clip in CLIP_SPACES:
            receivers = [np.array([[x, y, z] for x in (-1.0, 1.0) for y in (0.0, 5.0) for z in (-1.0, 1.0)])]
            (view,) = shadow_views(light, receivers, receivers[0], clip, 8, 0)
            depths = np.array([np.nan, 5.0, 7.0, 10.0])  # NaN: nothing drawn
            if target.is_depth:
                uvz = project(view.uvz_from_world, np.stack([0 * depths, 10.0 - depths, 0 * depths], axis=-1))
                stored = np.where(np.isnan(depths), clip.clear_depth, uvz[:, 2] / uvz[:, 3])
            else:
                stored = np.where(np.isnan(depths), 1.0, depths / 20.0)
            values = np.repeat(stored[None, None, :], 4, axis=1).astype(np.float32)
            (picture,) = map_previews(values, Used(views=(view,), target=target), side=4)
            row = picture[0].astype(int)
            assert (row[0] == EMPTY).all(), (target, clip)
            assert row[1, 0] > row[2, 0] > row[3, 0], (target, clip)
            # Linear in distance for a depth texture too: 7 is two fifths of the way from 5 to 10
            assert row[2, 0] == pytest.approx(row[1, 0] - 0.4 * (row[1, 0] - row[3, 0]), abs=2), (target, clip)


def test_lights_are_drawn_in_their_colours(frame):
    drawn = overlay(frame, ["lights"])
    place, _ = Canvas(frame).place(LIGHTS[1].position)
    assert np.abs(drawn[int(place[1]), int(place[0])].astype(int) - light_color(1)).max() <= 2
    assert (np.abs(drawn.astype(int) - light_color(0)).max(axis=-1) <= 2).any()


def test_axes_are_at_a_corner_of_the_scene(frame):
    canvas = Canvas(frame)
    where = changed(frame, "axes")
    low, high = frame.scene.bounds
    corners = np.array([[x, 0.0, z] for x in (low[0], high[0]) for z in (low[2], high[2])])
    inside = canvas.inside(corners, 8.0)
    assert inside.any()
    places = canvas.place(corners[inside])[0].astype(int)
    assert any(where[y - 3 : y + 4, x - 3 : x + 4].any() for x, y in places)


@LENSES
def test_axes_without_a_visible_corner_are_in_the_lower_left(frame, lens):
    camera = gs.PerspectiveCamera((0, 3, 0), (0.1, 0, 0))
    camera = camera if lens is gs.PerspectiveCamera else camera.through(lens, height=3.0)
    outputs = {**frame.outputs, "depth": np.full_like(frame.depth, 3.0)}
    near = replace(frame, camera=camera, outputs=outputs)
    where = changed(near, "axes")
    rows, columns = np.nonzero(where)
    assert columns.max() < SIZE[0] / 4
    assert rows.min() > SIZE[1] / 2


def test_grid_lies_on_the_visible_ground_at_round_steps(frame):
    # the slab's top, not its underside at -0.2
    assert floor_height(Canvas(frame), frame) == pytest.approx(0.0, abs=1e-3)
    canvas, drawn = Canvas(frame), overlay(frame, ["grid"]).astype(int)
    for on, point in ((True, (5.0, 0.0, 2.5)), (True, (5.0, 0.0, -2.5)), (False, (2.5, 0.0, 4.5))):
        (x, y), _ = canvas.place(point)
        difference = np.abs(drawn[int(y), int(x)] - frame.image[int(y), int(x)].astype(int)).max()
        assert (difference > 20) == on, point


@pytest.mark.parametrize(
    ("length", "step"),
    [(1.0, 1.0), (1.99, 1.0), (2.0, 2.0), (4.9, 2.0), (5.0, 5.0), (9.99, 5.0), (1589.0, 1000.0), (3e-7, 2e-7)],
)
def test_round_step(length, step):
    assert round_step(length) == pytest.approx(step)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=str)
@pytest.mark.parametrize(
    "light", [LIGHTS[0], LIGHTS[1], gs.SpotLight(position=(3, 8, 1))], ids=lambda light: type(light).__name__
)
def test_frustum_edges(light, clip):
    points = np.array([[x, y, z] for x in (-3.0, 2.0) for y in (0.0, 1.0) for z in (-2.0, 4.0)])
    for view in shadow_views(light, [points], points, clip, 256, 2):
        edges = frustum_edges(view)
        assert edges.shape == (12, 2, 3)
        clip_positions = project(view.clip_from_world, edges.reshape(-1, 3))
        ndc = clip_positions[:, :3] / clip_positions[:, 3:]
        # 1e-9: the inverse of a matrix with near : far of 1e-4
        np.testing.assert_allclose(np.abs(ndc[:, :2]), 1.0, rtol=1e-9)
        lowest = 0.0 if clip.zero_to_one else -1.0
        np.testing.assert_allclose(np.sort(ndc[:, 2]), np.repeat([lowest, 1.0], 12), atol=1e-9)
        depth = -(edges.reshape(-1, 3) @ view.view_from_world[2, :3] + view.view_from_world[2, 3])
        np.testing.assert_allclose([depth.min(), depth.max()], [view.near, view.far], rtol=1e-6)


@pytest.mark.parametrize("size", [(1, 1), (7, 5), (5, 40)])
def test_tiny_images(size):
    with gs.Renderer() as renderer:
        small = renderer.render(
            gs.scenes.courtyard(), lights=LIGHTS, size=size, outputs=required_outputs(OVERLAYS), samples=1
        )
    assert overlay(small).shape == (size[1], size[0], 3)


# -- lines


@LENSES
def test_line_is_where_the_camera_projects_it(lens):
    canvas = Canvas(flat_frame(lens=lens))
    ends = np.array([[-1.0, 0.5, 0.0], [1.5, -0.7, -3.0]])
    canvas.lines([ends], (255, 255, 255), 1.0, halo=False)
    rows, columns = np.nonzero(canvas.image[..., 0] > 0)
    points = ends[0] + np.linspace(0.0, 1.0, 4001)[:, None] * (ends[1] - ends[0])
    seen, _ = canvas.place(points)
    apart = np.hypot(columns[:, None] + 0.5 - seen[:, 0], rows[:, None] + 0.5 - seen[:, 1])
    assert apart.min(axis=1).max() <= 1.5  # half the width, half a pixel of ramp, the slanted end of a row
    assert apart.min(axis=0).max() <= 1.0  # and the line has no gap


def test_line_through_the_eye_plane_is_cut_not_mirrored():
    canvas = Canvas(flat_frame())
    # passes right of the eye at z = 5
    canvas.lines([[[1.0, 0.0, 0.0], [1.0, 0.0, 50.0]]], (255, 255, 255), 1.0, halo=False)
    lit = canvas.image[..., 0] > 0
    assert lit[:, 110:].any()
    assert not lit[:, :110].any()  # x = 1 at depth 5 is pixel 117
    canvas.lines([[[0.0, 0.0, 6.0], [3.0, 0.0, 60.0]]], (255, 255, 255), 1.0, halo=False)  # completely behind
    assert (lit == (canvas.image[..., 0] > 0)).all()


@LENSES
def test_projected_points_are_recovered(lens):
    frame = flat_frame(lens=lens)
    canvas = Canvas(frame)
    origins, rays = frame.camera.rays(frame.size)
    points = origins[::9, ::9] + rays[::9, ::9] * 7.5
    places, depth = canvas.place(points)
    rows, columns = np.mgrid[0:100:9, 0:200:9] + 0.5
    np.testing.assert_allclose(places, np.stack([columns, rows], axis=-1), atol=1e-9)
    np.testing.assert_allclose(depth, 7.5, rtol=1e-12)
    np.testing.assert_allclose(canvas.point(places, depth), points, atol=1e-9)


def test_orthographic_lines_begin_at_the_camera_or_its_near_plane():
    frame = flat_frame(lens=gs.OrthographicCamera)
    behind = [[[1.0, 0.0, 6.0], [3.0, 0.0, 7.0]]]
    for camera, shown in ((frame.camera, False), (replace(frame.camera, near=-4.0), True)):
        canvas = Canvas(replace(frame, camera=camera))
        canvas.lines(behind, (255, 255, 255), 1.0, halo=False)
        assert canvas.image.any() == shown
        assert np.isfinite(canvas.place(behind)[0]).all() == shown


def test_huge_line_is_clipped_to_the_image():
    canvas = Canvas(flat_frame())
    canvas.lines([[[-1e9, 0.0, 0.0], [1e9, 0.0, 0.0]]], (255, 255, 255), 1.0, halo=False)
    lit = canvas.image[..., 0] > 100
    assert lit[49:51].any(axis=0).all()
    assert not lit[:48].any()


@LENSES
@pytest.mark.parametrize(("depth", "shown"), [(np.inf, 1.0), (5.5, 1.0), (5.0, 1.0), (4.5, HIDDEN), (1.0, HIDDEN)])
def test_line_behind_a_surface_is_faint(depth, shown, lens):
    canvas = Canvas(flat_frame(depth, lens=lens))
    canvas.lines([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]], (200, 100, 0), 4.0, halo=False)  # at view depth 5
    np.testing.assert_allclose(canvas.pixels[50, 100], np.array([200, 100, 0]) * shown, atol=0.5)


def test_halo_keeps_a_white_line_visible_on_white():
    for halo in (False, True):
        canvas = Canvas(flat_frame(value=255))
        canvas.lines([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]], (255, 255, 255), 2.0, halo=halo)
        assert (canvas.image < 200).any() == halo


def test_crossing_lines_of_one_call_do_not_add_up():
    canvas = Canvas(flat_frame())
    segments = [[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]]
    canvas.lines(segments, GRID_COLOR, 4.0, 0.5, halo=False)
    np.testing.assert_allclose(canvas.pixels[50, 100], 0.5 * np.array(GRID_COLOR), atol=0.5)


def test_disc_covers_its_area():
    canvas = Canvas(flat_frame())
    canvas.disc((60.3, 40.7), 12.0, (255, 255, 255))
    # The ramp of one pixel is symmetric about the rim: the area is right to a few thousandths
    assert canvas.pixels[..., 0].sum() / 255.0 == pytest.approx(np.pi * 144.0, rel=0.01)
    before = canvas.image
    canvas.disc((-500.0, 40.0), 12.0, (255, 255, 255))
    assert (before == canvas.image).all()
