"""Draws the depth maps of a light's directions: small triangles by a compute pass, where there are any, all else by the caster pass."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.direction_maps import DirectionViews
from glshadow.derive.resolved import CasterSettings
from glshadow.gl.driver.buffers import BufferTexture, texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R32UI
from glshadow.gl.driver.targets import release, released_on_error
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.atlases import Atlas
from glshadow.gl.passes.caster import Map, begin_view, caster_program, draw_casters
from glshadow.gl.scene.bodies import hides_back_faces
from glshadow.gl.scene.geometry import GpuScene
from glshadow.lights import Light
from glshadow.shadows.filters import Filter

_SMALL = 8.0  # texels: longer edges are left to the rasteriser, whose cost is that of a draw for each map
_TOGETHER = 8  # directions: pass/direction_maps.comp
_GROUP, _GROUPS = 64, 65535
_CLOCKWISE, _COUNTERCLOCKWISE = 1 << 31, 1 << 30
_FARTHEST = int(np.float32(1.0).view(np.uint32))


class DirectionAtlas:
    """One light's maps in one texture: of depths, or if compute passes drew some of them, of the bits of depths."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._depth: Atlas | None = None
        self._bits: moderngl.Texture | None = None
        self._bits_framebuffer: moderngl.Framebuffer | None = None
        self._chosen: BufferTexture | None = None  # small triangles
        self._large: moderngl.Buffer | None = None  # corners of the others, relative to the scene's origin
        self._split: Hashable = None  # key of these two
        self.in_bits = False

    @property
    def texture(self) -> moderngl.Texture:
        """The maps."""
        texture = self._bits if self.in_bits else self._depth.texture if self._depth else None
        assert texture is not None
        return texture

    def draw(
        self, frame: FrameContext, light: Light, casting: NDArray[np.bool_], found: DirectionViews,
        settings: CasterSettings, filter_: Filter,
    ) -> int:  # fmt: skip
        """Draw all maps; returns the number of draws."""
        scene = frame.scene
        plain = casting & ~scene.round & ~np.array([gpu.cut_out for gpu in scene.meshes])
        self.in_bits = frame.caps.compute and settings.faces is None and bool(plain.any())
        if not self.in_bits:
            return self._draw_casters(frame, light, casting, found, settings, filter_)
        self._choose(frame, light, plain, 2.0 * found.radius / found.views[0].resolution)
        rest = casting & ~plain
        draws = self._draw_casters(frame, light, rest, found, settings, filter_) if rest.any() else 0
        if self._large is not None:
            draws += self._draw_large(frame, found, settings, cleared=not rest.any())
        self.in_bits = self._chosen is not None
        if not self.in_bits:
            return draws
        self._allocate_bits(found.size)
        assert self._bits_framebuffer is not None
        self._bits_framebuffer.use()
        if draws:
            self._copy(frame)
        else:
            self._context.gl.clear_unsigned(0, (_FARTHEST,) * 4)
        return draws + self._draw_small(frame, found)

    def _depth_of(self, size: tuple[int, int], settings: CasterSettings) -> Atlas:
        if self._depth is None or self._depth.size != size:
            release(self._depth)
            self._depth = None
            self._depth = Atlas(self._context, settings.target, size)
        return self._depth

    def _draw_casters(
        self, frame: FrameContext, light: Light, casting: NDArray[np.bool_], found: DirectionViews,
        settings: CasterSettings, filter_: Filter,
    ) -> int:  # fmt: skip
        atlas = self._depth_of(found.size, settings)
        atlas.drawn.clear()
        shadow_map = Map(found.views, atlas, settings, filter_)
        return draw_casters(self._context, frame.programs, frame.scene, light, casting, shadow_map)

    def _allocate_bits(self, size: tuple[int, int]) -> None:
        if self._bits is not None and self._bits.size == size:
            return
        release(self._bits_framebuffer, self._bits)
        self._bits = self._bits_framebuffer = None
        made: list[Any] = []
        with released_on_error(made):
            made.append(self._context.ctx.texture(size, 1, dtype="u4"))
            made[0].filter = (moderngl.NEAREST, moderngl.NEAREST)
            made.append(self._context.ctx.framebuffer([made[0]]))
            self._context.check_errors(f"allocating the maps of a light's directions, {size[0]} x {size[1]}")
        self._bits, self._bits_framebuffer = made

    def _choose(self, frame: FrameContext, light: Light, plain: NDArray[np.bool_], texel: float) -> None:
        """Divide the triangles of some nodes into small and large ones."""
        scene = frame.scene
        key = (scene.identity, plain.tobytes(), texel)
        if key == self._split:
            return
        self._split = None
        release(self._chosen, self._large)
        self._chosen = self._large = None
        triangles, places = scene.world.triangles, scene.world.positions
        numbers = np.flatnonzero(plain[triangles[:, 3]])
        corners = places[triangles[numbers, :3]]
        edges = np.abs(corners - corners[:, [1, 2, 0]]).max(axis=(1, 2))
        small = edges <= _SMALL * texel
        if small.any():
            bits = _sides(scene, light)[triangles[numbers[small], 3]] | numbers[small].astype(np.uint32)
            self._chosen = texture_buffer(self._context, bits, R32UI)
        if not small.all():
            self._large = self._context.ctx.buffer(np.ascontiguousarray(corners[~small]))
        self._split = key

    def _draw_large(self, frame: FrameContext, found: DirectionViews, settings: CasterSettings, cleared: bool) -> int:
        context, scene, ctx = self._context, frame.scene, self._context.ctx
        assert self._large is not None
        atlas = self._depth_of(found.size, settings)
        program = caster_program(frame.programs, settings, found.views[0], {})
        array = ctx.vertex_array(program.gl, [(self._large, "3f", "a_position")])
        world = np.eye(4)
        world[:3, 3] = scene.origin
        atlas.framebuffer.use()
        begin_view(context, atlas, found.views[0], settings, None)
        if cleared:
            atlas.framebuffer.clear(depth=found.views[0].clip.clear_depth, viewport=(0, 0, *found.size))
        for view in found.views:
            atlas.framebuffer.viewport = (*view.tile, view.resolution, view.resolution)
            program.set(u_clip_from_mesh=view.clip_from_world @ world)
            array.render(moderngl.TRIANGLES)
        array.release()
        ctx.polygon_offset = (0.0, 0.0)
        ctx.depth_clamp_range = None
        ctx.enable_only(moderngl.NOTHING)
        return len(found.views)

    def _copy(self, frame: FrameContext) -> None:
        assert self._depth is not None
        program = frame.programs.get("pass/over.vert", "pass/depth_bits.frag")
        program.bind(u_depth=(self._depth.texture, frame.samplers.plain))
        self._context.ctx.enable_only(moderngl.NOTHING)
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        program.unbind()

    def _draw_small(self, frame: FrameContext, found: DirectionViews) -> int:
        assert self._bits is not None
        assert self._chosen is not None
        program = frame.programs.compute("pass/direction_maps.comp")
        program.bind(**frame.scene.world.textures, u_chosen=self._chosen)
        self._bits.bind_to_image(0, read=True, write=True)
        rows = _rows(found, frame.scene.origin)
        count = self._chosen.buffer.size // 4
        for first in range(0, len(rows), _TOGETHER):
            program.set(u_rows=rows[first : first + _TOGETHER].tobytes())
            for start in range(0, count, _GROUP * _GROUPS):
                end = min(start + _GROUP * _GROUPS, count)
                program.set(u_part=(start, end))
                program.run(-(-(end - start) // _GROUP))
        self._context.ctx.memory_barrier()
        return len(found.views)

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._depth, self._bits_framebuffer, self._bits, self._chosen, self._large)


def _sides(scene: GpuScene, light: Light) -> NDArray[np.uint32]:
    """Per node (N,) the bits of pass/direction_maps.comp: back faces of closed nodes are left out."""
    hidden = hides_back_faces(scene, light, None)
    winding = np.where(np.array(scene.mirrored), _COUNTERCLOCKWISE, _CLOCKWISE)
    return np.asarray(np.where(hidden, winding, 0)).astype(np.uint32)


def _rows(found: DirectionViews, origin: Array) -> NDArray[np.float32]:
    """Uniforms (N, 4, 4) of pass/direction_maps.comp, N a multiple of _TOGETHER: what is too many has no tile."""
    rows = np.zeros((-(-len(found.views) // _TOGETHER) * _TOGETHER, 4, 4))
    rows[:, 3] = (0.0, 0.0, -1.0, -1.0)
    world = np.eye(4)
    world[:3, 3] = origin
    for row, view in zip(rows, found.views, strict=False):
        side, (x, y) = float(view.resolution), view.tile
        row[:3] = (view.uvz_from_world @ world)[:3]
        row[:2] *= side
        row[:2, 3] += (x, y)
        row[3] = x, y, x + side - 1.0, y + side - 1.0
    return rows.astype(np.float32)
