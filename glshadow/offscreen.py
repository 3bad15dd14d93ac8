"""PyrenderRenderer: a replacement for pyrender's OffscreenRenderer with glshadow's shadows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.setting import instance, number, optional, refuse, shown, whole
from glshadow.errors import SceneError, SettingsError
from glshadow.frame import Frame
from glshadow.gl.driver.context import Backend
from glshadow.io.from_pyrender import Made, placed_nodes, read_pyrender
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.checks import check_scene
from glshadow.scene.nodes import Node, Scene
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import Projection

DEPTH_ONLY, OFFSCREEN, ALL_SOLID = 1, 2, 16
SHADOWS: dict[Projection, int] = {"orthographic": 32, "cube": 64, "perspective": 128}
"""SHADOWS_DIRECTIONAL, SHADOWS_POINT and SHADOWS_SPOT."""
SKIP_CULL_FACES, RGBA, FLAT, SEG = 1024, 2048, 4096, 8192
"""pyrender.RenderFlags."""

UNSUPPORTED = {4: "FLIP_WIREFRAME", 8: "ALL_WIREFRAME", 256: "VERTEX_NORMALS", 512: "FACE_NORMALS"}
KNOWN = 2**14 - 1

REFLECTED = (
    0.04  # of a dielectric at normal incidence: pyrender's min_roughness, which it also uses as the specular colour
)
LAMBERT = (1.0 - REFLECTED) ** 2 / np.pi
"""Diffuse share of a light's intensity at normal incidence in pyrender; its shaders/mesh.frag."""

SAMPLES = 4  # samples per pixel, as in pyrender
MOST_PIXELS = 32768

Returned = NDArray[Any] | tuple[NDArray[Any], NDArray[Any]]


class PyrenderRenderer:
    """Draws pyrender.Scene objects as pyrender.OffscreenRenderer does, with shadows of directional, spot and point lights.

    Surfaces are Lambertian: the specular part is left out, and a metal is drawn as a dielectric of its colour. The default for shadows is
    `Exact()`, soft if the lights are given a size. pyrender itself is not imported, so its release without numpy 2 support works for the
    scene.

    Parameters
    ----------
    viewport_width, viewport_height : int
        Size in pixels; both may change between images.
    point_size : float
        Size of points. Points are not drawn; the parameter exists for compatibility.
    shadow : Shadow, optional
        Settings of the shadows; None: derived.
    angle, radius : float
        Size of directional lights, degrees, and of local lights, world units; 0: sharp shadows.
    backend : str
        As for Renderer.

    Raises
    ------
    ContextError
        If there is no usable OpenGL context.
    """

    def __init__(
        self,
        viewport_width: int,
        viewport_height: int,
        point_size: float = 1.0,
        *,
        shadow: Shadow | None = None,
        angle: float = 0.0,
        radius: float = 0.0,
        backend: Backend = "auto",
    ) -> None:
        self.viewport_width, self.viewport_height = viewport_width, viewport_height
        self.point_size = point_size
        self._shadow = optional(instance(Shadow), "derived")("shadow", shadow) or Shadow()
        self._angle = number(0.0, 180.0, below=True, unit="degrees")("angle", angle)
        self._radius = number(0.0)("radius", radius)
        self._renderer = Renderer(backend)
        self._made: Made = {}
        self._last: tuple[Any, Scene] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.delete()

    @property
    def viewport_width(self) -> int:
        """Pixels."""
        return self._width

    @viewport_width.setter
    def viewport_width(self, value: int) -> None:
        self._width: int = whole(1, MOST_PIXELS, unit="pixels")("viewport_width", value)

    @property
    def viewport_height(self) -> int:
        """Pixels."""
        return self._height

    @viewport_height.setter
    def viewport_height(self, value: int) -> None:
        self._height: int = whole(1, MOST_PIXELS, unit="pixels")("viewport_height", value)

    def delete(self) -> None:
        """Release the renderer. May be called twice."""
        self._renderer.release()

    def render(self, scene: Any, flags: int = 0, seg_node_map: Mapping[Any, Any] | None = None) -> Returned:
        """Render a pyrender.Scene.

        Parameters
        ----------
        scene : pyrender.Scene
            A scene with a main camera.
        flags : int
            pyrender.RenderFlags: DEPTH_ONLY, SHADOWS_*, RGBA, FLAT, SEG. Faces are never culled, as with SKIP_CULL_FACES. Wireframe and
            normals are not supported and raise a SettingsError.
        seg_node_map : mapping, optional
            With SEG: pyrender.Node -> (3,) colour in 0..255; other nodes are not drawn.

        Returns
        -------
        color : (H, W, 3) uint8, with RGBA (H, W, 4)
            Left out with DEPTH_ONLY.
        depth : (H, W) float32
            Distance along the view direction, 0 where there is no surface.

        Raises
        ------
        SettingsError
            For flags that are not supported, and for SEG without a map.
        SceneError
            For anything but a pyrender.Scene, and for a scene without a main camera.
        """
        flags = _flags(flags)
        if not hasattr(scene, "mesh_nodes") or not hasattr(scene, "main_camera_node"):
            raise SceneError(f"a pyrender.Scene is needed, got {shown(scene)}")
        if scene.main_camera_node is None:
            raise SceneError("this pyrender.Scene has no main camera: add one, scene.add(camera, pose=pose)")
        if flags & SEG and seg_node_map is None:
            raise SettingsError("RenderFlags.SEG needs seg_node_map, a mapping of pyrender nodes to colours")
        ours, owners = self._read(scene, set(seg_node_map or ()) if flags & SEG else None)
        size = (self._width, self._height)
        if ours is None:
            return _nothing(scene, size, flags)
        if flags & (DEPTH_ONLY | SEG):
            frame = self._renderer.render(ours, lights=[], size=size, outputs=("depth", "node"), samples=1)
            depth = _depth(frame)
            if flags & DEPTH_ONLY and not flags & SEG:
                return depth
            colors = np.array([*(_color(seg_node_map, node) for node in owners), (0, 0, 0)], dtype=np.uint8)
            image = colors[frame.node]  # -1, no surface: the last
            return (np.dstack([image, np.full_like(image[..., :1], 255)]) if flags & RGBA else image), depth
        lights = () if flags & FLAT else self._lights(ours.lights, flags)
        ambient = (1.0, 1.0, 1.0) if flags & FLAT else tuple(np.broadcast_to(scene.ambient_light, 3)[:3].tolist())
        ground = np.clip(np.asarray(scene.bg_color, dtype=np.float64), 0.0, 1.0)
        frame = self._renderer.render(
            ours, None, lights, size, ambient, tuple(ground[:3].tolist()), ("image", "alpha", "depth"), SAMPLES,
            exposure=None, tone="none",
        )  # fmt: skip
        if not flags & RGBA:
            return frame.image, _depth(frame)
        alpha = frame.alpha + (1.0 - frame.alpha) * (ground[3] if len(ground) > 3 else 1.0)
        return np.dstack([frame.image, np.rint(255.0 * alpha).astype(np.uint8)]), _depth(frame)

    def _read(self, scene: Any, chosen: set[Any] | None) -> tuple[Scene | None, list[Any]]:
        """The scene, and the pyrender node of each of its nodes. None if nothing is drawn. Meshes are cached between images."""
        found = read_pyrender(scene, self._made)
        used = {id(primitive) for node in scene.mesh_nodes for primitive in node.mesh.primitives}
        for gone in set(self._made) - used:
            del self._made[gone]
        owners = _owners(scene, self._made)
        nodes: list[Node] = []
        kept: list[Any] = []
        for node, owner in zip(found.nodes, owners, strict=True):
            if chosen is None or owner in chosen:
                nodes.append(node)
                kept.append(owner)
        if not nodes:
            return None, []
        key = tuple((id(node.mesh), node.world_from_mesh.tobytes()) for node in nodes)
        lights = tuple(found.lights or ())
        camera = found.camera
        if camera is None:
            raise SceneError(f"camera type {type(scene.main_camera_node.camera).__name__} is not supported")
        if self._last is not None and self._last[0] == key:  # a scene's cached data is found by its identity
            return self._placed(self._last[1], camera, lights), kept
        check_scene(nodes, stored=False)
        made = Scene(tuple(nodes), camera, lights, "pyrender")
        self._last = key, made
        return made, kept

    def _placed(self, last: Scene, camera: Camera, lights: tuple[Light, ...]) -> Scene:
        if last.camera == camera and last.lights == lights:
            return last
        made = replace(last, camera=camera, lights=lights)
        assert self._last is not None
        self._last = self._last[0], made
        return made

    def _lights(self, lights: tuple[Light, ...], flags: int) -> tuple[Light, ...]:
        """The lights with pyrender's intensities, and with shadows if the flags enable them."""
        result = []
        for light in lights:
            size = {light.sized_by: self._angle if light.at_infinity else self._radius}
            shadow = self._shadow if flags & SHADOWS[light.projection] else None
            result.append(replace(light, intensity=light.intensity * LAMBERT, shadow=shadow, **size))
        return tuple(result)


