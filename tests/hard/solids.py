"""Builders for the hard cases' scenes that are not built in, and a few closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.lights import Light
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid


def scene_of(
    parts: Mapping[str, Solid | Mesh], camera: PerspectiveCamera, light: Light, name: str, matrix: Array | None = None
) -> Scene:
    """A scene of solids or meshes, all placed by one matrix."""
    place = np.eye(4) if matrix is None else matrix
    nodes = tuple(
        Node(solid if isinstance(solid, Mesh) else Mesh(*solid), place, part) for part, solid in parts.items()
    )
    return Scene(nodes, camera, (light,), name=name)


def level(x: tuple[float, float], z: tuple[float, float], y: float = 0.0) -> Solid:
    """Horizontal rectangle that faces up."""
    return shapes.rectangle((x[0], y, z[1]), (x[1] - x[0], 0.0, 0.0), (0.0, 0.0, z[0] - z[1]))


def posts(places: list[tuple[float, float]], width: float, height: float) -> Solid:
    """Upright square posts on the ground."""
    return shapes.joined([shapes.box((width, height, width), (x, 0.5 * height, z)) for x, z in places])


def ribbons(centres: Array, width: float, length: float, y: float) -> Solid:
    """Horizontal strips along z, one per centre x, facing up."""
    return shapes.joined([level((x - 0.5 * width, x + 0.5 * width), (-0.5 * length, 0.5 * length), y) for x in centres])


def turned_y(solid: Solid, degrees: float) -> Solid:
    """A solid rotated about the y axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return solid[0] @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]).T, solid[1]


def checker(texels: int, cells: int, half: float, y: float, cutoff: float) -> Mesh:
    """A horizontal square |x|, |z| <= half with a texture of texels^2 whose alpha is a checker of cells^2."""
    cell = (np.arange(texels) * cells) // texels
    opaque = (cell[:, None] + cell[None, :]) % 2 == 0
    texture = np.full((texels, texels, 4), 255, dtype=np.uint8)
    texture[..., 3] = np.where(opaque, 255, 0)
    positions, triangles = level((-half, half), (-half, half), y)
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], dtype=np.float32)
    material = Material(texture=texture, alpha_mode=AlphaMode.MASK, cutoff=cutoff)
    return Mesh(positions, triangles, uv=uv, material=material)


def terrain(cells: int, size: float, height: float) -> tuple[Solid, Array]:
    """A fractal landscape, and its heights (cells + 1, cells + 1) over (row: z, column: x)."""
    generator = np.random.default_rng(4)
    line = np.linspace(-0.5, 0.5, cells + 1)
    x, z = np.meshgrid(line, line)
    relief = np.zeros_like(x)
    for octave in range(1, 6):
        for _ in range(6):
            a, b = generator.normal(size=2) * 2.0**octave
            relief += np.sin(a * x + b * z + generator.uniform(0.0, 6.3)) / 2.0**octave
    relief = (relief - relief.min()) / np.ptp(relief) * height
    positions = np.stack([x * size, relief, z * size], axis=-1).reshape(-1, 3)
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], 2).reshape(-1, 3)
    return (positions, triangles.astype(np.int32)), relief


def heights_at(relief: Array, size: float, x: Array, z: Array) -> Array:
    """Height of the landscape's triangles at (x, z); -inf outside."""
    cells = len(relief) - 1
    u, v = (x / size + 0.5) * cells, (z / size + 0.5) * cells
    i, j = (np.clip(np.floor(w).astype(np.int64), 0, cells - 1) for w in (u, v))
    fu, fv = u - i, v - j
    a, b, c, d = relief[j, i], relief[j, i + 1], relief[j + 1, i + 1], relief[j + 1, i]
    # Triangles a d c (fv >= fu) and a c b.
    height = np.where(fv >= fu, a + fv * (d - a) + fu * (c - d), a + fu * (b - a) + fv * (c - b))
    inside = (u >= 0) & (u <= cells) & (v >= 0) & (v <= cells)
    return np.where(inside, height, -np.inf)


def mapped(scene: Scene, matrix: Array) -> Scene:
    """Apply a matrix to every node, after its own."""
    return replace(
        scene, nodes=tuple(replace(node, world_from_mesh=matrix @ node.world_from_mesh) for node in scene.nodes)
    )


def bars(period: float, width: float, count: int, length: float, y: float) -> Solid:
    """`count` horizontal strips, centred on x = 0."""
    centres = (np.arange(count) - 0.5 * (count - 1)) * period
    return ribbons(centres, width, length, y)
