"""Coloured shadows of translucent casters: per light layers of transmitted colour and depth."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, ClipSpace, bias_matrix
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.queries import AnySamples
from glshadow.gl.driver.targets import depth_texture, release, released_on_error
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.atlases import layout
from glshadow.gl.passes.camera import CameraView, set_transparency
from glshadow.gl.scene.drawing import draw_nodes
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.matrices import pack_matrices
from glshadow.lights import Light
from glshadow.shadows.fit_request import FitRequest
from glshadow.shadows.fitted import around
from glshadow.shadows.metric import Target
from glshadow.shadows.view import ShadowView

RESOLUTION = 1024
UNTINTED = "{} passes through translucent casters untinted: their colours are rendered from one point, which is wrong for a wide light"
MOST_LAYERS = 4
"""Layers that are told apart by depth. What lies between casters that share the last one is tinted by all of these."""
COARSER = 1.5
"""Texels of a map that is kept while the camera moves are at most so many times as large as those of a map for this camera alone."""
_GUARD = 2


@dataclass(frozen=True, eq=False)
class Tint:
    """A light's layers of translucent casters, with the uniforms that receivers need to sample them.

    Parameters
    ----------
    texture : moderngl.Texture
        The layers, one above the other.
    height : int
        Rows of each.
    """

    views: tuple[ShadowView, ...]
    texture: moderngl.Texture
    height: int

    @property
    def defines(self) -> dict[str, int | str]:
        """Defines of lib/tint.glsl."""
        return {"GLS_TINT": len(self.views), "GLS_TINT_LAYERS": self.texture.height // self.height}

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
            "u_tint_size": (1.0 / self.texture.width, 1.0 / self.texture.height),
            "u_tint_layer": float(self.height),
            "u_tint_tile": np.array(tiles, dtype=np.float32).tobytes(),
            "u_tint_texel": max(self.views[0].texel),
        }


def untinted(casters: GpuScene | None, light: Light) -> tuple[str, ...]:
    """The fallback of a light that translucent casters should colour and do not."""
    if light.shadow is None or not light.wide or casters is None or not casters.tints.any():
        return ()
    return (UNTINTED.format(type(light).__name__),)


class TranslucentMap:
    """The layers of one light, kept while light, scene and views stay the same."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._whole: tuple[Hashable, tuple[ShadowView, ...]] | None = None
        self._key: Hashable = None
        self._tint: Tint | None = None
        self._owned: list[Any] = []

    def tint(self, frame: FrameContext, light: Light, casters: GpuScene, camera_view: CameraView) -> Tint | None:
        """The layers that colour the light on what a camera sees; None: nothing does.

        A map of everything that the casters can colour serves every camera. One that sees little of it gets a finer map.
        """
        if light.shadow is None or light.wide or not casters.tints.any():
            return None
        lit = (casters.identity, light.geometry, light.planes)
        if self._whole is None or self._whole[0] != lit:
            self._whole = (lit, self._fitted(frame, light, casters, camera_view, list(casters.corners)))
        whole, views = self._whole[1], self._fitted(frame, light, casters, camera_view, camera_view.receivers)
        if not views:
            return None
        key: Hashable = (lit, camera_view)
        if len(whole) == len(views) and _coarsest(whole) <= COARSER * _coarsest(views):
            views, key = whole, lit
        if key != self._key:
            self.release()
            self._tint = self._drawn(frame, casters, views)
            self._key = key
        return self._tint

    @staticmethod
    def _fitted(
        frame: FrameContext, light: Light, scene: GpuScene, camera_view: CameraView, receivers: list[Array]
    ) -> tuple[ShadowView, ...]:
        clip = ClipSpace(frame.caps.clip_control, reversed=False)
        request = FitRequest(
            light, scene.corners, scene.boxes, receivers, scene.corners[scene.tints].reshape(-1, 3),
            camera_view.camera, camera_view.size, camera_view.near, camera_view.far, clip, RESOLUTION, _GUARD,
        )  # fmt: skip
        return around(request, receivers).views

    def _drawn(self, frame: FrameContext, scene: GpuScene, found: tuple[ShadowView, ...]) -> Tint:
        views, size = layout(found, frame.caps.max_texture_size)
        drawing = LayersOfColor(frame, scene, views, ClipSpace(frame.caps.clip_control, reversed=False), size)
        with released_on_error(drawing.owned):
            texture = drawing.stacked()
        self._owned = [texture]
        return Tint(views, texture, size[1])

    def release(self) -> None:
        """Free the GPU memory."""
        release(*reversed(self._owned))
        self._owned, self._key, self._tint = [], None, None


def _coarsest(views: tuple[ShadowView, ...]) -> float:
    return max(max(view.texel) for view in views)


