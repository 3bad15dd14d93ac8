"""Built-in scenes: the courtyard's geometry against trimesh's, and the closed forms of the analytic scenes."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glshadow import scenes as builtin
from glshadow.core.cameras import PerspectiveCamera
from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight
from glshadow.scenes import shapes

MODELS = Path(os.environ.get("GLSHADOW_MODELS", Path(__file__).parents[3] / "shared" / "models"))
BENCH = MODELS.parent / "bench" / "courtyard.py"


def sorted_triangles(corners):
    """Triangles (T, 3, 3) in an order that is independent of vertex order (but not of winding); rounded only to compare."""
    key = corners.round(9) + 0.0
    first = np.lexsort(key.reshape(-1, 3).T[::-1])
    rank = np.zeros(len(first), dtype=np.int64)
    rank[first] = np.arange(len(first))
    rank = rank.reshape(-1, 3)
    same = (key[:, :, None] == key[:, None, :]).all(-1)
    rank = np.where(same, rank[:, None, :], len(first)).min(axis=2)  # equal corners have equal ranks
    start = rank.argmin(axis=1)
    turned = np.stack([corners[np.arange(len(corners)), (start + k) % 3] for k in range(3)], axis=1)
    flat = turned.reshape(len(turned), 9)
    return flat[np.lexsort((flat.round(9) + 0.0).T[::-1])]


def assert_same_triangles(ours, theirs):
    assert ours.shape == theirs.shape
    # 1e-12: float64 rounding of coordinates up to 12, with the sums in another order
    np.testing.assert_allclose(sorted_triangles(ours), sorted_triangles(theirs), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (shapes.box((3.0, 0.05, 2.0)), lambda: trimesh.creation.box(extents=(3.0, 0.05, 2.0))),
        (shapes.cylinder(0.25, 2.5, 48), lambda: trimesh.creation.cylinder(radius=0.25, height=2.5, sections=48)),
        (shapes.torus(1.0, 0.3, 32, 16), lambda: trimesh.creation.torus(1.0, 0.3, 32, 16)),
        (shapes.icosphere(3, 0.6), lambda: trimesh.creation.icosphere(subdivisions=3, radius=0.6)),
    ],
    ids=["box", "cylinder", "torus", "icosphere"],
)
def test_solids_equal_those_of_trimesh(ours, theirs):
    positions, triangles = ours
    assert_same_triangles(positions[triangles], np.asarray(theirs().triangles))


def test_courtyard_equals_the_benchmark_scene():
    if not BENCH.exists():
        pytest.skip(f"optional: {BENCH} is not here")
    spec = importlib.util.spec_from_file_location("bench_courtyard", BENCH)
    bench = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bench)
    scene = builtin.courtyard()
    parts = bench.build()
    assert [node.name for node in scene.nodes] == list(parts)
    for node in scene.nodes:
        assert_same_triangles(node.mesh.positions[node.mesh.triangles], np.asarray(parts[node.name].triangles))


def test_courtyard_facts():
    scene = builtin.courtyard()
    assert sum(len(node.mesh.triangles) for node in scene.nodes) == 91_656
    assert scene.camera == PerspectiveCamera(position=(9, 6, 11), target=(0, 1, 0), fov_y=50)
    assert scene.lights == (DirectionalLight(direction=(-0.55, -0.8, -0.25), intensity=0.8),)
    assert {node.name for node in scene.nodes if node.mesh.normals is not None} == {"torus", "sphere"}
    assert all(node.mesh.closed for node in scene.nodes)
    sphere = next(node for node in scene.nodes if node.name == "sphere").mesh
    radial = (sphere.positions - (1.5, 0.6, 3.0)) / 0.6
    np.testing.assert_allclose(sphere.normals, radial, atol=2e-3)  # angle weights on facets of 0.03 rad


def test_courtyard_needs_neither_trimesh_nor_scipy():
    code = (
        "import sys; from glshadow import scenes; scenes.courtyard();"
        "sys.exit('heavy' if {'trimesh', 'scipy', 'embreex'} & set(sys.modules) else 0)"
    )
    root = Path(__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], cwd=root, check=False).returncode == 0


ON_GROUND = [
    # scene, ground points with their answer, from the closed forms of each docstring
    (builtin.wall(30.0), [(-3.46, 1, 0), (-3.47, 1, 1), (-0.01, 1, 0), (0.01, 1, 1), (-1.0, 1, 0)]),
    (builtin.wall(0.1), [(-1145.9, 1, 0), (-1146.0, 1, 1)]),
    (builtin.sphere(10.0), [(-17.01 - 5.75, 0, 0), (-17.01 - 5.77, 0, 1), (-17.01 + 5.75, 0, 0), (-17.01, 0.99, 0)]),
    (builtin.sphere(90.0), [(0.999, 0, 0), (1.001, 0, 1)]),
    (builtin.sphere(height=6.0, lamp_height=10.0), [(2.581, 0, 0), (2.583, 0, 1), (0, -2.581, 0)]),
    (builtin.plates(gap=4.0, lamp_height=10.0), [(1.666, 1.666, 0), (1.667, 0, 1), (0, -1.666, 0)]),
    (builtin.plates(gap=0.1, elevation=45.0), [(-1.099, 0, 0), (-1.101, 0, 1), (0.899, 0, 0), (0.901, 0, 1)]),
    (builtin.plates(gap=0.0), [(0.0, 0.0, 1), (0.5, 0.5, 1)]),
    (builtin.box(45.0, 0.0), [(-2.49, 0, 0), (-2.51, 0, 1), (0.51, 0, 1), (-0.6, 0.74, 0), (-0.6, 0.76, 1)]),
    (builtin.plane(0.01), [(0.0, 0.0, 1), (4.9, -4.9, 1)]),
]


@pytest.mark.parametrize(("built", "points"), ON_GROUND)
def test_closed_forms_on_the_ground(built, points):
    ground = np.array([(x, 0.0, z) for x, z, _ in points])
    np.testing.assert_array_equal(built.exact(ground), [lit for *_, lit in points])


def test_sphere_light_above_unbounded_and_low_sun_are_refused():
    with pytest.raises(SettingsError, match="lamp_height"):
        builtin.sphere(lamp_height=2.0)
    with pytest.raises(SettingsError, match="elevation"):
        builtin.wall(elevation=0.0)
