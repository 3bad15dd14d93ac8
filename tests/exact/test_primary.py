"""Every pixel shows the triangle that its own ray hits, according to a tracer that shares no code with the renderer."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes.shapes import box, rectangle
from tests.tracer import View

SIZE = (320, 180)
CELLS = 90
HAIR = 1e-3  # pixels: float32 positions of vertices, relative to the camera, are off by less


def hills(rng: np.random.Generator, height: float = 0.04) -> gs.Scene:
    """A rough height field of 16,200 triangles, each about two pixels large, which does not occlude itself."""
    side = np.linspace(-1.0, 1.0, CELLS + 1)
    x, z = np.meshgrid(side, side, indexing="ij")
    y = height * rng.uniform(size=x.shape)
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    corner = (np.arange(CELLS)[:, None] * (CELLS + 1) + np.arange(CELLS)).ravel()
    first = np.stack([corner, corner + 1, corner + CELLS + 1], axis=1)
    second = np.stack([corner + 1, corner + CELLS + 2, corner + CELLS + 1], axis=1)
    mesh = gs.Mesh(positions, np.concatenate([first, second]).astype(np.int32))
    camera = gs.PerspectiveCamera(position=(0.4, 2.0, 0.9), target=(0.0, 0.0, 0.0), fov_y=40.0)
    return gs.Scene((gs.Node(mesh, np.eye(4), "hills"),), camera=camera)


def edge_distance(view: View, rows: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Distance in pixels (N,) from pixel centres to the nearest edge of one triangle each."""
    assert view.tracer is not None
    camera, height = view.camera, view.size[1]
    pixel = 2.0 * np.tan(np.radians(0.5 * camera.fov_y)) / height
    o, d = view.origins[rows], view.directions[rows]
    corners = view.tracer.corners[triangle] - o[:, None]
    depth = corners @ (
        np.subtract(camera.target, camera.position) / np.linalg.norm(np.subtract(camera.target, camera.position))
    )
    seen = corners / depth[..., None] - d[:, None]  # on the plane at depth 1
    start, along = seen, np.roll(seen, -1, axis=1) - seen
    share = np.clip(-(start * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(start + share[..., None] * along, axis=-1).min(axis=1) / pixel)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_height_field_pixels_show_the_triangle_their_ray_hits(
    rng: np.random.Generator, renderer: gs.Renderer, scale: float
) -> None:
    scene = hills(rng)
    mesh = scene.nodes[0].mesh
    camera = replace(scene.camera, position=tuple(scale * x for x in scene.camera.position))
    scene = gs.Scene((gs.Node(gs.Mesh(mesh.positions * scale, mesh.triangles), np.eye(4), "hills"),), camera=camera)
    frame = renderer.render(scene, size=SIZE, outputs=("triangle",), samples=1)
    view = View(scene, scene.camera, SIZE)
    other = np.flatnonzero(frame.triangle.ravel() != view.triangle)
    assert (view.triangle >= 0).sum() > 20_000
    # at the border of the field GL covers other pixels
    inside = other[(frame.triangle.ravel()[other] >= 0) & (view.triangle[other] >= 0)]
    assert len(other) - len(inside) <= 5
    assert len(inside) <= 3
    assert (edge_distance(view, inside, view.triangle[inside]) < HAIR).all()


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("light", [gs.DirectionalLight(direction=(-1.0, -0.15, 0.3)), gs.PointLight(position=(0.9, 0.3, 0.2))],
                         ids=["sun", "point"])  # fmt: skip
def test_height_field_under_grazing_light_matches_rays(
    rng: np.random.Generator, renderer: gs.Renderer, light: gs.DirectionalLight | gs.PointLight, samples: int
) -> None:
    scene = hills(rng)
    frame = renderer.render(scene, lights=[light], size=SIZE, samples=samples, outputs=("visibility",))
    places = [(0.5, 0.5)] if samples == 1 else [(x, y) for x in (0.25, 0.75) for y in (0.25, 0.75)]
    seen = []
    for place in places:
        view = View(scene, scene.camera, SIZE, place)
        source = (
            {"position": light.position}
            if isinstance(light, gs.PointLight)
            else {"towards": -np.array(light.direction)}
        )
        seen.append(view.visibility(**source))
    with np.errstate(invalid="ignore"):
        truth = np.mean(seen, axis=0)
        difference = np.abs(frame.visibility[0] - truth)
    judged = np.isfinite(difference)
    assert 0.2 < truth[judged].mean() < 0.8
    if samples == 1:  # two pixels may lie closer to a shadow's edge than float32 resolves
        assert (difference[judged] > 0.5).sum() <= 2
    else:
        assert (difference[judged] > 0.26).mean() <= 1e-3


def test_samples_on_bent_surfaces_see_edges_that_pass_beside_the_plane_of_one_of_them(
    rng: np.random.Generator, renderer: gs.Renderer
) -> None:
    """Under a light one degree above the horizon what lies a thousandth of a pixel off a plane has its shadow's edge elsewhere."""
    if not renderer._context.caps.compute:
        return  # every sample is shaded
    scene, light = hills(rng, 0.002), gs.DirectionalLight(direction=(-1.0, -0.04, 0.3))
    frame = renderer.render(scene, lights=[light], size=SIZE, samples=4, outputs=("visibility",))
    views = [View(scene, scene.camera, SIZE, place) for place in product((0.25, 0.75), (0.25, 0.75))]
    truth = np.mean([view.visibility(towards=-np.array(light.direction)) for view in views], axis=0)
    with np.errstate(invalid="ignore"):
        difference = np.abs(frame.visibility[0] - truth)
    judged = np.isfinite(difference)
    assert 0.2 < truth[judged].mean() < 0.9
    assert (difference[judged] > 0.26).sum() <= 15  # if all samples counted as seeing one plane: about 50


def test_position_depth_and_normal_match_the_ray(rng: np.random.Generator, renderer: gs.Renderer) -> None:
    scene = hills(rng)
    frame = renderer.render(scene, size=SIZE, outputs=("triangle", "position", "normal", "depth"), samples=1)
    view = View(scene, scene.camera, SIZE)
    assert view.tracer is not None
    rows = view.rows[frame.triangle.ravel()[view.rows] == view.triangle[view.rows]]
    points = np.full((SIZE[0] * SIZE[1], 3), np.nan)
    points[view.rows] = view.points
    position = frame.position.reshape(-1, 3)[rows]
    assert (
        np.abs(position - points[rows]).max() < 2e-5
    )  # depths are interpolated between vertices snapped to 1/256 pixel
    normal = view.tracer.normals[view.triangle[rows]]
    alike = np.abs((frame.normal.reshape(-1, 3)[rows] * normal).sum(axis=1))
    assert alike.min() > 1.0 - 1e-6


def test_ray_past_the_rasterised_triangle_shows_the_surface_behind(renderer: gs.Renderer) -> None:
    """A thin leaf in front of a wall. Its borders pass pixel centres at less than the distance by which GL snaps vertices."""
    camera = gs.OrthographicCamera(position=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), height=2.0, near=0.1, far=10.0)
    size = (64, 64)
    pixel = 2.0 / 64
    edge = 0.5 * pixel - pixel / 2048  # GL snaps it onto the pixel centres
    leaf = gs.Mesh(
        *rectangle((-10.5 * pixel, -10.5 * pixel, 1.0), (10.5 * pixel + edge, 0.0, 0.0), (0.0, 21.0 * pixel, 0.0))
    )
    wall = gs.Mesh(*box((4.0, 4.0, 0.2), (0.0, 0.0, 0.0)))
    scene = gs.Scene((gs.Node(leaf, np.eye(4), "leaf"), gs.Node(wall, np.eye(4), "wall")), camera=camera)
    frame = renderer.render(scene, size=size, outputs=("triangle", "node"), samples=1)
    view = View(scene, camera, size)
    np.testing.assert_array_equal(frame.triangle.ravel() >= 0, view.triangle >= 0)
    np.testing.assert_array_equal(frame.node.ravel(), view.node[view.triangle])