def _flags(value: Any) -> int:
    kept = value if isinstance(value, int) and not isinstance(value, bool) else None
    if kept is None or kept < 0 or kept & ~KNOWN:
        raise refuse("flags", "a combination of pyrender.RenderFlags", value)
    unsupported = [name for flag, name in UNSUPPORTED.items() if kept & flag]
    if unsupported:
        raise SettingsError(f"flags: RenderFlags.{', RenderFlags.'.join(unsupported)} is not supported; leave it out")
    return kept


def _owners(scene: Any, made: Made) -> list[Any]:
    """The pyrender node of each node that was read, in the same order."""
    return [
        node
        for node in placed_nodes(scene)
        for primitive in node.mesh.primitives
        if made[id(primitive)][1] is not None
        for _ in range(1 if primitive.poses is None else len(primitive.poses))
    ]


def _color(colors: Mapping[Any, Any] | None, node: Any) -> tuple[int, int, int]:
    value = np.asarray((colors or {})[node], dtype=np.float64).ravel()
    if value.shape[0] < 3 or not ((value >= 0.0) & (value <= 255.0)).all():
        raise refuse("seg_node_map", "colours of three numbers from 0 to 255", value)
    red, green, blue = value[:3].astype(int).tolist()
    return red, green, blue


def _depth(frame: Frame) -> NDArray[np.float32]:
    """Depth in pyrender's convention: 0 where there is no surface."""
    return np.where(np.isfinite(frame.depth), frame.depth, np.float32(0.0)).astype(np.float32)


def _nothing(scene: Any, size: tuple[int, int], flags: int) -> Returned:
    """The image of a scene without meshes."""
    shape = (size[1], size[0])
    depth = np.zeros(shape, dtype=np.float32)
    if flags & DEPTH_ONLY and not flags & SEG:
        return depth
    ground = np.ones(4)
    given = np.asarray(scene.bg_color, dtype=np.float64)
    ground[: len(given)] = np.clip(given, 0.0, 1.0)
    if flags & SEG:
        ground = np.array([0.0, 0.0, 0.0, 1.0])
    channels = 4 if flags & RGBA else 3
    image = np.broadcast_to(np.rint(255.0 * ground[:channels]).astype(np.uint8), (*shape, channels))
    return image.copy(), depth
