"""The GPU meshes of a context: one for each Mesh, Points or Lines that is alive."""

from __future__ import annotations

import weakref

from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.shared import Shared
from glshadow.gl.scene.capsules import GpuCapsules
from glshadow.gl.scene.meshes import GpuMesh, Shape
from glshadow.gl.scene.textures import Textures
from glshadow.scene.capsules import Capsules
from glshadow.scene.mesh import Mesh


class Meshes:
    """The GPU meshes of a context, kept as long as their Mesh is alive."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._shapes: Shared[Shape] = Shared()
        self._textures = Textures(context)
        self._meshes: weakref.WeakKeyDictionary[Mesh, GpuMesh] = weakref.WeakKeyDictionary()
        self._uploaded: list[GpuMesh] = []

    def get(self, mesh: Mesh) -> GpuMesh:
        """The GPU side of a mesh, uploaded at its first use."""
        gpu = self._meshes.get(mesh)
        if gpu is None:
            gpu = self._meshes[mesh] = self._made(mesh)
            self._uploaded.append(gpu)
        return gpu

    def _made(self, mesh: Mesh) -> GpuMesh:
        if isinstance(mesh, Capsules):
            return GpuCapsules(self._context, mesh)
        return GpuMesh(self._context, mesh, self._shapes, self._textures)

    def sweep(self) -> None:
        """Free what belonged to meshes that are gone; a finaliser of the mesh could not: the context may not be current there."""
        if len(self._uploaded) == len(self._meshes):
            return
        held = set(map(id, self._meshes.values()))
        gone = [gpu for gpu in self._uploaded if id(gpu) not in held]
        self._uploaded = [gpu for gpu in self._uploaded if id(gpu) in held]
        for gpu in gone:
            gpu.release()

    def release(self) -> None:
        """Free everything."""
        for gpu in self._uploaded:
            gpu.release()
        self._uploaded.clear()
        self._meshes.clear()
