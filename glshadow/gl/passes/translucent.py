"""Coloured shadows of translucent casters: per light a map of transmitted colour and a map of the nearest caster's depth."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, ClipSpace, bias_matrix
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import depth_texture, release, released_on_error
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.atlases import layout
from glshadow.gl.scene.drawing import draw_nodes
from glshadow.gl.scene.geometry import GpuScene, pack_matrices
from glshadow.lights import Light
from glshadow.shadows.fit_request import FitRequest
from glshadow.shadows.fitted import around
from glshadow.shadows.metric import Target
from glshadow.shadows.view import ShadowView

RESOLUTION = 1024
UNTINTED = "{} passes through translucent casters untinted: their colours are rendered from one point, which is wrong for a wide light"
_GUARD = 2


@dataclass(frozen=True, eq=False)
class Tint:
    """A light's two maps, with the uniforms that receivers need to sample them."""

    views: tuple[ShadowView, ...]
    colors: moderngl.Texture
    depths: moderngl.Texture

    @property
    def defines(self) -> dict[str, int | str]:
        """Defines of lib/tint.glsl."""
        return {"GLS_TINT": len(self.views)}

    def uniforms(self, axes: Array, offset: Array, origin: Array) -> dict[str, Any]:
        """Uniforms of lib/tint.glsl for receivers in a frame: its axes, and the position of the scene's origin in it."""
        world_from_lv = np.eye(4)
        world_from_lv[:3, :3], world_from_lv[:3, 3] = axes.T, origin - axes.T @ offset
        matrices, tiles = [], []
        for view in self.views:
            side, (x, y) = float(view.resolution), view.tile
            place = np.array([[side, 0, 0, x], [0, side, 0, y], [0, 0, 1, 0], [0, 0, 0, 1.0]])
            matrix = place @ bias_matrix(view.clip) @ view.clip_from_world @ world_from_lv
            matrices.append(np.ascontiguousarray(matrix.T, dtype=np.float32).tobytes())
            tiles.append((x, y, x + side, y + side))
        return {
            "u_tint_from_lv": b"".join(matrices),
            "u_tint_size": (1.0 / self.colors.width, 1.0 / self.colors.height),
            "u_tint_tile": np.array(tiles, dtype=np.float32).tobytes(),
            "u_tint_texel": max(self.views[0].texel),
        }


def untinted(casters: GpuScene | None, light: Light) -> tuple[str, ...]:
    """The fallback of a light that translucent casters should colour and do not."""
    if light.shadow is None or not light.wide or casters is None or not casters.tints.any():
        return ()
    return (UNTINTED.format(type(light).__name__),)


class TranslucentMap:
    """The maps of one light, kept while light, scene and camera view stay the same."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._key: Hashable = None
        self._tint: Tint | None = None
        self._size = (0, 0)
        self._owned: list[Any] = []

    def tint(self, frame: FrameContext, light: Light, casters: GpuScene | None) -> Tint | None:
        """The maps that colour the light on the frame's receivers; None: nothing does."""
        if light.shadow is None or light.wide or casters is None or not casters.tints.any():
            return None
        key = (casters.identity, light.geometry, light.planes, frame.camera_view)
        if key != self._key:
            self._key = None
            self._tint = self._drawn(frame, light, casters)
            self._key = key
        return self._tint

    def _drawn(self, frame: FrameContext, light: Light, scene: GpuScene) -> Tint | None:
        camera_view, ctx = frame.camera_view, frame.context.ctx
        clip = ClipSpace(frame.caps.clip_control, reversed=False)
        request = FitRequest(
            light, scene.corners, scene.boxes, camera_view.receivers, scene.corners[scene.tints].reshape(-1, 3),
            camera_view.camera, camera_view.size, camera_view.near, camera_view.far, clip, RESOLUTION, _GUARD,
        )  # fmt: skip
        found = around(request, camera_view.receivers).views
        if not found:
            return None
        views, size = layout(found, frame.caps.max_texture_size)
        self._make(size)
        colors, depths, framebuffer = self._owned
        matrices = [pack_matrices(view.clip_from_world @ scene.world_from_origin) for view in views]
        framebuffer.use()
        frame.context.gl.clip_control(clip.zero_to_one) if frame.caps.clip_control else None
        nodes, hidden = np.flatnonzero(scene.tints), [None] * len(scene.nodes)
        # first the nearest depth, then the product of all colours
        for depth in (True, False):
            framebuffer.depth_mask = depth
            framebuffer.color_mask = (not depth,) * 4
            framebuffer.viewport = (0, 0, *size)
            framebuffer.use()
            framebuffer.clear(1.0, 1.0, 1.0, 1.0, depth=1.0)
            for view, clip_from_mesh in zip(views, matrices, strict=True):
                framebuffer.viewport = (*view.tile, view.resolution, view.resolution)
                ctx.enable_only(moderngl.DEPTH_TEST if depth else moderngl.BLEND)
                ctx.depth_func = "<="
                ctx.depth_clamp_range = (0.0, 1.0)
                ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR
                draw_nodes(ctx, scene, nodes, hidden, self._begin(frame, scene, clip_from_mesh))
        ctx.enable_only(moderngl.NOTHING)
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        ctx.depth_clamp_range = None
        framebuffer.depth_mask, framebuffer.color_mask = True, (True, True, True, True)
        return Tint(views, colors, depths)

    def _begin(
        self, frame: FrameContext, scene: GpuScene, clip_from_mesh: NDArray[np.float32]
    ) -> Callable[[int], tuple[Callable[[int], None], moderngl.VertexArray]]:
        def begin(node: int) -> tuple[Callable[[int], None], moderngl.VertexArray]:
            gpu, material = scene.meshes[node], scene.nodes[node].mesh.material
            program = frame.programs.get(
                "pass/translucent.vert",
                "pass/translucent.frag",
                defines={"GLS_TEXTURED": int(gpu.textured), "GLS_COLORED": int(gpu.colored)},
            )
            program.set(u_color=material.color)
            if gpu.texture is not None:
                program.bind(u_texture=gpu.texture)

            def place(i: int) -> None:
                program.write("u_clip_from_mesh", clip_from_mesh[i])

            return place, gpu.vertex_array(program)

        return begin

    def _make(self, size: tuple[int, int]) -> None:
        if self._owned and self._size == size:
            return
        self.release()
        ctx, what = self._context.ctx, "the map of translucent casters"
        depths = depth_texture(self._context, size, Target.DEPTH32F, what)
        depths.compare_func = ""
        made: list[Any] = [depths]
        with released_on_error(made):
            colors = ctx.texture(size, 4, dtype="f2")
            made.append(colors)
            self._context.check_errors(f"allocating {what}, {size[0]} x {size[1]}")
            framebuffer = ctx.framebuffer([colors], depths)
        self._owned, self._size = [colors, depths, framebuffer], size

    def release(self) -> None:
        """Free the GPU memory."""
        release(*reversed(self._owned))
        self._owned, self._key, self._tint = [], None, None


class TranslucentMaps(dict[int, TranslucentMap]):
    """The translucent maps of all lights, by light number; kept from frame to frame."""

    def __init__(self, context: GLContext) -> None:
        super().__init__()
        self._context = context

    def tint(self, frame: FrameContext, number: int, light: Light, casters: GpuScene | None) -> Tint | None:
        """The maps of one light."""
        if casters is None:
            return None
        return self.setdefault(number, TranslucentMap(self._context)).tint(frame, light, casters)

    def release(self) -> None:
        """Release all maps."""
        for each in self.values():
            each.release()
