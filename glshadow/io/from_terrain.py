"""Reads an elevation model, from a GeoTIFF or given, as a scene's one node."""

from __future__ import annotations

from glshadow.core.spaces import translation
from glshadow.io.imported import Imported
from glshadow.io.limits import Budget
from glshadow.io.model_file import ModelFile
from glshadow.scene.nodes import Node
from glshadow.terrain.dem import Dem
from glshadow.terrain.geotiff import read_dem
from glshadow.terrain.surface import dem_mesh, triangle_count


def read_geotiff(file: ModelFile, budget: Budget) -> Imported:
    """A GeoTIFF's first band as triangles."""
    if file.path is not None:
        budget.announce(file.path, "the file")
    return read_terrain(read_dem(file.path if file.path is not None else file.read(budget)), budget)


def read_terrain(dem: Dem, budget: Budget) -> Imported:
    """An elevation model as triangles.

    Raises
    ------
    SceneError
        If it has more triangles than the budget allows.
    """
    budget.limits.check("triangles", triangle_count(dem), f"an elevation model of {dem.heights.size:,} cells")
    return Imported([Node(dem_mesh(dem), translation(dem.place), "terrain")])
