"""One frame from beginning to end: camera pass, the shadow of each light, lighting, read-back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from glshadow.arguments import FrameRequest
from glshadow.core.sampling import grid
from glshadow.derive.look import Look
from glshadow.derive.used import Used
from glshadow.errors import warn
from glshadow.gl.driver.clock import Clock
from glshadow.gl.driver.targets import clear_outputs
from glshadow.gl.frame_context import Work
from glshadow.gl.passes.camera import draw_surface, nothing_in_view
from glshadow.gl.passes.primary import find_primary
from glshadow.gl.passes.resolve import Share, resolve
from glshadow.gl.passes.translucent import untinted
from glshadow.gl.resources import Store
from glshadow.gl.techniques import LightWork
from glshadow.gl.techniques.technique import open_receiver
from glshadow.lights import DirectionalLight

_EVERY_SAMPLE = "all {} samples of every pixel are shaded: collecting those that differ needs OpenGL 4.3, {} has {:.1f}"


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a frame is made of.

    Parameters
    ----------
    outputs : dict
        By name.
    used : tuple of Used
        Per light.
    near, far : float
        Depth range of the camera.
    """

    outputs: dict[str, Any]
    used: tuple[Used, ...]
    near: float
    far: float


def draw_frame(store: Store, request: FrameRequest) -> Drawn:
    """Draw what is requested; the context is current."""
    context, look, outputs, count = store.context, request.look, request.outputs, len(request.lights)
    # without atomics every sample is shaded, as a pixel of a larger image
    spread = (1, 1) if context.caps.compute else grid(look.samples)
    work = store.work(request, spread)
    clock = Clock(context, "timings" in outputs)
    with clock("shadow"):
        lights = store.sources.claim(work, request.lights)
    _see(store, work, look.samples, clock)
    with clock("shadow"):
        for each in lights:
            each.used = each.used or each.technique.prepare(work)
            each.panes = store.glasses.panes(work, each.number, each.light)
    with clock("resolve"):
        # here, so that tiles are cleared and drawn in one go
        clear_outputs(context, work.targets, look.linear_background, look.background is None)
        shares = _shares(work, lights, look)
        used = [each.technique.amended(each.used) for each in lights if each.used]
        for share in shares:
            resolve(work, share)
    if work.targets.samples > 1:
        with clock("samples"):
            store.several(work).shade(
                work, shares, look.linear_background, look.background is None, "visibility" in outputs
            )
    with clock("read"):
        results = store.read(work, outputs, count, look, spread)
        if "shadow_maps" in outputs:
            results["shadow_maps"] = tuple(each.technique.stored() for each in lights)
    context.check_errors("rendering")
    sight = work.sight
    if not store.something:
        warn(nothing_in_view(request.scene, sight))
    fallbacks = sight.fallbacks + ((store.missed,) if store.missed else ())
    if spread != (1, 1):
        fallbacks += (_EVERY_SAMPLE.format(look.samples, context.caps.renderer, context.caps.version_code / 100),)
    if clock.wanted:
        results["timings"] = clock.times()
    said = tuple(
        replace(each, fallbacks=each.fallbacks + untinted(work.scene, light) + fallbacks)
        for each, light in zip(used, request.lights, strict=True)
    )
    return Drawn(results, said, sight.near, sight.far)


def _see(store: Store, work: Work, samples: int, clock: Clock) -> None:
    """Draw what the camera sees, unless it is there from the last frame."""
    key = (work.sight, work.targets.identity, samples)
    if store.seen == key:
        return
    store.seen = None
    with clock("surface"), store.covered:
        draw_surface(work.context, work.programs, work.scene, work.sight, work.targets.fine.framebuffer, samples)
    with clock("surface"):
        store.missed = find_primary(work, work.targets.fine, work.targets.samples)
    if work.targets.samples > 1:
        with clock("samples"):
            store.several(work).fill(work)
    store.something = store.covered.passed
    store.seen = key


def _shares(work: Work, lights: Sequence[LightWork], look: Look) -> tuple[Share, ...]:
    """Each light's part of the image; without lights one of a light that is dark."""
    if not lights:
        dark = DirectionalLight(intensity=0.0)
        return (Share(dark, open_receiver(work, dark), 0, 1, look.ambient, look.linear_background),)
    several = work.targets.samples > 1
    return tuple(
        Share(each.light, each.technique.marking_receiver(work) if several else each.technique.receiver(work),
              each.number, len(lights), look.ambient, look.linear_background, each.panes)
        for each in lights
    )  # fmt: skip