def test_wires_thinner_than_vertex_snapping_show_where_rays_hit(renderer: gs.Renderer) -> None:
    """Wires 1/1024 pixel wide, in front of a wall and in front of nothing: over pixel centres, or half a width beside them."""
    camera = gs.OrthographicCamera(position=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), height=2.0, near=0.1, far=10.0)
    pixel, hair = 2.0 / 64, 2.0 / 64 / 2048
    columns = np.arange(2, 62, 2)
    met = np.arange(len(columns)) % 2 == 0
    left = (columns + 0.5) * pixel - 1.0 - hair + np.where(met, 0.0, 1.5 * hair)
    wall = gs.Mesh(*rectangle((-1.5, -1.5, 0.0), (1.5, 0.0, 0.0), (0.0, 3.0, 0.0)))  # the left half
    nodes = [gs.Node(wall, np.eye(4), "wall")]
    for x in left.tolist():
        wire = rectangle((x, -30.25 * pixel, 1.0), (2.0 * hair, 0.0, 0.0), (0.0, 60.5 * pixel, 0.0))
        nodes.append(gs.Node(gs.Mesh(*wire), np.eye(4), "wire"))
    frame = renderer.render(gs.Scene(tuple(nodes), camera=camera), size=(64, 64), outputs=("node",), samples=1)
    expected = np.broadcast_to(np.where(np.arange(64) < 32, 0, -1), (64, 64)).copy()
    rows = np.abs(np.arange(64) - 31.5) < 30.25
    for k in np.flatnonzero(met):
        expected[rows, columns[k]] = 1 + k
    np.testing.assert_array_equal(frame.node, expected)


