"""Grids of triangle lists, the bound below which a distance is rounding, facets, and the settings of Exact()."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.spaces import Array, transform
from glshadow.core.spelling import parse
from glshadow.derive.lists import (
    CELLS,
    LEAST_CELLS,
    MOST_DOUBLINGS,
    RATIO,
    ListGrid,
    distance_bound,
    doublings,
    facets,
    list_grid,
)
from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.shadows.bias import NoBias, ReceiverPlaneBias
from glshadow.shadows.filters import FILTERS, Exact
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, Shadow

from ..tolerances import RTOL_FLOAT64, UNIT

SUN = DirectionalLight(direction=(-0.5, -0.8, 0.3))
ABOVE = (0.3, 9.0, 0.4)
SPOT = SpotLight(position=ABOVE, direction=(0.0, -1.0, 0.1), outer_angle=40.0)
BULB = PointLight(position=ABOVE)


@pytest.fixture
def casters(rng: np.random.Generator) -> Array:
    """Points in a flat box of 3 x 1 x 2 about the origin."""
    return rng.uniform(-1.0, 1.0, (200, 3)) * np.array([1.5, 0.5, 1.0])


def cells_of(grid: ListGrid, points: Array) -> Array:
    """Fine cells (N, 2), not rounded, of world points in front of the light."""
    local = transform(grid.view_from_world, points)
    place = local[:, :2] if grid.projection == "orthographic" else local[:, :2] / -local[:, 2:]
    x, y, z, w = grid.cells_from_window
    return place * np.array([x, y]) + np.array([z, w])


# -- list_grid


@pytest.mark.parametrize("light", [SUN, SPOT, BULB, DirectionalLight(direction=(0.0, -1.0, 0.0))])
def test_window_fits_the_casters_tightly(light: Light, casters: Array) -> None:
    grid = list_grid(light, casters)
    cells = cells_of(grid, casters)
    assert ((cells > 0.0) & (cells < grid.cells)).all()
    # 0.05 % larger than its content: a quarter of a cell in all of 512, and not rotated the wrong way
    np.testing.assert_allclose(np.ptp(cells, axis=0), grid.cells, rtol=1e-3)


@pytest.mark.parametrize(
    ("light", "kind", "faces"),
    [
        (SUN, "orthographic", 1),
        (SPOT, "perspective", 1),
        (BULB, "perspective", 1),  # far from all casters: one grid suffices
        (PointLight(position=(0.1, 0.2, -0.1)), "cube", 6),  # among them
        (PointLight(position=(0.0, 0.6, 0.0)), "cube", 6),  # so near that they surround it
        (PointLight(position=(1e4, 0.0, 0.0)), "perspective", 1),
    ],
)
def test_kinds(casters: Array, light: Light, kind: str, faces: int) -> None:
    grid = list_grid(light, casters)
    assert (grid.projection, grid.faces) == (kind, faces)
    assert grid.cells == CELLS[kind]  # type: ignore[index]


@pytest.mark.parametrize("light", [SUN, SPOT, BULB, PointLight(position=(0.1, 0.2, -0.1))])
def test_views_are_rigid_and_start_at_the_light(light: Light, casters: Array) -> None:
    grid = list_grid(light, casters)
    axes = grid.view_from_world[:3, :3]
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=RTOL_FLOAT64)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    if isinstance(light, DirectionalLight):
        np.testing.assert_allclose(axes[2], -np.asarray(light.direction), atol=RTOL_FLOAT64)
        assert np.abs(transform(grid.view_from_world, casters)).max() < 4.0  # about the centre: coordinates stay small
    else:
        np.testing.assert_allclose(transform(grid.view_from_world, light.position), 0.0, atol=RTOL_FLOAT64)


def test_six_faces_have_world_axes_and_a_right_angle(casters: Array) -> None:
    grid = list_grid(PointLight(position=(0.1, 0.2, -0.1)), casters)
    np.testing.assert_array_equal(grid.view_from_world[:3, :3], np.eye(3))
    assert grid.window == (-1.0, 1.0, -1.0, 1.0)
    assert grid.cells_from_window == (grid.cells / 2, grid.cells / 2, grid.cells / 2, grid.cells / 2)


def test_spot_window_ends_at_its_cone(casters: Array) -> None:
    narrow = SpotLight(position=ABOVE, direction=(0.0, -1.0, 0.1), inner_angle=0.0, outer_angle=3.0)
    edge = float(np.tan(np.radians(3.0)))
    grid = list_grid(narrow, casters)
    assert max(np.abs(grid.window)) <= 1.001 * edge
    # all of the cone's casters are still inside
    local = transform(grid.view_from_world, casters)
    tangent = np.hypot(*(local[:, :2] / -local[:, 2:]).T)
    assert (tangent < edge).any()
    cells = cells_of(grid, casters[tangent < edge])
    assert ((cells >= 0.0) & (cells <= grid.cells)).all()


def test_cone_partly_without_casters(casters: Array) -> None:
    aside = SpotLight(position=ABOVE, direction=(0.35, -1.0, 0.0), outer_angle=20.0)
    grid = list_grid(aside, casters)
    local = transform(grid.view_from_world, casters)
    inside = np.hypot(*(local[:, :2] / -local[:, 2:]).T) < np.tan(np.radians(20.0))
    assert inside.any()
    assert not inside.all()
    cells = cells_of(grid, casters[inside])
    assert ((cells >= 0.0) & (cells <= grid.cells)).all()


def test_cone_without_casters(casters: Array) -> None:
    away = SpotLight(position=ABOVE, direction=(1.0, 0.3, 0.0), outer_angle=30.0)
    edge = float(np.tan(np.radians(30.0)))
    np.testing.assert_allclose(list_grid(away, casters).window, (-edge, edge, -edge, edge))


def test_spot_among_its_casters_uses_its_whole_cone(casters: Array) -> None:
    within = SpotLight(position=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0), outer_angle=45.0)
    grid = list_grid(within, casters)
    np.testing.assert_allclose(grid.window, (-1.0, 1.0, -1.0, 1.0))
    assert grid.faces == 1


@pytest.mark.parametrize("light", [SUN, SPOT, BULB, PointLight(position=(0.0, 0.0, 0.0))])
def test_halvings(light: Light, casters: Array) -> None:
    usual = list_grid(light, casters)
    halved = list_grid(light, casters, halvings=2)
    assert halved.cells == usual.cells // 4
    assert (halved.window, halved.projection) == (usual.window, usual.projection)
    assert LEAST_CELLS % RATIO == 0
    assert usual.cells % RATIO == 0


def test_cells_double_with_the_number_of_balls() -> None:
    assert [doublings(count, 1e-4) for count in (0, 1, 50_000, 262_144, 1_000_000, 10**9)] == [
        0,
        0,
        0,
        1,
        2,
        MOST_DOUBLINGS,
    ]
    # 512 cells along a side: a ball of eight cells is not divided further
    assert [doublings(1_000_000, cells / 512.0) for cells in (1.0, 1.9, 3.9, 4.1, 9.0)] == [2, 2, 1, 0, 0]
    casters = np.random.default_rng(1).uniform(-1.0, 1.0, (8, 3))
    assert list_grid(SUN, casters, halvings=-2).cells == 4 * CELLS["orthographic"]


@pytest.mark.parametrize("light", [SUN, SPOT, BULB])
@pytest.mark.parametrize(
    "points", [[[0.0, 0.0, 0.0]], [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[1e9, 0.0, 0.0], [1e9, 1.0, 0.0]]]
)
def test_casters_without_extent_have_a_window(light: Light, points: list[list[float]]) -> None:
    grid = list_grid(light, np.array(points))
    left, right, bottom, top = grid.window
    assert left < right
    assert bottom < top
    assert np.isfinite(grid.cells_from_window).all()


def test_grid_is_invariant_to_translation(casters: Array) -> None:
    near = list_grid(SUN, casters)
    far = list_grid(SUN, casters + np.array([1e6, -2e6, 5e5]))
    np.testing.assert_allclose(far.window, near.window, rtol=1e-6)


# -- distance_bound


def test_bound_is_linear_in_its_lengths() -> None:
    root = np.sqrt(3.0)
    assert distance_bound(1.0, 0.0)[0] == pytest.approx(2.0 * root * UNIT)
    assert distance_bound(0.0, 1.0)[0] == pytest.approx(3.0 * root * UNIT)
    assert distance_bound(3.0, 5.0)[0] == pytest.approx(6.0 * root * UNIT + 15.0 * root * UNIT)
    assert distance_bound(3.0, 5.0)[1] == distance_bound(0.0, 0.0)[1] == 6.0 * UNIT


@pytest.mark.parametrize("offset", [0.0, 10.0, 300.0])
def test_coplanar_points_are_within_the_bound(rng: np.random.Generator, offset: float) -> None:
    """Pairs of triangles of one plane in float32, as lists.comp and exact.glsl round them; the bound is needed: half is reached."""
    count = 20_000
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    shift = offset * axes[:, 0] + rng.normal(size=(count, 3))
    flat = rng.uniform(-1.0, 1.0, (count, 2, 3, 2))
    world = (shift[:, None, None] + np.einsum("ntcj,nji->ntci", flat, axes[:, 1:])).astype(np.float32)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0].astype(np.float32).astype(np.float64)
    local = (world.astype(np.float64) @ frame.T).astype(np.float32)
    both = [corners.reshape(-1, 3, 3).astype(np.float64) for corners in (local, world)]
    normals = facets(*both, frame)[:, :, 3].reshape(count, 2, 3).astype(np.float32)
    # a point of the first triangle, projected to its plane in float32, seen from the second
    weights = rng.dirichlet(np.ones(3), count)
    point = np.einsum("nc,nci->ni", weights, local[:, 0].astype(np.float64)).astype(np.float32)
    point = point - normals[:, 0] * _dot(normals[:, 0], point - local[:, 0, 0])[:, None]
    gap = _dot(normals[:, 1], point - local[:, 1, 0])
    a, b = distance_bound(float(np.abs(world).max()), float(np.abs(local).max()))
    reach = np.abs(point - local[:, 0, 0]).sum(axis=1) + np.abs(point - local[:, 1, 0]).sum(axis=1)
    thick = (
        np.linalg.norm(np.cross(local[:, :, 1] - local[:, :, 0], local[:, :, 2] - local[:, :, 0]), axis=2).min(axis=1)
        > 0.2
    )
    inside = _inside(point, local[:, 1], normals[:, 1])  # outside a triangle the tilt of its plane counts for more
    share = np.abs(gap) / (a + b * reach)
    assert (share[thick & inside] <= 1.0).all()
    assert share[thick & inside].max() > 0.02


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=1, dtype=np.float32))


def _inside(points: Array, corners: Array, normals: Array) -> Array:
    """Whether points of a triangle's plane lie inside it."""
    signs = [
        np.einsum("ni,ni->n", np.cross(corners[:, (k + 1) % 3] - corners[:, k], points - corners[:, k]), normals)
        for k in range(3)
    ]
    return np.asarray(np.min(signs, axis=0) >= 0.0)


