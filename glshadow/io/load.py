"""Loads scenes from files, trimesh and pyrender; unsupported content is refused or noted."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.setting import as_int, as_path, flag, instance, number, one_of, optional, refuse, text
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError, warn
from glshadow.io.imported import Imported, shortened
from glshadow.io.limits import Budget, Limits
from glshadow.io.mesh_files import SUFFIXES
from glshadow.io.smoothed import smoothed
from glshadow.scene.checks import check_scene
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene

GLTF = (".glb", ".gltf")
FORMATS = (*GLTF, *SUFFIXES)

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
    camera: str | int | None = None,
    smooth: float | None = None,
    limits: Limits | None = None,
) -> Scene:
    """Load a scene from a file or another library's object.

    Parameters
    ----------
    source : path, trimesh.Trimesh, trimesh.Scene, pyrender.Scene, Scene, or meshes and nodes
        One Mesh or Node, or a list of them, is a scene too. Files: .glb, .gltf, .obj, .ply, .stl, .off. Coordinates are not changed,
        matrices are composed in float64, and nodes with the same geometry share one Mesh. Shading normals are used if the source has
        them; otherwise shading is flat, see `smooth`.
    ground : bool or "catcher"
        Put a plane under the model to receive its shadow, see `Scene.with_ground`; "catcher": a shadow catcher, which shows only the
        shadow, see `Node`.
    up_axis : {None, "x", "y", "z"}
        Up axis of the source; it is rotated to y. None means "y", as glTF prescribes; STL and PLY files, and models from CAD, robotics or
        maps, often use "z".
    name : str, optional
        Name of the scene; None: the file's name without its suffix.
    camera : str or int, optional
        Name of one of the source's cameras, or its number, from 0; None: the first, or pyrender's main camera. All of them are in
        `Scene.cameras`.
    smooth : float, optional
        Crease angle in degrees: meshes without normals get smooth ones, except at edges where triangles meet at this angle or more; 30
        suits most models, 0 keeps all edges. None: flat, or as the smoothing groups of an OBJ file say. glTF files stay as they are: there,
        a mesh without normals is flat.
    limits : Limits, optional
        What a file may cost, checked before memory is allocated; None: the defaults of `Limits`. Objects in memory are not limited.

    Returns
    -------
    Scene
        With the source's camera and lights, or defaults that frame the scene. A camera's clip planes are ignored (derived from the
        scene), as are the default camera and lights that trimesh makes up.

    Raises
    ------
    SceneError
        If the file is missing, nothing of it can be drawn, it needs unsupported features, has no such camera, or exceeds its limits; the
        message names file and cause.
    SettingsError
        If `up_axis` or another argument is not allowed.

    Warns
    -----
    GlshadowWarning
        If something is not drawn as intended: broken parts, missing textures, lost precision.
    """
    ground, up_axis = _ground("ground", ground), optional(one_of(*TURNS), "y")("up_axis", up_axis)
    name = optional(text(), "the file's name")("name", name)
    limits = optional(instance(Limits), "the defaults")("limits", limits)
    camera = optional(_camera, "the first")("camera", camera)
    smooth = optional(number(0.0, 180.0), "flat")("smooth", smooth)
    return read_scene(source, Budget(limits or Limits()), ground, up_axis, name, camera, smooth)


def read_scene(
    source: Any,
    budget: Budget,
    ground: bool | str = False,
    up_axis: str | None = None,
    name: str | None = None,
    camera: str | int | None = None,
    smooth: float | None = None,
) -> Scene:
    """As `load`, with checked arguments; afterwards `budget.files` has the files that were read."""
    label, title, read, stored = _reader(source, budget, smooth)
    try:
        found = read()
        if camera is not None:
            found.camera = found.camera_named(camera)
        notes = found.notes + check_scene(found.nodes, stored=stored)
    except SceneError as error:
        raise SceneError(f"{label}: {error}") from error
    except MemoryError as error:
        raise SceneError(f"{label}: there is not enough memory to read it") from error
    except Exception as error:  # any other error in a reader means that the file is broken; the message must name it
        cause = f"{type(error).__name__}: {error}"
        raise SceneError(f"{label} cannot be read ({cause}); it is broken or not of its format") from error
    for note in shortened(notes):
        warn(f"{label}: {note}", stacklevel=4)  # the caller of `load`
    scene = _turned(found, TURNS[up_axis or "y"], name or title)
    return scene.with_ground(ground == "catcher") if ground else scene


def _camera(name: str, value: Any) -> str | int:
    if isinstance(value, str) and value:
        return value
    index = as_int(value)
    if index is None or index < 0:
        raise refuse(name, "the name or the number of a camera", value)
    return index


def _ground(name: str, value: Any) -> bool | str:
    if isinstance(value, str) and value == "catcher":
        return value
    try:
        return bool(flag()(name, value))
    except SettingsError:
        raise refuse(name, 'True, False or "catcher"', value) from None


def _reader(source: Any, budget: Budget, smooth: float | None = None) -> tuple[str, str, Callable[[], Imported], bool]:
    """The source's name in messages, its scene's name, a function that reads it, and whether it was stored in a file."""
    if isinstance(source, (str, os.PathLike)):
        try:
            path = as_path("source", source)
        except SettingsError as error:
            raise SceneError(str(error)) from None
        return path.name or str(path), path.stem, lambda: _read_file(path, budget, smooth), True
    if isinstance(source, Scene):
        given = Imported(list(source.nodes), source.camera, list(source.lights), cameras=dict(source.cameras))
        return source.name, source.name, lambda: smoothed(given, smooth), False
    if isinstance(source, Mesh | Node) or (isinstance(source, list | tuple) and source):
        placed = Scene(source if isinstance(source, list | tuple) else [source])
        return "scene", "scene", lambda: smoothed(Imported(list(placed.nodes), None, None), smooth), False
    libraries = {str(parent.__module__).partition(".")[0] for parent in type(source).__mro__}
    kind = f"{str(type(source).__module__).partition('.')[0]}.{type(source).__name__}"
    if "trimesh" in libraries:
        from glshadow.io.from_trimesh import read_trimesh

        return kind, "scene", lambda: smoothed(read_trimesh(source), smooth), False
    if "pyrender" in libraries:
        from glshadow.io.from_pyrender import read_pyrender

        return kind, "scene", lambda: smoothed(read_pyrender(source), smooth), False
    raise SceneError(
        f"load takes a path ({' '.join(FORMATS)}), a trimesh.Trimesh, a trimesh.Scene, a pyrender.Scene, a Scene, or meshes and nodes, "
        f"got {type(source).__name__}"
    )


def _read_file(path: Path, budget: Budget, smooth: float | None) -> Imported:
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise SceneError(f"a model file must end in one of {', '.join(FORMATS)}, got {path.suffix or 'no ending'!r}")
    if not path.is_file():
        raise SceneError(f"file not found: {path}")
    if path.stat().st_size == 0:
        raise SceneError("nothing to render: the file is empty (0 bytes)")
    if suffix in GLTF:
        from glshadow.io.gltf import read_gltf

        found = read_gltf(path, budget)
        if smooth is not None and any(node.mesh.normals is None for node in found.nodes):
            found.notes.append(f"smooth={smooth:g} is left out: in glTF, meshes without normals are flat")
        return found
    from glshadow.io.mesh_files.read import read_mesh_file

    return read_mesh_file(path, budget, smooth)


def _turned(found: Imported, turn: Array, name: str) -> Scene:
    camera, lights, nodes, cameras = found.camera, found.lights, found.nodes, found.cameras
    if not np.array_equal(turn, np.eye(3)):
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        nodes = [Node(node.mesh, matrix @ node.world_from_mesh, node.name) for node in nodes]
        camera = None if camera is None else _turned_camera(camera, turn)
        cameras = {title: _turned_camera(each, turn) for title, each in cameras.items()}
        lights = None if lights is None else [light.turned(turn, np.zeros(3)) for light in lights]
    return Scene(nodes, camera, lights, name, cameras)


def _turn(turn: Array, vector: tuple[float, float, float]) -> Any:
    return tuple((turn @ np.asarray(vector)).tolist())


def _turned_camera(camera: Camera, turn: Array) -> Camera:
    return replace(
        camera, position=_turn(turn, camera.position), target=_turn(turn, camera.target), up=_turn(turn, camera.up)
    )
