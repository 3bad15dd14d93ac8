"""Baked: visibility on faces, vertices or texels as arrays, and as objects and files of other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.baking.gltf import written
from glshadow.core.setting import as_path, optional, refuse, whole
from glshadow.core.spaces import world_positions
from glshadow.errors import SettingsError, required
from glshadow.files import replacing
from glshadow.lights import Light
from glshadow.scene.faces import face_starts
from glshadow.scene.nodes import Node, Scene


@dataclass(frozen=True, eq=False, repr=False)
class Baked:
    """The share of each light that a scene's faces, vertices or texels see.

    Attributes
    ----------
    scene, lights
        As given.
    to : {"faces", "vertices", "texels"}
    values : (L, F) float32, or mapping from node names to arrays
        Faces: by scene-wide number, as in `Frame.triangle`; NaN for what was not baked. Vertices: (L, V) of each
        node, NaN for a vertex of no triangle. Texels: images (L, H, W) of each node, row 0 at the top, NaN far from all faces.
    error : (L, F) float32, optional
        Of faces, a bound of the standard deviation: see `bake`.
    samples : int
        Points of each face or texel.
    uv_set : int
        Texture coordinates of the texels.
    """

    scene: Scene
    lights: tuple[Light, ...]
    to: str
    values: NDArray[np.float32] | Mapping[str, NDArray[np.float32]]
    error: NDArray[np.float32] | None
    samples: int
    uv_set: int = 0

    def __repr__(self) -> str:
        lights = f"{len(self.lights)} light{'' if len(self.lights) == 1 else 's'}"
        return f"Baked({self.scene.name!r}, to {self.to}, {lights}, {self.samples} samples)"

    def of(self, node: str, light: int | None = None) -> NDArray[np.float32]:
        """The values of a node: of one light, or the mean of all. (T,) faces, (V,) vertices or (H, W) texels.

        Raises
        ------
        SettingsError
            If no baked node has that name, or there is no such light.
        """
        rows = self._rows(light)
        if isinstance(self.values, Mapping):
            if node not in self.values:
                known = ", ".join(list(self.values)[:8])
                raise SettingsError(f"{node!r} is no baked node; these are: {known}")
            values = self.values[node]
        else:
            if node not in self.scene.places:
                raise SettingsError(f"no node of {self.scene.name} is named {node!r}")
            number, starts = self.scene.places[node], face_starts(self.scene)
            values = self.values[:, starts[number] : starts[number + 1]]
        return np.asarray(values[rows].mean(axis=0), dtype=np.float32)

    @property
    def _nodes(self) -> list[Node]:
        """The baked nodes."""
        if isinstance(self.values, Mapping):
            return [self.scene.nodes[self.scene.places[name]] for name in self.values]
        starts, known = face_starts(self.scene), np.asarray(np.isfinite(self.values).all(axis=0))
        return [node for k, node in enumerate(self.scene.nodes) if known[starts[k] : starts[k + 1]].any()]

    def _rows(self, light: int | None) -> list[int]:
        if not self.lights:
            raise SettingsError("nothing is baked: there are no lights")
        number = optional(whole(0, len(self.lights) - 1))("light", light)
        return list(range(len(self.lights))) if number is None else [number]

    def to_gltf(self, path: str | PathLike[str], light: int | None = None) -> None:
        """Write a .glb file with the baked nodes' triangles, base colours and values.

        Vertices and faces: in COLOR_0, multiplied with the colours of the vertices; those of faces get vertices of their own. Texels: an
        occlusion texture (red), which glTF applies to ambient light. Of materials only base colour factor, sides and alpha mode are
        written, not their textures; no animation, points or lines.

        Parameters
        ----------
        path : str or path
            Ends in .glb.
        light : int, optional
            None: the mean of all lights.
        """
        target = as_path("path", path)
        if target.suffix.lower() != ".glb":
            raise refuse("path", "a file that ends in .glb", path)
        nodes = self._nodes
        values = [self.of(node.name, light) for node in nodes]
        with replacing(target) as part:
            part.write_bytes(written(nodes, values, self.to, self.uv_set))

    def to_pyvista(self, light: int | None = None) -> Any:
        """A `pyvista.PolyData` of the baked triangles in the world, with an array "visibility" of its cells or points.

        Raises
        ------
        GlshadowError
            If pyvista is not installed.
        SettingsError
            For texels, which are images: see `values`.
        """
        if self.to == "texels":
            raise SettingsError("PyVista takes values of faces or vertices: texels are images, see Baked.values")
        required("to_pyvista", "bake", "pyvista")
        import pyvista

        points, values = [], []
        faces: list[Any] = []
        count = 0
        for node in self._nodes:
            mesh = node.mesh
            points.append(world_positions(mesh.positions, node.world_from_mesh, np.zeros(3)))
            faces.append(mesh.triangles.astype(np.int64) + count)
            values.append(self.of(node.name, light))
            count += len(mesh.positions)
        surface = pyvista.PolyData.from_regular_faces(np.concatenate(points), np.concatenate(faces).astype(int))
        data = surface.cell_data if self.to == "faces" else surface.point_data
        data["visibility"] = np.concatenate(values)
        return surface

    def to_xarray(self) -> Any:
        """An `xarray.Dataset`. Faces: "visibility" and "error" (light, face), with the node of each face as a coordinate. Vertices and
        texels: an array for each node, by its name.

        Raises
        ------
        GlshadowError
            If xarray is not installed.
        """
        required("to_xarray", "bake", "xarray")
        import xarray

        kinds = [type(light).__name__ for light in self.lights]
        attributes = {"scene": self.scene.name, "to": self.to, "samples": self.samples}
        coordinates: dict[str, Any] = {"kind": ("light", kinds)}
        if isinstance(self.values, Mapping):
            within = ("vertex",) if self.to == "vertices" else ("row", "column")
            arrays = {
                name: (("light", *(f"{each} of {name}" for each in within)), values)
                for name, values in self.values.items()
            }
            return xarray.Dataset(arrays, coordinates, attributes)
        names = np.array([node.name for node in self.scene.nodes])
        coordinates["node"] = ("face", np.repeat(names, np.diff(face_starts(self.scene))))
        of_faces = {"visibility": (("light", "face"), self.values), "error": (("light", "face"), self.error)}
        return xarray.Dataset(of_faces, coordinates, attributes)
