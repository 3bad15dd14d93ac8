"""Gives meshes without a material the reflectance of a look's white."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

from glshadow.io.imported import WHITE
from glshadow.scene.mesh import MAPS, AlphaMode, Mesh
from glshadow.scene.motion import moved
from glshadow.scene.nodes import Node


class Whitened:
    """Changes meshes that are wholly white and matte, as where a source names no material.

    Parameters
    ----------
    white : float
        Linear reflectance.
    nodes : sequence of Node
        As read; each mesh of theirs is changed once, so that nodes share it and it stays the same object in every pose.
    """

    def __init__(self, white: float, nodes: Sequence[Node]) -> None:
        color = (white, white, white, 1.0)
        meshes = {id(node.mesh): node.mesh for node in nodes if _unpainted(node.mesh)} if white != 1.0 else {}
        self._materials = {id(mesh.material): mesh.material for mesh in meshes.values()}
        self._white = {key: replace(each, color=color) for key, each in self._materials.items()}
        self._read, self._made = meshes, {key: self._changed(each) for key, each in meshes.items()}

    def __call__(self, mesh: Mesh) -> Mesh:
        """The mesh, or the same with another material."""
        if id(mesh) in self._made:
            return self._made[id(mesh)]
        return self._changed(mesh) if id(mesh.material) in self._white and mesh.colors is None else mesh

    def _changed(self, mesh: Mesh) -> Mesh:
        made = copy(mesh)
        object.__setattr__(made, "material", self._white[id(mesh.material)])
        return made

    def __getstate__(self) -> tuple[Any, ...]:
        return tuple([(each, made[key]) for key, each in read.items()] for read, made in self._pairs)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        """Objects have other ids where they are unpickled."""
        (self._materials, self._white), (self._read, self._made) = (
            ({id(each): each for each, _ in pairs}, {id(each): made for each, made in pairs}) for pairs in state
        )

    @property
    def _pairs(self) -> tuple[tuple[dict[int, Any], dict[int, Any]], ...]:
        return (self._materials, self._white), (self._read, self._made)

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
