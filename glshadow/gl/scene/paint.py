"""What the camera pass draws of a material beside its base colour: maps, roughness and metal, emission. Nothing for a plain material."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.geometry.tangents import face_tangents
from glshadow.gl.scene.textures import Textures
from glshadow.scene.mesh import MAPS, Mesh
from glshadow.scene.texture import Sampler, Texture

VERTEX_TANGENTS, FACE_TANGENTS, FACE_NORMALS = 1, 2, 3
"""GLS_NORMAL_MAP: tangents of vertices; of triangles; these, and normals of triangles."""
MATTE = 2.0
"""The roughness of what is matte, for pass/surface.frag."""
FACTOR, MAP, UNLIT = 1, 2, 3
"""GLS_EMISSION."""


class Paint:
    """A mesh's part of it.

    Attributes
    ----------
    matte, rough, emits : bool
        See Material.
    bumped, occluded : bool
        Whether it has a normal map, an occlusion map.
    defines, uniforms : dict
        Of pass/surface.vert, .geom and .frag.
    textures : dict
        The maps by sampler name.
    of_vertices : dict
        Attributes (V, k) by name.
    of_faces : dict
        The same per triangle (T, k).
    """

    def __init__(self, textures: Textures, mesh: Mesh) -> None:
        material = mesh.material
        self._textures = textures
        self._held: list[tuple[NDArray[np.uint8], Sampler, bool]] = []
        self.matte, self.rough, self.emits = material.matte, material.rough, material.emits
        self.defines: dict[str, int] = {}
        self.uniforms: dict[str, Any] = {}
        self.textures: dict[str, moderngl.Texture] = {}
        self.of_vertices: dict[str, NDArray[np.float32]] = {}
        self.of_faces: dict[str, NDArray[np.float32]] = {}
        maps = {} if material.unlit else {name: getattr(material, name) for name in MAPS}
        maps = {name: each for name, each in maps.items() if each is not None and _placed(each, mesh) is not None}
        if not any(material.emission):
            maps.pop("emission_map", None)
        self.bumped, self.occluded = "normal_map" in maps, "occlusion_map" in maps
        for name, each in maps.items():
            self._add(name, each)
        if maps:
            none = np.zeros((len(mesh.positions), 2), dtype=np.float32)
            sets = [none if each is None else each for each in (mesh.uv, mesh.second_uv)]
            self.of_vertices["a_sets"] = np.concatenate(sets, axis=1)
            self.defines["GLS_SETS"] = 1
        if not self.matte:
            roughness = 1.0 if material.roughness is None else material.roughness
            self.uniforms["u_metallic_roughness"] = (material.metallic, roughness)
        if self.occluded:
            self.uniforms["u_occlusion_strength"] = material.occlusion_strength
        if self.emits:
            self.defines["GLS_EMISSION"] = UNLIT if material.unlit else MAP if "emission_map" in maps else FACTOR
            self.uniforms["u_emitted"] = material.emission
        if self.bumped:
            self.uniforms["u_normal_scale"] = material.normal_scale
            self._add_tangents(mesh, maps["normal_map"])

    def _add(self, name: str, texture: Texture) -> None:
        srgb, sampler = name == "emission_map", texture.sampler
        what = f"a {name.replace('_', ' ')}"
        self.textures[f"u_{name}"] = self._textures.take(texture.pixels, sampler, srgb, what)
        self._held.append((texture.pixels, sampler, srgb))
        matrix = np.eye(3) if sampler.transform is None else sampler.transform
        place = np.zeros((2, 4))
        place[:, 2 * sampler.uv_set : 2 * sampler.uv_set + 2] = matrix[:2, :2]
        self.uniforms[f"u_{name}_place"], self.uniforms[f"u_{name}_offset"] = place, tuple(matrix[:2, 2].tolist())
        self.defines[f"GLS_{name.upper()}"] = 1

    def _add_tangents(self, mesh: Mesh, texture: Texture) -> None:
        if mesh.tangents is not None and mesh.normals is not None:
            self.of_vertices["a_tangent"] = mesh.tangents
            self.defines["GLS_NORMAL_MAP"] = VERTEX_TANGENTS
            return
        uv = _placed(texture, mesh)
        assert uv is not None
        tangents, normals = face_tangents(mesh.positions[mesh.triangles], uv.astype(np.float64)[mesh.triangles])
        self.of_faces["a_tangent"] = tangents.astype(np.float32)
        self.defines["GLS_NORMAL_MAP"] = FACE_TANGENTS
        if mesh.normals is None:
            self.of_faces["a_normal"] = normals.astype(np.float32)
            self.defines |= {"GLS_NORMAL_MAP": FACE_NORMALS, "GLS_SMOOTH": 1}

    def release(self) -> None:
        """Give the textures back."""
        while self._held:
            self._textures.give_back(*self._held.pop())


def _placed(texture: Texture, mesh: Mesh) -> NDArray[np.float32] | None:
    return texture.sampler.place(mesh.uv, mesh.second_uv)


@dataclass(frozen=True)
class Features:
    """What the materials of a scene need beyond a base colour: see the attributes of Paint.

    `glossy`: some are neither matte nor rough; `rough`: none is, and some are rough.
    """

    glossy: bool = False
    rough: bool = False
    occluded: bool = False
    emits: bool = False
    bumped: bool = False

    @classmethod
    def of(cls, paints: Iterable[Paint]) -> Features:
        """Those of meshes."""
        paints = tuple(paints)
        glossy = any(not (each.matte or each.rough) for each in paints)
        return cls(
            glossy, not glossy and any(each.rough for each in paints), any(each.occluded for each in paints),
            any(each.emits for each in paints), any(each.bumped for each in paints),
        )  # fmt: skip

    @property
    def any(self) -> bool:
        """Whether any needs four channels of the surface buffer."""
        return self.glossy or self.occluded or self.emits or self.bumped

    def defines(self, channels: int) -> dict[str, int | str]:
        """Defines of the camera pass and of passes that read its surface buffer, which has as many channels; empty if nothing is needed."""
        each = {
            "GLS_MATERIAL": channels == 4 and (self.glossy or self.rough or self.occluded),
            "GLS_GLOSSY": self.glossy,
            "GLS_ROUGH": self.rough,
            "GLS_OCCLUDED": self.occluded,
            "GLS_EMITS": self.emits,
            "GLS_BUMPED": self.bumped,
            "GLS_OCTAHEDRAL": self.glossy or self.bumped,
        }
        return {name: 1 for name, needed in each.items() if needed}
