"""The street of Riemer's tutorial: two lampposts, and a car whose headlights project an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import translation
from glshadow.lights import SpotLight
from glshadow.scene.mesh import Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid
from glshadow.shadows.cookie import Cookie

_ASPHALT, _STONE, _BRICK, _IRON, _PAINT, _GLASS = (
    Material(color=(*color, 1.0))
    for color in (
        (0.10, 0.10, 0.11), (0.42, 0.40, 0.38), (0.36, 0.16, 0.11), (0.05, 0.06, 0.06), (0.45, 0.05, 0.04), (0.12, 0.16, 0.20),
    )
)  # fmt: skip


def street() -> Scene:
    """A street at night in metres: road, pavement and wall, two lampposts and a car; three spot lights, the car's with a cookie.

    References
    ----------
    Grootjans, "Riemer's XNA tutorials", series 3: the scene for multiple lights and adjusted Z values.
    """
    parts = [
        ("road", shapes.box((40.0, 0.2, 7.0), (0.0, -0.1, 0.0)), _ASPHALT),
        ("pavement", shapes.box((40.0, 0.35, 3.0), (0.0, 0.0, -5.0)), _STONE),
        ("wall", shapes.box((40.0, 4.5, 0.4), (0.0, 2.1, -6.7)), _BRICK),
        ("car", _body(), _PAINT),
        ("windows", shapes.box((2.0, 0.55, 1.52), (5.1, 1.28, 0.6)), _GLASS),
        ("wheels", _wheels(), _IRON),
    ]
    nodes = [Node(Mesh(*solid, material=material), np.eye(4), name) for name, solid, material in parts]
    post = Mesh(*_post(), material=_IRON)
    nodes += [Node(post, translation((x, 0.175, -4.0)), f"lamppost {i}") for i, x in enumerate((-6.0, 2.5))]
    warm = (1.0, 0.82, 0.55)
    lamps = tuple(
        SpotLight(
            position=(x, 4.15, -3.0), direction=(0.05, -1.0, 0.12), inner_angle=40.0, outer_angle=62.0, color=warm,
            intensity=14.0, falloff=2.0,
        )
        for x in (-6.0, 2.5)
    )  # fmt: skip
    car = SpotLight(
        position=(3.1, 0.75, 0.4), direction=(-1.0, -0.03, -0.46), inner_angle=30.0, outer_angle=34.0, color=(0.9, 0.95, 1.0),
        intensity=2.6, cookie=Cookie(image=headlights()),
    )  # fmt: skip
    camera = PerspectiveCamera(position=(-4.5, 3.4, 9.5), target=(-1.0, 1.1, -2.5), fov_y=44.0)
    return Scene(tuple(nodes), camera, (car, *lamps), name="street")


def headlights(size: int = 128) -> NDArray[np.uint8]:
    """(size, size, 3) sRGB: two ovals of light, brightest in the middle."""
    y, x = (np.mgrid[:size, :size] + 0.5) / size - 0.5
    light = sum(np.exp(-(((x - side * 0.17) / 0.12) ** 2) - ((y - 0.02) / 0.1) ** 2) for side in (-1.0, 1.0))
    grey = np.clip(255.0 * np.minimum(light, 1.0) ** (1.0 / 2.2), 0, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=-1)


def _body() -> Solid:
    return shapes.joined(
        [shapes.box((4.2, 0.55, 1.75), (5.3, 0.72, 0.6)), shapes.box((1.9, 0.6, 1.5), (5.1, 1.28, 0.6))]
    )


def _wheels() -> Solid:
    wheel = shapes.cylinder(0.33, 0.22, 24)
    places = [(x, 0.33, z) for x in (4.0, 6.6) for z in (-0.2, 1.4)]
    return shapes.joined([(wheel[0] + np.array(place), wheel[1]) for place in places])


def _post() -> Solid:
    """A post 3.9 m high, with an arm over the edge of the pavement and a hood."""
    x, y, z = shapes.cylinder(0.07, 4.2, 16)[0].T
    mast = np.stack([x, z + 2.1, -y], axis=-1), shapes.cylinder(0.07, 4.2, 16)[1]
    return shapes.joined(
        [mast, shapes.box((0.08, 0.08, 1.2), (0.0, 4.2, 0.5)), shapes.box((0.35, 0.06, 0.5), (0.0, 4.16, 1.0))]
    )
