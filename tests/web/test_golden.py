"""The exported page in a real browser stores the values that the real Babylon.js stored at the same points with the same matrices."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, project, translation
from glshadow.gl.passes.caster import metric_uniform
from glshadow.shadows.metric import unpack

from ..golden.babylon import F32_TOLERANCE, PACKING_TOLERANCE, Reading, load_readings
from .browser import pixels_of

LIGHTS: dict[str, gs.Light] = {
    "directional": gs.DirectionalLight(),
    "spot": gs.SpotLight(position=(7, 9, 6), direction=(-7, -9, -6)),
    "point": gs.PointLight(position=(1, 6, 2)),
}
ZOOM = 1e4  # size of the window around a texel: the whole of its view
PAGE = F32_TOLERANCE  # a reading's tolerance is Babylon.js's own rounding; the page's 32-bit matrices round as much
HALF = 5e-4  # world units: covers the centre of that window


@pytest.fixture(scope="module")
def readings() -> list[Reading]:
    return load_readings()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "target"), [*((kind, "packed") for kind in LIGHTS), ("directional", "unorm8")])
def test_page_stores_the_values_of_babylon(
    browser: Callable[[Path, str], str], readings: list[Reading], tmp_path: Path, kind: str, target: str
) -> None:
    chosen = [r for r in readings if r.config.kind == kind and r.config.filter == "none" and r.read_metric is not None]
    assert len(chosen) >= 20
    assert {r.config.clip.reversed for r in chosen} == {False, True}
    path = gs.export_page(gs.scenes.courtyard(), tmp_path / "page", lights=[LIGHTS[kind]], target=target)
    _add_readings(path, chosen)
    stored = pixels_of(browser(path, "test16x16"), "map", len(chosen))[0] / 255.0
    metrics = unpack(stored) if target == "packed" else stored[:, 0]
    within = 0
    for reading, metric in zip(chosen, metrics, strict=True):
        assert reading.read_metric is not None
        wanted = min(reading.read_metric, 1.0)  # Babylon's float targets hold what is beyond far; ours is clamped
        step = PACKING_TOLERANCE - F32_TOLERANCE if target == "packed" else 0.5 / 255.0
        assert abs(metric - wanted) <= step + PAGE + reading.tolerance(wanted), f"{reading.config.name} {reading.texel}"
        within += 0.0 < metric < 1.0
    assert within >= 0.8 * len(chosen)


def _add_readings(path: Path, readings: list[Reading]) -> None:
    """Make an exported page draw the readings' points, each with its light's matrices, into a texel of its own."""
    page = path.read_text()
    found = re.search(r"const scene = (\{.*\});\n", page)
    assert found
    scene = json.loads(found[1])
    corners, views = [], []
    # Each at a place of its own, so that no view shows another's; its light moves along.
    places = np.random.default_rng(20260101).uniform(-1.0, 1.0, (len(readings), 3))
    for number, (reading, place) in enumerate(zip(readings, places, strict=True)):
        corners.append(_square(place, reading.plane_normal))
        view = reading.config.view[reading.face] @ translation(reading.world_point - place)
        clip = reading.config.projection[reading.face] @ view
        x, y, _, w = project(clip, place)
        zoom = np.eye(4)
        zoom[:2, :2] *= ZOOM
        zoom[:2, 3] = (-ZOOM * x / w, -ZOOM * y / w)
        views.append(
            {
                "tile": [number, 0],
                "resolution": 1,
                "clip": (zoom @ clip).T.ravel().tolist(),
                "view": view.T.ravel().tolist(),
                "metric": list(metric_uniform(reading.config.shadow_view, reading.config.bias)),
            }
        )
    triangles = np.concatenate(corners).astype("<f4")
    scene["geometry"] = scene["normals"] = base64.b64encode(triangles.tobytes()).decode()
    scene["nodes"] = [{"first": 0, "count": len(triangles), "color": [1, 1, 1], "casts": True}]
    scene["map"] = {"size": [len(readings), 1], "views": views}
    path.write_text(page[: found.start(1)] + json.dumps(scene) + page[found.end(1) :])


def _square(point: Array, normal: Array) -> Array:
    """Two triangles (6, 3) in a plane."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    a, b, c, d = (point + HALF * (i * u + j * v) for i, j in ((-1, -1), (1, -1), (-1, 1), (1, 1)))
    return np.array([a, b, c, c, b, d])
