"""Checks that a scene can be drawn: size limits, visible area, precision lost in float32 files far from the origin."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array, cofactors
from glshadow.errors import SceneError
from glshadow.scene.box import box_corners, check_place
from glshadow.scene.nodes import Node

# derived: the squares of lengths, with a margin of 8 decades on either side, stay inside float32's 1e-38..1e38
LEAST_SIZE, MOST_SIZE = 1e-15, 1e15
LEAST_STEPS = (
    1000.0  # float32 steps across a mesh below which its shape is visibly lost: about a pixel of an ordinary image
)
MAP_TEXELS = 2048  # the default shadow map
SAMPLED = 20_000  # triangles per mesh from which its area is estimated


def check_scene(nodes: list[Node], *, stored: bool) -> list[str]:
    """Check a scene; returns texts for warnings.

    Parameters
    ----------
    nodes : list of Node
    stored : bool
        Whether the coordinates come from a file, where float32 may have lost precision.

    Raises
    ------
    SceneError
        If nothing is visible, or the size is outside the range that float32 can draw.
    """
    some = any(node.mesh.count for node in nodes)
    nodes = [node for node in nodes if node.drawn]
    if not nodes:
        why = "the alpha of all of it is 0" if some else "it has no triangles, points or lines"
        raise SceneError(f"nothing to render: {why}")
    boxes = (
        np.stack([node.mesh.bounds_for(node.world_from_mesh) for node in nodes]),
        np.stack([node.world_from_mesh for node in nodes]),
    )
    corners = box_corners(*boxes)
    with np.errstate(over="ignore", invalid="ignore"):  # infinite corners: see check_place
        size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    if size == 0.0:
        raise SceneError("nothing to render: its size is zero, all vertices are at one point")
    if np.isfinite(size) and not LEAST_SIZE <= size <= MOST_SIZE:
        raise SceneError(f"its size is {size:.3g}; it must be from {LEAST_SIZE:g} to {MOST_SIZE:g}: scale it first")
    check_place(corners)
    notes = _lost_in_float32(nodes) if stored else []
    if not all(len(node.mesh.triangles) for node in nodes):  # balls and tubes have a surface
        return notes
    if not _any_area(nodes):
        if notes:
            return notes
        raise SceneError("nothing to render: all its triangles have zero area")
    if _area(nodes) < (size / MAP_TEXELS) ** 2 and not _thin(corners):
        notes.append(
            f"its bounds are {size:.4g} across, but its total surface area is smaller than one texel of a "
            f"{MAP_TEXELS} "
            "map over them: something is far away from the rest; remove it, or aim the camera and use ViewFit"
        )
    return notes


def visible(nodes: list[Node]) -> bool:
    """Whether any triangle has an area."""
    nodes = [node for node in nodes if len(node.mesh.triangles)]
    return bool(nodes) and _any_area(nodes)


def _thin(corners: Array) -> bool:
    """Whether the bounds themselves are needle-shaped: a small surface is then no sign of an outlier."""
    sides = np.sort(np.ptp(corners.reshape(-1, 3), axis=0))
    return bool(sides[1] < sides[2] / MAP_TEXELS)


def _doubled_areas(corners: Array) -> Array:
    """Cross products (T, 3) of two edges of triangles (T, 3, 3): twice their area vectors."""
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.stack([e[:, i] * f[:, j] - e[:, j] * f[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


def _area(nodes: list[Node]) -> float:
    """World area, estimated from every n-th triangle of a mesh, scaled as for a surface with evenly distributed normals."""
    areas: dict[int, float] = {}
    placed = []
    for node in nodes:
        key = id(node.mesh)
        if key not in areas:
            step = max(1, len(node.mesh.triangles) // SAMPLED)
            vectors = _doubled_areas(node.mesh.positions[node.mesh.triangles[::step]])
            areas[key] = 0.5 * step * float(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)).sum())
        placed.append(areas[key])
    scale = np.linalg.norm(cofactors(_linear(nodes)), axis=(1, 2)) / np.sqrt(3.0)
    return float(np.asarray(placed) @ scale)


def _linear(nodes: list[Node]) -> Array:
    return np.stack([node.world_from_mesh for node in nodes])[:, :3, :3]


def _any_area(nodes: list[Node]) -> bool:
    """Whether any triangle has a non-zero area, exactly; stops at the first block with such a triangle."""
    block = 4096
    for node, cofactor in zip(nodes, cofactors(_linear(nodes)), strict=True):
        for start in range(0, len(node.mesh.triangles), block):
            corners = node.mesh.positions[node.mesh.triangles[start : start + block]]
            if (_doubled_areas(corners) @ cofactor.T != 0.0).any():
                return True
    return False


def _lost_in_float32(nodes: list[Node]) -> list[str]:
    """Texts for meshes whose float32 coordinates are too far from their origin to represent the shape."""
    lost = []
    for mesh in {id(node.mesh): node.mesh for node in nodes}.values():
        low, high = mesh.bounds
        far = float(np.abs(mesh.bounds).max())
        extent = float(np.ptp(mesh.bounds, axis=0).max())
        step = float(np.spacing(np.float32(far)))
        single = all((corner.astype(np.float32) == corner).all() for corner in (low, high))
        single = single and not (mesh.positions[:SAMPLED] % (4.0 * step) == 0.0).all()  # whole numbers are not rounded
        if single and extent < LEAST_STEPS * step:
            lost.append((far, step, extent))
    if not lost:
        return []
    far, step, extent = lost[0]
    return [
        f"{len(lost)} mesh(es) are up to {far:.3g} from their origin, where float32 has steps of {step:.3g}, but are only "
        f"{extent:.3g} large: their shape is already lost in the file; export them near the origin, with the position in the node"
    ]
