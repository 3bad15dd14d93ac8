"""The tracer against closed forms: no mismatches, except at points within rounding of the boundary."""

import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest

from glshadow import scenes as builtin
from glshadow.core.cameras import PerspectiveCamera
from glshadow.errors import ReferenceUnavailable, SettingsError
from glshadow.lights import DirectionalLight, PointLight, SpotLight
from glshadow.reference import trace
from glshadow.reference.rays import PLANE_BOUND, Rays, world_positions
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

SIZE = (320, 180)
DOWN = DirectionalLight(direction=(0, -1, 0))


def settled(built, truth, distance):
    """Exact visibility (N,) at the hit points, and which of them keep it when moved by `distance` in the light plane.

    Points are moved in 8 directions, and along the light back onto their own plane.
    """
    seen = truth.triangle >= 0
    points, normals = truth.position[seen], truth.shading[seen]
    exact = built.exact(points, normals)
    towards, _ = built.scene.lights[0].to_light(points)
    cosine = (towards * normals).sum(axis=1)
    sure = np.abs(cosine) > 1e-6
    u = np.cross(towards, np.eye(3)[np.abs(towards).argmin(axis=1)])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(towards, u)
    for angle in np.arange(8) * np.pi / 4:
        offset = distance * (np.cos(angle) * u + np.sin(angle) * v)
        offset -= towards * ((offset * normals).sum(axis=1) / np.where(sure, cosine, 1.0))[:, None]
        sure &= built.exact(points + offset, normals) == exact
    return seen, exact, sure


def assert_exact(built, size=SIZE, band=0.0, left_out=1e-3):
    """No mismatch outside the band, and not more than a fraction `left_out` of the points in it.

    The band is float32's rounding in the light plane: PLANE_BOUND times the scene's largest coordinate from the eye's
    corner of it, plus `band` for how far the mesh is from the ideal solid.
    """
    truth = trace(built.scene, size=size, samples=1)
    seen, exact, sure = settled(built, truth, PLANE_BOUND * truth.rays.size + band)
    assert seen.sum() > 1000
    assert (~sure).mean() <= left_out
    assert ((truth.visibility[0][seen] != exact) & sure).sum() == 0
    return truth, exact


@pytest.mark.parametrize("elevation", [60.0, 30.0, 5.0, 1.0, 0.1])
def test_wall(elevation):
    _, exact = assert_exact(builtin.wall(elevation))
    assert 0.05 < exact.mean() < 0.95


# The mesh is inscribed: its facets lie up to 0.82 * 4**-6 of the radius inside the ideal sphere.
FACETS = 0.82 * 4.0**-6


@pytest.mark.parametrize("elevation", [90.0, 45.0, 10.0])
def test_sphere_under_a_directional_light(elevation):
    _, exact = assert_exact(builtin.sphere(elevation), band=FACETS, left_out=5e-3)
    assert 0.01 < 1.0 - exact.mean() < 0.9


def test_sphere_under_a_point_light():
    assert_exact(builtin.sphere(height=6.0, lamp_height=10.0), band=FACETS, left_out=5e-3)


@pytest.mark.parametrize(("gap", "local_light"), [(4.0, 10.0), (0.1, None), (1e-3, None), (1e-5, None), (0.0, None)])
def test_plates(gap, local_light):
    _, exact = assert_exact(builtin.plates(gap=gap, lamp_height=local_light))
    if gap == 0.0:
        assert exact.all()  # coplanar: nothing shadows itself


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-5])
def test_gap_seen_from_near(gap):
    built = builtin.plates(gap=gap)
    camera = PerspectiveCamera((-1.0 - 15 * gap, 12 * gap, 10 * gap), (-1.0 - 0.5 * gap, 0, 0))
    built = replace(built, scene=replace(built.scene, camera=camera))
    # At 1e-5 the band, 1e-6, is a tenth of the strip of shadow.
    _, exact = assert_exact(built, left_out=0.1)
    assert 0.01 < 1.0 - exact.mean() < 0.5


@pytest.mark.parametrize("elevation", [60.0, 5.0])
def test_convex_body_is_lit_iff_it_faces_the_light(elevation):
    _, exact = assert_exact(builtin.ball(elevation), left_out=0.0)
    assert 0.2 < exact.mean() < 0.95


@pytest.mark.parametrize("azimuth", [10.0, 30.0, 200.0])
def test_box(azimuth):
    assert_exact(builtin.box(azimuth=azimuth))


