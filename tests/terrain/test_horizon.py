"""Horizons and lit shares of height fields against closed forms and rays in float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.terrain import horizon
from glshadow.terrain.horizon import Oriented, lit_share, ray_tangents, sweep
from glshadow.terrain.shadow import EARTH_RADIUS

NORTH_UP = (30.0, 0.0, 500_000.0, 0.0, -30.0, 5_300_000.0)
AZIMUTHS = (0.0, 33.0, 45.0, 71.0, 90.0, 123.4, 180.0, 200.0, 270.0, 291.0, 315.0, 359.0)


def hills(rng: np.random.Generator, rows: int = 90, columns: int = 70) -> NDArray[np.float64]:
    """Steep smooth hills of 400 m."""
    y, x = np.mgrid[:rows, :columns]
    waves = rng.uniform(-0.35, 0.35, (12, 2))
    phases = rng.uniform(0.0, 6.28, 12)
    found = sum(np.sin(a * x + b * y + phase) for (a, b), phase in zip(waves, phases, strict=True))
    return 60.0 * np.asarray(found)


def light(azimuth: float, elevation: float, angle: float = 0.53) -> gs.DirectionalLight:
    """The sun in the axes of a loaded elevation model."""
    a, e = np.radians([azimuth, elevation])
    aim = -np.array([np.cos(e) * np.sin(a), np.sin(e), -np.cos(e) * np.cos(a)])
    return gs.DirectionalLight(direction=tuple(aim.tolist()), angle=angle)


def ray_horizon(
    heights: NDArray[np.float64], cell: NDArray[np.float64], row: float, column: float, azimuth: float
) -> float:
    """The horizon's tangent by one ray over the bilinear surface, at every row or column that it crosses, whichever are more."""
    aim = np.array([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))])
    step = np.linalg.solve(cell, aim)  # columns, rows per metre
    length = 1.0 / np.abs(step).max()

    def height(r: float, c: float) -> float:
        r0, c0 = min(int(r), heights.shape[0] - 2), min(int(c), heights.shape[1] - 2)
        fr, fc = r - r0, c - c0
        four = heights[r0 : r0 + 2, c0 : c0 + 2]
        return float(np.array([1.0 - fr, fr]) @ four @ np.array([1.0 - fc, fc]))

    own, best, k = height(row, column), -np.inf, 1
    while True:
        r, c = row + k * length * step[1], column + k * length * step[0]
        r, c = (round(v) if abs(v - round(v)) < 1e-9 else v for v in (r, c))
        if not (0 <= r <= heights.shape[0] - 1 and 0 <= c <= heights.shape[1] - 1):
            return best
        best = max(best, (height(r, c) - own) / (k * length))
        k += 1


@pytest.mark.parametrize("azimuth", AZIMUTHS)
@pytest.mark.parametrize(
    "cell", [np.diag([30.0, -30.0]), np.array([[20.0, 11.0], [-7.0, 25.0]])], ids=["north", "turned"]
)
def test_refined_horizons_are_those_of_rays(
    azimuth: float, cell: NDArray[np.float64], rng: np.random.Generator
) -> None:
    heights = hills(rng)
    field = Oriented.of(heights, cell, azimuth)
    where = np.arange(heights.size).reshape(heights.shape)
    own = field.view(where)
    rows, columns = rng.integers(0, own.shape[0], 20), rng.integers(0, own.shape[1], 20)
    found = ray_tangents(field, rows, columns, 0.0, 0.0)
    for row, column, tangent in zip(rows, columns, found, strict=True):
        r, c = np.unravel_index(own[row, column], heights.shape)
        assert tangent == pytest.approx(ray_horizon(heights, cell, float(r), float(c), azimuth), rel=1e-9, abs=1e-9)


def test_lines_have_the_horizon_of_rays_from_between_cells(rng: np.random.Generator) -> None:
    heights, cell = hills(rng), np.diag([30.0, -30.0])
    field = Oriented.of(heights, cell, 123.4)
    own = field.view(np.arange(heights.size).reshape(heights.shape))
    checked = 0
    for row, place, before, after, share in sweep(field, 0.0, 0.0):
        column = place.start + int(rng.integers(0, place.stop - place.start))
        for tangent, shift in ((before[column - place.start], share - 1.0), (after[column - place.start], share)):
            at = column + shift
            if np.isnan(tangent) or not 0 <= at <= own.shape[1] - 1:
                continue
            near = min(int(at), own.shape[1] - 2)
            ends = [np.array(np.unravel_index(own[row, k], heights.shape)) for k in (near, near + 1)]
            r, c = ends[0] + (at - near) * (ends[1] - ends[0])
            assert tangent == pytest.approx(ray_horizon(heights, cell, r, c, 123.4), rel=1e-9, abs=1e-9)
            checked += 1
    assert checked > 100


