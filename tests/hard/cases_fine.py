"""N7, N8, N12, N13, N23 and N30: depth differences that a format cannot resolve, and detail that a map cannot resolve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.lights import DirectionalLight, PointLight, SpotLight
from glshadow.scenes import analytic

from .registry import AS_DEFAULT, Case, Picture, crease, overhead, picture_of, sun_direction
from .solids import bars, heights_at, level, posts, ribbons, scene_of, terrain, turned_y

LAYERS = (10.0, 1.0, 0.1)
RANGE = 1000.0
OVERHEAD = (0.0, -1.0, 0.0)


def layer(gap: float) -> Picture:
    """Two horizontal planes `gap` apart under an overhead light whose map spans 1000 m; the camera looks between them."""
    sun = DirectionalLight(direction=OVERHEAD, near=-900.0, far=100.0)
    parts = {"ground": level((-12.0, 12.0), (-12.0, 12.0)), "roof": level((-5.0, 5.0), (-5.0, 5.0), gap)}
    eye = 0.4 * min(gap, 2.0)  # sees ground from a distance of 1 on, up to beyond the roof
    camera = PerspectiveCamera(
        (-4.0, eye, 0.2), (0.0, eye, 0.0), fov_y=float(np.degrees(2.0 * np.arctan(eye))), pixel_aspect=0.3 / eye
    )
    return Picture(f"layers {gap:g} apart", scene_of(parts, camera, sun, "layers"), sun, camera, _roofed, length=gap)


def _roofed(points: Array, normals: Array) -> Array:
    under = (np.abs(points[:, (0, 2)]) <= 5.0).all(axis=1) & (points[:, 1] < 1e-9)
    return np.where((normals[:, 1] > 0.0) & ~under, 1.0, 0.0)


def layers() -> list[Picture]:
    return [layer(gap) for gap in LAYERS]


def far_spot(name: str, near: float | None, far: float | None) -> Picture:
    """A square of half-side 1 at 5000, the receiver at 5001."""
    spot = SpotLight(position=(0.0, 5001.0, 0.0), inner_angle=0.2, outer_angle=0.2, near=near, far=far)
    built = analytic.plates(gap=1.0, lamp_height=5001.0)
    camera = PerspectiveCamera((-6.0, 3.0, 2.0), (0.0, 0.0, 0.0))
    return picture_of(name, built, spot, camera)


def far_spots() -> list[Picture]:
    return [far_spot("near 0.01, far 1e4", 0.01, 1e4), far_spot("derived range", None, None)]


def wires() -> list[Picture]:
    """64 ribbons, each 1/64 texel further; 1024 texels over 10.24 m."""
    pictures = []
    for width, angle in ((2.0, 0.0), (1.0, 17.0), (0.5, 45.0), (0.1, 0.0)):
        pictures.append(wire(width, angle))
    return pictures


WIRE_TEXEL = 0.01
WIRE_COUNT = 64
HIGH = 450.0  # above the camera, so that only the ground is seen


def wire(width: float, angle: float) -> Picture:
    """Ribbons of `width` texels, above the camera, 13 + 1/64 texels apart, rotated by `angle`."""
    texel = WIRE_TEXEL
    spacing = (13.0 + 1.0 / WIRE_COUNT) * texel
    centres = (np.arange(WIRE_COUNT) - 0.5 * (WIRE_COUNT - 1)) * spacing
    ground = level((-6.0, 6.0), (-6.0, 6.0))  # beyond the image, so that edges there are known
    strips = turned_y(ribbons(centres, width * texel, 12.0, HIGH), angle)
    sun = DirectionalLight(direction=OVERHEAD)
    camera = overhead((-5.12, 5.12), (-5.12, 5.12), 400.0, (1024, 61))
    scene = scene_of({"ground": ground, "wires": strips}, camera, sun, "wires")
    return Picture(f"wires of {width:g} texels at {angle:g} degrees", scene, sun, camera, size=(1024, 61),
                   length=width * texel)  # fmt: skip


def lattices() -> list[Picture]:
    return [lattice(ratio) for ratio in (8.0, 2.0, 1.0, 0.5)]


def lattice(ratio: float) -> Picture:
    """Bars of 0.4 periods, `ratio` texels and a little apart, in both directions; 512 texels over 5.12 m."""
    period = 0.01 * ratio * 1.0737
    count = int(5.5 / period)
    strips = bars(period, 0.4 * period, count, 5.5, HIGH)
    other = turned_y(bars(period, 0.4 * period, count, 5.5, HIGH), 90.0)
    sun = DirectionalLight(direction=OVERHEAD)
    camera = overhead((-2.56, 2.56), (-2.56, 2.56), 400.0)
    parts = {"ground": level((-2.56, 2.56), (-2.56, 2.56)), "bars": strips, "cross bars": other}
    scene = scene_of(parts, camera, sun, "lattice")
    return Picture(f"lattice of {ratio:g} texels", scene, sun, camera, resolution=512, length=period)


CELLS, EXTENT, RELIEF = 128, 5000.0, 700.0


def landscapes() -> list[Picture]:
    solid, relief = terrain(CELLS, EXTENT, RELIEF)
    camera = PerspectiveCamera((-1500.0, 2600.0, 3600.0), (0.0, 200.0, 0.0))
    pictures = []
    for elevation in (5.0, 0.5):
        sun = DirectionalLight(direction=sun_direction(elevation, 20.0))
        scene = scene_of({"terrain": solid}, camera, sun, "terrain")

        def exact(points: Array, normals: Array, sun: DirectionalLight = sun) -> Array:
            return horizon(relief, points, normals, sun)

        pictures.append(Picture(f"terrain, sun {elevation:g} degrees high", scene, sun, camera, exact, resolution=2048, size=(96, 96),
                                length=RELIEF, closed_form_share=1e-2))  # fmt: skip
    return pictures


def horizon(relief: Array, points: Array, normals: Array, sun: DirectionalLight) -> Array:
    """Lit iff nothing along the way to the light rises above it; steps of a quarter cell."""
    towards = -np.asarray(sun.direction)
    level_length = np.hypot(towards[0], towards[2])
    ahead, climb = towards[[0, 2]] / level_length, towards[1] / level_length
    lit = normals @ towards > 0.0
    for s in np.arange(0.5, 1.5 * CELLS, 0.5) * EXTENT / CELLS:
        over = heights_at(relief, EXTENT, points[:, 0] + s * ahead[0], points[:, 2] + s * ahead[1])
        lit &= over <= points[:, 1] + s * climb + 1e-9
    return np.where(lit, 1.0, 0.0)


def outliers() -> list[Picture]:
    """A cube of 1 m, and a triangle a thousand kilometres away."""
    built = analytic.box(30.0, 30.0, (1.0, 1.0, 1.0))
    far = np.array([[1e6, 0.0, 1e6], [1e6 + 1.0, 0.0, 1e6], [1e6, 1.0, 1e6]])
    triangle = (far, np.array([[0, 1, 2]], dtype=np.int32))
    from glshadow.scene.mesh import Mesh
    from glshadow.scene.nodes import Node

    nodes = (*built.scene.nodes, Node(Mesh(*triangle), np.eye(4), "outlier"))
    scene = replace(built.scene, nodes=nodes)
    pictures = [picture_of("cube and outlier", analytic.AnalyticScene(scene, built.blocked), size=(128, 128))]
    point_light = PointLight(position=(3.0, 4.0, 2.0))
    pictures.append(
        picture_of(
            "cube and outlier, point light", analytic.AnalyticScene(scene, built.blocked), point_light, size=(128, 128)
        )
    )
    return pictures


def cascades() -> list[Picture]:
    """20 posts in a row away from the camera, over 200 m."""
    places = [(1.5 * (-1) ** k, -2.0 - 10.0 * k) for k in range(20)]
    sun = DirectionalLight(direction=sun_direction(35.0, 30.0))
    camera = PerspectiveCamera((0.0, 2.0, 6.0), (0.0, 0.5, -10.0))
    parts = {"ground": level((-30.0, 30.0), (-220.0, 10.0)), "posts": posts(places, 0.4, 1.6)}
    scene = scene_of(parts, camera, sun, "posts")
    return [Picture("20 posts", scene, sun, camera, resolution=2048)]


STEP = "a projected step of 149 m (24 bits) at 5000"

CASES = (
    Case(7, "parallel layers, range 1000", "shadow for every d > 0", layers, elsewhere="test_sizes.py: the gap that is lost"),
    Case(8, "spot with far / near = 1e6", "square x 5001 / 5000", far_spots,
         fails={"depth24": STEP, "depth16": STEP, "-1..1": STEP, "-1..1 reversed": "as D24: -1..1 keeps 0.5 as its finest step"}),
    Case(12, "wires of 2 to 1/10 texels", "bands of width w, unbiased over phases", wires,
         elsewhere="test_sizes.py: mean width"),
    Case(13, "lattice of 8 to 1/2 texels", "mean visibility (1 - w/p)^2", lattices, elsewhere="test_sizes.py: mean, moire"),
    Case(27, "far outlier", "as N10", outliers, skips=AS_DEFAULT),
    Case(30, "terrain under a low sun", "lit iff below the horizon line", landscapes, skips=AS_DEFAULT,
         findings=(crease("terrain, sun 5 degrees high", techniques=("default", "hard")),
                   crease("terrain, sun 0.5 degrees high"))),
    Case(35, "posts in depth", "every shadow has length H cot e", cascades),
)  # fmt: skip
