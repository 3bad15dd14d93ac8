"""An area light against triangle lists: a pass over all pixels finds those that silhouette edges cut, rays are cast only for these."""

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
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.per_sample import PerSample
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.screen import camera_uniforms, draw_over, surface_textures
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.accumulated import Accumulated
from glshadow.gl.techniques.cells import LINK_BYTES, CellLists
from glshadow.gl.techniques.counts import Counts
from glshadow.gl.techniques.found import BATCH, ROW, Found
from glshadow.gl.techniques.grown import DEFINES, Grown
from glshadow.gl.techniques.interpolated import UNITS, Interpolated, image_only
from glshadow.gl.techniques.listed import Listed
from glshadow.gl.techniques.mapped import Mapped
from glshadow.gl.techniques.technique import open_receiver
from glshadow.lights import Light
from glshadow.shader.slots import area_slots, precomputed_slots
from glshadow.shadows.shadow import ResolvedShadow

# A partly lit pixel walks most of the triangles whose shadows move far, 13 ns each; a frame with a hard shadow takes 40 ns a pixel and
# 100 a triangle (llvmpipe): the cost of this many of the former equals one of the latter.
_PIXEL, _TRIANGLE = 4, 10
_WIDE = 75  # the same for points, of which one in eight is partly lit: measured on the courtyard
_LONGEST = 60000  # links in a receiver's list: llvmpipe ends loops after 65,536 turns