class LayersOfColor:
    """Draws the layers of one light.

    Attributes
    ----------
    owned : list
        What is released if drawing fails.
    """

    def __init__(
        self,
        frame: FrameContext,
        scene: GpuScene,
        views: tuple[ShadowView, ...],
        clip: ClipSpace,
        size: tuple[int, int],
    ) -> None:
        self._frame, self._scene, self._views, self._clip, self._size = frame, scene, views, clip, size
        self._matrices = [pack_matrices(view.clip_from_world @ scene.world_from_origin) for view in views]
        self._what = f"the map of translucent casters, {size[0]} x {size[1]}"
        self.owned: list[Any] = []

    def stacked(self) -> moderngl.Texture:
        """The layers, one above the other; everything else is released."""
        context, ctx = self._frame.context, self._frame.context.ctx
        most = max(1, min(MOST_LAYERS, self._frame.caps.max_texture_size // self._size[1]))
        depth = self._kept(depth_texture(context, self._size, Target.DEPTH32F, self._what))
        query = self._kept(AnySamples(context.gl))
        layers: list[moderngl.Texture] = []
        if self._frame.caps.clip_control:
            context.gl.clip_control(self._clip.zero_to_one)
        while len(layers) < most:
            layer = self._texture(self._size)
            framebuffer = self._kept(ctx.framebuffer([layer], depth))
            before, last = layers[-1] if layers else None, len(layers) + 1 == most
            with query:
                self._draw(framebuffer, before, "depth")
            if layers and not query.passed:
                break
            self._draw(framebuffer, before, "all colours" if last else "colours")
            layers.append(layer)
        ctx.enable_only(moderngl.NOTHING)
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        ctx.depth_clamp_range = None
        found = layers[0] if len(layers) == 1 else self._stack(layers)
        self.owned.remove(found)
        self._frame.targets.depth_framebuffer.use()  # moderngl would bind a released one again
        release(*reversed(self.owned))
        self.owned.clear()
        return found

    def _kept(self, thing: Any) -> Any:
        self.owned.append(thing)
        return thing

    def _texture(self, size: tuple[int, int]) -> moderngl.Texture:
        texture: moderngl.Texture = self._kept(self._frame.context.ctx.texture(size, 4, dtype="f4"))
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._frame.context.check_errors(f"allocating {self._what}")
        return texture

    def _stack(self, layers: list[moderngl.Texture]) -> moderngl.Texture:
        ctx, (width, height) = self._frame.context.ctx, self._size
        stacked = self._texture((width, height * len(layers)))
        framebuffer = self._kept(ctx.framebuffer([stacked]))
        program = self._frame.programs.get("pass/over.vert", "pass/stack.frag")
        for number, layer in enumerate(layers):
            framebuffer.viewport = (0, number * height, width, height)
            framebuffer.use()
            program.set(u_row=number * height)
            program.bind(u_copied=layer)
            program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        return stacked

    def _draw(self, framebuffer: moderngl.Framebuffer, before: moderngl.Texture | None, what: str) -> None:
        """Draw the nearest depth, or the product of the colours at this depth, or of all colours behind the layer before."""
        ctx, depth = self._frame.context.ctx, what == "depth"
        framebuffer.depth_mask = depth
        framebuffer.color_mask = (True,) * 4 if depth else (True, True, True, False)
        framebuffer.viewport = (0, 0, *self._size)
        framebuffer.use()
        if depth:
            framebuffer.clear(1.0, 1.0, 1.0, 1.0, depth=1.0)
            framebuffer.color_mask = (False, False, False, True)
        nodes, hidden = np.flatnonzero(self._scene.tints), [None] * len(self._scene.nodes)
        for view, clip_from_mesh in zip(self._views, self._matrices, strict=True):
            framebuffer.viewport = (*view.tile, view.resolution, view.resolution)
            framebuffer.use()
            ctx.enable_only(moderngl.DEPTH_TEST if depth else moderngl.DEPTH_TEST | moderngl.BLEND)
            ctx.depth_func = {"depth": "<", "colours": "==", "all colours": "1"}[what]
            ctx.depth_clamp_range = (0.0, 1.0)
            ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR
            draw_nodes(ctx, self._scene, nodes, hidden, self._begin(clip_from_mesh, before))

    def _begin(
        self, clip_from_mesh: NDArray[np.float32], before: moderngl.Texture | None
    ) -> Callable[[int], tuple[Callable[[int], None], moderngl.VertexArray]]:
        scene = self._scene

        def begin(node: int) -> tuple[Callable[[int], None], moderngl.VertexArray]:
            gpu, material = scene.meshes[node], scene.nodes[node].mesh.material
            program = self._frame.programs.get(
                "pass/translucent.vert",
                "pass/translucent.frag",
                defines={
                    "GLS_TEXTURED": int(gpu.textured),
                    "GLS_COLORED": int(gpu.colored),
                    "GLS_ALPHA": int(gpu.cut_out),
                    "GLS_BEHIND": int(before is not None),
                    "GLS_TRANSMISSION_MAP": int(gpu.transmission is not None),
                },
            )
            program.set(u_color=material.color, u_cutoff=gpu.cutoff)
            set_transparency(program, gpu, material)
            if before is not None:
                program.bind(u_before=before)
            if gpu.texture is not None:
                program.bind(u_texture=gpu.texture)

            def place(i: int) -> None:
                program.write("u_clip_from_mesh", clip_from_mesh[i])

            return place, gpu.vertex_array(program)

        return begin


class TranslucentMaps(dict[int, TranslucentMap]):
    """The layers of all lights, by light number; kept from frame to frame."""

    def __init__(self, context: GLContext) -> None:
        super().__init__()
        self._context = context

    def tint(
        self, frame: FrameContext, number: int, light: Light, casters: GpuScene, camera_view: CameraView
    ) -> Tint | None:
        """The layers of one light."""
        return self.setdefault(number, TranslucentMap(self._context)).tint(frame, light, casters, camera_view)

    def release(self) -> None:
        """Release all maps."""
        for each in self.values():
            each.release()