@pytest.mark.parametrize("elevation", [90.0, 45.0, 1.0, 0.01])
def test_empty_plane_is_lit(elevation):
    _, exact = assert_exact(builtin.plane(elevation), left_out=0.0)
    assert exact.all()


def test_room():
    _, exact = assert_exact(builtin.room(), left_out=0.0)
    assert exact.all()
    _, exact = assert_exact(builtin.room(rods=True))
    assert 0.01 < 1.0 - exact.mean() < 0.9


@pytest.mark.parametrize("scale", [1e-6, 1e7])
def test_own_triangle_at_any_scale(scale):
    for elevation in (45.0, 0.01):
        _, exact = assert_exact(builtin.plane(elevation, half=5.0 * scale), left_out=0.0)
        assert exact.all()
    assert_exact(builtin.wall(30.0, height=2.0 * scale))
    assert_exact(builtin.box(extents=(scale, 2.0 * scale, 1.5 * scale)))
    assert_exact(builtin.ball(radius=scale, subdivisions=4), left_out=0.0)


@pytest.mark.parametrize("offset", [(1e7, 0.0, -1e7), (1e9, 1e9, 1e9)])
def test_large_world(offset):
    built = builtin.box().scene
    here = trace(built, size=SIZE, samples=1)
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    eye, target = (tuple(np.add(p, offset)) for p in (built.camera.position, built.camera.target))
    moved = built.moved({node.name: matrix for node in built.nodes})
    there = trace(moved, camera=PerspectiveCamera(eye, target), size=SIZE, samples=1)
    # float64 resolves 1.2e-7 at an eye at 1e9: only pixels at an edge may change
    differ = ~((here.visibility == there.visibility) | (np.isnan(here.visibility) & np.isnan(there.visibility)))
    assert differ.mean() < 1e-4


def test_far_outlier_does_not_coarsen_what_is_seen():
    built = builtin.box()
    outlier = Mesh(np.array([[1e6, 0, 0], [1e6, 1, 0], [1e6, 0, 1.0]]), np.array([[0, 1, 2]]))
    scene = replace(built.scene, nodes=(*built.scene.nodes, Node(outlier, np.eye(4), "far")))
    np.testing.assert_array_equal(
        trace(scene, size=SIZE, samples=1).visibility, trace(built.scene, size=SIZE, samples=1).visibility
    )


def test_coplanar_copies_do_not_shadow_each_other():
    turn = builtin._rotation(0.7, (0.3, 1.0, -0.4))
    half = 5.0
    sheets = []
    for cells in (1, 7, 7, 10):
        x = np.linspace(-half, half, cells + 1)
        positions = np.array([(a, 0.0, b) for a in x for b in x])
        i, j = (index.ravel() for index in np.meshgrid(np.arange(cells), np.arange(cells)))
        a, b, c, d = (p * (cells + 1) + q for p, q in ((i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)))
        triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([c, b, d], axis=1)])
        rounded = (positions @ turn[:3, :3].T).astype(np.float32)  # as a file would store them
        sheets.append(Node(Mesh(rounded, triangles), np.eye(4), f"{cells}"))
    up = turn[:3, 1]
    camera = PerspectiveCamera(tuple(12.0 * up + 1.0), (0, 0, 0), fov_y=60)
    for elevation in (60.0, 1.0):
        e = np.radians(elevation)
        light = DirectionalLight(direction=tuple(-np.sin(e) * up - np.cos(e) * turn[:3, 0]))
        truth = trace(Scene(tuple(sheets)), camera, [light], SIZE, samples=1)
        assert (truth.visibility[0][truth.triangle >= 0] == 1.0).all()


@pytest.mark.parametrize(("units", "blocked"), [(6.0, False), (10.0, True)])
def test_coplanar_tolerance(units, blocked):
    # Two sheets `units` of float32's rounding apart; the bound is 8. Heights near 0 are held exactly.
    low = Mesh(*shapes.rectangle((-1, 0, 1), (2, 0, 0), (0, 0, -2)))
    high = Mesh(*shapes.rectangle((-1, units * 2.0**-24, 1), (2, 0, 0), (0, 0, -2)))
    rays = Rays(Scene((Node(low, np.eye(4), "low"), Node(high, np.eye(4), "high"))), np.zeros(3))
    up, point = np.array([[0.6, 0.8, 0.0]]), np.array([[0.1, 0.0, 0.2]])
    assert rays.blocked(np.array([0], dtype=np.int32), point, up, np.array([np.inf]))[0] == [blocked]


