"""Converts arrays and trimesh visuals to meshes, for the readers of trimesh's and pyrender's objects."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.imported import (
    WHITE,
    alpha_mode,
    fans,
    linear_colors,
    of_mtl,
    reflectance,
    solid,
    srgb_colors,
    tinted,
    usable_normals,
    used_only,
)
from glshadow.scene.mesh import Material, Mesh

UNSET_DIFFUSE = (102, 102, 102, 255)  # trimesh's grey for "no colour given" (trimesh.visual.color.DEFAULT_COLOR)


@dataclass
class Builder:
    """Converts arrays and trimesh visuals to meshes; images are decoded once."""

    notes: list[str] = field(default_factory=list)
    # by id, with the image itself, which must stay alive while its id is a key
    images: dict[int, tuple[Any, NDArray[np.uint8] | None]] = field(default_factory=dict)

    def mesh(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        name: str,
        normals: ArrayLike | None = None,
        visual: Any = None,
        colors: ArrayLike | None = None,
        face_colors: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        material: Material | None = None,
    ) -> Mesh | None:
        """A Mesh, or None if there are no triangles.

        Parameters
        ----------
        vertices : (V, 3); faces : (T, K)
            Convex polygons of K corners.
        normals : (V, 3), optional
        visual : trimesh visual, optional
        colors, face_colors : (V, 3 or 4), (T, 3 or 4), optional
            sRGB bytes or floats in 0..1, straight alpha, used instead of the visual's. With face colours, each triangle gets vertices of
            its own.
        uv : (V, 2), optional
            Texture coordinates, v up; kept also without a texture, for materials that are given later.
        material : Material, optional
            Used instead of the visual's.
        """
        positions, polygons = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
        if len(positions) == 0 or polygons.ndim != 2 or len(polygons) == 0:
            return None
        triangles = fans(polygons) if polygons.shape[1] != 3 else polygons.astype(np.int64)
        if triangles.min() < 0 or triangles.max() >= len(positions):
            worst = int(triangles.max() if triangles.max() >= len(positions) else triangles.min())
            raise SceneError(f"{name}: a face refers to vertex {worst}, but there are {len(positions)}")
        found, own_uv = self._visual(visual, len(positions), name)
        material = found if material is None else material
        uv = own_uv if uv is None else self._coordinates(uv, len(positions), name)
        if uv is None and material.texture is not None:
            material = replace(material, texture=None)
        kept_normals: NDArray[Any] | None = usable_normals(positions, triangles, normals)
        kind = getattr(visual, "kind", None)
        if kind == "face" and colors is None and face_colors is None:
            face_colors = visual.face_colors
        linear = self._whole(self._vertex_colors(visual, colors, name), len(positions), name)
        material, tints = tinted(material, linear)
        if face_colors is not None:
            material, own = tinted(
                material, self._whole(srgb_colors(face_colors, name, self.notes), len(polygons), name)
            )
            if own is not None:
                tints = np.repeat(own, len(triangles) // len(polygons) * 3, axis=0)
                corners = triangles.ravel()
                positions, triangles = positions[corners], np.arange(len(corners)).reshape(-1, 3)
                kept_normals, uv = (None if each is None else each[corners] for each in (kept_normals, uv))
        material = solid(material, tints)
        positions, triangles, (kept_normals, uv, tints) = used_only(positions, triangles, kept_normals, uv, tints)
        try:
            return Mesh(positions, triangles.astype(np.int32), kept_normals, uv, tints, material)
        except SceneError as error:
            raise SceneError(f"{name}: {error}; repair or remove them") from error

    def _vertex_colors(self, visual: Any, colors: ArrayLike | None, name: str) -> Array | None:
        """Linear RGBA; a visual's colours next to a material are glTF's COLOR_0, which is linear."""
        if colors is None and getattr(visual, "kind", None) == "vertex":
            colors = visual.vertex_colors
        if colors is not None:
            return srgb_colors(colors, name, self.notes)
        beside = getattr(visual, "vertex_attributes", {}).get("color")
        if beside is None:
            return None
        stored = np.asarray(beside)
        return linear_colors(stored / 255.0 if stored.dtype == np.uint8 else stored, name, self.notes)

    def _whole(self, colors: Array | None, count: int, name: str) -> Array | None:
        if colors is None or len(colors) == count:
            return colors
        self.notes.append(f"{name} has {len(colors)} colours for {count} vertices or faces: drawn without them")
        return None

    def _visual(self, visual: Any, vertices: int, name: str) -> tuple[Material, NDArray[np.float32] | None]:
        if getattr(visual, "kind", None) != "texture":
            return WHITE, None
        material = self._material(visual.material, name)
        if material.texture is None:
            return material, None
        uv = self._coordinates(visual.uv, vertices, name)
        return (replace(material, texture=None), None) if uv is None else (material, uv)

    def _coordinates(self, given: Any, vertices: int, name: str) -> NDArray[np.float32] | None:
        """Texture coordinates (V, 2); None, with a note, if they are not usable."""
        with np.errstate(over="ignore"):  # values beyond float32 are not usable
            uv = None if given is None else np.asarray(given, dtype=np.float32)
        if uv is None or uv.ndim != 2 or len(uv) != vertices or not np.isfinite(uv[:, :2]).all():
            self.notes.append(f"{name} has a texture but no usable texture coordinates: drawn without it")
            return None
        return uv[:, :2]

    def _material(self, given: Any, name: str) -> Material:
        if hasattr(given, "baseColorFactor"):  # PBRMaterial
            factor = given.baseColorFactor
            color = (1.0,) * 4 if factor is None else tuple((np.asarray(factor, dtype=np.float64) / 255.0).tolist())
            material = Material(
                color=color,
                texture=self.texture(given.baseColorTexture, name),
                alpha_mode=alpha_mode(given.alphaMode),
                cutoff=0.5 if given.alphaCutoff is None else float(given.alphaCutoff),
                double_sided=bool(given.doubleSided),
            )
            return material
        if not hasattr(given, "diffuse"):
            self.notes.append(f"{name} has a {type(given).__name__}, which is not supported: drawn white")
            return WHITE
        return self._simple(given, name)

    def _simple(self, given: Any, name: str) -> Material:
        """SimpleMaterial of an OBJ: Kd (taken as linear), map_Kd, d."""
        texture = self.texture(given.image, name)
        extra = getattr(given, "kwargs", {}) or {}
        diffuse = tuple(np.asarray(given.diffuse).tolist())
        if "kd" in extra and np.shape(extra["kd"]) == (3,):
            color = np.array(reflectance(extra["kd"], name, self.notes))  # not rounded to bytes
        else:
            color = np.ones(3) if diffuse == UNSET_DIFFUSE else np.asarray(diffuse[:3]) / 255.0
        try:
            opacity = float(np.ravel(extra.get("d", 1.0))[0])
        except (ValueError, IndexError):
            opacity = 1.0
        return of_mtl(color, opacity, texture)

    def texture(self, picture: Any, name: str) -> NDArray[np.uint8] | None:
        """A PIL image as RGBA bytes (H, W, 4)."""
        if picture is None:
            return None
        if id(picture) not in self.images:
            try:
                self.images[id(picture)] = (picture, _pixels(picture))
            except (OSError, ValueError, SyntaxError) as error:
                self.notes.append(f"{name}: its texture cannot be decoded ({error}): drawn without it")
                self.images[id(picture)] = (picture, None)
        return self.images[id(picture)][1]


def _pixels(picture: Any) -> NDArray[np.uint8]:
    if picture.mode.startswith("I"):  # 16-bit grey image; convert() would clip instead of scale
        grey = (np.asarray(picture).astype(np.uint32) >> 8).clip(0, 255).astype(np.uint8)
        return np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=2)
    return np.ascontiguousarray(np.asarray(picture.convert("RGBA"), dtype=np.uint8))
