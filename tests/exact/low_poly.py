"""Random scenes of few triangles that may shadow themselves: open shells, valleys, slabs, nested boxes, from any viewpoint."""

from __future__ import annotations

import numpy as np

import glshadow as gs
from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array
from glshadow.lights import Light
from glshadow.scene.mesh import Material, Mesh
from glshadow.scene.nodes import Node, Scene

Shape = tuple[Array, Array]

_QUADS = np.array(((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)))


def _triangles(quads: Array) -> Array:
    return quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def box(rng: np.random.Generator, missing: int = 0, flat: float = 1.0) -> Shape:
    """A box of edge 1 with outward or inward faces, some of them missing."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * (1.0, flat, 1.0)
    quads = _QUADS[rng.permutation(6)[missing:]]
    return corners, _triangles(quads if rng.random() < 0.7 else quads[:, ::-1])


def fold(rng: np.random.Generator, quads: int) -> Shape:
    """Quads side by side, folded at their seams: a tent, a valley, a folding screen."""
    x = np.linspace(-0.5, 0.5, quads + 1)
    seams = np.stack([x, rng.uniform(-0.4, 0.4, quads + 1), np.full(quads + 1, 0.5)], axis=1)
    corners = np.concatenate([seams, seams * (1.0, 1.0, -1.0)])
    k = np.arange(quads)
    faces = np.stack([k, k + 1, k + quads + 2, k + quads + 1], axis=1)
    return corners, _triangles(faces if rng.random() < 0.5 else faces[:, ::-1])


def nested(rng: np.random.Generator) -> Shape:
    """A box inside an open box, one mesh."""
    outer, faces = box(rng, 1)
    inner, more = box(rng, 5)
    return np.concatenate([outer, inner * 0.6]), np.concatenate([faces, more + 8])


def shape(rng: np.random.Generator) -> Shape:
    """A random box, fold or nested box of at most 16 triangles."""
    kind = rng.integers(9)
    if kind <= 1:
        return box(rng, int(rng.integers(1, 5)))
    if kind == 2:
        return box(rng)
    if kind == 3:
        return box(rng, flat=float(rng.choice([0.01, 0.1])))
    if kind == 4:
        return nested(rng)
    if kind == 5:
        return rng.uniform(-0.5, 0.5, (3, 3)), np.array([[0, 1, 2]])
    return fold(rng, int(rng.choice([1, 2, 2, 3, 6, 8])))


def turn(rng: np.random.Generator) -> Array:
    """A random rotation (3, 3)."""
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.asarray(matrix * np.sign(np.linalg.det(matrix)))


def place(rng: np.random.Generator, size: float) -> Array:
    """A random placement (4, 4): upright or rotated, sometimes stretched or mirrored."""
    linear = np.diag(size * (rng.uniform(0.3, 1.5, 3) if rng.random() < 0.5 else np.ones(3)))
    if rng.random() < 0.1:
        linear[2] *= -1.0
    if rng.random() < 0.3:
        linear = turn(rng) @ linear
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = rng.uniform(-0.3, 0.3, 3) if size > 2.0 else rng.uniform(-2.5, 2.5, 3)
    return matrix


def low_poly_scene(rng: np.random.Generator) -> Scene:
    """One or two bodies as large as the scene, one to three small ones, sometimes a floor."""
    large, small = int(rng.choice([1, 1, 1, 2])), int(rng.choice([1, 1, 1, 2, 3]))
    nodes = []
    for k in range(large + small):
        positions, triangles = shape(rng)
        material = Material(double_sided=bool(rng.random() < 0.3))
        mesh = Mesh(positions, triangles.astype(np.int32), material=material)
        nodes.append(Node(mesh, place(rng, rng.uniform(4.0, 7.0) if k < large else rng.uniform(0.1, 0.8)), f"body {k}"))
    if rng.random() < 0.3:
        floor = np.array([(-6.0, -2.0, 6.0), (6.0, -2.0, 6.0), (6.0, -2.0, -6.0), (-6.0, -2.0, -6.0)])
        nodes.append(Node(Mesh(floor, np.array([[0, 1, 2], [0, 2, 3]], np.int32)), np.eye(4), "floor"))
    return Scene(tuple(nodes), gs.PerspectiveCamera((0.0, 0.0, 9.0), (0.0, 0.0, 0.0)))


def above(rng: np.random.Generator) -> Array:
    """A random unit vector, mostly in the upper hemisphere."""
    away = rng.normal(size=3)
    away[1] = np.abs(away[1]) * (1.0 if rng.random() < 0.8 else -1.0)
    return np.asarray(away / np.linalg.norm(away))


def camera(rng: np.random.Generator) -> Camera:
    """A camera outside, among the bodies, or with a near plane that cuts through them."""
    kind = rng.random()
    target = tuple(rng.uniform(-1.0, 1.0, 3).tolist())
    away = above(rng)
    if kind < 0.5:
        return gs.PerspectiveCamera(tuple((away * rng.uniform(7.0, 12.0)).tolist()), target, fov_y=50.0)
    if kind < 0.8:
        return gs.PerspectiveCamera(tuple((away * rng.uniform(0.5, 3.5)).tolist()), target, fov_y=80.0)
    if kind < 0.9:
        position = tuple((away * 8.0).tolist())
        return gs.PerspectiveCamera(position, target, fov_y=50.0, near=float(rng.uniform(3.0, 8.0)), far=30.0)
    position = tuple((away * 5.0).tolist())
    return gs.OrthographicCamera(position, target, height=8.0, near=float(rng.uniform(0.1, 5.0)), far=30.0)


def light(rng: np.random.Generator) -> Light:
    """A directional, spot or point light without size, inside bodies or outside."""
    kind = rng.integers(3)
    away = above(rng)
    if kind == 0:
        if rng.random() < 0.3:
            away[rng.integers(3)] = 0.0
        return gs.DirectionalLight(direction=tuple((-away).tolist()))
    position = away * rng.uniform(0.5, 9.0)
    place = tuple(position.tolist())
    if kind == 1:
        aim = tuple((rng.uniform(-1.0, 1.0, 3) - position).tolist())
        return gs.SpotLight(position=place, direction=aim, inner_angle=80.0, outer_angle=80.0)
    return gs.PointLight(position=place)
