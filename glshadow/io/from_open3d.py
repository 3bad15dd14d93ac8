"""Reads Open3D's TriangleMesh, PointCloud and LineSet, of its legacy and its tensor interface, as nodes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError
from glshadow.io.builder import Builder
from glshadow.io.clouds import lines_of, points_of
from glshadow.io.imported import Imported, reflectance, rgba, srgb_colors
from glshadow.scene.capsules import Points
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node

Values = NDArray[Any]


@dataclass
class _Arrays:
    """A mesh's arrays; `uv` belongs to corners (T, 3, 2), `picks` (T,) are indices of `textures`."""

    positions: Values
    triangles: Values
    normals: Values | None = None
    colors: Values | None = None
    face_colors: Values | None = None
    uv: Values | None = None
    picks: Values | None = None
    textures: tuple[Values | None, ...] = ()
    color: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)


def read_open3d(source: Any) -> Imported:
    """Read a TriangleMesh, a PointCloud or a LineSet of open3d.geometry or open3d.t.geometry.

    Vertex colours are sRGB. Of a material its base colour and its albedo texture are used; each texture becomes a node.

    Raises
    ------
    SceneError
        If it has no triangles, points or lines.
    """
    builder = Builder()
    found = Imported(notes=builder.notes)
    if hasattr(source, "vertices") and hasattr(source, "triangles"):
        arrays = _legacy(source)
    elif hasattr(source, "vertex") and hasattr(source, "triangle"):
        arrays = _tensor(source, builder)
    else:
        loose = _loose(source, builder.notes)
        if loose is None:
            raise SceneError(f"nothing to render: an open3d {type(source).__name__} has no triangles, points or lines")
        found.nodes.append(Node(loose, np.eye(4), "points" if isinstance(loose, Points) else "lines"))
        return found
    if not (len(arrays.positions) and len(arrays.triangles)):
        raise SceneError("nothing to render: it has no triangles")
    for part, name, texture in _parts(arrays, builder):
        mesh = _mesh(builder, arrays, part, texture, name)
        if mesh is not None:
            found.nodes.append(Node(mesh, np.eye(4), name))
    return found


def _loose(source: Any, notes: list[str]) -> Mesh | None:
    """A PointCloud with colours of points, or a LineSet with colours of lines: each line then has ends of its own."""
    tensor = hasattr(source, "point")
    if tensor:
        positions = _plain(source.point["positions"]) if "positions" in source.point else np.zeros((0, 3))
        of_points = _plain(source.point["colors"]) if "colors" in source.point else None
        line = getattr(source, "line", {})
        segments = _plain(line["indices"]) if "indices" in line else None
        of_lines = _plain(line["colors"]) if "colors" in line else None
    else:
        positions, of_points = np.asarray(getattr(source, "points", ())), None
        segments = np.asarray(source.lines) if hasattr(source, "lines") else None
        given = _filled(getattr(source, "colors", ()))
        of_points, of_lines = (given, None) if segments is None else (None, given)
    if segments is None:
        colors = None if of_points is None else srgb_colors(of_points, "its points", notes)
        return points_of(positions, colors, "its points", notes)
    if of_lines is not None and len(of_lines) == len(segments):
        positions, of_points = np.asarray(positions)[segments.ravel()], np.repeat(of_lines, 2, axis=0)
        segments = np.arange(2 * len(segments)).reshape(-1, 2)
    colors = None if of_points is None else srgb_colors(of_points, "its lines", notes)
    return lines_of(positions, segments, colors, "its lines", notes)


def _legacy(mesh: Any) -> _Arrays:
    """Textures of the legacy interface have row 0 at v = 0: its readers turn images upside down. Some are empty."""
    textures = [np.asarray(each) for each in getattr(mesh, "textures", ())]
    return _Arrays(
        np.asarray(mesh.vertices, dtype=np.float64),
        np.asarray(mesh.triangles),
        _filled(mesh.vertex_normals),
        _filled(mesh.vertex_colors),
        uv=_filled(mesh.triangle_uvs),
        picks=_filled(mesh.triangle_material_ids),
        textures=tuple(each[::-1] if each.ndim >= 2 else None for each in textures),
    )


def _filled(values: Any) -> Values | None:
    array = np.asarray(values)
    return array if len(array) else None