# -- facets


def test_facets_are_corners_and_unit_normals(rng: np.random.Generator) -> None:
    corners = rng.normal(size=(50, 3, 3))
    made = facets(corners, corners, np.eye(3))
    np.testing.assert_array_equal(made[:, :, :3], corners)
    normal = made[:, :, 3]
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=RTOL_FLOAT64)
    for k in range(3):
        side = corners[:, (k + 1) % 3] - corners[:, k]
        np.testing.assert_allclose(np.einsum("ij,ij->i", normal, side), 0.0, atol=1e-12)
    assert (
        np.einsum("ij,ij->i", normal, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])) > 0.0
    ).all()


def test_degenerate_facet_has_no_normal() -> None:
    corners = np.array([[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]])
    made = facets(corners, corners, np.eye(3))
    np.testing.assert_array_equal(made[0, :, 3], 0.0)


# -- settings


@pytest.mark.parametrize("samples", [1, 16, "4"])
def test_exact_refuses_samples_and_names_the_new_setting(samples: object) -> None:
    with pytest.raises(SettingsError, match=rf"Exact takes no samples, got {samples!r}; .*samples=16.*--samples 16"):
        Exact(samples)
    with pytest.raises(
        SettingsError,
        match=r"'16' is not understood; it is written exact\[:light_samples=N,dither,interpolate\]; .*--samples 16",
    ):
        parse("exact:16", FILTERS)


def test_exact_is_a_setting() -> None:
    shadow = Shadow(filter=Exact(), faces=Faces.BOTH, strength=0.5)
    assert shadow.filter == Exact()
    assert hash(shadow) == hash(Shadow(filter=Exact(), faces=Faces.BOTH, strength=0.5))
    assert Exact().radius == 0
    assert repr(Exact()) == "Exact()"


@pytest.mark.parametrize(
    "settings", [{"bias": NoBias()}, {"bias": ReceiverPlaneBias()}, {"target": Target.DEPTH24}, {"target": Target.R32F}]
)
def test_exact_has_no_bias_and_no_target(settings: dict[str, object]) -> None:
    with pytest.raises(
        SettingsError, match=r"Exact\(\) tests triangles, not stored depths: leave bias and target at None"
    ) as caught:
        Shadow(filter=Exact(), **settings)  # type: ignore[arg-type]
    value = next(iter(settings.values()))
    assert (value.value if isinstance(value, Target) else repr(value)) in str(caught.value)