class Area(Listed):
    """One area light's triangle lists, the lists grown by its size, and the count of its sample points that each pixel sees."""

    marks_capsules = False

    def __init__(self, context: GLContext) -> None:
        super().__init__(context)
        self.grown = Grown(context)
        self._disc: BufferTexture | None = None
        self._disc_key: Hashable = None
        self._image_counts, self._sample_counts = Counts(context), Counts(context)
        self._sparse_counts, self._between = Counts(context), Interpolated(context)
        self._fragments: BufferTexture | None = None  # partly lit pixels: x | y << 16
        self._found = Found(context)
        self._counter = context.ctx.buffer(reserve=4)
        self._batch = BATCH
        self._accumulated = Accumulated(context, Listed(context), Mapped(context))
        self._rays: Receiver  # tests the ray to the light's centre
        self._instead = ""  # why sample points are rendered one after another; empty: they are not
        self._overflow = ""  # why the grown lists of `_key` do not fit; empty: they fit
        self.partly_lit = self.found = 0
        self._counted: tuple[Hashable, str] | None = None  # key of the counts, and why there are none

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Set the light and its settings."""
        super().allocate(frame, light, shadow)
        self._points = self._shadow.filter.points_of_light

    def update(self, frame: FrameContext) -> Used:
        """Build the lists, unless those of this scene and light are kept; if they do not fit, render sample point after sample point."""
        try:
            used = super().update(frame)
            self._instead = self._overflow
        except ResourceError as error:
            self._instead = str(error)
        if not self._instead and self.grown.longest > _LONGEST:
            self._instead = f"a list of up to {self.grown.longest} triangles"
        if self._instead:
            return self._begin_one_after_another(frame)
        self._place_points()
        return replace(used, links=used.links + self.grown.casters.count + self.grown.silhouettes.count)

    def finalize(self, used: Used) -> Used:
        """Add how the sample points were tested."""
        if not self._instead:
            between = ", interpolated between pixels" if self._shadow.filter.interpolates else ""
            return replace(used, why=f"{used.why}; {self._points} points of the light{between}")
        used = self._accumulated.finalize(used)
        if used.filter is not None and used.filter.has_map:  # its own reason is given already
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
        # a coarser grid would not make them shorter
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

    def receiver(self, frame: FrameContext) -> Receiver:
        """A receiver that reads the counts. They are rendered again only if light, scene or camera view changed since the last frame."""
        if self._instead:
            return self._accumulated.receiver(frame)
        marking = frame.targets.samples > 1 and not self._interpolates(frame)
        self._rays = self._marking(frame) if marking else self._walked(frame)
        key = (self._key, frame.camera_view, frame.targets.identity, self._shadow.filter)
        if self._counted is None or self._counted[0] != key:
            self._counted = None
            self._counted = key, self._count(frame)
        self._instead = self._counted[1]
        if self._instead:
            self._begin_one_after_another(frame)
            return self._accumulated.receiver(frame)
        return replace(
            self._counts_receiver(frame, self._image_counts),
            marks={"GLS_MARKS": 1} if self._rays.marks else {},
            collected={**self._rays.collected, "GLS_NEIGHBORS": 1},
            per_sample=lambda per_sample: self._per_sample_receiver(frame, per_sample),
        )

    def marking_receiver(self, frame: FrameContext) -> Receiver:
        """The same receiver: the counts hold the marks."""
        return self.receiver(frame)

    def _count(self, frame: FrameContext) -> str:
        """Count for all pixels of the image. Returns why that would take too long or does not fit (nothing is counted then), or ''."""
        pixels, triangles = frame.camera_view.size[0] * frame.camera_view.size[1], frame.scene.world.count
        sparse, counts = None, self._image_counts
        if self._interpolates(frame):
            sparse, counts, frame = self._between.sparse(frame), self._sparse_counts, image_only(frame)
            pixels //= 4
        self._classify(frame, counts, sparse)
        if frame.targets.points:  # the answer of a point may not depend on how many others there are
            if self.grown.widest > _WIDE * self._points:
                return f"{self.grown.widest} triangles whose shadows move far"
        elif self.partly_lit * self.grown.widest > self._points * (_PIXEL * pixels + _TRIANGLE * triangles):
            return f"{self.grown.widest} triangles whose shadows move far and {self.partly_lit} pixels that see some of the light"
        try:
            self._cast_rays(frame, counts, sparse)
            if sparse is not None:
                self._interpolate(frame, None, self._sparse_counts, self._image_counts)
        except ResourceError as error:
            return str(error)
        return ""

    def _interpolates(self, frame: FrameContext) -> bool:
        return self._shadow.filter.interpolates and not frame.targets.points  # given points have no neighbours

    def _interpolate(self, frame: FrameContext, per_sample: PerSample | None, known: Counts, counts: Counts) -> None:
        """Interpolate the counts of the image or of samples between others, and count the rest."""
        between = self._between
        between.interpolate(frame, per_sample, known, counts, self._points)
        for batch in between.batches(frame.targets.aside if per_sample is None else per_sample.aside):
            self._classify(frame, between.counts, batch)
            self._cast_rays(frame, between.counts, batch)
            between.scatter(frame, batch, counts)

    def _begin_one_after_another(self, frame: FrameContext) -> Used:
        self._accumulated.allocate(frame, self.light, self._shadow)
        return self._accumulated.update(frame)

    def _per_sample_receiver(self, frame: FrameContext, per_sample: PerSample) -> Receiver:
        if self._interpolates(frame):
            self._interpolate(frame, per_sample, self._image_counts, self._sample_counts)
        else:
            self._classify(frame, self._sample_counts, per_sample)
            self._cast_rays(frame, self._sample_counts, per_sample)
        assert per_sample.framebuffer is not None
        per_sample.framebuffer.use()
        return self._counts_receiver(frame, self._sample_counts)

    def _classify(self, frame: FrameContext, counts: Counts, per_sample: PerSample | None) -> None:
        """Count all or no sample points where no silhouette edge cuts the light; list the other pixels."""
        counts.use(frame, per_sample, 1, "u4")
        width, height = counts.texture.size
        if self._fragments is None or self._fragments.buffer.size < 4 * width * height:
            release(self._fragments)
            self._fragments = self._buffer(None, 4 * width * height, R32UI)
        program = self._program(frame, per_sample, 0, "silhouettes", self.grown.silhouettes)
        self._begin(self._fragments)
        if per_sample is None:
            draw_over(self._context, program, frame.camera_view)
            program.unbind()
            self._context.ctx.memory_barrier()
        else:
            self._draw(program)
        self.partly_lit = self._counted_items()

    def _cast_rays(self, frame: FrameContext, counts: Counts, per_sample: PerSample | None) -> None:
        """Cast rays from the listed pixels to the sample points, batch after batch."""
        self._found.reserve(self._points)
        caps = self._context.caps
        first = 0
        while first < self.partly_lit:
            now = min(self._batch, self.partly_lit - first)
            program = self._program(frame, per_sample, 1, "region", self.grown.casters)
            program.set(u_partly_lit=(first, now, ROW), u_capacity=self._found.capacity)
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
            program = self._program(frame, per_sample, 2, "found", None, GLS_SIDE=self._found.side)
            program.set(u_partly_lit=(first, now, ROW))
            program.bind(u_found=self._found.links, u_lists=self._found.texture)
            counts.texture.bind_to_image(0, read=True, write=True)
            self._found.use_blocks(now)
            self._draw(program)
            first += now

    def _program(
        self,
        frame: FrameContext,
        per_sample: PerSample | None,
        stage: int,
        between: str,
        lists: CellLists | None,
        **more: int,
    ) -> Program:
        """A program of pass/penumbra.frag with its uniforms and textures set."""
        scene, targets = frame.scene, frame.targets
        rays = self._rays
        defines = {
            **rays.defines,
            "GLS_ORTHO": int(not frame.camera_view.camera.is_perspective),
            "GLS_SELECTIVE": int(scene.selective),
            "GLS_ROUNDED": int(scene.rounded is not None),
            "GLS_PER_SAMPLE": int(per_sample is not None),
            "GLS_POINTS": targets.points,
            **DEFINES,
            **(self.light.penumbra or {}),
            "GLS_DITHER": int(self._shadow.filter.dithers),
            "GLS_STAGE": stage,
            "GLS_AREA": int(stage > 0),
            **(per_sample.defines if per_sample else {"GLS_SOFT": 1, **rays.marks} if stage == 0 else {}),
            **more,
        }
        program = frame.programs.get(
            "pass/resolve.vert", "pass/penumbra.frag", "core430", area_slots(self.light, between), defines
        )
        aside = per_sample.aside if per_sample else targets.aside
        program.set(**camera_uniforms(scene, frame.camera_view, rays.axes, rays.offset, aside))
        program.set(**rays.uniforms, **self._values)  # with the eye in the light's frame
        program.set(u_count=self._points, u_samples=targets.fine.surface.size if per_sample else frame.camera_view.size)
        program.set(u_sampled=targets.sampled)
        program.set(**self.light.area_uniforms(rays.axes))
        program.bind(**surface_textures(frame.samplers, scene, targets), **rays.textures)
        program.bind(u_disc=self._disc, u_fragments=self._fragments)
        if per_sample is not None:
            program.set(**per_sample.uniforms)
            program.bind(u_surface=targets.fine.surface, u_pixels=per_sample.pixels)
        if lists is not None:
            program.bind(u_grown_heads=lists.heads, u_grown_links=lists.links)
        return program

    def _begin(self, items: BufferTexture) -> None:
        """Reset the counter and bind the list that the next pass appends to."""
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

    def _counts_receiver(self, frame: FrameContext, counts: Counts) -> Receiver:
        return replace(
            open_receiver(frame, self.light),
            slots=precomputed_slots(self.light),
            defines={"GLS_COUNTED": 1},
            uniforms={"u_points": float(self._points * (UNITS if self._interpolates(frame) else 1))},
            textures={"u_counts": counts.texture},
        )

    def release(self) -> None:
        """Free the GPU memory."""
        super().release()
        release(
            self.grown,
            self._disc,
            self._image_counts,
            self._sample_counts,
            self._sparse_counts,
            self._between,
            self._fragments,
            self._found,
            self._counter,
            self._accumulated,
        )
