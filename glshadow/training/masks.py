"""shadow_masks: for each node the pixels of a frame that its shadow covers, and the pixels that show it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glshadow.arguments import chosen_nodes
from glshadow.core.setting import flag, instance, shown, whole
from glshadow.core.spaces import Bools
from glshadow.errors import SettingsError
from glshadow.frame import Frame, LeftBehind
from glshadow.lights import Light
from glshadow.reference.blockers import node_shadows


@dataclass(frozen=True, eq=False, repr=False)
class ShadowMasks:
    """The shadow of each of some nodes in an image.

    Attributes
    ----------
    nodes : tuple of str
        Their names.
    shadows : (K, H, W) bool
        Pixels whose ray to the light's centre meets the node. Nodes may share pixels: a point that is behind two is in the shadow of both.
    objects : (K, H, W) bool
        Pixels that show the node.
    light : Light
    """

    nodes: tuple[str, ...]
    shadows: Bools
    objects: Bools
    light: Light

    def __repr__(self) -> str:
        shares = ", ".join(f"{name} {share:.2%}" for name, share in list(self._shares.items())[:6])
        more = ", ..." if len(self.nodes) > 6 else ""
        return f"ShadowMasks({self.shadows.shape[2]} x {self.shadows.shape[1]}, {self.light.spelling} light: {shares}{more})"

    @property
    def _shares(self) -> dict[str, float]:
        return dict(zip(self.nodes, self.shadows.mean(axis=(1, 2)).tolist(), strict=True))


def shadow_masks(frame: Frame, of: Any = None, light: int = 0, attached: bool = False) -> ShadowMasks:
    """Masks of each node's shadow at the centres of a frame's pixels, by rays in float64.

    The mask of a node is counterfactual: it is what would be in shadow if this node alone cast shadows. `Frame.blocker` names for each
    pixel one node, the first along the ray; a mask holds the shadow also where others are in between or beyond. A surface of the node
    itself on which it casts a shadow belongs to its mask; one that faces away from the light only with `attached`. Soft shadows: of the
    light's centre.

    Parameters
    ----------
    frame : Frame
        Rendered with the output "triangle".
    of : optional
        Nodes, their names or indices, one or several; None: all that cast, but a ground.
    light : int
        Index in `frame.lights`.
    attached : bool
        Whether the mask also holds the node's own surfaces that face away from the light.

    Returns
    -------
    ShadowMasks

    Raises
    ------
    MissingOutput
        If the frame has no "triangle".
    SettingsError
        For what is not a frame, not a node or not a light of it, and for a frame of a lens with distortion or without its scene.
    ReferenceUnavailable
        If embreex is not installed.
    """
    frame = instance(Frame)("frame", frame)
    if isinstance(frame.scene, LeftBehind):
        raise SettingsError(
            f"a pickled frame does not contain its scene {shown(frame.scene.name)}: make its masks before"
        )
    if frame.distortion is not None:
        raise SettingsError("masks need a frame without distortion: make them of an image of the camera itself")
    number = whole(0, len(frame.lights) - 1)("light", light)
    scene, attached = frame.scene, flag()("attached", attached)
    chosen = chosen_nodes("of", scene, of)
    if of is None:
        nodes = scene.nodes
        chosen = [
            i for i in chosen if nodes[i].casts and nodes[i].drawn and not nodes[i].blends and not nodes[i].ground
        ]
    source = frame.lights[number]
    shadows = node_shadows(scene, frame.camera, source, frame.triangle, chosen, attached)
    first = np.cumsum([0, *(node.mesh.count for node in scene.nodes)])
    owner = np.searchsorted(first, frame.triangle, side="right") - 1
    objects = np.array([owner == i for i in chosen], dtype=bool).reshape(shadows.shape)
    return ShadowMasks(tuple(scene.nodes[i].name for i in chosen), shadows, objects, source)
