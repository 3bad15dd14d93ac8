"""What Exact() falls back to on OpenGL 3.3: a map of the numbers of the triangles nearest a light. Exact only where its texels saw all."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.culling import hidden_sides
from glshadow.core.decision import ignored_size
from glshadow.core.lights import Light
from glshadow.core.lists import ListGrid, facets, list_grid
from glshadow.core.metric import Target
from glshadow.core.shadow import Settled
from glshadow.core.spaces import ClipSpace, orthographic, perspective, rigid_inverse
from glshadow.core.used import Used
from glshadow.core.view import FACES, NEAREST_SHARE
from glshadow.gl.bodies import casters_seen, hides_back_faces
from glshadow.gl.buffers import BufferTexture, texture_buffer
from glshadow.gl.context import GLContext
from glshadow.gl.drawing import draw_nodes
from glshadow.gl.entry_points import RGBA32F
from glshadow.gl.geometry import GpuScene, pack_matrices
from glshadow.gl.program import Programs
from glshadow.gl.receiver import Receiver
from glshadow.gl.sources.source import Source
from glshadow.gl.sources.triangles import casting_corners, check_facets, light_frame, made_for, triangle_receiver
from glshadow.gl.targets import depth_texture
from glshadow.gl.work import Work
from glshadow.gl.world import local_corners

_NOT_EXACT = (
    "Exact() asks only the triangles seen in the 4 x 4 nearest texels of a map of their numbers, one point in each pixel: not exact, "
    "casters thinner than a texel may be missed; lists of all triangles need OpenGL 4.3, {} has {:.1f}"
)


class Numbered(Source):
    """One light's map of triangle numbers, and what it was made for.

    Attributes
    ----------
    grid : ListGrid
        Its window; a cell is a texel.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._key: tuple[Hashable, ...] | None = None
        self._texture: moderngl.Texture | None = None
        self._depth: moderngl.Texture | None = None
        self._framebuffer: moderngl.Framebuffer | None = None
        self._facets: BufferTexture | None = None
        self.grid: ListGrid

    def claim(self, work: Work, light: Light, shadow: Settled | None) -> None:
        """Take the light with its settings."""
        assert shadow is not None
        self.light, self._shadow = light, shadow

    def prepare(self, work: Work) -> Used:
        """Draw it, unless it is that of this scene and light already."""
        shadow, caps = self._shadow, work.caps
        drawn = self._update(work, shadow)
        missing = _NOT_EXACT.format(caps.renderer, caps.version_code / 100)
        fallbacks = (*ignored_size(self.light, shadow.filter), missing)
        return Used(
            filter=shadow.filter, faces=shadow.asked.faces, draws=int(drawn), fallbacks=fallbacks, why=shadow.why
        )

    def receiver(self, work: Work) -> Receiver:
        """Ask the triangles whose numbers lie near."""
        textures = {"u_numbers": self._texture, "u_facets": self._facets}
        return triangle_receiver(work, self.light, self.grid, "numbers", False, textures)

    def _update(self, work: Work, shadow: Settled) -> bool:
        """Whether it had to be drawn."""
        scene, light, resolution = work.scene, self.light, shadow.resolution
        casting = casters_seen(scene, light, work.sight)
        key = (*made_for(scene, light, casting), resolution)
        if key == self._key:
            return False
        self._key = None
        self.grid = list_grid(light, casting_corners(scene, casting))
        # six faces: a quarter of the texels each
        cells = resolution if self.grid.faces == 1 else max(resolution // 2, 1)
        self.grid = replace(self.grid, cells=cells)
        self._reserve(scene)
        for face in range(self.grid.faces):
            self._draw(work.programs, scene, light, face, casting)
        self._context.check_errors("drawing a map of triangle numbers")
        self._key = key
        return True

    def _reserve(self, scene: GpuScene) -> None:
        context, grid = self._context, self.grid
        size = (grid.cells, grid.cells * grid.faces)
        if self._texture is None or self._texture.size != size:
            self._release_map()
            self._depth = depth_texture(context, size, Target.DEPTH32F, "the map of triangle numbers")
            self._texture = context.ctx.texture(size, 1, dtype="u4")
            self._texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._framebuffer = context.ctx.framebuffer([self._texture], self._depth)
        check_facets(scene, context.caps.max_texture_buffer_size)
        axes, origin = light_frame(grid, scene)
        frame = rigid_inverse(axes, np.zeros(3))
        data = facets(local_corners(scene.world, frame, origin), scene.world.corners, axes).astype(np.float32)
        if self._facets is None or self._facets.buffer.size != data.nbytes:
            self._release_facets()
            self._facets = texture_buffer(context, data, RGBA32F)
        else:
            self._facets.buffer.write(data.tobytes())
        context.check_errors(f"uploading the facets of {scene.world.count} triangles")

    def _draw(self, programs: Programs, scene: GpuScene, light: Light, face: int, chosen: NDArray[np.bool_]) -> None:
        context, grid = self._context, self.grid
        ctx = context.ctx
        assert self._framebuffer is not None
        clip = ClipSpace(False, False)
        view = grid.view_from_world
        if grid.kind == "point":
            view = rigid_inverse(FACES[face], np.zeros(3)) @ view
        depth = -(scene.corners.reshape(-1, 3) @ view[2, :3] + view[2, 3])
        if grid.kind == "directional":
            pad = 1e-3 * float(np.ptp(depth)) + 1e-300
            projection = orthographic(*grid.window, float(depth.min()) - pad, float(depth.max()) + pad, clip)
        else:
            far = max(1.001 * float(depth.max()), 1e-300)
            near = max(0.999 * float(depth.min()), NEAREST_SHARE[False] * far)
            projection = perspective(*grid.window, near, far, clip)
        packed = pack_matrices(projection @ view @ scene.world_from_origin)
        if context.caps.clip_control:
            context.gl.clip_control(False)
        self._framebuffer.viewport = (0, face * grid.cells, grid.cells, grid.cells)
        self._framebuffer.use()
        ctx.depth_func = "<="
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_clamp_range = (0.0, 1.0)
        if face == 0:
            self._framebuffer.clear(depth=1.0, viewport=(0, 0, *self._framebuffer.size))
        faces = light.shadow.faces if light.shadow else None
        hidden = hidden_sides(faces, hides_back_faces(scene, light, faces))

        def begin(node: int) -> tuple[Callable[[int], None], moderngl.VertexArray]:
            gpu, material = scene.meshes[node], scene.nodes[node].mesh.material
            defines = {"GLS_SURFACE": 1, **gpu.alpha_test}
            program = programs.get("pass/surface.vert", "pass/surface.frag", defines=defines)
            program.set(u_color=material.color, u_cutoff=gpu.cutoff)
            if gpu.texture is not None:
                program.bind(u_texture=gpu.texture)

            def place(i: int) -> None:
                program.write("u_clip_from_mesh", packed[i])
                program.write("u_first_triangle", scene.packed_first[i])

            return place, gpu.vertex_array(program, "numbered")

        draw_nodes(ctx, scene, np.flatnonzero(chosen), hidden, begin)
        ctx.depth_clamp_range = None
        ctx.enable_only(moderngl.NOTHING)

    def _release_map(self) -> None:
        for thing in (self._framebuffer, self._texture, self._depth):
            if thing is not None:
                thing.release()

    def _release_facets(self) -> None:
        if self._facets is not None:
            self._facets.release()

    def release(self) -> None:
        """Free the GPU memory."""
        self._release_map()
        self._release_facets()