def test_light_on_a_surface_is_not_blocked_by_it():
    ground, ceiling = (shapes.rectangle((-2, y, 2), (4, 0, 0), (0, 0, -4)) for y in (0.0, 1.0))
    scene = Scene((Node(Mesh(*ground), np.eye(4), "ground"), Node(Mesh(*ceiling), np.eye(4), "ceiling")))
    camera = PerspectiveCamera((1.5, 0.9, 1.5), (0, 0, 0), fov_y=80)
    for height, lit in ((1.0, True), (1.01, False), (0.99, True)):
        truth = trace(scene, camera, [PointLight(position=(0.1, height, 0.2))], SIZE, samples=1)
        assert (truth.visibility[0][truth.node == 0] == lit).all()


def test_surface_beyond_the_light_does_not_block():
    built = builtin.plates(gap=4.0, lamp_height=10.0).scene
    low = PointLight(position=(0, 3.0, 0))
    truth = trace(built, lights=[low, replace(low, shadow=None)], size=SIZE, samples=1)
    assert (truth.visibility[0][truth.node == 0] == 1.0).all()


def test_light_without_shadow_is_not_blocked():
    built = builtin.box().scene
    sun = built.lights[0]
    truth = trace(built, lights=[replace(sun, shadow=None)], size=SIZE, samples=1)
    seen = truth.triangle >= 0
    np.testing.assert_array_equal(truth.visibility[0][seen], truth.cosine[0][seen] > 0)


def checkered(cutoff, mode=AlphaMode.MASK):
    """An 8 x 8 checker over 2 m at y = 1, 8 texels a cell, above a ground."""
    texture = np.full((64, 64, 4), 255, dtype=np.uint8)
    row, column = np.mgrid[:64, :64] // 8
    texture[..., 3] = np.where((row + column) % 2 == 0, 255, 0)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    material = Material(texture=texture, alpha_mode=mode, cutoff=cutoff)
    sheet = Mesh(*shapes.rectangle((-1, 1, 1), (2, 0, 0), (0, 0, -2)), uv=uv, material=material)
    ground = Mesh(*shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4)))
    return Scene((Node(ground, np.eye(4), "ground"), Node(sheet, np.eye(4), "sheet")))


@pytest.mark.parametrize("cutoff", [0.25, 0.5, 0.75])
def test_alpha_mask(cutoff):
    camera = PerspectiveCamera((0.3, 2.5, 2.5), (0, 0.3, 0), fov_y=50)
    truth = trace(checkered(cutoff), camera, [DOWN], (640, 360), samples=1)

    def cells(points):
        """Whether the checker is solid above or at points, and whether its lines are more than one texel away."""
        u, v = (points[:, 0] + 1) * 4, (1 + points[:, 2]) * 4  # row 0 of the texture is v = 1, at z = -1
        distance = np.minimum(np.abs(u - u.round()), np.abs(v - v.round())) / 8 * 2
        inside = (np.abs(points[:, 0]) < 1 - 2 / 64) & (np.abs(points[:, 2]) < 1 - 2 / 64)
        return (np.floor(u) + np.floor(v)) % 2 == 0, inside & (distance > 1.01 * 2 / 64)

    for node in (0, 1):
        seen = truth.node == node
        solid, sure = cells(truth.position[seen])
        assert sure.sum() > 1000
        if node == 1:  # only the solid cells are seen, and the light reaches them
            assert solid[sure].all()
            assert (truth.visibility[0][seen] == 1.0).all()
        else:
            np.testing.assert_array_equal(truth.visibility[0][seen][sure], ~solid[sure])
            assert 0.2 < solid[sure].mean() < 0.8


def test_alpha_cutoff_moves_the_edge():
    camera = PerspectiveCamera((0.0, 0.9, 0.001), (0, 0, 0), fov_y=90)  # below the sheet
    lit = [
        np.nanmean(trace(checkered(cutoff), camera, [DOWN], (200, 200), samples=1).visibility)
        for cutoff in (0.25, 0.5, 0.75)
    ]
    assert lit[0] < lit[1] < lit[2]
    assert lit[1] == pytest.approx(0.5, abs=0.02)


def test_blend_is_neither_seen_nor_casts():
    camera = PerspectiveCamera((0.3, 2.5, 2.5), (0, 0.3, 0), fov_y=50)
    truth = trace(checkered(0.5, AlphaMode.BLEND), camera, [DOWN], SIZE, samples=1)
    assert (truth.node != 1).all(), "layers are no part of the surfaces that are traced"
    assert (truth.visibility[0][truth.triangle >= 0] == 1.0).all()


