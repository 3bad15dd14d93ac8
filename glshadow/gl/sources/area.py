"""A light that has a size, asked of triangle lists: all pixels for the outlines that cut it, those that see one ray by ray."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from glshadow.core.area import disc, disc_axes, radius_of, square
from glshadow.core.lights import DirectionalLight, Light, RectLight
from glshadow.core.shadow import Settled
from glshadow.core.spaces import Array
from glshadow.core.used import Used
from glshadow.core.view import kind_of
from glshadow.errors import ResourceError
from glshadow.gl.buffers import BufferTexture, texture_buffer
from glshadow.gl.context import GLContext
from glshadow.gl.dense import Dense
from glshadow.gl.entry_points import R32UI, RG32F, RGBA32UI
from glshadow.gl.geometry import GpuScene
from glshadow.gl.program import Program, Programs
from glshadow.gl.receiver import Receiver
from glshadow.gl.screen import camera_uniforms, draw_over, surface_textures
from glshadow.gl.sources.accumulated import Accumulated, undithered
from glshadow.gl.sources.cells import LINK_BYTES, CellLists
from glshadow.gl.sources.listed import Listed
from glshadow.gl.sources.source import open_receiver
from glshadow.gl.sources.triangles import cell_defines, light_frame
from glshadow.gl.work import Work
from glshadow.shader.slots import area_slots, given_slots

_GROUNDS = 64  # this and what follows: lib/cells.glsl
_GROWN = 256
_LEVELS = 6
_GRIDS: dict[str, int | str] = {"GLS_GROUNDS": _GROUNDS, "GLS_GROWN": _GROWN, "GLS_LEVELS": _LEVELS}
TOGETHER = 16  # exact/found.glsl
_ROW = 1024  # collected pixels in a row of the passes that ask them
# A pixel that sees some of the light walks most of the triangles whose shadows move far, 13 ns each; a hard frame takes 40 ns a pixel and
# 100 a triangle (llvmpipe): so many of the former are worth one of the latter
_PIXEL, _TRIANGLE = 4, 10
_LONGEST = 60000  # of a receiver's list: llvmpipe ends a shader after 65,536 turns of its loops
_BATCH = 1 << 16  # of them at once


class Area(Listed):
    """One light's triangle lists, its outlines' lists, and the counts of its points that pixels see."""

    def __init__(self, context: GLContext) -> None:
        super().__init__(context)
        self.casters, self.outlines = CellLists(context), CellLists(context)
        self._disc: BufferTexture | None = None
        self._disc_key: Hashable = None
        self._picture, self._samples = Counts(context), Counts(context)
        self._found = Found(context)
        self._counter = context.ctx.buffer(reserve=4)
        self._grounds: tuple[moderngl.Texture, ...] = ()
        self._framebuffer: moderngl.Framebuffer | None = None
        self._batch = _BATCH
        self._accumulated = Accumulated(context, Listed(context))
        self._instead = ""  # why the points are asked one after another; empty: they are not
        self._widest = self._longest = 0
        self.asked = self.found = 0
        self._counted: tuple[Hashable, str] | None = None  # what was counted, and why it was not

    def claim(self, work: Work, light: Light, shadow: Settled | None) -> None:
        """Take the light with its settings."""
        super().claim(work, light, shadow)
        self._points = self._shadow.filter.points_of_light

    def prepare(self, work: Work) -> Used:
        """Build the lists, unless they are those of this scene and light already."""
        used = super().prepare(work)
        self._place_points()
        self._instead = ""
        if self._longest > _LONGEST:
            self._instead = f"a list of up to {self._longest} triangles"
        return replace(used, links=used.links + self.casters.count + self.outlines.count)

    def amended(self, used: Used) -> Used:
        """With how the points were asked."""
        more = f", one after another, for {self._instead}" if self._instead else ""
        fallbacks = used.fallbacks + undithered(self._shadow.filter) if self._instead else used.fallbacks
        return replace(used, why=f"{used.why}; {self._points} points of the light{more}", fallbacks=fallbacks)

    def _build(self, programs: Programs, scene: GpuScene, light: Light) -> bool:
        grid, world, context = self.grid, scene.world, self._context
        depths = self._depths(scene)
        self._values = {"u_radius": radius_of(light), "u_depths": depths}
        self._reserve_grounds(grid.faces)
        assert self._framebuffer is not None
        ground, around = self._grounds
        self._framebuffer.use()
        context.gl.clear_unsigned(0, (0, 0, 0, 0))
        ground.bind_to_image(1, read=True, write=True)
        if not super()._build(programs, scene, light):
            return False
        program = programs.compute(
            "pass/grounds.comp", defines={"GLS_GROUNDS": _GROUNDS, "GLS_POINT": int(grid.kind == "point")}
        )
        program.set(u_around=self._farthest(depths), u_depths=depths)
        program.bind(u_ground=ground)
        around.bind_to_image(0, read=False, write=True)
        program.run(_GROUNDS // 8, grid.faces * _GROUNDS // 8)
        context.ctx.memory_barrier()
        size = (_GROWN, 2 * _GROWN * grid.faces)
        self._widest = self._longest = 0
        for number, lists in enumerate((self.casters, self.outlines)):
            program = programs.compute(
                "pass/grown.comp", defines={**cell_defines(grid, grid.cells), **_GRIDS, "GLS_OUTLINES": number}
            )
            program.set(**self._values, u_triangles=world.count, u_cells=grid.cells_from_window)
            program.bind(**world.textures, u_traits=self._traits, u_neighbours=world.neighbours, u_facets=self._facets,
                         u_ground=ground, u_ground_around=around)  # fmt: skip
            if not lists.fill(program, size, world.count, max(2 * world.count, 1 << 16), self._limit):
                return False
            self._chain(programs, lists)
        return True

    def _chain(self, programs: Programs, lists: CellLists) -> None:
        assert lists.links is not None
        assert lists.heads is not None
        program = programs.compute("pass/chain.comp", defines={"GLS_GROWN": _GROWN})
        lists.links.buffer.bind_to_storage_buffer(1)
        lists.counter.bind_to_storage_buffer(2)
        lists.heads.bind_to_image(0, read=True, write=True)
        for level in reversed(range(_LEVELS - 1)):
            program.set(u_level=level)
            program.run((_GROWN >> level) // 8, self.grid.faces * (_GROWN >> level) // 8)
            self._context.ctx.memory_barrier()
        _, wide, *longest = np.frombuffer(lists.counter.read(), dtype=np.uint32).tolist()
        self._widest, self._longest = max(self._widest, wide), max(self._longest, wide + sum(longest))

    def _farthest(self, depths: tuple[float, float]) -> int:
        """Cells of the grounds over which shadows move, at most."""
        grid, reach = self.grid, radius_of(self.light)
        finest = max(grid.cells_from_window[:2])
        least, deepest = depths
        if grid.kind == "directional":
            spread = reach * (deepest - least)
        elif least <= reach:
            return _GROUNDS
        else:
            left, right, bottom, top = grid.window
            slant = np.sqrt(1.0 + max(abs(left), abs(right)) ** 2 + max(abs(bottom), abs(top)) ** 2)
            spread = reach * slant * max(1.0 - least / deepest, 0.0) / (least - reach)
        return min(int(np.ceil(spread * finest * _GROUNDS / grid.cells)) + 1, _GROUNDS)

    def _reserve_grounds(self, faces: int) -> None:
        size = (_GROUNDS, _GROUNDS * faces)
        if self._grounds and self._grounds[0].size == size:
            return
        old = (self._framebuffer, *self._grounds)
        self._grounds = tuple(self._context.ctx.texture(size, 1, dtype="u4") for _ in range(2))
        for texture in self._grounds:
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._framebuffer = self._context.ctx.framebuffer([self._grounds[0]])
        self._framebuffer.use()  # before the old one goes: moderngl would bind that again
        for thing in old:
            if thing is not None:
                thing.release()

    def _depths(self, scene: GpuScene) -> tuple[float, float]:
        """No caster is nearer than the first, no receiver deeper than the second, in the light's frame."""
        axes, origin = light_frame(self.grid, scene)
        local = (scene.corners - scene.origin - origin) @ axes.T
        if self.grid.kind == "point":
            low, high = local.min(axis=1), local.max(axis=1)
            nearest = np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0), axis=1).min() / np.sqrt(3.0)
            return 0.999 * float(nearest), 1.001 * float(np.linalg.norm(local, axis=-1).max())
        depth = -local[..., 2]
        slack = 1e-5 * float(np.abs(local).max())
        return float(depth.min()) - slack, float(depth.max()) + slack

    def _place_points(self) -> None:
        light = self.light
        key = (type(light), light.direction if isinstance(light, DirectionalLight) else None, radius_of(light), self._points,
               self.grid.view_from_world.tobytes() if isinstance(light, DirectionalLight) else None)  # fmt: skip
        if self._disc_key == key:
            return
        points: Array = square(self._points) if isinstance(light, RectLight) else disc(self._points)
        if isinstance(light, DirectionalLight):  # in world axes, so that they do not turn with the grid
            turned = disc_axes(light)[:2] @ self.grid.view_from_world[:2, :3].T
            points = radius_of(light) * points @ turned
        if self._disc is not None:
            self._disc.release()
        self._disc = texture_buffer(self._context, points.astype(np.float32), RG32F)
        self._disc_key = key

    def receiver(self, work: Work) -> Receiver:
        """Read the counts, made anew unless light, scene and what the camera sees are those of the last frame."""
        key = (self._key, work.sight, work.targets.identity, self._shadow.filter)
        if self._instead:
            return self._one_after_another(work)
        if self._counted is None or self._counted[0] != key:
            self._counted = None
            self._picture.reserve(work.targets.depth.size, work.targets.depth, work.targets.identity)
            self._classify(work, self._picture, None)
            pixels, triangles = work.sight.size[0] * work.sight.size[1], work.scene.world.count
            instead = ""
            if self.asked * self._widest > self._points * (_PIXEL * pixels + _TRIANGLE * triangles):
                instead = f"{self._widest} triangles whose shadows move far and {self.asked} pixels that see some of the light"
            elif self.asked:
                self._ask(work, self._picture, None)
            self._counted = key, instead
        self._instead = self._counted[1]
        if self._instead:
            return self._one_after_another(work)
        return replace(self._given(work, self._picture), densely=lambda dense: self._densely(work, dense))

    def _one_after_another(self, work: Work) -> Receiver:
        self._accumulated.claim(work, self.light, self._shadow)
        self._accumulated.prepare(work)
        return self._accumulated.receiver(work)

    def _densely(self, work: Work, dense: Dense) -> Receiver:
        self._samples.reserve(dense.framebuffer.size, None, 0)
        self._samples.viewport = dense.viewport
        self._classify(work, self._samples, dense)
        if self.asked:
            self._ask(work, self._samples, dense)
        dense.framebuffer.use()
        return self._given(work, self._samples)

    def _classify(self, work: Work, counts: Counts, dense: Dense | None) -> None:
        """All or nothing where no outline comes between; a list of the others."""
        assert counts.framebuffer is not None
        assert counts.fragments is not None
        program = self._program(work, counts, dense, 0, "outlines", self.outlines)
        counts.framebuffer.use()
        if dense is not None:
            counts.framebuffer.viewport = counts.viewport
        self._begin(counts.fragments)
        if dense is None:
            draw_over(self._context, program, work.sight)
            program.unbind()
            self._context.ctx.memory_barrier()
        else:
            self._draw(program)
        self.asked = self._counted_items()

    def _ask(self, work: Work, counts: Counts, dense: Dense | None) -> None:
        """Point by point, batch after batch of the list."""
        assert counts.texture is not None
        side = 1
        while TOGETHER * side * side < self._points:
            side *= 2
        self._found.reserve(side)
        first = 0
        while first < self.asked:
            now = min(self._batch, self.asked - first)
            program = self._program(work, counts, dense, 1, "region", self.casters)
            program.set(u_asked=(first, now, _ROW), u_capacity=self._found.capacity)
            self._begin(self._found.links)
            self._found.lists(now).use()
            self._draw(program)
            self.found = self._counted_items()
            if self.found > self._found.capacity:
                if not self._found.grow(self.found, self._limit):
                    if now == 1:
                        raise ResourceError(f"{self.found} triangles may come between one surface and its light, a buffer of this driver "
                                            f"holds {self._limit // LINK_BYTES}: give the light a smaller size")  # fmt: skip
                    self._batch = now // 2
                continue
            program = self._program(work, counts, dense, 2, "found", None, GLS_SIDE=side)
            program.set(u_asked=(first, now, _ROW))
            program.bind(u_found=self._found.links, u_lists=self._found.texture)
            counts.texture.bind_to_image(0, read=True, write=True)
            self._found.blocks(now, side).use()
            self._draw(program)
            first += now

    def _program(
        self,
        work: Work,
        counts: Counts,
        dense: Dense | None,
        stage: int,
        between: str,
        lists: CellLists | None,
        **more: int,
    ) -> Program:
        """A pass of pass/penumbra.frag, with all that it reads."""
        scene, targets = work.scene, work.targets
        asked = super().receiver(work)
        defines = {
            **asked.defines,
            "GLS_ORTHO": int(not work.sight.camera.is_perspective),
            "GLS_SELECTIVE": int(scene.selective),
            "GLS_DENSE": int(dense is not None),
            "GLS_GROWN": _GROWN,
            "GLS_PANEL": int(isinstance(self.light, RectLight)),
            "GLS_DITHER": int(self._shadow.filter.dithers),
            "GLS_STAGE": stage,
            "GLS_AREA": int(stage > 0),
            **(dense.defines if dense else {}),
            **more,
        }
        program = work.programs.get(
            "pass/resolve.vert", "pass/penumbra.frag", "core430", area_slots(kind_of(self.light), between), defines
        )
        right, up, backward = disc_axes(self.light) @ asked.axes.T
        aside = (0.0, 0.0) if dense else targets.aside
        program.set(**camera_uniforms(scene, work.sight, asked.axes, asked.offset, aside))
        program.set(**asked.uniforms, **self._values)  # its eye is the light's own
        program.set(u_count=self._points, u_disc_axes=np.stack([right, up, -backward], axis=1),
                    u_samples=targets.fine_surface.size if dense else work.sight.size)  # fmt: skip
        program.bind(**surface_textures(work.samplers, scene, targets), **asked.textures)
        program.bind(u_disc=self._disc, u_fragments=counts.fragments)
        if dense is not None:
            program.set(**dense.uniforms)
            program.bind(u_surface=targets.fine_surface, u_pixels=dense.pixels)
        if lists is not None:
            program.bind(u_grown_heads=lists.heads, u_grown_links=lists.links)
        return program

    def _begin(self, items: BufferTexture) -> None:
        """What comes next appends to a list."""
        self._counter.write(b"\0\0\0\0")
        self._counter.bind_to_storage_buffer(0)
        items.buffer.bind_to_storage_buffer(1)

    def _draw(self, program: Program) -> None:
        self._context.ctx.enable_only(moderngl.NOTHING)
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        program.unbind()
        self._context.ctx.memory_barrier()

    def _counted_items(self) -> int:
        return int(np.frombuffer(self._counter.read(), dtype=np.uint32)[0])

    def _given(self, work: Work, counts: Counts) -> Receiver:
        return replace(
            open_receiver(work, self.light),
            slots=given_slots(kind_of(self.light)),
            defines={"GLS_COUNTED": 1},
            uniforms={"u_points": float(self._points)},
            textures={"u_given": counts.texture},
        )

    def release(self) -> None:
        """Free the GPU memory."""
        super().release()
        for thing in (
            self.outlines,
            self._disc,
            self._picture,
            self._samples,
            self._found,
            self._framebuffer,
            self._accumulated,
            self.casters,
            *self._grounds,
            self._counter,
        ):
            if thing is not None:
                thing.release()