@pytest.mark.parametrize("azimuth", AZIMUTHS)
def test_plane_has_one_horizon(azimuth: float) -> None:
    # A plane that rises along the azimuth a: its horizon is its slope times the cosine between, uphill and downhill alike.
    y, x = np.mgrid[:40, :50]
    dem = gs.Dem(30.0 * (0.3 * x - 0.2 * -y), NORTH_UP)
    found = np.asarray(gs.terrain_horizon(dem, [azimuth]))
    a = np.radians(azimuth)
    slope = 0.3 * np.sin(a) - 0.2 * np.cos(a)
    inner = found[1:-1, 1:-1]
    np.testing.assert_allclose(inner, np.degrees(np.arctan(slope)), atol=1e-5)  # float32


@pytest.mark.parametrize("elevation", [8.0, 20.0, 45.0])
def test_wall_casts_its_height_over_tangent(elevation: float) -> None:
    heights = np.zeros((9, 200))
    heights[:, 150] = 400.0
    lit = np.asarray(gs.terrain_shadow(gs.Dem(heights, NORTH_UP), light(90.0, elevation)))[4]
    distance = 30.0 * (150 - np.arange(150))
    expected = lit_share(elevation, 400.0 / distance, 0.53)
    assert lit[:150] == pytest.approx(expected, abs=1e-6)
    assert lit[150:].tolist() == [1.0] * 50
    width = 400.0 / np.tan(np.radians(elevation))
    assert abs(30.0 * (lit[:150] < 0.5).sum() - width) <= 30.0


def test_share_of_the_disc_is_that_of_a_circle_cut_by_a_line() -> None:
    assert lit_share(10.0, np.tan(np.radians([9.7, 10.0, 10.3])), 0.53).tolist() == pytest.approx([1.0, 0.5, 0.0])
    # A line at half the radius from the middle leaves 1/3 - sqrt(3) / (4 pi) of a disc beyond it.
    above = lit_share(10.0, np.tan(np.radians([10.0 + 0.53 / 4.0])), 0.53)
    assert above[0] == pytest.approx(1.0 / 3.0 - np.sqrt(3.0) / (4.0 * np.pi), abs=1e-12)


@pytest.mark.parametrize("azimuth", [90.0, 137.0, 250.0])
def test_cone_casts_the_tangents_of_its_base(azimuth: float) -> None:
    # Base radius 20 cells, height 1800 m, sun at 25 degrees: the tip's shadow lies 1800 / tan(25) = 3860 m away, beyond the base's 600 m.
    # The shadow on the plane is the base and the two tangents from that point.
    size, radius, height = 301, 600.0, 1800.0
    y, x = np.mgrid[:size, :size] - size // 2
    away = 30.0 * np.hypot(x, y)
    dem = gs.Dem(np.maximum(height * (1.0 - away / radius), 0.0), NORTH_UP)
    lit = np.asarray(gs.terrain_shadow(dem, light(azimuth, 25.0, angle=0.0)))
    a = np.radians(azimuth)
    along = -(30.0 * x * np.sin(a) + 30.0 * -y * np.cos(a))
    across = np.abs(30.0 * x * np.cos(a) - 30.0 * -y * np.sin(a))
    tip = height / np.tan(np.radians(25.0))
    half = np.arcsin(radius / tip)
    foot = radius * np.sin(half)
    dark = (along >= foot) & (across <= (tip - along) * np.tan(half))
    outside = away > radius + 45.0
    border = np.abs((tip - along) * np.sin(half) - across * np.cos(half)) < 30.0
    border |= np.hypot(along - tip, across) < 150.0  # the tip, which is a corner of cells here
    assert (lit[outside & ~border] == ~dark[outside & ~border]).all()
    assert (lit[outside] < 0.5).sum() == pytest.approx(dark[outside].sum(), rel=0.02)


def test_curvature_lowers_by_distance_squared() -> None:
    heights = np.zeros((3, 2000))
    heights[:, -1] = 3000.0
    dem = gs.Dem(heights, (100.0, 0.0, 0.0, 0.0, -100.0, 0.0))
    distance = 100.0 * np.arange(1999, 0, -1)
    for refraction in (0.0, 0.13):
        found = np.asarray(gs.terrain_horizon(dem, [90.0], curvature=True, refraction=refraction))[1, :-1]
        tip = 3000.0 / distance - distance * (1.0 - refraction) / (2.0 * EARTH_RADIUS)
        near = -100.0 * (1.0 - refraction) / (2.0 * EARTH_RADIUS)  # the next cell of the flat
        np.testing.assert_allclose(found, np.degrees(np.arctan(np.maximum(tip, near))), rtol=1e-6, atol=1e-6)


