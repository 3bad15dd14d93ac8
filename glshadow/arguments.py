"""Checks the arguments that all rendering functions share: scene, camera, lights and size."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.outputs import checked_outputs
from glshadow.core.setting import as_int, instance, optional, refuse, several, shown, whole
from glshadow.core.tone import Exposure
from glshadow.derive.exposure import light_level
from glshadow.derive.look import Look, look_of
from glshadow.errors import SceneError
from glshadow.lights import Light, Lights, as_lights
from glshadow.scene.nodes import Node, Scene
from glshadow.scene.sampled import surface_samples

DEFAULT_SIZE = (1280, 720)
"""Default size of an image, pixels."""

LARGEST_SIDE = 1 << 15  # pixels; the driver's own limit is checked when the image is made

CAMERA = optional(instance(Camera), "the scene's own")


@dataclass(frozen=True, eq=False)
class FrameRequest:
    """The checked inputs of a frame."""

    scene: Scene
    camera: Camera
    lights: tuple[Light, ...]
    size: tuple[int, int]
    outputs: frozenset[str]
    look: Look

    def __str__(self) -> str:
        return f"scene {self.scene.name}, {self.camera}, lights {list(self.lights)}, size {self.size}"


def frame_request(
    scene: Scene,
    camera: Camera | None,
    lights: Lights,
    size: tuple[int, int],
    outputs: Any,
    ambient: Any,
    background: Any,
    samples: Any,
    exposure: Any = None,
    tone: Any = "none",
) -> FrameRequest:
    """Check the arguments of `Renderer.render`; raises SettingsError or SceneError."""
    camera, lights, size = frame_arguments(scene, camera, lights, size)
    names = frozenset(checked_outputs(outputs))
    own = scene.defaults
    look = look_of(ambient, background, samples, exposure, tone, own.ambient_beside(lights), own.background)
    return FrameRequest(scene, camera, lights, size, names, look.metered(metered(scene, lights, look.exposure)))


def metered(scene: Scene, lights: tuple[Light, ...], exposure: Exposure) -> float | None:
    """The level of a scene's lights, where their intensities are not relative to white or the exposure is "auto"; None elsewhere."""
    if exposure != "auto" and not any(light.photometric for light in lights):
        return None
    if all(light.at_infinity for light in lights):  # alike everywhere
        return light_level(lights, np.zeros((1, 3)), np.zeros((1, 3)))
    kept = _levels.get(scene)
    if kept is None or len(kept[0]) != len(lights) or any(a is not b for a, b in zip(kept[0], lights, strict=True)):
        kept = _levels[scene] = lights, _level(scene, lights)  # 5 ms for each light
    return kept[1]


_levels: weakref.WeakKeyDictionary[Scene, tuple[tuple[Light, ...], float]] = weakref.WeakKeyDictionary()


def _level(scene: Scene, lights: tuple[Light, ...]) -> float:
    """The level of lights of which some have a position."""
    rest = scene.rest
    if rest is not None and [each.geometry for each in lights] == [each.geometry for each in scene.lights]:
        # the same for all times of an animation
        pairs = zip(rest.lights, lights, strict=True)
        lights = tuple(replace(own, color=each.color, intensity=each.intensity) for own, each in pairs)
    return light_level(lights, *surface_samples(rest or scene))


def as_scene(source: Any, ground: bool | str | None = False, look: str | None = None, usual: str = "studio") -> Scene:
    """A scene itself, so that its cached data stays valid; anything else is converted by `load`. Optionally adds ground and look of `load`.

    `usual`: the look, if none is given, of a source that has none and no lights; other than "studio" only without ground and look.
    """
    if isinstance(source, Scene) and not ground and look is None:
        return source
    from glshadow.io.limits import Budget
    from glshadow.io.load import load, read_scene  # slow to import

    if usual == "studio":
        return load(source, ground=ground, look=look)
    return read_scene(source, Budget(), usual=usual)


def frame_arguments(
    scene: Scene, camera: Camera | None, lights: Lights, size: tuple[int, int]
) -> tuple[Camera, tuple[Light, ...], tuple[int, int]]:
    """The camera and the lights (by default the scene's own) and the size, checked.

    Raises
    ------
    SceneError
        If the scene is not a Scene.
    SettingsError
        If another argument is not allowed.
    """
    scene = checked_scene(scene)
    camera = CAMERA("camera", camera)
    chosen = scene.lights if lights is None else as_lights("lights", lights)
    return scene.camera if camera is None else camera, chosen, pixels("size", size)


def checked_scene(scene: Scene) -> Scene:
    """The scene, or a SceneError if it is not a Scene."""
    if not isinstance(scene, Scene):
        raise SceneError(f"a glshadow.Scene is needed (see glshadow.load), got {shown(scene)}")
    return scene


def chosen_nodes(name: str, scene: Scene, of: Any) -> list[int]:
    """Indices of nodes: a node, its name or its index, or a sequence of these; None: all nodes.

    Raises
    ------
    SettingsError
        For what is not a node of the scene.
    """
    if of is None:
        return list(range(len(scene.nodes)))
    sequence = isinstance(of, list | tuple | range | set | frozenset) or (isinstance(of, np.ndarray) and of.ndim == 1)
    given = of if sequence else [of]
    return sorted({_index_of(name, scene, each) for each in given})


def _index_of(name: str, scene: Scene, node: Any) -> int:
    if isinstance(node, Node):
        for index, each in enumerate(scene.nodes):
            if each is node:
                return index
        node = node.name if node.name in scene.places else node
    if isinstance(node, str) and node in scene.places:
        return scene.places[node]
    number = as_int(node)
    if number is not None and 0 <= number < len(scene.nodes):
        return number
    names = ", ".join(repr(each.name) for each in scene.nodes[:6]) + (", ..." if len(scene.nodes) > 6 else "")
    raise refuse(name, f"nodes of the scene, their names or indices from 0 to {len(scene.nodes) - 1} ({names})", node)


def pixels(name: str, value: Any) -> tuple[int, int]:
    """Check a size: width and height in pixels, integers of at least 1."""
    try:
        width, height = several(whole(1, LARGEST_SIDE), "pixels", 2)(name, value)
    except ValueError:  # too few values, or SettingsError
        raise refuse(name, f"two integers in [1, {LARGEST_SIDE}] (width, height in pixels)", value) from None
    return width, height
