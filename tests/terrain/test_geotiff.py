"""Elevation models as files, scenes and rasters: places, units and holes survive, and what is refused is named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import rasterio

import glshadow as gs
from tests.terrain.test_horizon import NORTH_UP, hills, light

HEIGHTS = np.array([[1.0, 2.0, 4.0], [3.0, 5.0, 8.0], [0.0, 1.0, 1.5], [2.0, 2.5, 9.0]])


def write(path: Path, heights: np.ndarray, crs: str | None = "EPSG:32632", **settings: object) -> Path:
    """A GeoTIFF as others write it."""
    given = {"dtype": heights.dtype, "transform": rasterio.Affine(*NORTH_UP), **settings}
    with rasterio.open(
        path, "w", driver="GTiff", count=1, height=heights.shape[0], width=heights.shape[1], crs=crs, **given
    ) as file:
        file.write(heights, 1)
    return path


def test_file_gives_heights_holes_and_place(tmp_path: Path) -> None:
    stored = HEIGHTS.astype(np.int16)
    stored[1, 2] = -9999
    dem = gs.read_dem(write(tmp_path / "a.tif", stored, nodata=-9999))
    expected = stored.astype(np.float32)
    expected[1, 2] = np.nan
    assert np.array_equal(dem.heights, expected, equal_nan=True)
    assert dem.transform == NORTH_UP
    assert dem.crs == "EPSG:32632"
    assert gs.read_dem((tmp_path / "a.tif").read_bytes()).transform == NORTH_UP


def test_feet_become_metres(tmp_path: Path) -> None:
    dem = gs.read_dem(write(tmp_path / "a.tif", HEIGHTS), factor=0.3048)
    np.testing.assert_allclose(dem.heights, 0.3048 * HEIGHTS, rtol=1e-15)


@pytest.mark.parametrize("source", ["path", "bytes", "dem"])
def test_loaded_surface_is_that_of_the_cells(tmp_path: Path, source: str) -> None:
    path = write(tmp_path / "a.tif", HEIGHTS)
    scene = gs.load({"path": path, "bytes": path.read_bytes(), "dem": gs.read_dem(path)}[source])
    mesh = scene.nodes[0].mesh
    assert mesh.count == 12
    matrix = scene.nodes[0].world_from_mesh
    placed = (mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]).reshape(4, 3, 3)
    assert placed[0, 0].tolist() == [500_015.0, 1.0, -5_299_985.0]
    assert placed[3, 2].tolist() == [500_075.0, 9.0, -5_299_895.0]
    assert np.array_equal(placed[..., 1], HEIGHTS)
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 1] > 0.0).all()  # seen from above


def test_surface_faces_up_where_rows_run_north() -> None:
    mesh = gs.load(gs.Dem(HEIGHTS, (30.0, 0.0, 0.0, 0.0, 30.0, 0.0))).nodes[0].mesh
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 1] > 0.0).all()


def test_holes_have_no_triangles() -> None:
    heights = HEIGHTS.copy()
    heights[1, 1] = np.nan
    assert gs.load(gs.Dem(heights, NORTH_UP)).nodes[0].mesh.count == 12 - 6


def test_result_is_written_where_the_model_is(tmp_path: Path, rng: np.random.Generator) -> None:
    heights = hills(rng).astype(np.float32)
    heights[5, 7] = np.nan
    dem = gs.read_dem(write(tmp_path / "a.tif", heights))
    lit = gs.terrain_shadow(tmp_path / "a.tif", light(200.0, 15.0))
    lit.save(tmp_path / "lit.tif")
    with rasterio.open(tmp_path / "lit.tif") as file:
        assert file.crs.to_epsg() == 32632
        assert tuple(file.transform)[:6] == dem.transform
        assert np.array_equal(file.read(1), lit.values[0], equal_nan=True)
        assert file.descriptions == ("lit",)
    assert np.isnan(lit.values[0][5, 7])
    horizons = gs.terrain_horizon(dem, 4)
    horizons.save(tmp_path / "horizon.tif")
    with rasterio.open(tmp_path / "horizon.tif") as file:
        assert file.descriptions == ("horizon 0", "horizon 90", "horizon 180", "horizon 270")


def test_shadow_is_that_of_rays_on_the_loaded_surface(rng: np.random.Generator) -> None:
    # Two surfaces through the same cells: triangles here, there lines from row to row. They differ at a shadow's border alone.
    dem = gs.Dem(3.0 * hills(rng, 60, 60), NORTH_UP)
    sun = light(140.0, 25.0, angle=0.0)
    lit = np.asarray(gs.terrain_shadow(dem, sun))
    scene = gs.load(dem)
    from glshadow.reference.rays import Rays

    origin = scene.bounds.mean(axis=0)
    rays = Rays(scene, origin)
    matrix = scene.nodes[0].world_from_mesh
    starts = scene.nodes[0].mesh.positions + matrix[:3, 3] - origin + np.array([0.0, 0.01, 0.0])
    aims = np.broadcast_to(-np.asarray(sun.direction), starts.shape)
    traced = rays.first_hits(starts, aims, np.full(len(starts), np.inf))[0].reshape(60, 60) < 0
    inner = np.s_[2:-2, 2:-2]
    assert 0.2 < traced[inner].mean() < 0.9
    assert (traced[inner] != (lit[inner] > 0.5)).mean() < 0.02


GEOGRAPHIC = (1e-3, 0.0, 11.5, 0.0, -1e-3, 48.2)
GOOD = gs.Dem(HEIGHTS, NORTH_UP)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gs.Dem(HEIGHTS, GEOGRAPHIC, "EPSG:4326"), "in degrees.*UTM zone 32: gdalwarp -t_srs EPSG:32632"),
        (lambda: gs.Dem(HEIGHTS, NORTH_UP, "EPSG:nothing"), "crs must be a name such as"),
        (lambda: gs.Dem(HEIGHTS[0], NORTH_UP), "heights must be numbers"),
        (lambda: gs.Dem(HEIGHTS[:1], NORTH_UP), "at least 2 x 2 cells"),
        (lambda: gs.Dem(HEIGHTS * np.nan, NORTH_UP), "no height: all 12 cells are empty"),
        (lambda: gs.Dem(np.where(HEIGHTS == 1.0, np.inf, HEIGHTS), NORTH_UP), "2 infinite heights"),
        (lambda: gs.Dem(HEIGHTS, (1.0, 0.0, 0.0, 2.0, 0.0, 0.0)), "cells have an area"),
        (lambda: gs.Dem(HEIGHTS, (1.0, 0.0)), "transform must be 6 numbers"),
        (lambda: gs.read_dem("missing.tif"), "file not found"),
        (lambda: gs.read_dem(b"II*\0 nothing"), "cannot be read as a raster"),
        (lambda: gs.load(b"II*\0 nothing"), "bytes: .* cannot be read as a raster"),
        (lambda: gs.terrain_shadow(HEIGHTS, light(90, 20)), "dem must be Dem"),
        (lambda: gs.terrain_shadow(GOOD, light(90, -20)), "20.00 degrees below the horizon"),
        (lambda: gs.terrain_shadow(GOOD, gs.PointLight(position=(0, 0, 0))), "sun must be DirectionalLight.*SunPath"),
        (lambda: gs.terrain_shadow(GOOD, light(90, 20), refraction=2.0), "refraction must be"),
        (lambda: gs.terrain_shadow(GOOD, light(90, 20), within=0.0), "within must be"),
        (lambda: gs.terrain_shadow(GOOD, light(90, 20), progress=3), "progress must be a callable"),
        (lambda: gs.terrain_horizon(GOOD, []), "azimuths must be degrees"),
        (lambda: gs.terrain_horizon(GOOD, 0), "azimuths must be"),
        (lambda: gs.terrain_horizon(GOOD, 4).save("a.png"), "must be a file that ends in .tif"),
    ],
)
def test_bad_input_is_named(call: Callable[[], object], words: str) -> None:
    with pytest.raises(gs.GlshadowError, match=words):
        call()


@pytest.mark.filterwarnings("ignore:Dataset has no geotransform")
def test_files_that_are_no_elevation_models_are_named(tmp_path: Path) -> None:
    with pytest.raises(gs.SceneError, match=r"a\.tif: .*in degrees.*gdalwarp"):
        gs.load(write(tmp_path / "a.tif", HEIGHTS, "EPSG:4326", transform=rasterio.Affine(*GEOGRAPHIC)))
    gs.image.write(tmp_path / "image.tif", np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(gs.SceneError, match="is an image, not an elevation model"):
        gs.load(tmp_path / "image.tif")
    with pytest.raises(gs.SceneError, match="there is no band 2"):
        gs.read_dem(write(tmp_path / "b.tif", HEIGHTS), band=2)


def test_hours_before_a_wall_at_the_equinox() -> None:
    # At the equator on the equinox the sun rises in the east and passes the zenith, at 15 degrees an hour. Before a wall in the east whose
    # edge is at elevation h, it is in the sky for 12 - h / 15 hours; the disc's rise over the edge counts half of its two minutes.
    heights = np.zeros((9, 120))
    heights[:, 100] = 1000.0
    path = gs.SunPath(0.0, 0.0, "2026-03-20T00:00Z", "2026-03-21T00:00Z", 1.0, refraction=False)
    hours = np.asarray(gs.terrain_shadow(gs.Dem(heights, NORTH_UP), path))[4]
    edge = np.degrees(np.arctan(1000.0 / (30.0 * np.arange(100, 0, -1))))
    # The azimuth is up to 0.2 degrees from 90, the day 12 h by a minute of time: steps of one minute.
    np.testing.assert_allclose(hours[:100], 12.0 - edge / 15.0, atol=0.03)
