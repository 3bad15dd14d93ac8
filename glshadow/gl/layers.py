"""Blended surfaces as layers: peeled front to back, shaded like all others, and composited over the opaque image at every sample."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import FrameRequest
from glshadow.core.cropped import Cropped
from glshadow.core.sampling import grid
from glshadow.core.spaces import Array
from glshadow.derive.culling import seen_by
from glshadow.derive.look import Look
from glshadow.gl.driver.clock import Clock
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.kept import Kept
from glshadow.gl.driver.layer_targets import LayerTargets
from glshadow.gl.driver.queries import AnySamples
from glshadow.gl.driver.targets import CameraTargets, release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.atlases import Atlases
from glshadow.gl.passes.camera import CameraView, Peel, draw_surface, view_scene
from glshadow.gl.passes.primary import find_primary
from glshadow.gl.passes.readback import pixels
from glshadow.gl.passes.resolve import resolve
from glshadow.gl.passes.screen import draw_over
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.kept_meshes import Meshes
from glshadow.gl.scene.matrices import pack_matrices
from glshadow.gl.scene.reuse import Before
from glshadow.gl.shares import shares_of
from glshadow.gl.techniques import LightPass, Techniques
from glshadow.scene.nodes import Scene
from glshadow.shadows.view import camera_view

MOST_SAMPLES = 1 << 20
"""Samples of the image whose layers are held at a time: up to 160 MB of targets."""


def opaque_scene(context: GLContext, meshes: Meshes, scene: Scene, before: Before | None = None) -> GpuScene:
    """The scene without the nodes that blend, if there are others: all outputs but the image describe it. `before`: see `GpuScene`."""
    blending = scene.blending
    chosen = np.flatnonzero(~blending) if blending.any() and not blending.all() else slice(None)
    return GpuScene(context, meshes, scene, before, chosen)


class Layers:
    """The layers of a renderer's frames, and what is kept for them from frame to frame.

    Layers have triangle lists and shadow maps of their own, since these depend on all surfaces in view: those of the opaque image are the
    same as without any blended surface.
    """

    def __init__(self, context: GLContext, meshes: Meshes) -> None:
        self._context, self._meshes = context, meshes
        self._scene: Kept[GpuScene] = Kept()
        self._view: tuple[Any, CameraView] | None = None
        self._targets: Kept[LayerTargets] = Kept()
        self._techniques = Techniques(context)
        self._atlases = Atlases(context)
        self._any: AnySamples | None = None

    def scene(self, scene: Scene) -> GpuScene | None:
        """The whole scene, with triangles in the order in which they are drawn; None if nothing blends."""
        if not scene.blending.any():
            return None

        def make() -> GpuScene:
            meshes = [id(scene.nodes[i].mesh) for i in scene.drawn.tolist()]
            place = {mesh: k for k, mesh in enumerate(dict.fromkeys(meshes))}
            order = np.argsort([place[mesh] for mesh in meshes], kind="stable")
            return GpuScene(self._context, self._meshes, scene, chosen=order)

        return self._scene.get(weakref.ref(scene), make)

    def composite(
        self,
        frame: FrameContext,
        request: FrameRequest,
        scene: GpuScene,
        opaque: Sequence[LightPass],
        results: dict[str, Any],
        clock: Clock,
    ) -> bool:
        """Composite all layers over the frame's image, linear light and alpha. Returns whether there are any in view.

        `opaque`: the lights of the image, whose tints are those of the layers.
        """
        if results.keys().isdisjoint(("image", "linear", "alpha")):
            return False
        view = self.view(scene, request)
        block = grid(request.look.samples)
        tiles = _tiles(view, scene, block, frame.caps.max_texture_size)
        if not tiles:
            return False
        shape = (tiles[0][2:], block, scene.channels, len(request.lights), scene.features.emits)
        targets = self._targets.get(shape, lambda: LayerTargets(self._context, *shape))
        whole = replace(
            frame, scene=scene, camera_view=view, atlases=self._atlases, targets=targets.opaque, measured=False
        )
        lights: list[LightPass] | None = None
        found = False
        for tile in tiles:
            part = replace(whole, camera_view=_cropped(view, scene, tile))
            with clock("layers"):
                self._begin(part, targets, request)
                number = 0
                while self._peel(part, targets, request, number):
                    lights = self._lights(whole, opaque) if lights is None else lights
                    self._shade(part, targets.layers[number % 2], request, lights)
                    self._add(part, targets, number % 2)
                    number += 1
                if number == 0:
                    continue
                assert lights is not None
                found = True
                mean = self._mean(part, targets, request, lights)
            _put(results, mean, tile, request.look)
        return found

    def view(self, scene: GpuScene, request: FrameRequest) -> CameraView:
        """What the camera sees of the whole scene."""
        key = (request.camera, request.size, scene.identity)
        if self._view is None or self._view[0] != key:
            self._view = (key, view_scene(scene, request.camera, request.size, self._context.caps.clip_control))
        return self._view[1]

    def _lights(self, whole: FrameContext, opaque: Sequence[LightPass]) -> list[LightPass]:
        """Each light's technique, for layers as well as what is behind them."""
        self._atlases.begin()
        lights = self._techniques.allocate(whole, tuple(each.light for each in opaque))
        for each, other in zip(lights, opaque, strict=True):
            each.used = each.used or each.technique.update(whole)
            each.tint = other.tint
        return lights

    def _begin(self, part: FrameContext, targets: LayerTargets, request: FrameRequest) -> None:
        """Draw the opaque surfaces, and let the layer before the first be the near plane."""
        gl, view = part.context.gl, part.camera_view
        opaque, before = targets.opaque.fine, targets.layers[1].fine
        draw_surface(part.context, part.programs, part.scene, view, opaque.framebuffer, request.look.samples)
        find_primary(part, opaque, request.look.samples)
        before.framebuffer.use()
        before.framebuffer.clear(depth=1.0 - view.clip.clear_depth)
        gl.clear_unsigned(0, (0, 0, 0, 0))
        targets.cleared.use()
        gl.clear_floats(0, (0.0,) * 4)
        gl.clear_floats(1, (1.0,) * 4)

    def _peel(self, part: FrameContext, targets: LayerTargets, request: FrameRequest, number: int) -> bool:
        """Draw the next layer; returns whether there is one."""
        scene, view = part.scene, part.camera_view
        before = targets.layers[1 - number % 2]
        peel = Peel(
            {"GLS_PEEL": 1, "GLS_REVERSED": int(view.clip.reversed)},
            {"u_peeled": before.surface, "u_peeled_depth": before.depth, "u_opaque_depth": targets.opaque.depth},
        )
        seen = seen_by(view.view.clip_from_world, scene.corners, view.view)
        blended = replace(view, drawn=np.flatnonzero(seen & scene.blends))
        self._any = self._any or AnySamples(part.context.gl)
        with self._any:
            draw_surface(
                part.context, part.programs, scene, blended, targets.peeled[number % 2], request.look.samples, peel=peel
            )
        return self._any.passed

    def _shade(
        self, part: FrameContext, targets: CameraTargets, request: FrameRequest, lights: Sequence[LightPass]
    ) -> None:
        """Shade the surfaces of some targets with all lights."""
        targets.renew()
        shaded = replace(part, targets=targets)
        look = replace(request.look, tone="none", scale=1.0)  # linear: the mean is exposed and tone mapped, see `_put`
        for share in shares_of(shaded, lights, look):
            resolve(shaded, share)

    def _add(self, part: FrameContext, targets: LayerTargets, which: int) -> None:
        """Composite the shaded layer behind those before it."""
        for product, framebuffer in enumerate((targets.adding[which], targets.multiplying[which])):
            program = part.programs.get("pass/resolve.vert", "pass/layer.frag", defines={"GLS_PRODUCT": product})
            program.set(u_far_z=part.camera_view.far_z)
            program.bind(u_kept=targets.kept, u_through=targets.through, u_light=targets.opaque.linear)
            framebuffer.use()
            draw_over(part.context, program, part.camera_view, added=1 - product, multiplied=bool(product))

    def _mean(
        self, part: FrameContext, targets: LayerTargets, request: FrameRequest, lights: Sequence[LightPass]
    ) -> NDArray[np.float32]:
        """The mean of each pixel that a layer covers, over what is behind (H, W, 4), premultiplied; NaN elsewhere."""
        look, view, opaque = request.look, part.camera_view, targets.opaque
        block: dict[str, int | str] = {"GLS_COLUMNS": targets.block[0], "GLS_ROWS": targets.block[1]}
        layers = {"u_through": targets.through, "u_added": targets.added}
        program = part.programs.get("pass/resolve.vert", "pass/unlayered.frag", defines=block)
        program.set(u_far_z=view.far_z)
        program.bind(**layers)
        opaque.fine.depth_alone.use()
        draw_over(part.context, program, view)
        opaque.framebuffer(opaque.image, max(len(request.lights), 1) - 1).use()
        part.context.gl.clear_floats(2, (0.0,) * 4 if look.background is None else (*look.linear_background, 0.0))
        self._shade(part, opaque, request, lights)
        program = part.programs.get("pass/over.vert", "pass/layered_mean.frag", defines=block)
        program.bind(**layers, u_light=opaque.linear)
        targets.averaged.use()
        part.context.ctx.enable_only(moderngl.NOTHING)
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        program.unbind()
        return pixels(targets.mean, np.float32)

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._scene, self._targets, self._techniques, self._atlases, self._any)


