"""Draws one frame: camera pass, the shadow of each light, lighting, read-back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from glshadow.arguments import FrameRequest
from glshadow.core.sampling import grid
from glshadow.derive.used import Used
from glshadow.errors import warn
from glshadow.gl.driver.clock import Clock
from glshadow.gl.driver.targets import clear_outputs
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.camera import draw_surface, nothing_in_view
from glshadow.gl.passes.primary import count_surface, find_primary
from glshadow.gl.passes.resolve import resolve
from glshadow.gl.passes.translucent import untinted
from glshadow.gl.resources import ResourceCache
from glshadow.gl.shares import every_sample, shares_of

_EVERY_SAMPLE = "all {} samples of every pixel are shaded: collecting those that differ needs OpenGL 4.3, {} has {:.1f}"


@dataclass(frozen=True, eq=False)
class Drawn:
    """A drawn frame.

    Parameters
    ----------
    outputs : dict
        Arrays by name.
    used : tuple of Used
        For each light.
    near, far : float
        Depth range of the camera.
    """

    outputs: dict[str, Any]
    used: tuple[Used, ...]
    near: float
    far: float


def draw_frame(cache: ResourceCache, request: FrameRequest) -> Drawn:
    """Draw a frame; the context must be current."""
    context, look, outputs = cache.context, request.look, request.outputs
    blending = cache.layers.scene(request.scene)
    # without atomics all samples are shaded, as pixels of a larger image
    pattern = (1, 1) if context.caps.compute else grid(look.samples)
    frame = cache.frame_context(request, pattern)
    clock = Clock(context, "timings" in outputs)
    with clock("shadow"):
        lights = cache.techniques.allocate(frame, request.lights)
    _draw_camera(cache, frame, look.samples, clock)
    with clock("shadow"):
        for each in lights:
            each.used = each.used or each.technique.update(frame)
            if blending is not None:
                view = cache.layers.view(blending, request)
                each.tint = cache.translucent_maps.tint(frame, each.number, each.light, blending, view)
    with clock("resolve"):
        # cleared only now, so that tile-based rasterisers clear and draw each tile in one go
        clear_outputs(context, frame.targets, look.linear_background, look.background is None)
        shares = shares_of(frame, lights, look)
        used = [each.technique.finalize(each.used) for each in lights if each.used]
        if not every_sample(frame, lights):
            for share in shares:
                resolve(frame, share)
    if frame.targets.samples > 1:
        with clock("samples"):
            cache.samples(frame).shade(
                frame, shares, look.linear_background, look.background is None, "visibility" in outputs
            )
    with clock("read"):
        results = cache.read(frame, outputs, [(each.light, each.tint) for each in lights], look, pattern)
        if "shadow_maps" in outputs:
            results["shadow_maps"] = tuple(each.technique.stored() for each in lights)
    layered = blending is not None and cache.layers.composite(frame, request, blending, lights, results, clock)
    context.check_errors("rendering")
    camera_view = frame.camera_view
    if not (cache.any_surface or layered):
        warn(nothing_in_view(request.scene, camera_view))
    fallbacks = camera_view.fallbacks + ((cache.primary_fallback,) if cache.primary_fallback else ())
    if pattern != (1, 1):
        fallbacks += (_EVERY_SAMPLE.format(look.samples, context.caps.renderer, context.caps.version_code / 100),)
    if clock.wanted:
        results["timings"] = clock.times()
    reported = tuple(
        replace(each, fallbacks=each.fallbacks + untinted(blending, light) + fallbacks)
        for each, light in zip(used, request.lights, strict=True)
    )
    return Drawn(results, reported, camera_view.near, camera_view.far)


def _draw_camera(cache: ResourceCache, frame: FrameContext, samples: int, clock: Clock) -> None:
    """Draw the camera pass, unless the surface buffer still holds this view."""
    key = (frame.camera_view, frame.targets.identity, samples)
    if cache.seen == key:
        return
    cache.seen = None
    with clock("surface"):
        draw_surface(
            frame.context, frame.programs, frame.scene, frame.camera_view, frame.targets.fine.framebuffer, samples
        )
    with clock("surface"):
        cache.primary_fallback = find_primary(frame, frame.targets.fine, frame.targets.samples)
        with cache.covered:
            count_surface(frame, frame.targets.fine)
    if frame.targets.samples > 1:
        with clock("samples"):
            cache.samples(frame).fill(frame)
    cache.any_surface = cache.covered.passed
    cache.seen = key
