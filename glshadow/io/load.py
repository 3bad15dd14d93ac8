"""Loads scenes from files, trimesh and pyrender; unsupported content is refused or noted."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.setting import as_path, flag, instance, number, one_of, optional, refuse, text
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError, warn
from glshadow.io.imported import Imported
from glshadow.io.limits import Budget, Limits
from glshadow.io.mesh_files import SUFFIXES
from glshadow.scene.checks import check_scene, visible
from glshadow.scene.mesh import Mesh
from glshadow.scene.motion import moved, turned_camera
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
    limits: Limits | None = None,
    time: float | None = None,
    animation: str | int | None = None,
) -> Scene:
    """Load a scene from a file or another library's object.

    Parameters
    ----------
    source : path, trimesh.Trimesh, trimesh.Scene, pyrender.Scene, Scene, or meshes and nodes
        One Mesh or Node, or a list of them, is a scene too. Files: .glb, .gltf, .obj, .ply, .stl, .off. Coordinates are not changed,
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
    time : float, optional
        Seconds of the file's animation, see `Scene.at`. None: the pose of the file's nodes; if nothing can be seen of that, the beginning
        of the animation, with a warning.
    animation : str or int, optional
        Name of the animation, or its number from 0; None: the first.

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
    time = optional(number(unit="s"), "the file's pose")("time", time)
    return read_scene(source, Budget(limits or Limits()), ground, up_axis, name, time, animation)


def read_scene(
    source: Any,
    budget: Budget,
    ground: bool | str = False,
    up_axis: str | None = None,
    name: str | None = None,
    time: float | None = None,
    animation: str | int | None = None,
) -> Scene:
    """As `load`, with checked arguments; afterwards `budget.files` has the files that were read."""
    if isinstance(source, Scene) and time is not None:
        source, time = source.at(time, animation), None
    label, title, read, stored = _reader(source, budget)
    try:
        found = read()
        _place(found, time, animation)
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


def _place(found: Imported, time: float | None, animation: str | int | None) -> None:
    """Choose an animation, and place what it moves where it is at a time."""
    motion = found.motion
    if motion is None:
        if time is not None or animation is not None:
            found.notes.append("it has no animation: it looks the same at all times")
        return
    found.motion = motion = motion.of(animation)
    if time is not None:
        if not 0.0 <= time <= motion.duration:
            found.notes.append(
                f"{time:g} s is outside its animation, which lasts {motion.duration:g} s: it stands still"
            )
        found.at(min(max(time, 0.0), motion.duration))
    elif not motion.names and not visible(found.nodes):
        found.at(0.0)
        found.notes.append(
            "nothing can be seen of the pose of its nodes: it is shown at the beginning of its animation"
        )


def _ground(name: str, value: Any) -> bool | str:
    if isinstance(value, str) and value == "catcher":
        return value
    try:
        return bool(flag()(name, value))
    except SettingsError:
        raise refuse(name, 'True, False or "catcher"', value) from None


def _reader(source: Any, budget: Budget) -> tuple[str, str, Callable[[], Imported], bool]:
    """The source's name in messages, its scene's name, a function that reads it, and whether it was stored in a file."""
    if isinstance(source, (str, os.PathLike)):
        try:
            path = as_path("source", source)
        except SettingsError as error:
            raise SceneError(str(error)) from None
        return path.name or str(path), path.stem, lambda: _read_file(path, budget), True
    if isinstance(source, Scene):
        given = Imported(list(source.nodes), source.camera, list(source.lights), motion=source.motion)
        return source.name, source.name, lambda: given, False
    if isinstance(source, Mesh | Node) or (isinstance(source, list | tuple) and source):
        placed = Scene(source if isinstance(source, list | tuple) else [source])  # type: ignore[arg-type]
        return "scene", "scene", lambda: Imported(list(placed.nodes), None, None), False
    libraries = {str(parent.__module__).partition(".")[0] for parent in type(source).__mro__}
    kind = f"{str(type(source).__module__).partition('.')[0]}.{type(source).__name__}"
    if "trimesh" in libraries:
        from glshadow.io.from_trimesh import read_trimesh

        return kind, "scene", lambda: read_trimesh(source), False
    if "pyrender" in libraries:
        from glshadow.io.from_pyrender import read_pyrender

        return kind, "scene", lambda: read_pyrender(source), False
    raise SceneError(
        f"load takes a path ({' '.join(FORMATS)}), a trimesh.Trimesh, a trimesh.Scene, a pyrender.Scene, a Scene, or meshes and nodes, "
        f"got {type(source).__name__}"
    )


def _read_file(path: Path, budget: Budget) -> Imported:
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise SceneError(f"a model file must end in one of {', '.join(FORMATS)}, got {path.suffix or 'no ending'!r}")
    if not path.is_file():
        raise SceneError(f"file not found: {path}")
    if path.stat().st_size == 0:
        raise SceneError("nothing to render: the file is empty (0 bytes)")
    if suffix in GLTF:
        from glshadow.io.gltf import read_gltf

        return read_gltf(path, budget)
    from glshadow.io.mesh_files.read import read_mesh_file

    return read_mesh_file(path, budget)


def _turned(found: Imported, turn: Array, name: str) -> Scene:
    camera, lights, nodes, motion = found.camera, found.lights, found.nodes, found.motion
    if not np.array_equal(turn, np.eye(3)):
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        nodes = [moved(node, node.mesh, matrix @ node.world_from_mesh) for node in nodes]
        camera = None if camera is None else turned_camera(camera, turn)
        lights = None if lights is None else [light.turned(turn, np.zeros(3)) for light in lights]
        if motion is not None:
            motion = replace(motion, turn=turn @ motion.turn)
    scene = Scene(tuple(nodes), camera, None if lights is None else tuple(lights), name)  # type: ignore[arg-type]
    if motion is None:
        return scene
    names = motion.names or tuple(node.name for node in scene.nodes)
    follows = dict(zip(map(id, found.lights or ()), scene.lights, strict=False))
    motion = replace(
        motion,
        names=names,
        camera=camera if motion.camera is found.camera else motion.camera,
        lights=tuple(follows.get(id(light), light) for light in motion.lights),
    )
    return replace(scene, motion=motion)