class Counts:
    """How many points of a light are seen, for each pixel or sample, and the list of those that were asked one by one."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self.texture: moderngl.Texture | None = None
        self.framebuffer: moderngl.Framebuffer | None = None
        self.fragments: BufferTexture | None = None
        self.viewport = (0, 0, 0, 0)
        self._for: Hashable = None

    def reserve(self, size: tuple[int, int], depth: Any, key: Hashable) -> None:
        """Room for so many, with a depth buffer or none; `key`: whose."""
        if self._for == (size, key):
            return
        self._for = None
        ctx = self._context.ctx
        old = (self.framebuffer, self.texture, self.fragments)
        self.texture = ctx.texture(size, 1, dtype="u4")
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.framebuffer = ctx.framebuffer([self.texture], depth)
        self.framebuffer.depth_mask = False
        self.framebuffer.use()  # before the old one goes: moderngl would bind that again
        self.fragments = BufferTexture(self._context.gl, ctx.buffer(reserve=4 * size[0] * size[1]), R32UI)
        for thing in old:
            if thing is not None:
                thing.release()
        self._context.check_errors(f"allocating the share of a light that is seen, {size[0]} x {size[1]}")
        self._for = (size, key)

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (self.framebuffer, self.texture, self.fragments):
            if thing is not None:
                thing.release()


class Found:
    """Lists of triangles that may come between, for a batch of collected pixels, and what the passes over them draw to."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._side = 0
        self._made: list[Any] = []
        self.links: BufferTexture
        self.texture: moderngl.Texture
        self.capacity = 0

    def reserve(self, side: int) -> None:
        """Room for lists, and for blocks of fragments `side` wide for each pixel."""
        if side == self._side:
            return
        ctx, rows = self._context.ctx, _BATCH // _ROW
        old, self._made = self._made, []
        self.texture = ctx.texture((_ROW, rows), 1, dtype="u4")
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        buffer = ctx.renderbuffer((side * _ROW, side * rows), 1)
        self._lists, self._blocks = ctx.framebuffer([self.texture]), ctx.framebuffer([buffer])
        self._made = [self._lists, self._blocks, self.texture, buffer]
        self._lists.use()  # before the old one goes: moderngl would bind that again
        for thing in old:
            thing.release()
        if self.capacity == 0:
            self.grow(1 << 16, 1 << 30)
        self._context.check_errors("allocating lists of what comes between")
        self._side = side

    def grow(self, count: int, limit: int) -> bool:
        """Room for so many links and some more; False: there is no such room."""
        if count * LINK_BYTES > limit:
            return False
        if self.capacity:
            self.links.release()
        self.capacity = min(int(1.25 * count), limit // LINK_BYTES)
        self.links = BufferTexture(
            self._context.gl, self._context.ctx.buffer(reserve=self.capacity * LINK_BYTES), RGBA32UI
        )
        self._context.check_errors(f"allocating {self.capacity} links")
        return True

    def lists(self, count: int) -> moderngl.Framebuffer:
        """One fragment for each of so many pixels."""
        self._lists.viewport = (0, 0, _ROW, -(-count // _ROW))
        return self._lists

    def blocks(self, count: int, side: int) -> moderngl.Framebuffer:
        """A block of fragments for each."""
        self._blocks.viewport = (0, 0, side * _ROW, side * -(-count // _ROW))
        return self._blocks

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in self._made:
            thing.release()
        if self.capacity:
            self.links.release()
