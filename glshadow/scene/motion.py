"""Motion: how a loaded scene moves in time, and the scene at a given time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.setting import number, shown
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.lights import Light
from glshadow.scene.mesh import Mesh

if TYPE_CHECKING:
    from glshadow.scene.nodes import Node, Scene

_SECONDS = number(unit="s")
VANISHED = 1e-9  # scale of nodes that stand for those of scale 0, if a scene has no others


@dataclass(frozen=True, eq=False)
class Pose:
    """What moves, at one time.

    Parameters
    ----------
    nodes : dict
        Number of a node, in the order of the source -> its mesh and world_from_mesh (4, 4).
    cameras : dict
        All cameras of the source by name.
    lights : tuple of Light
        All lights of the source.
    """

    nodes: Mapping[int, tuple[Mesh, Array]]
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    lights: tuple[Light, ...] = ()


class Animated(Protocol):
    """What a reader keeps of a file with animations."""

    @property
    def durations(self) -> Mapping[str, float]:
        """Name of each animation -> its length in seconds."""

    def pose(self, animation: str, seconds: float) -> Pose:
        """Everything that any animation moves, at a time of one of them."""


@dataclass(frozen=True, eq=False)
class Motion:
    """How a scene moves: its animations, one of which is chosen.

    Parameters
    ----------
    source : Animated
    animation : str
        The chosen animation.
    names : tuple of str
        Names of the source's nodes in the scene.
    cameras, lights : optional
        Of the source as they are in the scene now. A scene with other ones keeps those.
    turn : (3, 3) float64
        Rotation of the source's axes to the scene's.
    changed : function
        What the scene shows in place of a mesh of the source.
    """

    source: Animated
    animation: str
    names: tuple[str, ...] = ()
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    lights: tuple[Light, ...] = ()
    turn: Array = field(default_factory=lambda: np.eye(3))
    changed: Callable[[Mesh], Mesh] = lambda mesh: mesh

    @property
    def duration(self) -> float:
        """Length of the chosen animation, seconds."""
        return self.source.durations[self.animation]

    def of(self, animation: str | int | None) -> Motion:
        """The same with another animation, given by name or by number from 0.

        Raises
        ------
        SceneError
            If there is none of that name or number.
        """
        if animation is None:
            return self
        names = list(self.source.durations)
        if isinstance(animation, int) and not isinstance(animation, bool) and 0 <= animation < len(names):
            animation = names[animation]
        if not isinstance(animation, str) or animation not in self.source.durations:
            known = ", ".join(map(shown, names[:8]))
            raise SceneError(f"no animation is {shown(animation)}; there are {len(names)}: {known}")
        return self if animation == self.animation else replace(self, animation=animation)

    def placed(self, scene: Scene, seconds: float) -> Scene:
        """The scene at a time: nodes by their names; what does not move is the same object."""
        pose = self.source.pose(self.animation, seconds)
        place = scene.places
        nodes: dict[int, Node] = {}
        turn = np.eye(4)
        turn[:3, :3] = self.turn
        turned = not np.array_equal(self.turn, np.eye(3))
        for each, (mesh, matrix) in pose.nodes.items():
            index = place.get(self.names[each])
            if index is None:  # no longer in the scene
                continue
            node, matrix = scene.nodes[index], turn @ matrix if turned else matrix
            mesh = self.changed(mesh)
            if node.mesh is not mesh or not np.array_equal(node.world_from_mesh, matrix):
                nodes[index] = moved(node, mesh, matrix)
        cameras, lights = dict(pose.cameras), pose.lights
        if turned:
            cameras = {name: turned_camera(each, self.turn) for name, each in cameras.items()}
            lights = tuple(light.turned(self.turn, np.zeros(3)) for light in lights)
        follows: dict[int, Any] = {id(self.cameras[name]): each for name, each in cameras.items()}
        follows |= zip(map(id, self.lights), lights, strict=True)
        seen = follows.get(id(scene.camera), scene.camera)
        lit = tuple(follows.get(id(light), light) for light in scene.lights)
        every = {name: follows.get(id(each), each) for name, each in scene.cameras.items()}
        if not nodes and self is scene.motion and (seen, lit, every) == (scene.camera, scene.lights, scene.cameras):
            return scene  # nothing has moved
        motion = replace(self, cameras=cameras, lights=lights)
        settings = {"camera": seen, "lights": lit, "cameras": every, "motion": motion, "rest": scene.rest or scene}
        try:
            return scene.changed(nodes, **settings)
        except SceneError:
            vanished = {index: node for index, node in nodes.items() if not node.world_from_mesh[:3, :3].any()}
            if not vanished:
                raise
        return scene.changed(nodes | {index: _unseen(node) for index, node in vanished.items()}, **settings)


def posed(scene: Scene, seconds: Any, animation: str | int | None) -> Scene:
    """The scene at a time.

    Raises
    ------
    SettingsError
        If `seconds` is not a finite number.
    SceneError
        If there is no such animation, or nothing can be drawn then.
    """
    given = float(_SECONDS("seconds", seconds))
    if scene.motion is None:
        if animation is not None:
            raise SceneError(f"{scene.name} has no animation, and so none that is {shown(animation)}")
        return scene
    motion = scene.motion.of(animation)
    return motion.placed(scene, min(max(given, 0.0), motion.duration))


def _unseen(node: Node) -> Node:
    """A node whose scale is 0, so small that no pixel sees it: a scene needs a size, also when all of it has vanished."""
    matrix = node.world_from_mesh.copy()
    matrix[:3, :3] = VANISHED * np.eye(3)
    return moved(node, node.mesh, matrix)


def moved(node: Node, mesh: Mesh, world_from_mesh: Array) -> Node:
    """A checked node with another mesh and matrix, both checked already."""
    other = copy(node)
    object.__setattr__(other, "mesh", mesh)
    object.__setattr__(other, "world_from_mesh", world_from_mesh)
    return other


def turned_camera(camera: Camera, turn: Array) -> Camera:
    """The camera after a rotation (3, 3) about the origin."""
    place: dict[str, Any] = {
        name: tuple((turn @ np.asarray(getattr(camera, name))).tolist()) for name in ("position", "target", "up")
    }
    return replace(camera, **place)
