"""Gives meshes without a material the reflectance of a look's white."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from weakref import WeakKeyDictionary

from glshadow.io.imported import WHITE
from glshadow.scene.mesh import MAPS, AlphaMode, Mesh
from glshadow.scene.motion import moved
from glshadow.scene.nodes import Node


@dataclass(frozen=True, eq=False)
class Whitened:
    """Changes meshes that are wholly white and matte, as where a source names no material; a mesh stays the same object each time.

    Parameters
    ----------
    white : float
        Linear reflectance.
    """

    white: float
    _made: WeakKeyDictionary[Mesh, Mesh] = field(default_factory=WeakKeyDictionary)

    def __call__(self, mesh: Mesh) -> Mesh:
        """The mesh, or the same with another material."""
        if self.white == 1.0 or not _unpainted(mesh):
            return mesh
        if mesh not in self._made:
            made = copy(mesh)
            material = replace(mesh.material, color=(self.white,) * 3 + (1.0,))
            object.__setattr__(made, "material", material)
            self._made[mesh] = made
        return self._made[mesh]

    def node(self, node: Node) -> Node:
        """A node with its mesh changed."""
        mesh = self(node.mesh)
        return node if mesh is node.mesh else moved(node, mesh, node.world_from_mesh)


def _unpainted(mesh: Mesh) -> bool:
    material = mesh.material
    return (
        mesh.colors is None
        and material.color == WHITE.color
        and material.texture is None
        and material.alpha_mode is AlphaMode.OPAQUE
        and material.transmission == 0.0
        and material.matte
        and not material.emits
        and all(getattr(material, name) is None for name in MAPS)
    )
