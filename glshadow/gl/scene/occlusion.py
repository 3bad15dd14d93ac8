"""Occlusion culling: repeated draws of a shadow map skip clusters of triangles that cannot change it.

Clusters outside the view or behind others do not change a depth map, in whatever order they are drawn. Clusters hidden in the last
map of a moving light are mostly hidden in the next one too: the others are drawn, their depth is read back, and of the skipped
clusters only those that are not behind that depth are drawn after them. Read-back pays off where OpenGL runs on the CPU; elsewhere
clusters are only culled by the view. Clusters that face away from the light are not culled: drawing one costs a tenth of a visible
one, as much as the test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, translation
from glshadow.derive.occlusion import behind, farthest
from glshadow.derive.resolved import CasterSettings
from glshadow.geometry.frustum import Bools, Extents, extents, in_frustum
from glshadow.gl.driver.context import GLContext
from glshadow.gl.passes.atlases import Atlas
from glshadow.gl.scene.drawing import Begin, draw_nodes
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.runs import Runs, Whole
from glshadow.shadows.metric import Target
from glshadow.shadows.view import ShadowView

LEAST_TRIANGLES = 1 << 17
"""Scenes with fewer triangles are drawn faster than tested."""
_FEWER = (
    0.8  # largest share of the draw time for which culling pays off: clusters share fewer vertices (10 % on a brain)
)
# Seconds on llvmpipe (Mesa 22.3, two cores), tuned with scripts/benchmarks/spared.py. They decide how a map is drawn, not its content.
_FRONT, _BACK = 1e-7, 1e-8  # a drawn triangle, and a culled back face
_TEXEL, _CLUSTER = 1.2e-9, 2e-7  # of the test
_STEPS = {Target.DEPTH32F: 0.0}
_STEP = 2.0**-15  # largest step of the other depth formats
_FIRST_PAUSE = 3  # draws before clusters are built, which takes as long as two or three draws
_PAUSE, _LONGEST_PAUSE = 16, 1024  # draws until culling is tried again after it did not pay off


def can_cull(scene: GpuScene, settings: CasterSettings, views: Sequence[ShadowView]) -> bool:
    """Whether culling keeps the maps' content the same.

    Not in perspective. For a metric, of equal depths the last one drawn wins, so all must be drawn, in order. Casters that are moved by
    a bias leave their clusters' bounds.
    """
    warped = any(view.warp is not None for view in views)
    return (
        not warped
        and not scene.capsules
        and settings.target.is_depth
        and settings.bias.of_caster is None
        and scene.count >= LEAST_TRIANGLES
    )


@dataclass
class Backoff:
    """Delay until something that did not pay off is tried again: after 16 draws, then 32, and so on."""

    left: int = 0
    waits: int = 0

    def ready(self) -> bool:
        """Whether to try now."""
        self.left -= 1
        return self.left < 0

    def record(self, worth: bool) -> None:
        """Record whether it paid off."""
        self.left = self.waits = 0 if worth else min(max(2 * self.waits, _PAUSE), _LONGEST_PAUSE)


@dataclass
class ViewHistory:
    """What is known of a view from its last maps.

    Attributes
    ----------
    scene : int
        Identity of the scene.
    clusters : (C,) bool or None
        Clusters that were visible; None: unknown.
    choosing, testing : Backoff
        Of culling clusters at all, and of testing which are hidden.
    """

    scene: int
    choosing: Backoff
    testing: Backoff
    clusters: Bools | None = None


class OcclusionCulling:
    """Draws the maps of one light with culled clusters.

    Parameters
    ----------
    hidden : sequence of {"back", "front", None}
        Per node the side that is culled.
    """

    def __init__(
        self, context: GLContext, scene: GpuScene, atlas: Atlas, settings: CasterSettings, hidden: Sequence[str | None]
    ) -> None:
        self._context, self._scene, self._atlas, self._settings, self._hidden = context, scene, atlas, settings, hidden
        self._triangles = np.array([gpu.count for gpu in scene.meshes])
        self._side = np.array([{"back": 1.0, "front": -1.0, None: 0.0}[side] for side in hidden])
        offset = settings.bias.polygon_offset
        self._reads = context.caps.software and min(offset) >= 0.0

    def draw(self, view: ShadowView, chosen: NDArray[np.int64], whole: Begin, clustered: Begin) -> int:
        """Draw nodes into a view's tile, which is clear; returns the number of draws.

        Parameters
        ----------
        chosen : (K,) int64
            Nodes that may be in the view.
        whole, clustered : Begin
            For meshes in their own order, and cluster after cluster.
        """
        history = self._history(view)
        if not history.choosing.ready():
            self._draw_whole(chosen, whole)
            return len(chosen)
        bounds, shows, mine = self._shows(view, chosen)
        cost = self._cost(view)
        reading, testing = _TEXEL * view.resolution**2, _CLUSTER * len(cost)
        tests_hidden = self._reads and 0.5 * cost[shows].sum() > reading and history.testing.ready()
        now = shows & history.clusters if tests_hidden and history.clusters is not None else shows
        if cost[now].sum() > _FEWER * cost[mine].sum():
            self._draw_whole(chosen, whole)
            now = mine
        else:
            self._draw(now, clustered)
        needed = shows
        if tests_hidden:
            history.clusters = ~self._behind(view, bounds)
            needed = shows & history.clusters
            self._draw(needed & ~now, clustered)
            history.testing.record(cost[shows & ~needed].sum() > reading)
        fewer = cost[needed].sum() <= _FEWER * cost[mine].sum()
        history.choosing.record(fewer and cost[mine & ~needed].sum() > testing)
        return len(chosen)

    def _cost(self, view: ShadowView) -> Array:
        """Estimated draw time (C,) of clusters, seconds, by how much of each faces the light."""
        placed = self._scene.clusters
        backward = view.view_from_world[2, :3]
        towards = backward[:, None]
        if view.projection != "orthographic":
            eye = -view.view_from_world[:3, :3].T @ view.view_from_world[:3, 3] - self._scene.origin
            towards = eye[:, None] - placed.centre
            towards /= np.maximum(np.linalg.norm(towards, axis=0), 1e-300)
        side = self._side[placed.body]
        front = np.clip(0.5 + side * (placed.normal * towards).sum(axis=0), 0.0, 1.0)
        share = np.where(side == 0.0, 1.0, front)
        each = self._triangles / np.diff(placed.first)
        return np.asarray(each[placed.body] * (_BACK + _FRONT * share))

    def _shows(self, view: ShadowView, chosen: NDArray[np.int64]) -> tuple[Extents, Bools, Bools]:
        scene, placed = self._scene, self._scene.clusters
        clip_from_origin = view.clip_from_world @ translation(scene.origin)
        bounds = extents(placed, clip_from_origin, view.clip_from_world @ scene.world_from_origin)
        nodes = np.zeros(len(scene.nodes), dtype=bool)
        nodes[chosen] = True
        mine = nodes[placed.body]
        return bounds, in_frustum(placed, clip_from_origin, bounds) & mine, mine

    def _history(self, view: ShadowView) -> ViewHistory:
        history = self._atlas.shown.get(view.tile)
        if history is None or history.scene != self._scene.identity:
            history = self._atlas.shown[view.tile] = ViewHistory(self._scene.identity, Backoff(_FIRST_PAUSE), Backoff())
        return history

    def _draw_whole(self, chosen: NDArray[np.int64], begin: Begin) -> None:
        stroke = Whole(self._context, self._scene.count)
        draw_nodes(self._context.ctx, self._scene, chosen, self._hidden, begin, stroke)

    def _draw(self, drawn: Bools, begin: Begin) -> None:
        runs = Runs(self._context, self._scene.clusters, drawn, self._triangles)
        draw_nodes(self._context.ctx, self._scene, runs.nodes, self._hidden, begin, runs)

    def _behind(self, view: ShadowView, bounds: Extents) -> Bools:
        side = view.resolution
        depth = self._atlas.staging(side)
        self._atlas.framebuffer.read_into(
            depth, (*view.tile, side, side), components=1, attachment=-1, dtype="f4", alignment=1
        )
        step = _STEPS.get(self._settings.target, _STEP)
        return behind(view, bounds, farthest(depth, view.clip.reversed), step)