def _tensor(mesh: Any, builder: Builder) -> _Arrays:
    def of(owner: Any, name: str) -> Values | None:
        return _plain(owner[name]) if name in owner else None

    positions, triangles = of(mesh.vertex, "positions"), of(mesh.triangle, "indices")
    if positions is None or triangles is None:
        raise SceneError("nothing to render: it has no triangles")
    texture, color = None, (1.0, 1.0, 1.0, 1.0)
    material = getattr(mesh, "material", None)
    if material is not None:
        if "albedo" in material.texture_maps:
            texture = _plain(material.texture_maps["albedo"].as_tensor())
        if "base_color" in material.vector_properties:
            given = np.append(np.asarray(material.vector_properties["base_color"], dtype=np.float64), 1.0)[:4]
            color = reflectance(given, "its base colour", builder.notes)  # type: ignore[assignment]
    return _Arrays(
        positions,
        triangles,
        of(mesh.vertex, "normals"),
        of(mesh.vertex, "colors"),
        of(mesh.triangle, "colors"),
        of(mesh.triangle, "texture_uvs"),
        textures=() if texture is None else (texture,),
        color=color,
    )


def _plain(tensor: Any) -> Values:
    return np.asarray((tensor.cpu() if hasattr(tensor, "cpu") else tensor).numpy())


def _parts(arrays: _Arrays, builder: Builder) -> Iterator[tuple[Values | slice, str, Values | None]]:
    """Triangles by texture: their numbers, a name, and the texture."""
    usable = arrays.uv is not None and arrays.uv.size == 6 * len(arrays.triangles)
    textures = arrays.textures if usable else ()
    if any(each is not None for each in arrays.textures) and not usable:
        builder.notes.append("it has textures but no usable texture coordinates: drawn without them")
    picks = arrays.picks
    if picks is None or len(picks) != len(arrays.triangles) or len(textures) < 2:
        yield slice(None), "mesh", next((each for each in textures if each is not None), None)
        return
    for number in np.unique(picks).tolist():
        texture = textures[number] if 0 <= number < len(textures) else None
        yield np.flatnonzero(picks == number), f"mesh{number}", texture


def _mesh(builder: Builder, arrays: _Arrays, part: Values | slice, texture: Values | None, name: str) -> Any:
    triangles = np.asarray(arrays.triangles, dtype=np.int64)
    if triangles.min() < 0 or triangles.max() >= len(arrays.positions):
        worst = int(triangles.max() if triangles.max() >= len(arrays.positions) else triangles.min())
        raise SceneError(f"a triangle refers to vertex {worst}, but there are {len(arrays.positions)}")
    triangles, uv = triangles[part], None
    positions, normals, colors = arrays.positions, _whole(arrays.normals, arrays), _whole(arrays.colors, arrays)
    material = Material(color=arrays.color, alpha_mode=AlphaMode.BLEND if arrays.color[3] < 1.0 else AlphaMode.OPAQUE)  # type: ignore[arg-type]
    if texture is not None and arrays.uv is not None:
        uv = arrays.uv.reshape(-1, 3, 2)[part].reshape(-1, 2)
        corners, triangles = triangles.ravel(), np.arange(triangles.size).reshape(-1, 3)
        positions = positions[corners]
        normals, colors = (None if each is None else each[corners] for each in (normals, colors))
        material = Material(color=material.color, texture=_rgba(texture), alpha_mode=material.alpha_mode)
    return builder.mesh(
        positions,
        triangles,
        name=name,
        normals=normals,
        colors=colors,
        face_colors=None if arrays.face_colors is None or colors is not None else arrays.face_colors[part],
        uv=uv,
        material=material,
    )


def _whole(values: Values | None, arrays: _Arrays) -> Values | None:
    """Values of vertices, if there is one for each."""
    return values if values is not None and len(values) == len(arrays.positions) else None


def _rgba(texture: Values) -> NDArray[np.uint8]:
    """Bytes (H, W, 4) of an image (H, W) or (H, W, 1 to 4) of bytes, 16-bit integers, or floats in 0..1."""
    pixels = texture if texture.ndim == 3 else texture[..., None]
    if pixels.dtype.kind == "f":
        pixels = np.rint(np.clip(np.nan_to_num(pixels), 0.0, 1.0) * 255.0)
    elif pixels.dtype == np.uint16:
        pixels = pixels >> 8
    return rgba(pixels)
