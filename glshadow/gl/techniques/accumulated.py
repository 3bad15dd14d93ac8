"""An area light as many point samples, rendered one after another: counts how many of them each pixel sees."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

from glshadow.derive.resolved import resolve_shadow
from glshadow.derive.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.atlases import Atlases
from glshadow.gl.passes.per_sample import PerSample
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.resolve import count_seen
from glshadow.gl.techniques.counts import Counts
from glshadow.gl.techniques.technique import Technique, open_receiver
from glshadow.lights import Light
from glshadow.shader.slots import precomputed_slots
from glshadow.shadows.filters import Filter
from glshadow.shadows.shadow import ResolvedShadow


class Accumulated(Technique):
    """Counts of one light's visible sample points, for the pixels of the image and for the samples of collected pixels.

    Parameters
    ----------
    one : Technique
        Finds the shadow of a single sample point; used for each of them in turn.
    maps : Technique, optional
        Used instead if `one` does not fit into the driver's buffers and the light's filter was not requested but derived.
    """

    def __init__(self, context: GLContext, one: Technique, maps: Technique | None = None) -> None:
        self._context, self._first, self._maps = context, one, maps
        self._atlases = Atlases(context)
        self._filter: Filter
        self._counted: tuple[Hashable, Used, Technique, ResolvedShadow] | None = None  # what was counted, and how
        self._image_counts, self._sample_counts = Counts(context), Counts(context)

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Set the light and its settings."""
        assert shadow is not None
        self.light, self._requested = light, shadow
        self._use(self._first, shadow)

    def _use(self, one: Technique, shadow: ResolvedShadow) -> None:
        self._one, self._resolved = one, shadow
        self._shadow, self._filter = replace(shadow, filter=shadow.filter.of_a_point), shadow.filter
        points = self.light.hard_lights(shadow.filter.points_of_light)
        self._points = points if shadow.filter.has_map else tuple(point.without_cone() for point in points)
        one.expect(self._points)
        self._weights = 2 if self.light.per_channel else int(self.light.weighted)

    def update(self, frame: FrameContext) -> Used:
        """Update the technique for the first sample point, unless the counts are still valid.

        Raises
        ------
        ResourceError
            If it does not fit into the driver's buffers and there is no other technique for the light.
        """
        if self._counted is not None and self._counted[0] == self._key(frame):
            _, used, one, shadow = self._counted
            self._use(one, shadow)
            self._used = replace(used, draws=0)
            return self._used
        try:
            self._used = self._update_first(frame)
        except ResourceError as error:
            self._turn_to_maps(frame, error)
        return self._used

    def finalize(self, used: Used) -> Used:
        """What was really used for all sample points: the lists may have stopped fitting at a later one than the first."""
        return self._used

    def _turn_to_maps(self, frame: FrameContext, error: ResourceError) -> None:
        """Switch to shadow maps, from the first sample point on, for this reason."""
        shadow = resolve_shadow(self.light, str(error))
        if self._maps is None or self._one is self._maps or shadow is None or not shadow.filter.has_map:
            raise error
        self._use(self._maps, shadow)
        self._used = self._update_first(frame)

    def _update_first(self, frame: FrameContext) -> Used:
        used = self._update(frame, self._points[0])
        why = f"{used.why}; {len(self._points)} points of the light, one after another"
        return replace(used, filter=self._filter, why=why, fallbacks=used.fallbacks + undithered(self._filter))

    def _update(self, frame: FrameContext, point: Light) -> Used:
        """Update the technique for one sample point. Its maps have their own atlas, so that the next point may overwrite them."""
        alone = replace(frame, atlases=self._atlases)
        self._atlases.begin()
        self._one.allocate(alone, point, self._shadow)
        return self._one.update(alone)

    def _key(self, frame: FrameContext) -> Hashable:
        """All that the counts depend on."""
        light = replace(self.light, color=(1.0, 1.0, 1.0), intensity=1.0)
        return (frame.scene.identity, frame.camera_view, frame.targets.identity, light, self._requested.filter)

    def receiver(self, frame: FrameContext) -> Receiver:
        """A receiver that reads the counts. They are rendered again only if light, scene or camera view changed since the last frame."""
        key = self._key(frame)
        if self._counted is None or self._counted[0] != key:
            self._counted = None
            try:
                self._count(frame, self._image_counts, None)
            except ResourceError as error:
                self._turn_to_maps(frame, error)
                self._count(frame, self._image_counts, None)
            self._counted = key, self._used, self._one, self._resolved
        return replace(
            self._counts_receiver(frame, self._image_counts),
            per_sample=lambda per_sample: self._per_sample_receiver(frame, per_sample),
        )

    def _per_sample_receiver(self, frame: FrameContext, per_sample: PerSample) -> Receiver:
        self._count(frame, self._sample_counts, per_sample)
        assert per_sample.framebuffer is not None
        per_sample.framebuffer.use()
        return self._counts_receiver(frame, self._sample_counts)

    def _count(self, frame: FrameContext, counts: Counts, per_sample: PerSample | None) -> None:
        components, textures = ((1, 1), (2, 1), (4, 2))[self._weights]
        counts.use(frame, per_sample, components, "f4", textures)
        for number in range(textures):
            self._context.gl.clear_floats(number, (0.0,) * 4)
        for point in self._points:
            self._update(frame, point)
            receiver = self._one.receiver(replace(frame, atlases=self._atlases))
            counts.use(frame, per_sample, components, "f4", textures)
            count_seen(frame, point, receiver, per_sample, self._weights)

    def _counts_receiver(self, frame: FrameContext, counts: Counts) -> Receiver:
        return replace(
            open_receiver(frame, self.light),
            slots=precomputed_slots(self.light),
            defines={"GLS_WEIGHED": self._weights},
            uniforms={"u_points": float(len(self._points))},
            textures=dict(zip(("u_counts", "u_unshadowed"), counts.textures, strict=False)),
        )

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._first, self._maps, self._atlases, self._image_counts, self._sample_counts)


def undithered(filter_: Filter) -> tuple[str, ...]:
    """The fallbacks of a filter that dithers or interpolates, whose sample points are rendered one after another."""
    asked = {"no dither": filter_.dithers, "not interpolated": filter_.interpolates}
    return tuple(
        f"{what}: the light's points are sampled one after another, each for all pixels"
        for what, so in asked.items()
        if so
    )
