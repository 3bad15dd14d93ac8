"""A light that has a size, asked of triangle lists: all pixels for the outlines that cut it, those that see one ray by ray."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

import moderngl
import numpy as np

from glshadow.derive.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.driver.buffers import BufferTexture, texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R32UI, RG32F
from glshadow.gl.driver.program import Program, Programs
from glshadow.gl.driver.targets import release
from glshadow.gl.frame_context import Work
from glshadow.gl.passes.per_sample import Dense
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.screen import camera_uniforms, draw_over, surface_textures
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.accumulated import Accumulated
from glshadow.gl.techniques.cells import LINK_BYTES, CellLists
from glshadow.gl.techniques.counts import Counts
from glshadow.gl.techniques.found import BATCH, ROW, Found
from glshadow.gl.techniques.grown import DEFINES, Grown
from glshadow.gl.techniques.listed import Listed
from glshadow.gl.techniques.mapped import Mapped
from glshadow.gl.techniques.technique import open_receiver
from glshadow.lights import Light
from glshadow.shader.slots import area_slots, given_slots
from glshadow.shadows.shadow import Settled

# A pixel that sees some of the light walks most of the triangles whose shadows move far, 13 ns each; a hard frame takes 40 ns a pixel and
# 100 a triangle (llvmpipe): so many of the former are worth one of the latter
_PIXEL, _TRIANGLE = 4, 10
_LONGEST = 60000  # of a receiver's list: llvmpipe ends a shader after 65,536 turns of its loops


class Area(Listed):
    """One light's triangle lists, what is grown by its size, and the counts of its points that pixels see."""

    def __init__(self, context: GLContext) -> None:
        super().__init__(context)
        self.grown = Grown(context)
        self._disc: BufferTexture | None = None
        self._disc_key: Hashable = None
        self._picture, self._samples = Counts(context), Counts(context)
        self._fragments: BufferTexture | None = None  # that are asked: x, y << 16
        self._found = Found(context)
        self._counter = context.ctx.buffer(reserve=4)
        self._batch = BATCH
        self._accumulated = Accumulated(context, Listed(context), Mapped(context))
        self._rays: Receiver  # what a ray to the light's middle is tested with
        self._instead = ""  # why the points are asked one after another; empty: they are not
        self._overflow = ""  # why the grown lists do not fit, those of `_key`; empty: they do
        self.asked = self.found = 0
        self._counted: tuple[Hashable, str] | None = None  # what was counted, and why it was not

    def claim(self, work: Work, light: Light, shadow: Settled | None) -> None:
        """Take the light with its settings."""
        super().claim(work, light, shadow)
        self._points = self._shadow.filter.points_of_light

    def prepare(self, work: Work) -> Used:
        """Build the lists, unless they are those of this scene and light already; where they do not fit, those of its points."""
        try:
            used = super().prepare(work)
            self._instead = self._overflow
        except ResourceError as error:
            self._instead = str(error)
        if not self._instead and self.grown.longest > _LONGEST:
            self._instead = f"a list of up to {self.grown.longest} triangles"
        if self._instead:
            return self._begin_one_after_another(work)
        self._place_points()
        return replace(used, links=used.links + self.grown.casters.count + self.grown.outlines.count)

    def amended(self, used: Used) -> Used:
        """With how the points were asked."""
        if not self._instead:
            return replace(used, why=f"{used.why}; {self._points} points of the light")
        used = self._accumulated.amended(used)
        if used.filter is not None and used.filter.has_map:  # which has a reason of its own
            return used
        return replace(used, why=f"{used.why}, for {self._instead}")

    def _build(self, programs: Programs, scene: GpuScene, light: Light) -> bool:
        self.grown.begin(scene, light, self.grid)
        self._values = self.grown.values
        textures = {"u_facets": self._facets, "u_traits": self._traits}
        if not super()._build(programs, scene, light):
            return False
        most = self._context.caps.max_texture_buffer_size
        fits = self.grown.build(programs, scene, light, self.grid, most, textures)
        # they would be no shorter on a coarser grid
        self._overflow = (
            "" if fits else f"lists of {self.grown.most} entries for its size, a buffer of this driver holds {most}"
        )
        return True

    def _place_points(self) -> None:
        points = self.light.area_points(self._points, self.grid.view_from_world[:3, :3]).astype(np.float32)
        key = points.tobytes()
        if self._disc_key == key:
            return
        if self._disc is not None:
            self._disc.release()
        self._disc = texture_buffer(self._context, points, RG32F)
        self._disc_key = key

    def receiver(self, work: Work) -> Receiver:
        """Read the counts, made anew unless light, scene and what the camera sees are those of the last frame."""
        if self._instead:
            return self._accumulated.receiver(work)
        self._rays = self._marking(work) if work.targets.samples > 1 else self._walked(work)
        key = (self._key, work.sight, work.targets.identity, self._shadow.filter)
        if self._counted is None or self._counted[0] != key:
            self._counted = None
            self._counted = key, self._count(work)
        self._instead = self._counted[1]
        if self._instead:
            self._begin_one_after_another(work)
            return self._accumulated.receiver(work)
        return replace(
            self._given(work, self._picture),
            marks={"GLS_MARKS": 1} if self._rays.marks else {},
            collected={**self._rays.collected, "GLS_NEIGHBORS": 1},
            densely=lambda dense: self._densely(work, dense),
        )

    def marking_receiver(self, work: Work) -> Receiver:
        """The marks are in the counts."""
        return self.receiver(work)

    def _count(self, work: Work) -> str:
        """Of all pixels of the picture; what is returned says why that would take too long or does not fit: then it was not done."""
        self._classify(work, self._picture, None)
        pixels, triangles = work.sight.size[0] * work.sight.size[1], work.scene.world.count
        if self.asked * self.grown.widest > self._points * (_PIXEL * pixels + _TRIANGLE * triangles):
            return f"{self.grown.widest} triangles whose shadows move far and {self.asked} pixels that see some of the light"
        try:
            if self.asked:
                self._ask(work, self._picture, None)
        except ResourceError as error:
            return str(error)
        return ""

    def _begin_one_after_another(self, work: Work) -> Used:
        self._accumulated.claim(work, self.light, self._shadow)
        return self._accumulated.prepare(work)

    def _densely(self, work: Work, dense: Dense) -> Receiver:
        self._classify(work, self._samples, dense)
        if self.asked:
            self._ask(work, self._samples, dense)
        dense.framebuffer.use()
        return self._given(work, self._samples)

    def _classify(self, work: Work, counts: Counts, dense: Dense | None) -> None:
        """All or nothing where no outline comes between; a list of the others."""
        counts.use(work, dense, 1, "u4")
        width, height = counts.texture.size
        if self._fragments is None or self._fragments.buffer.size < 4 * width * height:
            release(self._fragments)
            self._fragments = self._buffer(None, 4 * width * height, R32UI)
        program = self._program(work, dense, 0, "outlines", self.grown.outlines)
        self._begin(self._fragments)
        if dense is None:
            draw_over(self._context, program, work.sight)
            program.unbind()
            self._context.ctx.memory_barrier()
        else:
            self._draw(program)
        self.asked = self._counted_items()

    def _ask(self, work: Work, counts: Counts, dense: Dense | None) -> None:
        """Point by point, batch after batch of the list."""
        self._found.reserve(self._points)
        caps = self._context.caps
        first = 0
        while first < self.asked:
            now = min(self._batch, self.asked - first)
            program = self._program(work, dense, 1, "region", self.grown.casters)
            program.set(u_asked=(first, now, ROW), u_capacity=self._found.capacity)
            self._begin(self._found.links)
            self._found.use_lists(now)
            self._draw(program)
            self.found = self._counted_items()
            if self.found > self._found.capacity:
                limit = min(caps.max_storage_block // LINK_BYTES, caps.max_texture_buffer_size)
                if not self._found.grow(self.found, limit):
                    if now == 1:
                        raise ResourceError(
                            f"{self.found} triangles may come between one surface and its light, a buffer of this driver holds "
                            f"{limit}: give the light a smaller size"
                        )
                    self._batch = now // 2
                continue
            program = self._program(work, dense, 2, "found", None, GLS_SIDE=self._found.side)
            program.set(u_asked=(first, now, ROW))
            program.bind(u_found=self._found.links, u_lists=self._found.texture)
            counts.texture.bind_to_image(0, read=True, write=True)
            self._found.use_blocks(now)
            self._draw(program)
            first += now

    def _program(
        self, work: Work, dense: Dense | None, stage: int, between: str, lists: CellLists | None, **more: int
    ) -> Program:
        """A pass of pass/penumbra.frag, with all that it reads."""
        scene, targets = work.scene, work.targets
        asked = self._rays
        defines = {
            **asked.defines,
            "GLS_ORTHO": int(not work.sight.camera.is_perspective),
            "GLS_SELECTIVE": int(scene.selective),
            "GLS_ROUNDED": int(scene.rounded is not None),
            "GLS_DENSE": int(dense is not None),
            **DEFINES,
            **(self.light.penumbra or {}),
            "GLS_DITHER": int(self._shadow.filter.dithers),
            "GLS_STAGE": stage,
            "GLS_AREA": int(stage > 0),
            **(dense.defines if dense else {"GLS_SOFT": 1, **asked.marks} if stage == 0 else {}),
            **more,
        }
        program = work.programs.get(
            "pass/resolve.vert", "pass/penumbra.frag", "core430", area_slots(self.light, between), defines
        )
        aside = (0.0, 0.0) if dense else targets.aside
        program.set(**camera_uniforms(scene, work.sight, asked.axes, asked.offset, aside))
        program.set(**asked.uniforms, **self._values)  # its eye is the light's own
        program.set(u_count=self._points, u_samples=targets.fine.surface.size if dense else work.sight.size)
        program.set(u_sampled=targets.sampled)
        program.set(**self.light.area_uniforms(asked.axes))
        program.bind(**surface_textures(work.samplers, scene, targets), **asked.textures)
        program.bind(u_disc=self._disc, u_fragments=self._fragments)
        if dense is not None:
            program.set(**dense.uniforms)
            program.bind(u_surface=targets.fine.surface, u_pixels=dense.pixels)
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
            slots=given_slots(self.light),
            defines={"GLS_COUNTED": 1},
            uniforms={"u_points": float(self._points)},
            textures={"u_given": counts.texture},
        )

    def release(self) -> None:
        """Free the GPU memory."""
        super().release()
        release(
            self.grown,
            self._disc,
            self._picture,
            self._samples,
            self._fragments,
            self._found,
            self._counter,
            self._accumulated,
        )
