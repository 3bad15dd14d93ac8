"""A light that has a size, as many hard lights one after another: the count of those that are seen, for every pixel."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

from glshadow.core.area import hard_lights, without_cone
from glshadow.core.filters import Filter
from glshadow.core.lights import Light, SkyLight
from glshadow.core.shadow import Settled
from glshadow.core.used import Used
from glshadow.core.view import kind_of
from glshadow.gl.atlases import Atlases
from glshadow.gl.context import GLContext
from glshadow.gl.dense import Dense
from glshadow.gl.receiver import Receiver
from glshadow.gl.resolve import count_seen
from glshadow.gl.sources.counts import Counts
from glshadow.gl.sources.source import Source, open_receiver
from glshadow.gl.targets import release
from glshadow.gl.work import Work
from glshadow.shader.slots import given_slots


class Accumulated(Source):
    """One light's count of seen points, over the picture and over the samples of collected pixels.

    Parameters
    ----------
    one : Source
        What a single hard light is asked of, again and again.
    """

    def __init__(self, context: GLContext, one: Source) -> None:
        self._context, self._one = context, one
        self._atlases = Atlases(context)
        self._filter: Filter
        self._key: tuple[Hashable, ...] | None = None
        self._picture, self._samples = Counts(context), Counts(context)

    def claim(self, work: Work, light: Light, shadow: Settled | None) -> None:
        """Take the light with its settings."""
        assert shadow is not None
        self.light = light
        self._shadow, self._filter = replace(shadow, filter=shadow.filter.of_a_point), shadow.filter
        points = hard_lights(light, shadow.filter.points_of_light)
        self._points = points if shadow.filter.has_map else tuple(map(without_cone, points))
        self._one.expect(self._points)
        self._weighed = isinstance(light, SkyLight)

    def prepare(self, work: Work) -> Used:
        """Make what the first point needs: where that can be done, it can be done for all."""
        used = self._prepare(work, self._points[0])
        why = f"{used.why}; {len(self._points)} points of the light, one after another"
        return replace(used, filter=self._filter, why=why, fallbacks=used.fallbacks + undithered(self._filter))

    def _prepare(self, work: Work, point: Light) -> Used:
        """What one point needs; its maps are its own, so that the next one may draw over them."""
        alone = replace(work, atlases=self._atlases)
        self._atlases.begin()
        self._one.claim(alone, point, self._shadow)
        return self._one.prepare(alone)

    def receiver(self, work: Work) -> Receiver:
        """Read the counts, made anew unless light, scene and what the camera sees are those of the last frame."""
        key = (work.scene.identity, work.sight, work.targets.identity, self._points, self._filter, self._shadow.asked)
        if self._key != key:
            self._key = None
            self._count(work, self._picture, None)
            self._key = key
        return replace(self._given(work, self._picture), densely=lambda dense: self._densely(work, dense))

    def _densely(self, work: Work, dense: Dense) -> Receiver:
        self._count(work, self._samples, dense)
        dense.framebuffer.use()
        return self._given(work, self._samples)

    def _count(self, work: Work, counts: Counts, dense: Dense | None) -> None:
        components = 2 if self._weighed else 1
        counts.use(work, dense, components, "f4")
        self._context.gl.clear_floats(0, (0.0,) * 4)
        for point in self._points:
            self._prepare(work, point)
            asked = self._one.receiver(replace(work, atlases=self._atlases))
            counts.use(work, dense, components, "f4")
            count_seen(work, point, asked, dense, self._weighed)

    def _given(self, work: Work, counts: Counts) -> Receiver:
        return replace(
            open_receiver(work, self.light),
            slots=given_slots(kind_of(self.light)),
            defines={"GLS_WEIGHED": int(self._weighed)},
            uniforms={"u_points": float(len(self._points))},
            textures={"u_given": counts.texture},
        )

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._one, self._atlases, self._picture, self._samples)


def undithered(filter_: Filter) -> tuple[str, ...]:
    """The fallback of a filter that dithers, whose points are asked one after another."""
    return ("no dither: the light's points are asked one after another, each of all pixels",) if filter_.dithers else ()