def test_receivers_above_the_ground_see_over_low_walls() -> None:
    heights = np.zeros((5, 50))
    heights[:, 40] = 10.0
    dem = gs.Dem(heights, NORTH_UP)
    found = np.asarray(gs.terrain_horizon(dem, [90.0], above=4.0))[2, :40]
    assert found == pytest.approx(np.degrees(np.arctan(6.0 / (30.0 * np.arange(40, 0, -1)))), abs=1e-5)


def test_unrefined_borders_differ_within_a_cell(rng: np.random.Generator) -> None:
    dem = gs.Dem(3.0 * hills(rng, 200, 200), NORTH_UP)
    sun = light(123.4, 20.0)
    fine, quick = (np.asarray(gs.terrain_shadow(dem, sun, refine=each)) for each in (True, False))
    differ = np.abs(fine - quick) > 0.5
    assert 0 < differ.mean() < 0.03
    dark = fine < 0.5
    grown = np.zeros_like(dark)
    shrunk = np.ones_like(dark)
    for rows in (-1, 0, 1):
        for columns in (-1, 0, 1):
            moved = np.roll(dark, (rows, columns), (0, 1))
            grown |= moved
            shrunk &= moved
    assert (grown & ~shrunk)[differ].mean() > 0.97


@pytest.mark.parametrize("azimuth", AZIMUTHS)
def test_strips_and_deep_hulls_change_nothing(
    azimuth: float, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    dem = gs.Dem(3.0 * hills(rng), NORTH_UP)
    whole = np.asarray(gs.terrain_horizon(dem, [azimuth]))
    monkeypatch.setattr(horizon, "STRIP", 7)
    monkeypatch.setattr(horizon, "_FIRST_DEPTH", 1)
    assert np.array_equal(np.asarray(gs.terrain_horizon(dem, [azimuth])), whole, equal_nan=True)


def test_holes_cast_no_shadow_and_have_no_value() -> None:
    heights = np.zeros((20, 60))
    heights[:, 50] = 100.0
    heights[8:12, 50] = np.nan
    heights[4:6, 10:12] = np.nan
    lit = np.asarray(gs.terrain_shadow(gs.Dem(heights, NORTH_UP), light(90.0, 20.0, angle=0.0)))
    assert (np.isnan(lit) == np.isnan(heights)).all()
    assert lit[2, 45] == 0.0
    assert lit[10, 45] == 1.0
    masked = np.ma.masked_invalid(heights)
    again = np.asarray(gs.terrain_shadow(gs.Dem(masked, NORTH_UP), light(90.0, 20.0, angle=0.0)))
    assert np.array_equal(lit, again, equal_nan=True)


@pytest.mark.parametrize(("scale", "shift"), [(1e-6, 0.0), (1.0, 1e7)])
def test_units_and_place_do_not_matter(scale: float, shift: float, rng: np.random.Generator) -> None:
    heights, sun = hills(rng), light(211.0, 20.0)
    plain = np.asarray(gs.terrain_shadow(gs.Dem(heights, NORTH_UP), sun))
    a, b, c, d, e, f = NORTH_UP
    moved = gs.Dem(scale * heights + shift, (scale * a, b, scale * c + shift, d, scale * e, scale * f - shift))
    np.testing.assert_allclose(np.asarray(gs.terrain_shadow(moved, sun)), plain, atol=1e-5)


@pytest.mark.parametrize("azimuth", [-90.0, 0.0, 90.0, 180.0, 270.0, 360.0])
def test_cells_at_the_border_see_peaks_there_along_rows_and_columns(azimuth: float) -> None:
    """The sine or cosine of a quarter turn is no exact 0."""
    heights = np.zeros((20, 20))
    heights[[0, 0, -1, -1], [0, -1, 0, -1]] = 10.0  # at the corners
    found = gs.terrain_horizon(gs.Dem(heights, (1, 0, 0, 0, -1, 0)), [azimuth]).values[0]
    expected = np.degrees(np.arctan(10.0))
    east, north = round(np.sin(np.radians(azimuth))), round(np.cos(np.radians(azimuth)))
    for row in (0, -1) if east else (1 if north > 0 else -2,):
        for column in (-2 if east > 0 else 1,) if east else (0, -1):
            assert found[row, column] == pytest.approx(expected, abs=1e-3), (row, column)