def splinters(rng: np.random.Generator, count: int = 4000) -> gs.Scene:
    """Random triangles without shared edges, most of them much thinner than a pixel of SIZE; a third behind or beside the camera."""
    middle = rng.uniform(-1.0, 1.0, (count, 1, 3)) * (1.5, 1.0, 2.0)
    along = rng.normal(size=(count, 1, 3)) * 10.0 ** rng.uniform(-2.0, 0.0, (count, 1, 1))
    across = rng.normal(size=(count, 1, 3)) * 10.0 ** rng.uniform(-5.0, -1.5, (count, 1, 1))
    corners = np.concatenate([middle - along, middle + along, middle + across], axis=1).reshape(-1, 3)
    mesh = gs.Mesh(corners, np.arange(3 * count, dtype=np.int32).reshape(-1, 3))
    return gs.Scene((gs.Node(mesh, np.eye(4), "splinters"),))


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_splinter_pixels_show_what_their_ray_hits(rng: np.random.Generator, renderer: gs.Renderer, kind: str) -> None:
    """Also where the ray hits nothing. Without double except for rays that pass an edge closer than float32 resolves."""
    scene = splinters(rng)
    camera = (
        gs.PerspectiveCamera(position=(0.0, 0.0, 1.0), target=(0.1, 0.05, -1.0), fov_y=60.0)
        if kind == "perspective"
        else gs.OrthographicCamera(position=(0.0, 0.0, 3.5), target=(0.1, 0.05, -1.0), height=2.0)
    )
    frame = renderer.render(scene, camera, size=SIZE, outputs=("triangle",), samples=1)
    view = View(scene, camera, SIZE)
    assert view.tracer is not None
    met = view.tracer.trace(view.origins, view.directions, least=frame.near if kind == "perspective" else 0.0)[0]
    ours = frame.triangle.ravel()
    other = np.flatnonzero(ours != met)
    assert (met >= 0).sum() > 5_000
    caps = renderer._context.caps
    most = (
        0 if caps.doubles and caps.version_code >= 400 else 5
    )  # in float32 3, whose rays pass 2e-6 to 7e-6 pixel beside an edge
    assert len(other) <= most


def test_surfaces_do_not_depend_on_earlier_frames(rng: np.random.Generator) -> None:
    scene = splinters(rng, 500)
    cameras = [gs.PerspectiveCamera(position=(x, 0.0, 1.0), target=(0.0, 0.0, -1.0)) for x in (0.0, 0.01, 0.3)]
    outputs = ("triangle", "depth", "visibility")

    def frames(order: list[int]) -> dict[int, gs.Frame]:
        with gs.Renderer() as each:
            return {
                k: each.render(scene, cameras[k], [gs.DirectionalLight()], SIZE, outputs=outputs, samples=1)
                for k in order
            }

    there, back = frames([0, 1, 2]), frames([2, 1, 0])
    for k in range(3):
        for one, other in (
            (there[k].triangle, back[k].triangle),
            (there[k].depth, back[k].depth),
            (there[k].visibility, back[k].visibility),
        ):
            np.testing.assert_array_equal(one, other)


def test_without_triangle_buffers_pixels_show_rasterised_triangles(rng: np.random.Generator) -> None:
    scene = hills(rng)
    mesh = scene.nodes[0].mesh
    soup = gs.Mesh(mesh.positions[mesh.triangles.ravel()], np.arange(3 * len(mesh.triangles)).reshape(-1, 3))
    scene = gs.Scene((gs.Node(soup, np.eye(4), "hills"),), camera=scene.camera)
    lights = [gs.DirectionalLight(direction=(-1.0, -0.3, 0.3), shadow=gs.Shadow(filter=gs.Pcf(1)))]
    with gs.Renderer() as usual, gs.Renderer() as small:
        small._context.caps = replace(small._context.caps, max_texture_buffer_size=2 * len(mesh.triangles))
        frames = [
            each.render(scene, None, lights, SIZE, outputs=("triangle", "visibility"), samples=1)
            for each in (usual, small)
        ]
    assert frames[0].used[0].fallbacks == ()
    assert [line for line in frames[1].used[0].fallbacks if "pixels show the triangles that GL drew" in line]
    differs = frames[0].triangle != frames[1].triangle
    assert 20 < differs.sum() < 0.03 * differs.size
