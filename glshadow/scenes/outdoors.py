"""The large built-in scene: a square kilometre of hills with trees and a house, seen from eye height."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array, translation
from glshadow.lights import DirectionalLight
from glshadow.scene.mesh import Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid

SIDE = 1000.0  # metres
CELLS = 200
TREES = 600
EYE = 1.7

_GRASS, _BARK, _LEAF, _WALL, _ROOF = (
    Material(color=(*color, 1.0))
    for color in ((0.30, 0.36, 0.16), (0.22, 0.15, 0.09), (0.10, 0.20, 0.07), (0.62, 0.58, 0.50), (0.34, 0.13, 0.09))
)
_WAVES = ((0.0063, 0.0041, 9.0, 0.3), (-0.0117, 0.0096, 4.0, 1.9), (0.021, 0.027, 1.6, 4.2), (0.061, -0.048, 0.45, 0.7))


def height(x: ArrayLike, z: ArrayLike) -> Array:
    """Height of the ground, metres: hills around a flat area with the house."""
    x, z = np.asarray(x, dtype=np.float64), np.asarray(z, dtype=np.float64)
    rise = sum(size * np.sin(2.0 * np.pi * (a * x + b * z) + phase) for a, b, size, phase in _WAVES)
    away = np.hypot(x, z)
    return np.asarray(rise * (1.0 - np.exp(-((away / 90.0) ** 2))) + 20.0 * (away / 500.0) ** 2)


def outdoors() -> Scene:
    """A kilometre of hills with 600 trees and a house; camera 1.7 m above the ground, sun 28 degrees high: 168,560 triangles.

    From the fence at 6 m to trees at 700 m: no single shadow map is fine enough for both.
    """
    ground = _ground()
    nodes = [Node(Mesh(*ground, normals=shapes.vertex_normals(ground), material=_GRASS), np.eye(4), "ground")]
    trunk = Mesh(*_standing(shapes.cylinder(0.22, 2.4, 10), 1.2), material=_BARK)
    crowns = [Mesh(*_crown(levels), material=_LEAF) for levels in (2, 3)]
    for number, (x, z, size, turn) in enumerate(_places()):
        place = translation((x, float(height(x, z)) - 0.1, z)) @ _scaled(size) @ _turned(turn)
        nodes.append(Node(trunk, place, f"trunk {number}"))
        nodes.append(Node(crowns[number % 2], place, f"crown {number}"))
    home = translation((6.0, 0.0, -14.0)) @ _turned(0.5)
    home[1, 3] = float(height(6.0, -14.0))
    nodes += [Node(Mesh(*_walls(), material=_WALL), home, "walls"), Node(Mesh(*_roof(), material=_ROOF), home, "roof")]
    nodes.append(Node(Mesh(*_fence(), material=_BARK), np.eye(4), "fence"))
    eye = np.array([-3.0, float(height(-3.0, 9.0)) + EYE, 9.0])
    camera = PerspectiveCamera(position=tuple(eye), target=(4.0, eye[1] - 0.4, -16.0), fov_y=55.0)
    azimuth, elevation = np.radians([62.0, 28.0])
    aim = np.array([np.cos(elevation) * np.sin(azimuth), -np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
    return Scene(
        tuple(nodes), camera, (DirectionalLight(direction=tuple(aim.tolist()), intensity=2.2),), name="outdoors"
    )


def _ground() -> Solid:
    """A grid, finer towards its middle."""
    along = np.linspace(-1.0, 1.0, CELLS + 1)
    along = 0.5 * SIDE * np.sign(along) * np.abs(along) ** 2
    x, z = np.meshgrid(along, along)
    positions = np.stack([x, height(x, z), z], axis=-1).reshape(-1, 3)
    i, j = (each.ravel() for each in np.meshgrid(np.arange(CELLS), np.arange(CELLS)))
    a = j * (CELLS + 1) + i
    b, c, d = a + 1, a + CELLS + 1, a + CELLS + 2
    return positions, np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]).astype(np.int32)


def _places() -> list[tuple[float, float, float, float]]:
    """x, z, size and rotation of trees: a jittered sunflower pattern without the meadow around the house."""
    rng = np.random.default_rng(11)
    k = np.arange(2 * TREES)
    radius = 480.0 * np.sqrt((k + 0.5) / len(k))
    angle = 2.399963229728653 * k
    x, z = radius * np.cos(angle) + rng.normal(0.0, 4.0, len(k)), radius * np.sin(angle) + rng.normal(0.0, 4.0, len(k))
    wood = np.sin(0.02 * x + 1.0) + np.cos(0.017 * z) > 0.15
    free = (np.hypot(x, z) > 22.0) & (wood | (radius < 90.0))
    kept = np.flatnonzero(free)[:TREES]
    return [(float(x[i]), float(z[i]), float(rng.uniform(0.8, 1.7)), float(angle[i])) for i in kept]


def _crown(levels: int) -> Solid:
    """A fir's crown: stacked cones."""
    solids = []
    for level in range(levels):
        low, wide = 1.6 + 1.5 * level, 1.7 - 0.4 * level
        positions, triangles = shapes.cylinder(wide, 2.4, 12)
        top = positions[:, 2] > 0.0
        positions[top, :2] *= 0.03
        solids.append(_standing((positions, triangles), low + 1.2))
    return shapes.joined(solids)


