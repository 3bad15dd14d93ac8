"""The two cases in which any shadow at all is an artefact: an empty plane at grazing light, and a single convex body.

Every pixel with N.L > 0 for the geometric normal is tested, and not one may be darkened.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glshadow import scenes as builtin
from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.spaces import Array
from glshadow.frame import Frame
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.shadows.filters import Filter, Hard
from glshadow.shadows.shadow import Shadow

from ..pairwise import every_pair
from ..tolerances import WEIGHT

SIZE = (320, 240)
KINDS = ("directional", "spot", "point")
DEFAULT = Shadow().filter
PLANE_VIEWS = {
    "built-in": None,
    "top": PerspectiveCamera((0.0, 12.0, 0.001), (0.0, 0.0, 0.0)),
    "grazing": PerspectiveCamera((0.3, 0.15, 7.0), (0.0, 0.0, 0.0)),
    "grazing across": PerspectiveCamera((7.0, 0.4, 0.3), (0.0, 0.0, 0.0)),
}
BALL_VIEWS = {
    "built-in": None,
    "top": PerspectiveCamera((0.2, 3.0, 0.1), (0.0, 0.0, 0.0)),
    "close": PerspectiveCamera((-0.8, 0.5, 1.0), (0.0, 0.0, 0.0)),
}


@pytest.fixture(scope="module")
def plane() -> Scene:
    return builtin.plane().scene


@pytest.fixture(scope="module")
def ball() -> Scene:
    """With flat facets: a smooth mesh is lit by its smooth normal."""
    scene = builtin.ball().scene
    (node,) = scene.nodes
    return replace(scene, nodes=(replace(node, mesh=replace(node.mesh, normals=None)),))


def lights(towards: Array, distance: float, resolution: int, kernel: Filter) -> dict[str, Light]:
    """The three kinds of light, seen from the origin in direction `towards`."""
    shadow = Shadow(resolution=resolution, filter=kernel)
    position, direction = tuple(distance * towards), tuple(-towards)
    return {
        "directional": DirectionalLight(direction=direction, shadow=shadow),
        "spot": SpotLight(position=position, direction=direction, outer_angle=25, shadow=shadow),
        "point": PointLight(position=position, shadow=shadow),
    }


def positions(frame: Frame) -> tuple[Array, Array]:
    """World points (H, W, 3), and which pixels show a surface."""
    hit = np.isfinite(frame.depth)
    depth = np.where(hit, frame.depth, 0.0).astype(np.float64)
    return np.asarray(frame.camera.position) + pixel_rays(frame.camera, frame.size) * depth[..., None], hit


def assert_lit(frame: Frame, counted: Array) -> None:
    dark = counted & ~(frame.visibility[0] >= 1.0 - WEIGHT)
    assert not dark.any(), (
        f"{dark.sum()} of {counted.sum()} pixels darkened, worst {frame.visibility[0][dark].min():.3f}"
    )


@every_pair(
    kind=KINDS,
    kernel=(DEFAULT, Hard()),
    resolution=(2048, 512),
    theta=(0.0, 45.0, 80.0, 89.0, 89.9, 89.99),
    view=list(PLANE_VIEWS),
)
def test_empty_plane(
    renderer: Renderer, plane: Scene, kind: str, kernel: Filter, resolution: int, theta: float, view: str
) -> None:
    """N6: completely lit, however low the light."""
    e = np.radians(90.0 - theta)
    towards = np.array([0.8 * np.cos(e), np.sin(e), 0.6 * np.cos(e)])
    light = lights(towards, 40.0, resolution, kernel)[kind]
    frame = renderer.render(plane, PLANE_VIEWS[view], [light], SIZE, outputs=("visibility", "depth"), samples=1)
    points, hit = positions(frame)
    points[..., 1] = 0.0
    cosine = light.to_light(points)[0][..., 1]
    counted = hit & (cosine > 0.0)
    assert counted.sum() > 4000
    assert_lit(frame, counted)


@every_pair(kernel=(DEFAULT, Hard()), kind=("spot", "point"), height=(5.0, 1.0, 0.1, 0.01))
def test_point_light_just_above_the_plane(
    renderer: Renderer, plane: Scene, kernel: Filter, kind: str, height: float
) -> None:
    """Every angle up to grazing in one image."""
    shadow = Shadow(filter=kernel)
    where = (0.0, height, 0.3)
    light: Light = PointLight(position=where, shadow=shadow)
    if kind == "spot":
        light = SpotLight(position=where, direction=(1.0, -0.3, 0.0), outer_angle=60, shadow=shadow)
    for view in PLANE_VIEWS.values():
        frame = renderer.render(plane, view, [light], SIZE, outputs=("visibility", "depth"), samples=1)
        points, hit = positions(frame)
        # where the light shines: beyond a spot's cone visibility is 0
        assert_lit(frame, hit & (light.strength(np.nan_to_num(points)) > 1e-4))


class Facets:
    """The facets of a convex body, and which of them lie next to visible points."""

    def __init__(self, scene: Scene) -> None:
        mesh = scene.nodes[0].mesh
        self._corners = mesh.positions[mesh.triangles]
        edges = self._corners[:, 1:] - self._corners[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1])
        self._normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        self._tree = cKDTree(self._corners.mean(axis=1))
        self._known: dict[str, tuple[Array, Array, Array]] = {}

    def _around(self, view: str, points: Array) -> tuple[Array, Array]:
        """Normals (N, 8, 3) of the facets next to points (N, 3), and which of them a point lies on: both at an edge."""
        if view not in self._known or not np.array_equal(self._known[view][0], points):
            _, near = self._tree.query(points, k=8)
            normals = self._normals[near]
            # maximum, 0, for its own facet
            above = np.einsum("nki,nki->nk", normals, points[:, None] - self._corners[near, 0])
            self._known[view] = points, normals, above >= above.max(axis=1, keepdims=True) - 1e-6
        return self._known[view][1:]

    def facing(self, view: str, points: Array, light: Light) -> Array:
        """Which points (N,) lie on facets that face the light; at an edge both must."""
        normals, own = self._around(view, points)
        cosine = np.einsum("nki,ni->nk", normals, light.to_light(points)[0])
        return np.where(own, cosine > 1e-6, True).all(axis=1)  # float32 rounds N.L by that much


@pytest.fixture(scope="module")
def facets(ball: Scene) -> Facets:
    return Facets(ball)


@every_pair(
    kind=KINDS, kernel=(DEFAULT, Hard()), resolution=(2048, 512), elevation=(0.0, 30.0, 75.0), view=list(BALL_VIEWS)
)
def test_convex_body_alone(
    renderer: Renderer,
    ball: Scene,
    facets: Facets,
    kind: str,
    kernel: Filter,
    resolution: int,
    elevation: float,
    view: str,
) -> None:
    """N5: a sphere of 81,920 triangles is lit wherever its facet faces the light."""
    e = np.radians(elevation)
    towards = np.array([0.6 * np.cos(e), np.sin(e), 0.8 * np.cos(e)])
    light = lights(towards, 3.0, resolution, kernel)[kind]
    frame = renderer.render(ball, BALL_VIEWS[view], [light], SIZE, outputs=("visibility", "depth"), samples=1)
    points, hit = positions(frame)
    lit = facets.facing(view, points[hit], light)
    counted = hit.copy()
    counted[hit] = lit
    assert counted.sum() > 2000
    assert_lit(frame, counted)
