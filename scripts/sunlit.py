"""Renders the images of docs/sun.md and docs/terrain.md: a house with its hours of sun, and a mountain with its shadow and its hours."""

from __future__ import annotations

import numpy as np
from matplotlib import cbook, colormaps
from numpy.typing import NDArray

import glshadow as gs
from scripts.pictures import MODELS, OUT

GAP = 8  # pixels between two images


def house() -> NDArray[np.uint8]:
    """Hours of sun of a year in Munich, from two sides."""
    year = gs.SunPath.of_year(48.1, 11.6, 2026, "Europe/Berlin")
    found = gs.sun_hours(gs.load(MODELS / "house_scene.glb"), year, cell=0.01, per_face=1, within=2.0)
    drawn = found.images((560, 420))
    return beside(drawn["from the south-east"], drawn["from the north-east"])


def mountain() -> NDArray[np.uint8]:
    """The Jacksboro fault: shaded, with the shadow of a December morning; and the hours of sun of that day."""
    data = cbook.get_sample_data("jacksboro_fault_dem.npz")
    dem = gs.Dem(data["elevation"], (74.39, 0, 0, 0, -92.66, 0))
    morning = gs.sun(36.5, -84.2, "2026-12-21T09:00-05:00")
    day = gs.SunPath(36.5, -84.2, "2026-12-21T00:00-05:00", "2026-12-22T00:00-05:00", 10)
    south, east = np.gradient(dem.heights, 92.66, 74.39)
    normal = np.stack([-east, np.ones(dem.heights.shape), -south], axis=-1)
    cosine = normal @ -np.array(morning.direction) / np.linalg.norm(normal, axis=-1)
    shade = 0.2 + 0.8 * np.asarray(gs.terrain_shadow(dem, morning)) * np.clip(cosine / 0.6, 0.0, 1.0)
    hours = np.asarray(gs.terrain_shadow(dem, day)) / 10.0
    parts = np.repeat(shade[..., None], 3, axis=2), colormaps["inferno"](hours)[..., :3]
    return beside(*(np.rint(255.0 * each).astype(np.uint8) for each in parts))


def beside(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Two images of one height, with a white gap."""
    gap = np.full((len(left), GAP, 3), 255, dtype=np.uint8)
    return np.concatenate([left, gap, right], axis=1)


def main() -> None:
    gs.image.write(OUT / "sun_hours.jpg", house())
    gs.image.write(OUT / "terrain.jpg", mountain())


if __name__ == "__main__":
    main()
