"""Nodes (meshes with a transform) and scenes, frozen; adds the ground under a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.setting import (
    Settings,
    as_floats,
    flag,
    instance,
    one_of,
    optional,
    refuse,
    setting,
    several,
    shown,
    text,
)
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError
from glshadow.lights import Light, as_lights
from glshadow.scene import summary
from glshadow.scene.box import box_corners, check_place
from glshadow.scene.framing import framed, model_outline, turning_camera
from glshadow.scene.ground import CLEARANCE, ground_plane
from glshadow.scene.looks import LOOKS, Look
from glshadow.scene.mesh import Mesh
from glshadow.scene.motion import Motion, posed
from glshadow.scene.names import numbered


def _affine(name: str, value: Any) -> Array:
    matrix = as_floats(value, (4, 4))
    if matrix is None or not np.isfinite(matrix).all():
        raise refuse(name, "a finite matrix (4, 4)", value)
    if np.abs(matrix[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-6:
        raise SettingsError(f"{name} must be affine: its last row is {matrix[3].tolist()}, not [0, 0, 0, 1]")
    return matrix


@dataclass(frozen=True, eq=False, repr=False)
class Node(Settings):
    """A mesh, points or lines with a transform; instances share the Mesh object.

    Parameters
    ----------
    mesh : Mesh
        Triangles, or `Points` or `Lines`.
    world_from_mesh : (4, 4) float64
    name : str
        Name; nodes of a scene with the same name get a number appended.
    casts, receives : bool
        Whether it casts shadows, and whether it receives them.
    catches : bool
        Shadow catcher: only the shadow on it is visible, as black with alpha 1 - (light with shadow) / (light without), of luminances.
    ground : bool
        Marks a ground plane that does not belong to the model: `Scene.bounds` ignores it.
    """

    refusal = SceneError

    mesh: Mesh = setting(instance(Mesh), help="the mesh; nodes may share it")
    world_from_mesh: Array = setting(_affine, factory=lambda: np.eye(4), help="(4, 4) transform")
    name: str = setting(text(), "node", help="made unique within a scene")
    casts: bool = setting(flag(), True, help="casts shadows")
    receives: bool = setting(flag(), True, help="receives shadows")
    catches: bool = setting(flag(), False, help="shadow catcher: only the shadow on it is visible")
    ground: bool = setting(flag(), False, help="a ground plane that does not belong to the model")

    __repr__ = summary.node_line

    @property
    def drawn(self) -> bool:
        """Whether it has triangles, points or lines, and an alpha that is not 0 everywhere; a shadow catcher's alpha does not count."""
        return self.mesh.count > 0 and (self.catches or not self.mesh.unseen)

    @property
    def blends(self) -> bool:
        """Whether what is behind it is seen through it; a shadow catcher's alpha does not count."""
        return self.mesh.blends and not self.catches

    @property
    def label(self) -> str:
        """Name of the node in messages."""
        return f"Node {shown(self.name)}" if isinstance(self.name, str) else "Node"


def _cameras(name: str, value: Any) -> dict[str, Camera]:
    if not isinstance(value, Mapping) or not all(
        isinstance(key, str) and isinstance(camera, Camera) for key, camera in value.items()
    ):
        raise refuse(name, "a mapping from names to cameras", value)
    return dict(value)