def test_spot_reaches_its_cone_and_range():
    built = builtin.plane().scene
    spot = SpotLight(position=(0, 4, 0), outer_angle=30, range=4.3)
    truth = trace(built, lights=[spot, built.lights[0]], size=SIZE, samples=1)
    seen = truth.triangle >= 0
    level = np.linalg.norm(truth.position[seen][:, [0, 2]], axis=1)
    np.testing.assert_array_equal(truth.reached[0][seen], (level < 4 * np.tan(np.pi / 6)) & (np.hypot(level, 4) < 4.3))
    np.testing.assert_array_equal(truth.visibility[0][seen], level < 4 * np.tan(np.pi / 6))  # range is intensity
    assert truth.reached[1][seen].all()


def test_camera_near_and_far_cut():
    built = builtin.wall().scene
    depth = -(trace(built, size=SIZE, samples=1).position - built.camera.position) @ built.camera.view_from_world[2, :3]
    near, far = np.nanpercentile(depth, [30, 70])
    cut = trace(built, replace(built.camera, near=float(near), far=float(far)), size=SIZE, samples=1)
    inside = -(cut.position - built.camera.position) @ built.camera.view_from_world[2, :3]
    assert np.nanmin(inside) >= near * (1 - 1e-6)
    assert np.nanmax(inside) <= far * (1 + 1e-6)
    # only the wall is in front of anything here: the remaining image is unchanged
    assert 0.3 < np.isfinite(inside).sum() / np.isfinite(depth).sum() < 0.6


def test_penumbra_of_a_disc():
    # HARD_CASES N31: a straight edge under a disc; V(u) = 1/2 + (u sqrt(1 - u^2) + asin u) / pi across the penumbra
    height, half = 1.0, 50.0
    ground = Mesh(*shapes.rectangle((-4, 0, 4), (8, 0, 0), (0, 0, -8)))
    roof = Mesh(*shapes.rectangle((0, height, half), (half, 0, 0), (0, 0, -2 * half)))
    scene = Scene((Node(ground, np.eye(4), "ground"), Node(roof, np.eye(4), "roof")))
    camera = PerspectiveCamera((-1.0, 0.8, 0.0), (0.2, 0, 0), fov_y=60)
    samples = 64
    sun = DirectionalLight(direction=(0, -1, 0), angle=20.0)
    truth = trace(scene, camera, [sun], (160, 90), light_samples=samples, samples=1)
    seen = (truth.node == 0) & (np.abs(truth.position[..., 0]) < 1)
    u = np.clip(-truth.position[seen][:, 0] / (height * np.tan(np.radians(10.0))), -1, 1)
    exact = 0.5 + (u * np.sqrt(1 - u * u) + np.arcsin(u)) / np.pi
    error = truth.visibility[0][seen] - exact
    assert ((np.abs(u) < 0.9).sum()) > 500
    assert np.abs(error).max() < 4 * 0.5 / np.sqrt(samples)  # four deviations of samples that were not even stratified
    assert np.sqrt((error**2).mean()) < 0.5 * 0.5 / np.sqrt(samples)  # stratified: less than half of that noise
    assert abs(error.mean()) < 2e-3
    mean = truth.visibility[0][seen]
    np.testing.assert_allclose(truth.variance[0][seen], mean * (1 - mean), atol=1e-6)


def test_point_light_with_and_without_radius_agree_away_from_the_edge():
    built = builtin.plates(gap=4.0, lamp_height=10.0).scene
    local_light = built.lights[0]
    soft = trace(built, lights=[replace(local_light, radius=0.1)], size=SIZE, light_samples=9, samples=1)
    hard = trace(built, size=SIZE, samples=1)
    ground = hard.node == 0
    largest = np.abs(hard.position[..., [0, 2]]).max(axis=-1)
    half_penumbra = 0.1 * 4 / (10 - 4)  # radius * gap / (height - gap)
    clear = ground & (np.abs(largest - 5 / 3) > half_penumbra + 1e-3)
    np.testing.assert_array_equal(soft.visibility[0][clear], hard.visibility[0][clear])
    assert ((soft.visibility[0][ground] > 0) & (soft.visibility[0][ground] < 1)).any()


def test_samples_are_averaged():
    built = builtin.wall().scene
    hard, smooth = trace(built, size=(64, 36), samples=1), trace(built, size=(64, 36), samples=9)
    fine = trace(built, size=(192, 108), samples=1).visibility[0].reshape(36, 3, 64, 3)
    with np.errstate(invalid="ignore"):
        mean = np.nansum(fine, axis=(1, 3)) / np.isfinite(fine).sum(axis=(1, 3))
    np.testing.assert_allclose(smooth.visibility[0], mean, atol=1e-6)
    np.testing.assert_array_equal(smooth.triangle, hard.triangle)
    np.testing.assert_allclose(smooth.alpha, np.isfinite(fine).mean(axis=(1, 3)), atol=1e-6)
    assert (smooth.samples, hard.samples) == (9, 1)


