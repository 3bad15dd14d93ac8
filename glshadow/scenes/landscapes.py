"""The three landscapes of p5.tree's shadow mapping sketch, and its rotating light."""

from __future__ import annotations

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.setting import flag, number, whole
from glshadow.core.spaces import translation
from glshadow.lights import DirectionalLight, SpotLight
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid
from glshadow.shadows.shadow import Shadow

HALF, NEAR, FAR, DISTANCE = 110.0, 110.0, 350.0, 230.0
"""Frustum of the sketch's light, `ortho(-110, 110, -110, 110, 110, 350)`, and its distance, in the middle of the depth range."""


def landscape(which: int = 1) -> Scene:
    """Landscape 1 (blocks), 2 (round shapes) or 3 (posts and a tilted plate), 200 units wide, lit by `landscape_light()`.

    The sketch has three scenes of growing complexity, selected by the keys 1, 2 and 3. It does not prescribe their shapes.

    Raises
    ------
    SettingsError
        For any other number.
    """
    which = whole(1, 3)("which", which)
    solids = (_blocks, _round, _posts)[which - 1]()
    ground = shapes.box((200.0, 4.0, 200.0), (0.0, -2.0, 0.0))
    nodes = [Node(Mesh(*ground), np.eye(4), "ground")]
    nodes += [Node(Mesh(*solid), np.eye(4), f"part {i}") for i, solid in enumerate(solids)]
    camera = PerspectiveCamera(position=(150.0, 130.0, 190.0), target=(0.0, 10.0, 0.0), fov_y=40.0)
    return Scene(tuple(nodes), camera, (landscape_light(),), name=f"landscape {which}")


def landscape_light(
    turn: float = 2.4, perspective: bool = False, shadow: Shadow | None = None
) -> DirectionalLight | SpotLight:
    """The sketch's rotating light: `turn` radians about the vertical, at 230 units from the middle.

    Parameters
    ----------
    turn : float
        Angle in radians; change it to animate the light.
    perspective : bool
        A spot light, as in the second exercise; otherwise parallel light through the sketch's box.
    shadow : Shadow, optional
    """
    turn = number()("turn", turn)
    perspective = flag()("perspective", perspective)
    position = DISTANCE * np.array([np.cos(turn) * 0.7, 0.714, np.sin(turn) * 0.7])
    place, aim = tuple(position.tolist()), tuple((-position).tolist())
    given = Shadow() if shadow is None else shadow
    if perspective:
        angle = float(np.degrees(np.arctan2(HALF, DISTANCE)))
        return SpotLight(position=place, direction=aim, inner_angle=angle, outer_angle=angle, shadow=given)
    return DirectionalLight(direction=aim, shadow=given)


def _blocks() -> list[Solid]:
    """A town of boxes whose heights follow a wave."""
    solids = []
    for x in range(-75, 76, 30):
        for z in range(-75, 76, 30):
            height = 14.0 + 11.0 * np.sin(0.05 * x + 0.4) * np.cos(0.043 * z)
            solids.append(shapes.box((14.0, height, 14.0), (x, 0.5 * height, z)))
    return solids


def _round() -> list[Solid]:
    """Spheres, an upright ring, and columns."""
    ring, faces = shapes.torus(26.0, 6.0, 96, 32)
    solids = [(ring + np.array([0.0, 32.0, 0.0]), faces)]
    for k in range(7):
        angle = 2.0 * np.pi * k / 7.0
        ball, triangles = shapes.icosphere(3, 9.0)
        solids.append((ball + np.array([62.0 * np.cos(angle), 9.0 + 3.0 * k, 62.0 * np.sin(angle)]), triangles))
    return solids


def _posts() -> list[Solid]:
    """Thin posts, a bar across them, and a tilted plate."""
    solids = [shapes.box((2.5, 46.0, 2.5), (x, 23.0, z)) for x in range(-80, 81, 20) for z in (-50, 40)]
    solids += [shapes.box((165.0, 2.5, 2.5), (0.0, 46.0, z)) for z in (-50.0, 40.0)]
    plate = shapes.box((90.0, 2.0, 50.0))
    tilt = translation((0.0, 24.0, -4.0))
    tilt[1:3, 1:3] = [[0.85, -0.527], [0.527, 0.85]]
    solids.append((plate[0] @ tilt[:3, :3].T + tilt[:3, 3], plate[1]))
    return solids