def _nodes(name: str, value: Any) -> tuple[Node, ...]:
    """Check a scene's nodes: a mesh becomes a node without transform, and names are made unique."""
    several_nodes = several(instance(Node), "Node or Mesh", 10**8)
    if isinstance(value, tuple | list):
        value = tuple(Node(each) if isinstance(each, Mesh) else each for each in value)
    nodes: tuple[Node, ...] = several_nodes(name, value)
    return nodes if len({node.name for node in nodes}) == len(nodes) else numbered(nodes)


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Settings):
    """Nodes with a camera and lights.

    Parameters
    ----------
    nodes : sequence of Node or Mesh
        At least one, with at least one triangle. A mesh gets no transform. Nodes with the same name are numbered: "wheel", "wheel 2".
    camera, lights : optional
        From the file. None is replaced by those of `look`, which frame the scene and light it.
    motion : Motion, optional
        How a loaded scene moves, see `at`.
    cameras : mapping from name to Camera
        All cameras of the file.
    look : {"plain", "studio", "outdoor"}
        What is not given: camera, lights, and the default background, ambient light and ground. See `glshadow.load`.

    Raises
    ------
    SceneError
        If there is nothing to render, or world coordinates overflow.
    """

    refusal = SceneError

    nodes: tuple[Node, ...] = setting(_nodes, help="nodes or meshes to draw")
    camera: Camera = setting(optional(instance(Camera), "frames the scene"), None, help="the camera")
    lights: tuple[Light, ...] = setting(optional(as_lights, "one directional light"), None, help="the lights")
    name: str = setting(text(), "scene", help="name in messages and files")
    cameras: Mapping[str, Camera] = setting(_cameras, factory=dict, help="all cameras of the file, by name")
    motion: Motion | None = setting(optional(instance(Motion), "nothing moves"), None, help="how the scene moves")
    look: str = setting(one_of(*LOOKS), "plain", help="default camera, lights, background, ambient light and ground")

    if TYPE_CHECKING:  # what may be given, and is converted

        def __init__(
            self,
            nodes: Sequence[Node | Mesh],
            camera: Camera | None = None,
            lights: Light | Sequence[Light] | None = None,
            name: str = "scene",
            cameras: Mapping[str, Camera] = ...,
            motion: Motion | None = None,
            look: str = "plain",
        ) -> None: ...

    rest: ClassVar[Scene | None] = None
    """Of a scene at a time of its animation: the scene that was posed, by whose light all of its poses are exposed."""

    __repr__ = summary.scene_line
    _repr_html_ = summary.scene_html

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any(node.drawn for node in self.nodes):
            some = any(node.mesh.count for node in self.nodes)
            why = "the alpha of all of it is 0" if some else "it has no triangles, points or lines"
            raise SceneError(f"{self.name}: nothing to render, {why}")
        self._check_place()
        if self.camera is None:
            object.__setattr__(self, "camera", self.defaults.camera(model_outline(self)))
        if self.lights is None:
            object.__setattr__(self, "lights", self.defaults.lights(self.camera, self.bounds))

    def _check_place(self) -> None:
        check_place(self.corners, f"{self.name}: ")
        low, high = self.extent
        if (low == high).all():
            raise SceneError(f"{self.name}: nothing to render, its size is zero at {low.tolist()}")

    @property
    def defaults(self) -> Look:
        """What its look stands for."""
        return LOOKS[self.look]

    @property
    def turning_camera(self) -> Camera:
        """The camera for `orbit`: the scene's own; but one that frames the model is replaced by one that frames it from all sides."""
        return turning_camera(self)

    @cached_property
    def places(self) -> dict[str, int]:
        """Index of each node by its name."""
        return {node.name: index for index, node in enumerate(self.nodes)}

    @cached_property
    def drawn(self) -> NDArray[np.int64]:
        """(N,) indices of the nodes that are drawn, opaque or not: see `Node.drawn`."""
        return np.flatnonzero(np.fromiter((node.drawn for node in self.nodes), dtype=bool, count=len(self.nodes)))

    @cached_property
    def blending(self) -> NDArray[np.bool_]:
        """(N,) which of the drawn nodes are composited over what is behind them."""
        return np.array([self.nodes[i].blends for i in self.drawn.tolist()])

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Mesh bounds (N, 2, 3) and world_from_mesh (N, 4, 4) of the drawn nodes."""
        nodes = [self.nodes[i] for i in self.drawn.tolist()]
        bounds = np.concatenate([node.mesh.bounds_for(node.world_from_mesh) for node in nodes]).reshape(-1, 2, 3)
        return bounds, np.concatenate([node.world_from_mesh for node in nodes]).reshape(-1, 4, 4)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest world corner of the model: boxes of all nodes except a ground, unless there are no others."""
        model = [not self.nodes[i].ground for i in self.drawn.tolist()]
        return self.extent if all(model) or not any(model) else _around(self.corners[model])

    @cached_property
    def extent(self) -> Array:
        """(2, 3) least and greatest world corner of everything, including a ground."""
        return _around(self.corners)

    @cached_property
    def corners(self) -> Array:
        """World corners (N, 8, 3) of the boxes."""
        return box_corners(*self.boxes)

    def moved(self, matrices: Mapping[str, Any]) -> Scene:
        """The same scene with new matrices for some nodes; meshes and their GPU data are shared.

        Parameters
        ----------
        matrices : mapping from node name to (4, 4) world_from_mesh

        Raises
        ------
        SceneError
                If no node has that name, or a matrix is not allowed.
        """
        if not isinstance(matrices, Mapping):
            raise SceneError(f"moved needs a mapping from node names to matrices, got {shown(matrices)}")
        places = self.places
        if unknown := set(matrices) - set(places):
            known = ", ".join(sorted(places)[:8])
            raise SceneError(f"no node is named {', '.join(sorted(map(shown, unknown)))}; the scene has: {known}")
        return self.changed(
            {
                places[name]: replace(self.nodes[places[name]], world_from_mesh=matrix)
                for name, matrix in matrices.items()
            }
        )

    def changed(self, nodes: Mapping[int, Node], **settings: Any) -> Scene:
        """The scene with some nodes replaced, by index, by checked nodes of the same names with as many triangles.

        Parameters
        ----------
        **settings
            Camera, lights, cameras, motion and rest, checked.
        """
        made = copy(self)
        kept = made.__dict__
        kept |= settings
        kept["nodes"] = tuple(nodes.get(index, node) for index, node in enumerate(self.nodes))
        if nodes:
            for name in ("bounds", "extent", "corners"):
                kept.pop(name, None)
            places = np.array(list(nodes))
            places = places[np.isin(places, self.drawn)]
            moved = [nodes[index] for index in places.tolist()]
            bounds, matrices = (each.copy() for each in self.boxes)
            rows = np.searchsorted(self.drawn, places)
            bounds[rows] = np.reshape([node.mesh.bounds for node in moved], (-1, 2, 3))
            matrices[rows] = np.reshape([node.world_from_mesh for node in moved], (-1, 4, 4))
            kept["boxes"] = bounds, matrices
            made._check_place()
        return made

    @property
    def animations(self) -> dict[str, float]:
        """Names of the file's animations, with their lengths in seconds."""
        return {} if self.motion is None else dict(self.motion.source.durations)

    @property
    def duration(self) -> float:
        """Length of the animation in seconds; 0 if there is none. Of several it is the first, or the one chosen for `load` or `at`."""
        return 0.0 if self.motion is None else self.motion.duration

    def at(self, seconds: float, animation: str | int | None = None) -> Scene:
        """The scene at a time of an animation: the same nodes with their matrices and meshes at that time. What does not move is shared.

        A camera and lights of the file follow their nodes; other ones, the default camera and a ground stay as they are.

        Parameters
        ----------
        seconds : float
            Before its beginning and after its end it stands still.
        animation : str or int, optional
            Its name, or its number from 0. None: the one that was chosen before, or else the first.

        Raises
        ------
        SettingsError
            If `seconds` is not a finite number.
        SceneError
            If there is no such animation, or nothing can be drawn at that time.
        """
        return posed(self, seconds, animation)

    def framed(self, times: Iterable[float]) -> Scene:
        """The scene with a default camera and a ground that suit all these times of its animation.

        The camera frames the bounds of all times together, unless the file has a camera; a ground lies under the lowest point of them all.
        """
        return framed(self, times)

    def with_ground(self, catches: bool = False) -> Scene:
        """The scene on a horizontal square plane at its lowest point, three times as wide as the scene, and as the scene's look has it.

        In the studio the plane has the background's colour and shows the shadow alone, so that it has no visible border.

        Parameters
        ----------
        catches : bool
            Make the plane a shadow catcher, see `Node`.
        """
        return replace(self, nodes=(*self.nodes, self.ground_under(self.bounds, self.lowest(), catches)))

    def ground_under(self, bounds: Array, lowest: float, catches: bool) -> Node:
        """The ground of its look under bounds (2, 3) and a height."""
        color, size = self.defaults.ground, self.defaults.ground_size
        casts = self.look == "plain"  # nothing is below it: the sky's maps need not cover all of it
        mesh, matrix = ground_plane(bounds, lowest, color or (1.0, 1.0, 1.0), size, 0.0 if casts else CLEARANCE)
        return Node(mesh, matrix, "ground", casts, catches=catches or color is None, ground=True)

    def lowest(self, model: bool = False) -> float:
        """Least world y of all nodes, or of the model's alone."""
        return min(
            node.mesh.lowest(node.world_from_mesh) for node in self.nodes if node.drawn and not (model and node.ground)
        )


def _around(corners: Array) -> Array:
    columns = [corners[..., axis] for axis in range(3)]  # numpy reduces columns much faster than rows of three
    return np.array([[c.min() for c in columns], [c.max() for c in columns]])
