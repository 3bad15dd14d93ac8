"""Images of a model whose faces have the colours of their values."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera, OrthographicCamera
from glshadow.core.orbit import orbit
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import SettingsError
from glshadow.insolation.result import SunHours
from glshadow.renderer import Renderer
from glshadow.scene.faces import face_starts, faces_of
from glshadow.scene.mesh import Material, Mesh
from glshadow.scene.nodes import Node, Scene

VIEWS = ("from the south-east", "from the south-west", "from the north-west", "from the north-east")
UNKNOWN = (0.75, 0.75, 0.75)
"""sRGB of faces without a value."""


def colored_scene(found: SunHours, values: Array, colors: Array, top: float) -> Scene:
    """The faces of a result in colours, east along x, up along y and south along z.

    Parameters
    ----------
    found : SunHours
        Of faces or vertices.
    values : (N,) float64
        Of the faces or vertices.
    colors : (K, 3) float64
        sRGB, in equal steps from 0 to `top`.
    top : float

    Raises
    ------
    SettingsError
        For a result at points.
    """
    if found.kind == "points":
        raise SettingsError('an image needs values of faces or vertices: sun_hours(..., to="faces")')
    corners = found.corners
    assert corners is not None
    local = (corners - corners.reshape(-1, 3).mean(axis=0)) @ found.path.axes.T
    placed = np.stack([local[..., 0], local[..., 2], -local[..., 1]], axis=-1).reshape(-1, 3)
    by_face = found.faces is not None
    shown = np.repeat(values, 3) if by_face else values[_vertex_of(found.scene, faces_of(found.scene))].ravel()
    known = np.isfinite(shown)
    place = np.clip(np.nan_to_num(shown) / max(top, 1e-300), 0.0, 1.0) * (len(colors) - 1)
    srgb = np.stack([np.interp(place, np.arange(len(colors)), colors[:, k]) for k in range(3)], axis=1)
    srgb[~known] = UNKNOWN
    rgba = np.concatenate([linear_from_srgb(srgb), np.ones((len(srgb), 1))], axis=1)
    mesh = Mesh(
        placed,
        np.arange(len(placed), dtype=np.int32).reshape(-1, 3),
        colors=rgba.astype(np.float32),
        material=Material(unlit=True),
    )
    return Scene([Node(mesh, np.eye(4), "hours")], look="studio")


def _vertex_of(scene: Scene, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """(F, 3) vertices of faces, as the vertices of all nodes with triangles are numbered."""
    starts, first, parts = face_starts(scene), 0, []
    for number, node in enumerate(scene.nodes):
        if len(node.mesh.triangles) == 0:
            continue
        mine = faces[(faces >= starts[number]) & (faces < starts[number + 1])] - starts[number]
        parts.append(first + node.mesh.triangles[mine].astype(np.int64))
        first += len(node.mesh.positions)
    return np.concatenate(parts)


def images(scene: Scene, size: tuple[int, int], renderer: Renderer) -> dict[str, NDArray[np.uint8]]:
    """The scene of `colored_scene` from four sides and from above with north up, on white: caption -> (H, W, 3)."""
    cameras: list[Camera] = list(orbit(_from_south_east(scene), 4))[::-1]
    cameras = [cameras[-1], *cameras[:-1]]
    found = {name: _drawn(scene, camera, size, renderer) for name, camera in zip(VIEWS, cameras, strict=True)}
    return {**found, "from above, north up": _drawn(scene, _above(scene, size), size, renderer)}


def _from_south_east(scene: Scene) -> Camera:
    camera: Any = scene.turning_camera
    offset = np.subtract(camera.position, camera.target)
    flat = float(np.hypot(offset[0], offset[2]))
    place = np.add(camera.target, (flat * np.sqrt(0.5), offset[1], flat * np.sqrt(0.5)))
    found: Camera = replace(camera, position=tuple(place.tolist()))
    return found


def _above(scene: Scene, size: tuple[int, int]) -> Camera:
    low, high = scene.bounds
    middle, extent = 0.5 * (low + high), high - low
    height = 1.08 * max(float(extent[2]), float(extent[0]) * size[1] / size[0], 1e-3 * float(extent.max()))
    eye = middle + np.array([0.0, extent.max(), 0.0])
    return OrthographicCamera(
        position=tuple(eye.tolist()), target=tuple(middle.tolist()), up=(0.0, 0.0, -1.0), height=height
    )


def _drawn(scene: Scene, camera: Camera, size: tuple[int, int], renderer: Renderer) -> NDArray[np.uint8]:
    frame = renderer.render(
        scene, camera, (), size, ambient=0.0, background=(1.0, 1.0, 1.0), samples=4, exposure=None, tone="none"
    )
    return frame.image
