"""Collects, while a glTF file is read, what its animations move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array
from glshadow.io.gltf.animation import Animation, read_animations
from glshadow.io.gltf.document import Document
from glshadow.io.gltf.graph import Graph
from glshadow.io.gltf.morph import Weights
from glshadow.io.gltf.pose import Deformer, Hierarchy, Moving, Part, hierarchy
from glshadow.io.gltf.skin import Bound
from glshadow.lights import Light
from glshadow.scene.mesh import Mesh
from glshadow.scene.motion import Motion

CameraAt = tuple[int, Camera, Callable[[Array], Camera]]
LightAt = tuple[int, Light, Callable[[Array], Light]]
"""A node, its light at rest, and a function that places the light by a node's world matrix."""


@dataclass
class Movement:
    """What animations move, node by node of the scene.

    Attributes
    ----------
    animations : dict
        By name.
    hierarchy : Hierarchy
        The nodes that they move.
    weighted : set of int
        Nodes whose morph targets they blend.
    """

    animations: dict[str, Animation]
    hierarchy: Hierarchy
    weighted: frozenset[int]
    parts: dict[int, Part] = field(default_factory=dict)
    weights: dict[int, Weights] = field(default_factory=dict)
    skins: dict[int, Bound] = field(default_factory=dict)

    def moves(self, node: int) -> bool:
        """Whether an animation moves a node, or one above it."""
        return node in self.hierarchy.rows

    def deforms(self, node: int, skin: Bound | None) -> bool:
        """Whether an animation deforms the mesh of a node: by its morph targets or its skin's joints."""
        return node in self.weighted or (skin is not None and any(map(self.moves, skin.joints)))

    def add(
        self,
        first: int,
        node: int,
        mesh: Mesh | Deformer,
        places: Array,
        locals_: Callable[[], Array] | None,
        weights: Weights,
        skin: int | None,
    ) -> None:
        """Add the nodes of the scene, from number `first` on, that a node of the file becomes: one for each of `places` (P, 4, 4).

        Parameters
        ----------
        locals_ : function, optional
            Gives node_from_mesh of each place; None: a skin places the mesh.
        skin : int, optional
            Index of the skin that deforms it.
        """
        fixed = locals_ is None or not self.moves(node)
        if fixed and isinstance(mesh, Mesh):
            return
        if isinstance(mesh, Deformer):
            self.weights[node] = weights
        local = None if fixed or locals_ is None else locals_()
        for k, place in enumerate(places):
            self.parts[first + k] = Part(node, mesh, place, None if local is None else local[k], skin)

    def motion(self, graph: Graph, cameras: dict[str, CameraAt], lights: Sequence[LightAt]) -> Motion | None:
        """The motion of the scene; None if the file has no animation."""
        if not self.animations:
            return None
        rows = self.hierarchy.rows
        skins = {}
        for index in {part.skin for part in self.parts.values() if part.skin is not None}:
            skin = self.skins[index]
            still = np.stack(graph.matrices(skin.joints))
            skins[index] = (skin, still, np.array([rows.get(joint, -1) for joint in skin.joints], dtype=np.int64))
        moving = Moving(self.animations, self.hierarchy, self.weights, self.parts, skins, cameras, tuple(lights))
        return Motion(
            moving,
            next(iter(self.animations)),
            cameras={name: camera for name, (_, camera, _) in cameras.items()},
            lights=tuple(light for _, light, _ in lights),
        )


def movement(document: Document, graph: Graph) -> Movement:
    """What the animations of a file move; nothing if it has none."""
    animations = read_animations(document)
    tracks = [track for each in animations.values() for track in each.tracks]
    return Movement(
        animations,
        hierarchy(graph, {track.node for track in tracks if track.path != "weights"}),
        frozenset(track.node for track in tracks if track.path == "weights"),
    )