_STEP = 64  # pixels: sides of parts are multiples of this, so that targets are kept while the camera moves a little

Tile = tuple[int, int, int, int]
"""First column from the left, first row from below, width, height; pixels."""


def _tiles(view: CameraView, scene: GpuScene, block: tuple[int, int], limit: int) -> list[Tile]:
    """Parts of the image, all of one size, that together contain everything that blends; none if it is out of view."""
    seen = seen_by(view.view.clip_from_world, scene.corners, view.view) & scene.blends
    if not seen.any():
        return []
    columns, rows = view.size
    per = block[0] * block[1]
    low, high = _rectangle(view, scene.corners[seen].reshape(-1, 3))
    if (low >= high).any():
        return []
    wide, tall = (-(-int(side) // _STEP) * _STEP for side in high - low)
    width = max(1, min(columns, wide, limit // block[0], MOST_SAMPLES // per))
    height = max(1, min(rows, tall, limit // block[1], MOST_SAMPLES // (per * width)))
    return [
        (min(x, columns - width), min(y, rows - height), width, height)
        for y in range(int(low[1]), int(high[1]), height)
        for x in range(int(low[0]), int(high[0]), width)
    ]


def _rectangle(view: CameraView, points: Array) -> tuple[Array, Array]:
    """Lower left and upper right corner, in whole pixels, of a rectangle that contains what is seen of the hulls of points (N, 3)."""
    size = np.array(view.size, dtype=np.float64)
    clip = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ view.view.clip_from_world.T
    least = 0.5 * view.near if view.camera.is_perspective else 0.5
    if clip[:, 3].min() < least:  # reaches beside or behind the eye
        return np.zeros(2), size
    places = 0.5 * (clip[:, :2] / clip[:, 3:] + 1.0) * size
    low, high = np.floor(places.min(axis=0)) - 1.0, np.ceil(places.max(axis=0)) + 1.0
    return np.maximum(low, 0.0), np.minimum(high, size)


def _cropped(view: CameraView, scene: GpuScene, tile: Tile) -> CameraView:
    """The view of a part of the image."""
    camera = Cropped(view.camera, view.size, tile[:2])
    part = camera_view(camera, tile[2:], view.near, view.far, view.clip)
    seen = seen_by(part.clip_from_world, scene.corners, part)
    return replace(
        view, camera=camera, size=tile[2:], view=part, drawn=np.flatnonzero(seen & ~scene.copies & ~scene.blends),
        clip_from_mesh=pack_matrices(part.clip_from_world @ scene.world_from_origin),
    )  # fmt: skip


def _put(results: dict[str, Any], mean: NDArray[np.float32], tile: Tile, look: Look) -> None:
    """Replace the pixels of a part that layers cover."""
    x, y, width, height = tile
    covered = ~np.isnan(mean[..., 3])
    light = mean[covered]
    for name in ("image", "linear", "alpha"):
        if name not in results:
            continue
        image = results[name]
        top = image.shape[0] - y - height
        part = image[top : top + height, x : x + width]
        if name == "linear":
            part[covered] = light[:, : part.shape[2]]
        elif name == "alpha":
            part[covered] = light[:, 3]
        else:
            part[covered] = look.encoded(light)
