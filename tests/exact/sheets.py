"""A closed sheet over a plane, which must be completely dark, and tessellations of one plane, which must be completely lit."""

from __future__ import annotations

import numpy as np

import glshadow as gs
from glshadow.core.spaces import Array, transform
from glshadow.lights import Light
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes.shapes import Solid

from .compare import shone
from .orientations import rotation

SHEET_HALF, SHEET_HEIGHT = 30.0, 4.0
PLANE_HALF = 6.0
ROUGH = 0.1  # fractions of a cell: how far vertices of the sheet are moved sideways; vertically a fifth of it
ELEVATIONS = (60.0, 20.0, 5.0, 1.0, 0.1)
LIGHTS = ("sun", "spot", "point light")


def grid(cells: int, half: float, height: float = 0.0) -> Solid:
    """A horizontal square of 2 cells^2 triangles, facing up."""
    line = np.linspace(-half, half, cells + 1)
    x, z = np.meshgrid(line, line, indexing="ij")
    positions = np.stack([x, np.full_like(x, height), z], axis=-1).reshape(-1, 3)
    a = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1].ravel()
    b, c, d = a + 1, a + cells + 1, a + cells + 2
    return positions, np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).astype(np.int32)


def _placed(rng: np.random.Generator, offset: float = 0.0) -> Array:
    """A random orientation, and a place `offset` from the world's origin, (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(rng)
    matrix[:3, 3] = offset * rotation(rng)[0]
    return matrix


def under_a_sheet(cells: int, rng: np.random.Generator) -> tuple[Scene, dict[str, Light]]:
    """A plane seen from between it and a jittered sheet of 2 cells^2 triangles, at a random orientation; three lights above.

    The vertices are moved by the matrix before they are rounded to float32, so that no coordinate is a round number.
    """
    place = _placed(rng)
    sheet, triangles = grid(cells, SHEET_HALF, SHEET_HEIGHT)
    cell = 2.0 * SHEET_HALF / cells
    sheet = sheet + rng.uniform(-1.0, 1.0, sheet.shape) * np.array([ROUGH, 0.2 * ROUGH, ROUGH]) * cell
    plane = grid(8, PLANE_HALF)
    parts = {"plane": plane, "sheet": (sheet, triangles)}
    nodes = tuple(Node(Mesh(transform(place, p), t), np.eye(4), name) for name, (p, t) in parts.items())
    camera = gs.PerspectiveCamera(
        _at(place, (0.0, 2.5, 5.0)), _at(place, (0.0, 0.0, 0.0)), _along(place, (0.0, 1.0, 0.0)), 60.0
    )
    lights: dict[str, Light] = {
        "sun": gs.DirectionalLight(direction=_along(place, (-0.3, -0.9, -0.2))),
        "spot": gs.SpotLight(
            position=_at(place, (0.0, 9.0, 0.0)),
            direction=_along(place, (0.01, -1.0, 0.02)),
            inner_angle=55.0,
            outer_angle=60.0,
        ),
        "point light": gs.PointLight(position=_at(place, (0.3, 5.5, 0.2))),
    }
    return Scene(nodes, camera, (), name=f"sheet of {len(triangles)} triangles"), lights


def tessellations(elevation: float, offset: float, rng: np.random.Generator) -> tuple[Scene, dict[str, Light]]:
    """One plane three times, as 20,000 triangles twice and as 2,738, turned at random, `offset` from the world's origin."""
    place = _placed(rng, offset)
    fine, coarse = grid(100, PLANE_HALF), grid(37, PLANE_HALF)
    meshes = [Mesh(transform(place, p), t) for p, t in (fine, fine, coarse)]
    nodes = tuple(Node(mesh, np.eye(4), str(number)) for number, mesh in enumerate(meshes))
    camera = gs.PerspectiveCamera(
        _at(place, (0.0, 2.5, 7.0)), _at(place, (0.0, 0.0, 0.0)), _along(place, (0.0, 1.0, 0.0)), 60.0
    )
    e = np.radians(elevation)
    towards = np.array([np.cos(e), np.sin(e), 0.0])
    lights: dict[str, Light] = {
        "sun": gs.DirectionalLight(direction=_along(place, -towards)),
        "spot": gs.SpotLight(position=_at(place, 9.0 * towards), direction=_along(place, -towards), outer_angle=50.0),
        "point light": gs.PointLight(position=_at(place, 9.0 * towards)),
    }
    return Scene(nodes, camera, (), name=f"tessellations, light {elevation:g} degrees high, {offset:g} off"), lights


def _at(place: Array, point: object) -> tuple[float, float, float]:
    return tuple(transform(place, np.asarray(point)))  # type: ignore[return-value]


def _along(place: Array, direction: object) -> tuple[float, float, float]:
    return tuple(place[:3, :3] @ np.asarray(direction))  # type: ignore[return-value]


def lit_and_asked(
    renderer: gs.Renderer, scene: Scene, light: Light, first: int, size: tuple[int, int] = (640, 360)
) -> tuple[int, int]:
    """Pixels of the first `first` triangles that are lit at all, and all pixels that show them, where the light shines."""
    frame = renderer.render(scene, None, [light], size, outputs=("visibility", "triangle", "position"), samples=1)
    tested = (frame.triangle >= 0) & (frame.triangle < first) & shone(frame)
    return int((frame.visibility[0][tested] > 0.0).sum()), int(tested.sum())


PLANE_TRIANGLES = 128
"""The triangles of the plane come first in `under_a_sheet`."""
