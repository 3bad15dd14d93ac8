"""Morph targets: their weights at rest, and the changes to attributes."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.document import Document

Weights = tuple[float, ...]


def resting_weights(node: dict[str, Any], mesh: dict[str, Any], where: str) -> Weights:
    """Weights of a mesh's targets: the node's, otherwise the mesh's; empty if all are zero.

    Raises
    ------
    SceneError
        If they are not finite numbers.
    """
    given = node.get("weights", mesh.get("weights"))
    if given is None:
        return ()
    try:
        weights = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        weights = np.full(1, np.nan)
    if weights.ndim != 1 or not np.isfinite(weights).all():
        raise SceneError(f"{where}: weights of morph targets must be finite numbers, got {str(given)[:80]}")
    return tuple(weights.tolist()) if weights.any() else ()


def targets_of(
    document: Document, primitive: dict[str, Any], weights: Weights, where: str
) -> list[tuple[float, dict[str, Any]]]:
    """(weight, attributes) of the targets with an effect."""
    targets = primitive.get("targets", [])
    if not isinstance(targets, list) or not all(isinstance(target, dict) for target in targets):
        raise SceneError(f"not valid glTF: {where}.targets must be an array of objects")
    if weights and len(weights) != len(targets):
        document.notes.append(
            f"{where} has {len(targets)} morph targets and {len(weights)} weights: the rest is left out"
        )
    return [(weight, target) for weight, target in zip(weights, targets, strict=False) if weight]


def moved(base: Array, weight: float, change: Array) -> Array:
    """Values (N, columns) with a weighted change (N, the same or fewer columns) added."""
    result = base.copy()
    with np.errstate(all="ignore"):  # overflows are refused with the vertices
        result[:, : change.shape[1]] += weight * change[:, : base.shape[1]]
    return result
