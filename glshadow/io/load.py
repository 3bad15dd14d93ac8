"""Loads scenes from files, trimesh and pyrender; unsupported content is refused or noted."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.setting import as_path, flag, instance, number, one_of, optional, refuse, shown, text
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError, warn
from glshadow.io.from_arrays import array_pair, read_arrays
from glshadow.io.imported import Imported, name_or_number, shortened
from glshadow.io.limits import Budget, Limits
from glshadow.io.model_file import FORMATS, GLTF, NAMES, TERRAIN, ModelFile, from_stream, in_memory, on_disk
from glshadow.io.smoothed import smoothed
from glshadow.io.whitened import Whitened
from glshadow.scene.checks import check_scene, visible
from glshadow.scene.framing import given_parts
from glshadow.scene.looks import LOOKS
from glshadow.scene.mesh import Mesh
from glshadow.scene.motion import moved, turned_camera
from glshadow.scene.nodes import Node, Scene
from glshadow.terrain.dem import Dem

# world_from_file rotations that turn the named axis up; proper rotations, so that nothing is mirrored
TURNS = {
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}


def load(
    source: Any,
    *,
    ground: bool | str | None = False,
    up_axis: str | None = None,
    name: str | None = None,
    camera: str | int | None = None,
    smooth: float | None = None,
    limits: Limits | None = None,
    format: str | None = None,
    time: float | None = None,
    animation: str | int | None = None,
    look: str | None = None,
) -> Scene:
    """Load a scene from a file or another library's object.

    Parameters
    ----------
    source : path, bytes, file object, (vertices, faces), another library's object, Scene, or meshes and nodes
        One Mesh or Node, or a list of them, is a scene too. Files: .glb, .gltf, .obj, .ply, .stl, .off, and elevation models as GeoTIFF
        (.tif, extra `terrain`) with x east, y up and z south. Objects: Dem, trimesh.Trimesh, trimesh.Scene, pyrender.Scene and Mesh,
        PyVista's datasets and MultiBlock, Open3D's TriangleMesh. Coordinates are not changed, matrices are composed in float64, and
        nodes with the same geometry share one Mesh. Shading normals are used if the source has them; otherwise shading is flat, see
        `smooth`.
    ground : bool, "catcher" or None
        Put a plane under the model to receive its shadow, see `Scene.with_ground`; "catcher": a shadow catcher, which shows only the
        shadow, see `Node`. It is the last node. None: as `glshadow render` does, if the look is "studio" or "outdoor" and camera and
        lights are the look's.
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
    format : {None, "glb", "gltf", "obj", "ply", "stl", "off", "tif", "tiff"}
        Format of a file; None: by its suffix, of bytes and file objects by their beginning.
    time : float, optional
        Seconds of the file's animation, see `Scene.at`. None: the pose of the file's nodes; if nothing can be seen of that, the beginning
        of the animation, with a warning.
    animation : str or int, optional
        Name of the animation, or its number from 0; None: the first.
    look : {None, "studio", "plain", "outdoor"}
        Default lights, background, ambient light and ground; the camera too, if the source has none. "studio": a soft key light from the
        side and light from all around, before a near-white background that is also the ground. "plain": one hard light, a camera that
        frames the model's bounding sphere. "outdoor": sun, sky and a horizon. None: "studio" if the source has no lights; its lights
        stay. A look that is given replaces them. Models without materials have a reflectance of 0.8, "plain" of 1.

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
    format = optional(one_of(*NAMES), "recognised")("format", format)
    camera = optional(name_or_number("a camera"), "the first")("camera", camera)
    smooth = optional(number(0.0, 180.0), "flat")("smooth", smooth)
    time = optional(number(unit="s"), "the file's pose")("time", time)
    look = optional(one_of(*LOOKS), "studio, or the source's lights")("look", look)
    return read_scene(
        source, Budget(limits or Limits()), ground, up_axis, name, format, camera, smooth, time, animation, look
    )


def read_scene(
    source: Any,
    budget: Budget,
    ground: bool | str | None = False,
    up_axis: str | None = None,
    name: str | None = None,
    format: str | None = None,
    camera: str | int | None = None,
    smooth: float | None = None,
    time: float | None = None,
    animation: str | int | None = None,
    look: str | None = None,
    usual: str = "studio",
) -> Scene:
    """As `load`, with checked arguments; afterwards `budget.files` has the files that were read. `usual`: the look if none is given."""
    if isinstance(source, Scene) and time is not None:
        source, time = source.at(time, animation), None
    label, title, read, stored = _reader(source, budget, None if format is None else f".{format}", smooth)
    try:
        found = read()
        if not stored:
            smoothed(found, smooth)
        _place(found, time, animation)
        if not found.as_given:
            _whiten(found, LOOKS[look or usual].white)
        if camera is not None:
            found.camera = found.camera_named(camera)
        elif found.no_view is not None:  # another view than the file's would be drawn
            others = f"name another one, of {', '.join(found.cameras)}" if found.cameras else "take it out of the file"
            raise SceneError(f"{found.no_view}: {others}")
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
    if look is not None:
        found.lights = None
    scene = _turned(
        found, TURNS[up_axis or "y"], name or title, look or (source.look if isinstance(source, Scene) else usual)
    )
    if ground is None:
        own = isinstance(source, Scene) or found.camera is not None or found.lights is not None
        ground = scene.defaults.stands and not own
    return scene.with_ground(ground == "catcher") if ground else scene


def _whiten(found: Imported, white: float) -> None:
    """Give meshes without a material the look's white."""
    whitened = Whitened(white, found.nodes)
    found.nodes = [whitened.node(node) for node in found.nodes]
    if found.motion is not None:
        found.motion = replace(found.motion, changed=whitened)


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