def _walls() -> Solid:
    """Four walls with an open window and an open door, and a chimney."""
    solids = [
        shapes.box((8.0, 2.8, 0.25), (0.0, 1.4, -3.0)), shapes.box((0.25, 2.8, 6.0), (-4.0, 1.4, 0.0)),
        shapes.box((0.25, 2.8, 6.0), (4.0, 1.4, 0.0)), shapes.box((3.2, 2.8, 0.25), (-2.4, 1.4, 3.0)),
        shapes.box((1.0, 2.8, 0.25), (3.5, 1.4, 3.0)), shapes.box((2.2, 0.9, 0.25), (1.9, 0.45, 3.0)),
        shapes.box((2.2, 0.6, 0.25), (1.9, 2.5, 3.0)), shapes.box((0.7, 2.6, 0.7), (2.2, 4.2, -0.8)),
    ]  # fmt: skip
    return shapes.joined(solids)


def _roof() -> Solid:
    """Two slopes of 38 degrees with open gables, 20 cm thick."""
    rise, run = 2.7, 3.5
    length, pitch = float(np.hypot(rise, run)), float(np.arctan2(rise, run))
    solids = []
    for side in (-1.0, 1.0):
        positions, triangles = shapes.box((8.8, 0.2, length))
        cosine, sine = np.cos(side * pitch), np.sin(side * pitch)
        turned = np.stack(
            [
                positions[:, 0],
                cosine * positions[:, 1] - sine * positions[:, 2],
                sine * positions[:, 1] + cosine * positions[:, 2],
            ],
            axis=-1,
        )
        solids.append((turned + np.array([0.0, 2.7 + 0.5 * rise, side * 0.5 * run]), triangles))
    return shapes.joined(solids)


def _fence() -> Solid:
    """Pickets of 4 cm from in front of the camera to the house."""
    start, end = np.array([-7.5, 4.5]), np.array([1.5, -8.0])
    along = np.linspace(0.0, 1.0, 90)[:, None]
    solids = []
    for x, z in start + along * (end - start):
        ground = float(height(x, z))
        solids.append(shapes.box((0.04, 1.1, 0.04), (x, ground + 0.5, z)))
    return shapes.joined(solids)


def _standing(solid: Solid, middle: float) -> Solid:
    """Rotates a solid about z to stand along y, its middle at a height."""
    x, y, z = solid[0].T
    return np.stack([x, z + middle, -y], axis=-1), solid[1]


def _scaled(size: float) -> Array:
    return np.diag([size, size, size, 1.0])


def _turned(angle_rad: float) -> Array:
    """(4, 4) rotation about y."""
    matrix = np.eye(4)
    matrix[[0, 2], [0, 2]] = np.cos(angle_rad)
    matrix[0, 2], matrix[2, 0] = np.sin(angle_rad), -np.sin(angle_rad)
    return matrix
