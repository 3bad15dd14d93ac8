"""Skins: vertices posed by the joints of the file's nodes (glTF 2.0, 3.7.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, cofactors
from glshadow.errors import SceneError
from glshadow.io.gltf.accessor import read_floats
from glshadow.io.gltf.document import Document

BLOCK = 1 << 16  # vertices per block: a matrix for each of their joints takes 100 times their own memory


@dataclass(frozen=True, eq=False)
class Bound:
    """The joints of a skin.

    Parameters
    ----------
    where : str
        Its name in messages.
    joints : tuple of int
        Nodes of the file.
    bind : (J, 4, 4) float64
        Inverse bind matrices; identities if the skin has none.
    """

    where: str
    joints: tuple[int, ...]
    bind: Array

    def matrices(self, world: Array) -> Array:
        """world_from_bind (J, 3, 4): the joints' world matrices (J, 4, 4) times their inverse bind matrices.

        Raises
        ------
        SceneError
            If a product overflows.
        """
        with np.errstate(all="ignore"):
            matrices = (world @ self.bind)[:, :3]
        if not np.isfinite(matrices).all():
            raise SceneError(f"{self.where}: a joint's matrix times its inverse bind matrix overflows")
        return np.asarray(matrices)


def bound(document: Document, index: Any, user: str) -> Bound:
    """The joints of skin `index`.

    Raises
    ------
    SceneError
        If a joint is not a node, or a matrix is missing or not finite.
    """
    where = f"skins[{index}]"
    skin = document.item("skins", index, user)
    joints = skin.get("joints")
    if not isinstance(joints, list) or not joints:
        raise SceneError(f"not valid glTF: {where}.joints must be an array of nodes, got {str(joints)[:80]}")
    for joint in joints:
        document.item("nodes", joint, f"{where}.joints")
    document.budget.take(2 * 128 * len(joints), where)
    bind = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in skin:
        stored = read_floats(document, skin["inverseBindMatrices"], ("MAT4",), f"{where}.inverseBindMatrices")
        if len(stored) < len(joints):
            raise SceneError(f"{where} has {len(stored)} inverse bind matrices for {len(joints)} joints")
        bind = stored[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
        bad = int((~np.isfinite(bind)).any(axis=(1, 2)).sum())
        if bad:
            raise SceneError(f"{where}: {bad} of {len(joints)} inverse bind matrices are not finite (NaN or infinite)")
        bind[:, 3] = (0.0, 0.0, 0.0, 1.0)  # required; exporters leave rounding errors here
    return Bound(where, tuple(joints), bind)


def influences(
    joints: list[NDArray[np.int64]], weights: list[Array], count: int, notes: list[str], where: str
) -> tuple[NDArray[np.int64], Array]:
    """Joints (N, K) of each vertex and their weights (N, K), sum 1, from all sets of four.

    Raises
    ------
    SceneError
        For weights that are not finite, and joints out of the skin's range, `count`.
    """
    chosen, shares = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    bad = int((~np.isfinite(shares)).any(axis=1).sum())
    if bad:
        raise SceneError(
            f"{where}: {bad} of {len(shares)} vertices have joint weights that are not finite (NaN or infinite)"
        )
    lost = (chosen >= count) & (shares != 0.0)
    if lost.any():
        raise SceneError(f"{where}: joint {int(chosen[lost].max())} is out of range, its skin has {count} joints")
    chosen = np.where(shares == 0.0, 0, chosen)
    with np.errstate(all="ignore"):
        total = shares.sum(axis=1)
    free = ~((total > 0.0) & np.isfinite(total))
    if free.any():
        notes.append(
            f"{where}: {int(free.sum())} of {len(shares)} vertices have no joint weights: they follow the first joint"
        )
        shares[free] = np.eye(shares.shape[1])[0]
        chosen[free] = 0
        total[free] = 1.0
    return chosen, shares / total[:, None]


def posed(
    positions: Array, normals: Array | None, chosen: NDArray[np.int64], shares: Array, joints: Array
) -> tuple[Array, Array | None]:
    """Positions and normals (N, 3) transformed by the weighted sum of their joints' matrices (J, 3, 4); normals of any length."""
    moved, turned = np.zeros_like(positions), None if normals is None else np.zeros_like(normals)
    with np.errstate(all="ignore"):  # overflows are refused with the vertices
        for start in range(0, len(positions), BLOCK):
            part = slice(start, start + BLOCK)
            matrix = np.einsum("nk,nkij->nij", shares[part], joints[chosen[part]])
            moved[part] = np.einsum("nij,nj->ni", matrix[..., :3], positions[part]) + matrix[..., 3]
            if turned is not None and normals is not None:
                turned[part] = np.einsum("nij,nj->ni", cofactors(matrix[..., :3]), normals[part])
    return moved, turned
