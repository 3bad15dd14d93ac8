"""Moments: prefiltered moment maps, computed from a shadow map after it is drawn."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

import moderngl

from glshadow.derive.compare import window_depth_line
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Programs
from glshadow.gl.driver.targets import release, released_on_error
from glshadow.gl.passes.atlases import layout
from glshadow.gl.passes.caster import Map
from glshadow.shader.slots import parallel_define
from glshadow.shadows.filters.moments import MIP_LEVELS, MomentFilter
from glshadow.shadows.view import ShadowView

_SHORT = 2  # texels: beyond this radius converting each depth repeatedly costs more than a separate pass


class Moments:
    """The moments of one light's map, in an atlas of their own, kept while the map is unchanged.

    Attributes
    ----------
    texture : moderngl.Texture
        Sampled bilinearly.
    size : (2,) ints
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._shape: Hashable = None
        self._drawn: Hashable = None
        self._owned: list[moderngl.Texture | moderngl.Framebuffer] = []
        self.texture: moderngl.Texture
        self.size = (0, 0)

    def filled(self, programs: Programs, drawn: Map) -> Map:
        """The map with moments in place of depths."""
        views, size = layout(drawn.views, self._context.caps.max_texture_size)
        filter_ = drawn.filter.of_a_point
        assert isinstance(filter_, MomentFilter)
        self._make(size, filter_)
        source = drawn.atlas.drawn.get(tuple(view.tile for view in drawn.views))
        if source is None or self._drawn != (source, filter_):
            self._drawn = None
            self._fill(programs, drawn, views, filter_)
            self._drawn = (source, filter_)
        return replace(drawn, views=views, atlas=self)  # type: ignore[arg-type]

    def _make(self, size: tuple[int, int], filter_: MomentFilter) -> None:
        shape = (size, filter_.channels, filter_.precision, filter_.radius > 0, filter_.mip_maps)
        if self._shape == shape:
            return
        self.release()
        ctx, what = self._context.ctx, "a prefiltered shadow map"
        self._context.check_size(size, what)
        made: list[moderngl.Texture | moderngl.Framebuffer] = []
        with released_on_error(made):
            for _ in range(2 if filter_.radius else 1):
                texture = ctx.texture(size, filter_.channels, dtype=filter_.precision)
                made.append(texture)
                texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
                texture.repeat_x = texture.repeat_y = False
            self._context.check_errors(
                f"allocating {what}, {size[0]} x {size[1]} of {filter_.channels} {filter_.precision}"
            )
            textures = [each for each in made if isinstance(each, moderngl.Texture)]
            self._framebuffers = [ctx.framebuffer([each]) for each in textures]
            made += self._framebuffers
        self._owned, self._textures, self.texture, self.size = made, textures, textures[0], size
        self._shape, self._drawn = shape, None

    def _fill(self, programs: Programs, drawn: Map, views: tuple[ShadowView, ...], filter_: MomentFilter) -> None:
        ctx = self._context.ctx
        ctx.enable_only(moderngl.NOTHING)
        # a short kernel is applied while converting, which saves a pass; the last pass then writes into the first texture
        row = filter_.radius if filter_.radius <= _SHORT else 0
        convert = programs.get(
            "pass/over.vert",
            "pass/moments.frag",
            slots={"encoding": filter_.encoding},
            defines={**parallel_define(views[0].projection), "GLS_ROW": row, **filter_.defines()},
        )
        for there, here in zip(drawn.views, views, strict=True):
            x, y = window_depth_line(there)
            self._onto(1 if row else 0, here)
            convert.set(
                u_even=(x, y, there.near, 1.0 / (there.far - there.near)),
                u_from=(there.tile[0] - here.tile[0], there.tile[1] - here.tile[1]),
            )
            convert.bind(u_stored=drawn.atlas.texture)
            convert.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        if filter_.radius:
            blur = programs.get("pass/over.vert", "pass/blur.frag", defines={"GLS_MOMENT_RADIUS": filter_.radius})
            for source, along in ((0, (1.0, 0.0)), (1, (0.0, 1.0)))[1 if row else 0 :]:
                for view in views:
                    self._onto(1 - source, view)
                    blur.set(u_along=along)
                    blur.bind(u_moments=self._textures[source])
                    blur.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        if filter_.mip_maps:
            self.texture.build_mipmaps(0, MIP_LEVELS)

    def _onto(self, number: int, view: ShadowView) -> None:
        """Draw over a view's tile and its empty gutter."""
        side = view.resolution + 2 * view.gutter
        framebuffer = self._framebuffers[number]
        framebuffer.viewport = (view.tile[0] - view.gutter, view.tile[1] - view.gutter, side, side)
        framebuffer.use()

    def release(self) -> None:
        """Free the GPU memory."""
        release(*reversed(self._owned))
        self._owned, self._shape, self._drawn = [], None, None
