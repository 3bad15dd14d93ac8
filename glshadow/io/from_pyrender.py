"""Reads a pyrender.Scene as nodes, camera and lights, and a pyrender.Mesh as nodes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.builder import Builder
from glshadow.io.clouds import lines_of, linked, points_of
from glshadow.io.imported import (
    WIDEST_CONE,
    Imported,
    alpha_mode,
    fans,
    linear_colors,
    reflectance,
    rgba,
    solid,
    tinted,
)
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.scene.mesh import Material, Mesh
from glshadow.scene.nodes import Node

POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6


Made = dict[int, tuple[Any, Mesh | None]]
"""Primitive by its id -> the primitive, which keeps it alive, and the mesh made from it."""


def read_pyrender(scene: Any, made: Made | None = None) -> Imported:
    """Read a pyrender.Scene: primitives at their poses, its main camera, its lights with their intensities; or a pyrender.Mesh.

    Point and spot lights fall off with the square of the distance, as in pyrender. The clip planes of cameras are ignored.
    As in pyrender, an IntrinsicsCamera's pixels are those of the rendered size, and an OrthographicCamera shows a height of 2 ymag,
    whatever its xmag. `made`: meshes of earlier calls; new ones are added.
    """
    builder = Builder()
    found = Imported(notes=builder.notes)
    made = {} if made is None else made
    if not hasattr(scene, "mesh_nodes"):
        placed_meshes = [(np.eye(4), str(getattr(scene, "name", None) or "mesh"), _alone(scene))]
    else:
        placed_meshes = [
            (scene.get_pose(node), str(node.name or node.mesh.name or f"mesh{number}"), node.mesh)
            for number, node in enumerate(placed_nodes(scene))
        ]
    for given, name, whole in placed_meshes:
        pose = np.asarray(given, dtype=np.float64)
        for primitive in whole.primitives:
            if id(primitive) not in made:
                made[id(primitive)] = primitive, _mesh(builder, primitive, name)
            mesh = made[id(primitive)][1]
            poses = np.eye(4)[None] if primitive.poses is None else np.asarray(primitive.poses, dtype=np.float64)
            if mesh is not None:
                titles = [name] if len(poses) == 1 else [f"{name}[{k}]" for k in range(len(poses))]
                found.nodes += [Node(mesh, pose @ own, title) for title, own in zip(titles, poses, strict=True)]
    if not hasattr(scene, "mesh_nodes"):
        return found
    found.camera, found.cameras = _cameras(scene, found.notes)
    placed = sorted(scene.light_nodes, key=_order(scene))
    found.lights = [_light(node.light, np.asarray(scene.get_pose(node)), found.notes) for node in placed] or None
    return found


def _alone(source: Any) -> Any:
    """A pyrender.Mesh that is in no scene.

    Raises
    ------
    SceneError
        For everything else.
    """
    if not hasattr(source, "primitives"):
        raise SceneError(f"a pyrender.{type(source).__name__} is neither a scene nor a mesh: add it to a scene")
    return source


def placed_nodes(scene: Any) -> list[Any]:
    """Nodes with a mesh, in the order in which they were added."""
    return sorted(scene.mesh_nodes, key=_order(scene))


def _order(scene: Any) -> Any:
    """Sort key: pyrender keeps nodes in sets, whose order changes from run to run; its graph keeps the insertion order."""
    places = {node: place for place, node in enumerate(scene._digraph.nodes)} if hasattr(scene, "_digraph") else {}
    return lambda node: places.get(node, 0)


def _mesh(builder: Builder, primitive: Any, name: str) -> Mesh | None:
    count = len(primitive.positions)
    indices = (
        np.arange(count) if primitive.indices is None else np.asarray(primitive.indices, dtype=np.int64).reshape(-1)
    )
    if primitive.mode not in (TRIANGLES, STRIP, FAN):
        return _loose(builder, primitive, indices, name)
    if primitive.mode == TRIANGLES:
        triangles = indices[: len(indices) // 3 * 3].reshape(-1, 3)
    elif primitive.mode == FAN:
        triangles = fans(indices[None])
    else:
        triangles = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
        triangles[1::2] = triangles[1::2][:, ::-1]
    mesh = builder.mesh(primitive.positions, triangles, name=name, normals=primitive.normals, visual=None)
    if mesh is None:
        return None
    material, colors = tinted(_material(builder, primitive.material, name), _colors(builder, primitive, name))
    used = np.zeros(count, dtype=bool)
    used[triangles.ravel()] = True
    uv = _uv(primitive.texcoord_0, used)
    colors = None if colors is None else colors[used]
    if material.texture is not None and uv is None:
        builder.notes.append(f"{name} has a texture but no texture coordinates: drawn without it")
        material = replace(material, texture=None)
    uv = None if material.texture is None else uv
    return replace(mesh, uv=uv, colors=colors, material=solid(material, colors))


def _loose(builder: Builder, primitive: Any, indices: NDArray[np.int64], name: str) -> Mesh | None:
    """Points or lines; their radius is derived, not that of `Mesh.from_points` spheres, which are triangles."""
    colors = _colors(builder, primitive, name)
    material = _material(builder, primitive.material, name)
    if primitive.mode == POINTS:
        own = None if colors is None else colors[indices]
        return points_of(primitive.positions[indices], own, name, builder.notes, material)
    return lines_of(primitive.positions, linked(indices, primitive.mode), colors, name, builder.notes, material)


def _colors(builder: Builder, primitive: Any, name: str) -> Array | None:
    """Vertex colours (V, 4); pyrender multiplies with them unconverted, so they are linear."""
    if primitive.color_0 is None or len(primitive.color_0) != len(primitive.positions):
        return None
    return linear_colors(primitive.color_0, name, builder.notes)


def _uv(given: Any, used: NDArray[np.bool_]) -> NDArray[np.float32] | None:
    """Texture coordinates (v up) of the used vertices, in their order."""
    if given is None or len(given) != len(used):
        return None
    with np.errstate(over="ignore"):
        uv = np.asarray(given, dtype=np.float32)
    if not np.isfinite(uv).all():
        return None
    return uv[used][:, :2]


def _material(builder: Builder, given: Any, name: str) -> Material:
    if given is None:
        return Material()
    factor = getattr(given, "baseColorFactor", getattr(given, "diffuseFactor", None))
    texture = getattr(given, "baseColorTexture", getattr(given, "diffuseTexture", None))
    color = (1.0,) * 4 if factor is None else reflectance(np.append(factor, 1.0)[:4], name, builder.notes)
    return Material(
        color=color,  # type: ignore[arg-type]
        texture=_texture(builder, texture, name),
        alpha_mode=alpha_mode(given.alphaMode),
        cutoff=0.5 if given.alphaCutoff is None else float(given.alphaCutoff),
        double_sided=bool(given.doubleSided),
    )


def _texture(builder: Builder, texture: Any, name: str) -> NDArray[np.uint8] | None:
    source = getattr(texture, "source", None)
    if source is None:
        return None
    if not isinstance(source, np.ndarray):
        return builder.texture(source, name)
    pixels = source if source.ndim == 3 else source[..., None]
    if pixels.dtype != np.uint8:
        pixels = (np.clip(pixels, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return rgba(pixels)


def _cameras(scene: Any, notes: list[str]) -> tuple[Camera | None, dict[str, Camera]]:
    """The main camera, and all of them by the names of their nodes, made unique."""
    nodes = sorted(getattr(scene, "camera_nodes", ()), key=_order(scene))
    main = scene.main_camera_node
    found: dict[str, Camera] = {}
    chosen = None
    for number, node in enumerate([main] if main is not None and main not in nodes else nodes):
        camera = _camera(scene, node, notes)
        if camera is None:
            continue
        name = str(node.name or getattr(node.camera, "name", None) or f"camera{number}")
        found[name if name not in found else f"{name}.{number}"] = camera
        chosen = camera if node is main else chosen
    return chosen, found


def _camera(scene: Any, node: Any, notes: list[str]) -> Camera | None:
    camera, pose = node.camera, np.asarray(scene.get_pose(node), dtype=np.float64)
    if hasattr(camera, "yfov"):
        return PerspectiveCamera.from_pose(pose, float(np.degrees(camera.yfov)))
    if hasattr(camera, "fx"):
        return IntrinsicsCamera.from_pose(pose, camera.fx, camera.fy, camera.cx, camera.cy)
    if hasattr(camera, "ymag"):
        return OrthographicCamera.from_pose(pose, 2.0 * camera.ymag)
    notes.append(f"its camera is a {type(camera).__name__}, which is not supported: left out")
    return None


def _light(light: Any, pose: Array, notes: list[str]) -> Light:
    color, intensity = tuple(np.asarray(light.color, dtype=np.float64).tolist()), float(light.intensity)
    position, direction = tuple(pose[:3, 3].tolist()), tuple((-pose[:3, 2]).tolist())
    reach = None if getattr(light, "range", None) is None else float(light.range)
    if hasattr(light, "outerConeAngle"):
        inner, outer = float(np.degrees(light.innerConeAngle)), float(np.degrees(light.outerConeAngle))
        if outer > WIDEST_CONE:
            notes.append(f"a spot light opens {outer:g} degrees from its axis: narrowed to {WIDEST_CONE:g}")
        return SpotLight(
            position=position,
            direction=direction,
            color=color,
            intensity=intensity,
            inner_angle=min(inner, WIDEST_CONE),
            outer_angle=min(outer, WIDEST_CONE),
            range=reach,
            falloff=2.0,
        )
    if hasattr(light, "range"):
        return PointLight(position=position, color=color, intensity=intensity, range=reach, falloff=2.0)
    return DirectionalLight(direction=direction, color=color, intensity=intensity)
