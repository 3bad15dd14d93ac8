"""Loads scenes from files, trimesh and pyrender; unsupported content is refused or noted."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.setting import as_path, flag, instance, one_of, optional, refuse, text
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError, warn
from glshadow.io.from_arrays import array_pair, read_arrays
from glshadow.io.imported import Imported
from glshadow.io.limits import Budget, Limits
from glshadow.io.model_file import FORMATS, GLTF, NAMES, ModelFile, from_stream, in_memory, on_disk
from glshadow.scene.checks import check_scene
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene

# world_from_file rotations that turn the named axis up; proper rotations, so that nothing is mirrored
TURNS = {
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}


def load(
    source: Any,
    *,
    ground: bool | str = False,
    up_axis: str | None = None,
    name: str | None = None,
    limits: Limits | None = None,
    format: str | None = None,
) -> Scene:
    """Load a scene from a file or another library's object.

    Parameters
    ----------
    source : path, bytes, file object, (vertices, faces), another library's object, Scene, or meshes and nodes
        One Mesh or Node, or a list of them, is a scene too. Files: .glb, .gltf, .obj, .ply, .stl, .off. Objects: trimesh.Trimesh,
        trimesh.Scene, pyrender.Scene, PyVista's datasets and MultiBlock, Open3D's TriangleMesh. Coordinates are not changed,
        matrices are composed in float64, and nodes with the same geometry share one Mesh. Shading normals are used if the source has
        them; otherwise shading is flat.
    ground : bool or "catcher"
        Put a plane under the model to receive its shadow, see `Scene.with_ground`; "catcher": a shadow catcher, which shows only the
        shadow, see `Node`.
    up_axis : {None, "x", "y", "z"}
        Up axis of the source; it is rotated to y. None means "y", as glTF prescribes; STL and PLY files, and models from CAD, robotics or
        maps, often use "z".
    name : str, optional
        Name of the scene; None: the file's name without its suffix.
    limits : Limits, optional
        What a file may cost, checked before memory is allocated; None: the defaults of `Limits`. Objects in memory are not limited.
    format : {None, "glb", "gltf", "obj", "ply", "stl", "off"}
        Format of a file; None: by its suffix, of bytes and file objects by their beginning.

    Returns
    -------
    Scene
        With the source's camera and lights, or defaults that frame the scene. A camera's clip planes are ignored (derived from the
        scene), as are the default camera and lights that trimesh makes up.

    Raises
    ------
    SceneError
        If the file is missing, broken or empty, needs unsupported features, or exceeds its limits; the message names file
        and cause.
    SettingsError
        If `up_axis` or another argument is not allowed.

    Warns
    -----
    GlshadowWarning
        If something is not drawn as intended: alpha blending, missing textures, lost precision.
    """
    ground, up_axis = _ground("ground", ground), optional(one_of(*TURNS), "y")("up_axis", up_axis)
    name = optional(text(), "the file's name")("name", name)
    limits = optional(instance(Limits), "the defaults")("limits", limits)
    format = optional(one_of(*NAMES), "recognised")("format", format)
    return read_scene(source, Budget(limits or Limits()), ground, up_axis, name, format)


def read_scene(
    source: Any,
    budget: Budget,
    ground: bool | str = False,
    up_axis: str | None = None,
    name: str | None = None,
    format: str | None = None,
) -> Scene:
    """As `load`, with checked arguments; afterwards `budget.files` has the files that were read."""
    label, title, read, stored = _reader(source, budget, None if format is None else f".{format}")
    try:
        found = read()
        notes = found.notes + check_scene(found.nodes, stored=stored)
    except SceneError as error:
        raise SceneError(f"{label}: {error}") from error
    except MemoryError as error:
        raise SceneError(f"{label}: there is not enough memory to read it") from error
    except Exception as error:  # any other error in a reader means that the file is broken; the message must name it
        cause = f"{type(error).__name__}: {error}"
        raise SceneError(f"{label} cannot be read ({cause}); it is broken or not of its format") from error
    for note in notes:
        warn(f"{label}: {note}", stacklevel=4)  # the caller of `load`
    scene = _turned(found, TURNS[up_axis or "y"], name or title)
    return scene.with_ground(ground == "catcher") if ground else scene


def _ground(name: str, value: Any) -> bool | str:
    if isinstance(value, str) and value == "catcher":
        return value
    try:
        return bool(flag()(name, value))
    except SettingsError:
        raise refuse(name, 'True, False or "catcher"', value) from None


def _reader(source: Any, budget: Budget, suffix: str | None) -> tuple[str, str, Callable[[], Imported], bool]:
    """The source's name in messages, its scene's name, a function that reads it, and whether it was stored in a file."""
    stored = _stored_reader(source, budget, suffix)
    if stored is not None:
        return *stored, True
    if suffix is not None:
        raise SceneError(f"format names that of a file, of bytes or of a file object, got {type(source).__name__}")
    if (pair := array_pair(source)) is not None:
        return "(vertices, faces)", "scene", lambda: read_arrays(*pair), False
    if isinstance(source, Scene):
        given = Imported(list(source.nodes), source.camera, list(source.lights))
        return source.name, source.name, lambda: given, False
    if isinstance(source, Mesh | Node) or (isinstance(source, list | tuple) and source):
        placed = Scene(source if isinstance(source, list | tuple) else [source])  # type: ignore[arg-type]
        return "scene", "scene", lambda: Imported(list(placed.nodes), None, None), False
    kind = f"{str(type(source).__module__).partition('.')[0]}.{type(source).__name__}"
    read = _library_reader(source, budget)
    if read is not None:
        return kind, "scene", read, False
    raise SceneError(
        f"load takes a path, bytes or a file object ({' '.join(FORMATS)}), (vertices, faces), a trimesh.Trimesh, a trimesh.Scene, "
        "a pyrender.Scene, a PyVista dataset, an Open3D TriangleMesh, a Scene, or meshes and nodes, got "
        f"{type(source).__name__}"
    )


def _stored_reader(source: Any, budget: Budget, suffix: str | None) -> tuple[str, str, Callable[[], Imported]] | None:
    """The same for a path, bytes or a file object; None for everything else."""
    if isinstance(source, (str, os.PathLike)):
        try:
            path = as_path("source", source)
        except SettingsError as error:
            raise SceneError(str(error)) from None
        return path.name or str(path), path.stem, lambda: _read_file(on_disk(path, suffix), budget)
    if isinstance(source, bytes | bytearray | memoryview):
        return "bytes", "scene", lambda: _read_file(in_memory(bytes(source), suffix), budget)
    if callable(getattr(source, "read", None)) and not isinstance(source, type):
        name = getattr(source, "name", None)
        named = Path(name) if isinstance(name, str) and name else Path("a file object")
        title = named.stem if named.suffix.lower() in FORMATS else "scene"
        return named.name, title, lambda: _read_file(from_stream(source, suffix, budget), budget)
    return None


def _library_reader(source: Any, budget: Budget) -> Callable[[], Imported] | None:
    """A function that reads another library's object, known by its class's module; None for everything else."""
    libraries = {str(parent.__module__).partition(".")[0] for parent in type(source).__mro__}
    if "trimesh" in libraries:
        from glshadow.io.from_trimesh import read_trimesh

        return lambda: read_trimesh(source)
    if "pyrender" in libraries:
        from glshadow.io.from_pyrender import read_pyrender

        return lambda: read_pyrender(source)
    if "pyvista" in libraries:
        from glshadow.io.from_pyvista import read_pyvista

        return lambda: read_pyvista(source, budget)
    if "open3d" in libraries:
        from glshadow.io.from_open3d import read_open3d

        return lambda: read_open3d(source)
    return None


def _read_file(file: ModelFile, budget: Budget) -> Imported:
    if file.suffix in GLTF:
        from glshadow.io.gltf import read_gltf

        return read_gltf(file, budget)
    from glshadow.io.mesh_files.read import read_mesh_file

    return read_mesh_file(file, budget)


def _turned(found: Imported, turn: Array, name: str) -> Scene:
    camera, lights, nodes = found.camera, found.lights, found.nodes
    if not np.array_equal(turn, np.eye(3)):
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        nodes = [Node(node.mesh, matrix @ node.world_from_mesh, node.name) for node in nodes]
        camera = None if camera is None else _turned_camera(camera, turn)
        lights = None if lights is None else [light.turned(turn, np.zeros(3)) for light in lights]
    return Scene(tuple(nodes), camera, None if lights is None else tuple(lights), name)  # type: ignore[arg-type]


def _turn(turn: Array, vector: tuple[float, float, float]) -> Any:
    return tuple((turn @ np.asarray(vector)).tolist())


def _turned_camera(camera: Camera, turn: Array) -> Camera:
    return replace(
        camera, position=_turn(turn, camera.position), target=_turn(turn, camera.target), up=_turn(turn, camera.up)
    )
