"""bake: the share of each light that faces, vertices or texels see."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import as_scene, pixels
from glshadow.baking.baked import Baked
from glshadow.baking.texels import covered, padded
from glshadow.core.setting import one_of, refuse, whole
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError, warn
from glshadow.lights import Light, Lights, as_lights
from glshadow.point_arguments import Progress
from glshadow.renderer import Renderer
from glshadow.scene.faces import face_corners, face_starts, faces_of, fronts, sample_faces
from glshadow.scene.nodes import Scene

_TOGETHER = 1 << 21  # points of a call
_INWARD = 1.0 / 64.0  # how far from a vertex to the middle of its face the vertex is tested
_TO = one_of("faces", "vertices", "texels")
_SIDE = one_of("front", "back")
_PER_FACE, _PER_TEXEL = whole(1, 1 << 16), one_of(1, 4, 16)
_UV_SET, _PADDING = one_of(0, 1), whole(0, 1 << 10)
FACE_SAMPLES, DEFAULT_SIZE = 16, (1024, 1024)

Seen = Callable[[Array, NDArray[np.int64], str], NDArray[np.float32]]
"""Points (N, 3) and triangles (N,), and what they are -> (L, N)."""


def bake(
    scene: Any,
    lights: Lights = None,
    to: str = "faces",
    samples: int | None = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    *,
    side: str = "front",
    uv_set: int = 0,
    padding: int = 4,
    light_samples: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Baked:
    """The share of each light that a scene's faces, vertices or texels see. With `lights=gs.SkyLight()`, ambient occlusion.

    The points are tested as by `visibility`: on their own triangles, without an offset, exactly. A side that faces away from a light sees
    nothing of it.

    Parameters
    ----------
    scene : Scene, path, trimesh.Trimesh, trimesh.Scene or pyrender.Scene
        Any scene that `glshadow.load` takes.
    lights : optional
        None: the scene's own.
    to : {"faces", "vertices", "texels"}
        "faces": of each face the mean over stratified points, see Notes. "vertices": of each vertex the mean over the faces around it,
        weighted by their angles; tested on each face at 1/64 of the way to its middle, so that a vertex at the foot of a wall is not in
        the wall. "texels": of each texel whose centre a face covers, in an image for each node.
    samples : int, optional
        "faces": points on each face; None: 16. "texels": points of each texel, 1 (None), 4 or 16, in a grid; their mean.
    size : (2,) ints
        Width and height of the images, texels.
    side : {"front", "back"}
        Which side of the faces receives light.
    uv_set : {0, 1}
        Texture coordinates: `Mesh.uv` or `Mesh.second_uv`. They should cover each texel once, as for lightmaps; where several triangles
        do, the first counts, and a warning says how many texels these are.
    padding : int
        Texels around the covered ones that take the mean of their neighbours, so that texture filtering finds no seams.
    light_samples : int, optional
        As for `visibility`.
    seed : int
        Of the points on faces.
    progress : callable, optional
        Called as (done, total, text).

    Returns
    -------
    Baked

    Raises
    ------
    SettingsError, SceneError, ResourceError
        For a setting out of range; a node without texture coordinates; not enough memory.

    Notes
    -----
    Of a face that a shadow's border crosses, the mean over n stratified points has a standard deviation of at most 0.71 n^(-3/4), as
    `sample_faces` derives it: 0.09 for 16 points, 0.03 for 64, 0.004 for 1,024. `Baked.error` estimates it for each face from its own
    points, as if these were independent: for a light without size sqrt(p (1 - p) / n), where p is their mean. Stratified points deviate
    less. A face whose points all agree is exact unless it has a detail that they miss.
    """
    scene = as_scene(scene)
    chosen = scene.lights if lights is None else as_lights("lights", lights)
    kind, facing = _TO("to", to), _SIDE("side", side)
    if kind == "vertices" and samples is not None:
        raise refuse("samples", "None for vertices: each is tested once on every face around it", samples)
    with Renderer() as renderer:
        seen = _tester(renderer, scene, chosen, facing, light_samples, progress)
        if kind == "faces":
            count = FACE_SAMPLES if samples is None else _PER_FACE("samples", samples)
            values, error = _of_faces(scene, seen, len(chosen), count, seed)
            return Baked(scene, chosen, kind, values, error, count)
        if kind == "vertices":
            return Baked(scene, chosen, kind, _of_vertices(scene, seen, len(chosen)), None, 1)
        count = 1 if samples is None else _PER_TEXEL("samples", samples)
        uv, side_of = _UV_SET("uv_set", uv_set), pixels("size", size)
        images = _of_texels(scene, seen, len(chosen), count, side_of, uv, _PADDING("padding", padding))
        return Baked(scene, chosen, kind, images, None, count, uv)


def _tester(
    renderer: Renderer, scene: Scene, lights: tuple[Light, ...], side: str, light_samples: int | None, progress: Any
) -> Seen:
    def seen(points: Array, triangles: NDArray[np.int64], what: str) -> NDArray[np.float32]:
        def told(done: int, total: int, text: str) -> None:
            progress(done, total, f"{what}, {text}")

        normals = -fronts(scene, triangles) if side == "back" else None
        return renderer.visibility(scene, points, lights, normals, triangles, light_samples, progress and told)

    return seen


def _of_faces(
    scene: Scene, seen: Seen, lights: int, count: int, seed: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Means and errors (L, F) of all elements of the scene by number; NaN where there is no face."""
    total = int(face_starts(scene)[-1])
    values, error = np.full((2, lights, total), np.nan, dtype=np.float32)
    faces = faces_of(scene)
    step = max(_TOGETHER // count, 1)
    for first in range(0, len(faces), step):
        some = faces[first : first + step]
        points, triangles, _ = sample_faces(scene, count, seed, some)
        each = seen(points, triangles, f"faces {first + 1} to {first + len(some)} of {len(faces)}")
        each = each.reshape(lights, len(some), count)
        mean = each.mean(axis=2, dtype=np.float64)
        values[:, some] = mean
        # of values that are not only 0 and 1 the deviation is less than that of the mean's
        spread = (each.astype(np.float64) ** 2).mean(axis=2) - mean**2
        error[:, some] = np.sqrt(np.maximum(spread, 0.0) / count)
    return values, error


def _of_vertices(scene: Scene, seen: Seen, lights: int) -> dict[str, NDArray[np.float32]]:
    """Per drawn node (L, V), NaN for vertices of no triangle."""
    starts, found = face_starts(scene), {}
    for number in _nodes_with_faces(scene):
        mesh = scene.nodes[number].mesh
        triangles = np.arange(starts[number], starts[number + 1])
        corners = face_corners(scene, triangles)
        middle = corners.mean(axis=1, keepdims=True)
        points = corners + _INWARD * (middle - corners)
        each = seen(points.reshape(-1, 3), np.repeat(triangles, 3), f"vertices of {scene.nodes[number].name}")
        weights, into = _angles(corners).ravel(), mesh.triangles.ravel()
        count = len(mesh.positions)
        whole_ = np.bincount(into, weights, count)
        sums = np.zeros((lights, count))
        for row, values in zip(sums, each, strict=True):
            row += np.bincount(into, weights * values, count)
        means = np.where(whole_ > 0.0, sums / np.where(whole_ > 0.0, whole_, 1.0), np.nan)
        found[scene.nodes[number].name] = means.astype(np.float32)
    return found


def _angles(corners: Array) -> Array:
    """Angles (T, 3) at the corners (T, 3, 3) of triangles; 0 in one without area."""
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    turn = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.where(turn > 0.0, np.arctan2(turn, (ahead * back).sum(axis=2)), 0.0)


def _of_texels(
    scene: Scene, seen: Seen, lights: int, samples: int, size: tuple[int, int], uv_set: int, padding: int
) -> dict[str, NDArray[np.float32]]:
    """Per drawn node an image (L, H, W); NaN where no face is near."""
    starts, found, block = face_starts(scene), {}, int(np.sqrt(samples))
    chosen = _nodes_with_faces(scene)
    sets = [scene.nodes[k].mesh.second_uv if uv_set else scene.nodes[k].mesh.uv for k in chosen]
    if bare := [scene.nodes[k].name for k, uv in zip(chosen, sets, strict=True) if uv is None]:
        raise SceneError(
            f"{', '.join(bare[:8])} of {scene.name} has no texture coordinates (set {uv_set}): bake to vertices or faces, or unwrap it"
        )
    width, height = size[0] * block, size[1] * block
    for number, uv in zip(chosen, sets, strict=True):
        node = scene.nodes[number]
        assert uv is not None
        texels = covered(uv.astype(np.float64), node.mesh.triangles, (width, height))
        if texels.shared:
            warn(
                f"{texels.shared} texels of {node.name} are inside several triangles, whose texture coordinates overlap: the first counts"
            )
        triangles = texels.triangles + starts[number]
        values = np.full((lights, width * height), np.nan, dtype=np.float32)
        for first in range(0, len(triangles), _TOGETHER):
            some = slice(first, first + _TOGETHER)
            a, b, c = face_corners(scene, triangles[some]).transpose(1, 0, 2)
            weights = texels.weights[some]
            points = a + (weights[:, 1:2] * (b - a) + weights[:, 2:3] * (c - a))
            values[:, texels.places[some]] = seen(points, triangles[some], f"texels of {node.name}")
        images = values.reshape(lights, size[1], block, size[0], block)
        count = np.isfinite(images).sum(axis=(2, 4))
        total = np.where(np.isfinite(images), images, 0.0).sum(axis=(2, 4))
        mean = np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(np.float32)
        found[node.name] = padded(mean, padding)
    return found


def _nodes_with_faces(scene: Scene) -> list[int]:
    chosen = [k for k in scene.drawn.tolist() if len(scene.nodes[k].mesh.triangles)]
    if not chosen:
        raise SettingsError(f"{scene.name} has no faces, only points or lines: use visibility")
    return chosen