def _ground(name: str, value: Any) -> bool | str | None:
    if value is None or (isinstance(value, str) and value == "catcher"):
        return value
    try:
        return bool(flag()(name, value))
    except SettingsError:
        raise refuse(name, 'True, False, "catcher" or None', value) from None


def _reader(
    source: Any, budget: Budget, suffix: str | None, smooth: float | None
) -> tuple[str, str, Callable[[], Imported], bool]:
    """The source's name in messages, its scene's name, a function that reads it, and whether it was stored in a file."""
    stored = _stored_reader(source, budget, suffix, smooth)
    if stored is not None:
        return *stored, True
    if suffix is not None:
        raise SceneError(f"format names that of a file, of bytes or of a file object, got {type(source).__name__}")
    if (pair := array_pair(source)) is not None:
        return "(vertices, faces)", "scene", lambda: read_arrays(*pair), False
    if isinstance(source, Scene):
        camera, lights = given_parts(source)
        given = Imported(
            list(source.nodes), camera, lights, cameras=dict(source.cameras), motion=source.motion, as_given=True
        )
        return source.name, source.name, lambda: given, False
    others = (
        [k for k, each in enumerate(source) if not isinstance(each, Mesh | Node)]
        if isinstance(source, list | tuple)
        else []
    )
    if others:
        raise SceneError(
            f"nodes[{others[0]}] must be Node or Mesh, or the pair must be (vertices, faces), arrays (V, 3) and (T, K) of numbers, got "
            f"{shown(source)}; objects of other libraries are loaded one by one: Scene([*load(a).nodes, *load(b).nodes])"
        )
    if isinstance(source, Dem):
        from glshadow.io.from_terrain import read_terrain

        return "elevation model", "terrain", lambda: read_terrain(source, budget), False
    if isinstance(source, Mesh | Node) or (isinstance(source, list | tuple) and source):
        placed = Scene(source if isinstance(source, list | tuple) else [source])
        return "scene", "scene", lambda: Imported(list(placed.nodes), None, None), False
    kind = f"{str(type(source).__module__).partition('.')[0]}.{type(source).__name__}"
    read = _library_reader(source)
    if read is not None:
        return kind, "scene", read, False
    raise SceneError(
        f"load takes a path, bytes or a file object ({' '.join(FORMATS)}), (vertices, faces), a trimesh.Trimesh, a trimesh.Scene, "
        "a pyrender.Scene, a PyVista dataset, an Open3D TriangleMesh, a Scene, or meshes and nodes, got "
        f"{type(source).__name__}"
    )


def _stored_reader(
    source: Any, budget: Budget, suffix: str | None, smooth: float | None
) -> tuple[str, str, Callable[[], Imported]] | None:
    """The same for a path, bytes or a file object; None for everything else."""
    if isinstance(source, (str, os.PathLike)):
        try:
            path = as_path("source", source)
        except SettingsError as error:
            raise SceneError(str(error)) from None
        return path.name or str(path), path.stem, lambda: _read_file(on_disk(path, suffix), budget, smooth)
    if isinstance(source, bytes | bytearray | memoryview):
        return "bytes", "scene", lambda: _read_file(in_memory(bytes(source), suffix), budget, smooth)
    if callable(getattr(source, "read", None)) and not isinstance(source, type):
        name = getattr(source, "name", None)
        named = Path(name) if isinstance(name, str) and name else Path("a file object")
        title = named.stem if named.suffix.lower() in FORMATS else "scene"
        return named.name, title, lambda: _read_file(from_stream(source, suffix, budget), budget, smooth)
    return None


def _library_reader(source: Any) -> Callable[[], Imported] | None:
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

        return lambda: read_pyvista(source)
    if "open3d" in libraries:
        from glshadow.io.from_open3d import read_open3d

        return lambda: read_open3d(source)
    return None


def _read_file(file: ModelFile, budget: Budget, smooth: float | None) -> Imported:
    if file.suffix in GLTF:
        from glshadow.io.gltf import read_gltf

        found = read_gltf(file, budget)
        if smooth is not None and any(node.mesh.normals is None for node in found.nodes):
            found.notes.append(f"smooth={smooth:g} is left out: in glTF, meshes without normals are flat")
        return found
    if file.suffix in TERRAIN:
        from glshadow.io.from_terrain import read_geotiff

        return read_geotiff(file, budget)
    from glshadow.io.mesh_files.read import read_mesh_file

    return read_mesh_file(file, budget, smooth)


def _turned(found: Imported, turn: Array, name: str, look: str) -> Scene:
    nodes, motion = found.nodes, found.motion
    turned: dict[int, Any] = {}  # cameras and lights by the id of what they were
    if not np.array_equal(turn, np.eye(3)):
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        nodes = [moved(node, node.mesh, matrix @ node.world_from_mesh) for node in nodes]
        seen = [each for each in (found.camera, *found.cameras.values()) if each is not None]
        turned = {id(each): turned_camera(each, turn) for each in seen}
        turned |= {id(each): each.turned(turn, np.zeros(3)) for each in found.lights or ()}
        if motion is not None:
            motion = replace(motion, turn=turn @ motion.turn)
    camera = turned.get(id(found.camera), found.camera)
    cameras = {title: turned.get(id(each), each) for title, each in found.cameras.items()}
    lights = None if found.lights is None else [turned.get(id(each), each) for each in found.lights]
    scene = Scene(nodes, camera, lights, name, cameras, look=look)
    if motion is None:
        return scene
    motion = replace(
        motion,
        names=motion.names or tuple(node.name for node in scene.nodes),
        cameras={title: turned.get(id(each), each) for title, each in motion.cameras.items()},
        lights=tuple(turned.get(id(each), each) for each in motion.lights),
    )
    return replace(scene, motion=motion)