def test_near_edge_measures_in_the_light_plane():
    elevation, height = 30.0, 2.0
    built = builtin.wall(elevation, height).scene
    truth = trace(built, size=SIZE, samples=1)
    x, z = truth.position[..., 0], truth.position[..., 2]
    ground = (truth.node == 0) & (np.abs(z) < 1.5) & (x < -0.5)
    distance = np.abs(x + height / np.tan(np.radians(elevation))) * np.sin(np.radians(elevation))
    near = truth.near_edge(0, 0.2, ground)
    assert not near[~ground].any()
    assert near[ground & (distance < 0.2 * 0.999)].all()  # two of the 16 directions are straight across
    assert not near[ground & (distance > 0.2 * 1.001)].any()
    per_pixel = truth.near_edge(0, np.where(z > 0, 0.2, 0.0), ground)
    np.testing.assert_array_equal(per_pixel, near & (z > 0))


def test_near_edge_on_a_curved_body_finds_no_boundary():
    truth = trace(builtin.ball().scene, size=SIZE, samples=1)
    lit = truth.cosine[0] > 0.3
    assert lit.sum() > 1000
    assert not truth.near_edge(0, 0.05, lit).any()  # put back on the sphere, not left on the tangent plane


def test_near_edge_in_a_bowl_finds_no_boundary():
    positions, triangles = shapes.icosphere(5, 1.0)
    lower = positions[triangles].mean(axis=1)[:, 1] < -0.3
    bowl = Scene((Node(Mesh(positions, triangles[lower]), np.eye(4), "bowl"),))
    truth = trace(bowl, PerspectiveCamera((0.0, 1.5, 0.01), (0, -1, 0), fov_y=60), [DOWN], SIZE, samples=1)
    inside = (truth.triangle >= 0) & (truth.position[..., 1] < -0.45)
    assert inside.sum() > 1000
    assert (truth.visibility[0][inside] == 1.0).all()
    # The plane of each triangle lies under the bowl: points left there would be in its shadow.
    assert not truth.near_edge(0, 0.1, inside).any()


def test_near_foot():
    truth = trace(builtin.wall().scene, size=SIZE, samples=1)
    x, z = truth.position[..., 0], truth.position[..., 2]
    ground = (truth.node == 0) & (np.abs(z) < 1.5)
    foot = truth.near_foot(0.3, ground)
    np.testing.assert_array_equal(foot[ground], np.abs(x[ground]) < 0.3)


def test_bodies():
    truth = trace(builtin.courtyard(), size=SIZE, samples=1)
    seen = np.unique(truth.body[truth.triangle >= 0])
    ground, columns_and_capitals, torus, sphere, fence, ramp = 1, 2 * 24, 1, 1, 60, 1
    assert truth.rays.body.max() + 1 == ground + columns_and_capitals + torus + sphere + fence + ramp
    assert len(seen) > 50
    assert (truth.body[truth.triangle < 0] == -1).all()


def test_equal_vertices_stay_equal_in_the_world():
    rng = np.random.default_rng(1)
    positions = rng.normal(size=(1001, 3))
    both = world_positions(np.concatenate([positions, positions[::-1]]), rng.normal(size=(4, 4)), rng.normal(size=3))
    np.testing.assert_array_equal(both[:1001], both[1001:][::-1])


def test_reference_can_be_pickled():
    scene = builtin.wall().scene
    truth = trace(scene, size=(32, 18), samples=1)
    again = pickle.loads(pickle.dumps(truth))
    where = again.cosine[0] > 0
    np.testing.assert_array_equal(again.near_edge(0, 0.5, where), truth.near_edge(0, 0.5, where))


def test_missing_embreex_names_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    with pytest.raises(ReferenceUnavailable, match=r"pip install 'glshadow\[reference\]'"):
        trace(builtin.plane().scene, size=(8, 8), samples=1)


@pytest.mark.parametrize(
    "bad", [{"size": (0, 4)}, {"size": (4, 2.5)}, {"samples": 0}, {"samples": 5}, {"light_samples": True}]
)
def test_bad_counts_are_refused(bad):
    with pytest.raises(SettingsError, match=r"integers? in \[1, "):
        trace(builtin.plane().scene, **bad)
