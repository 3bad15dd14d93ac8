"""The resolve pass: shades every visible surface with one light and adds it to the image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import moderngl
import numpy as np

from glshadow.core.spaces import Array
from glshadow.gl.driver.program import Program
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.per_sample import PerSample
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.screen import blended, camera_uniforms, draw_over, surface_textures
from glshadow.gl.passes.translucent import Tint
from glshadow.gl.scene.geometry import GpuScene
from glshadow.lights import BRIGHTEST_RADIANCE, Light
from glshadow.lights.table import LightTable


@dataclass(frozen=True, eq=False)
class Share:
    """One light's contribution to an image.

    Parameters
    ----------
    light : Light
    receiver : Receiver
        Finds its visibility.
    number, count : int
        Index of this light, and how many there are: the first adds the ambient term, the last writes the display image.
    ambient : (2, 3) float64
        Linear, from above and from below.
    background : (3,) float64
        Linear: seen through shadow catchers.
    tint : Tint, optional
        Translucent casters that colour the light.
    tone, white, scale
        As of `Look`.
    """

    light: Light
    receiver: Receiver
    number: int
    count: int
    ambient: Array
    background: Array
    tint: Tint | None = None
    tone: str = "none"
    white: float = 1.0
    scale: float = 1.0

    @property
    def tone_defines(self) -> dict[str, int | str]:
        """Defines of lib/tone.glsl."""
        return {"GLS_TONE": int(self.tone != "none"), "GLS_EXPOSED": int(self.scale != 1.0)}


def colors_of(scene: GpuScene) -> int:
    """Source of the base colour: 0 one for all, 1 per node, 2 per pixel."""
    return 2 if scene.textured else 0 if scene.color is not None else 1


def resolve(frame: FrameContext, share: Share, per_sample: PerSample | None = None) -> None:
    """Add a light to the image, or to the samples of some pixels, whose framebuffer must be bound."""
    scene, targets, light, receiver = frame.scene, frame.targets, share.light, share.receiver
    if per_sample is not None and receiver.per_sample is not None:
        receiver = receiver.per_sample(per_sample)
        share = replace(share, receiver=receiver)
    first, last = share.number == 0, share.number >= share.count - 1
    program = frame.programs.get(
        "pass/resolve.vert",
        "pass/resolve.frag",
        dialect=receiver.dialect,
        slots=receiver.slots,
        defines={
            **_common_defines(frame, light, receiver, per_sample),
            "GLS_SURFACE": targets.surface.components,
            "GLS_COLORS": colors_of(scene),
            **scene.features.defines(scene.channels),
            "GLS_FIRST": int(first),
            "GLS_LAST": int(last and per_sample is None),
            "GLS_HEMISPHERE": int(first and (share.ambient[0] != share.ambient[1]).any()),
            "GLS_WEAK": int(light.shadow is not None and light.shadow.strength < 1.0),
            "GLS_VISIBILITY": int(bool(targets.visibility) if per_sample is None else per_sample.visibility),
            "GLS_SUM": int(last and targets.linear is not None and per_sample is None),
            "GLS_CATCHES": int(scene.catches),
            "GLS_COOKIE": int(light.projected is not None),
            "GLS_METERED": int(first and scene.features.emits and share.white != 1.0),
            **(share.tone_defines if last and per_sample is None else {}),
            **(share.tint.defines if share.tint else {}),
            **(receiver.marks if per_sample is None and targets.samples > 1 else {}),
        },
    )
    program.set(u_sampled=targets.sampled, u_exposure=share.scale, u_white=share.white)
    # each pixel shows the surface of one of its samples and is shaded at that sample's position
    _set(program, frame, share, (0.0, 0.0) if per_sample else targets.aside)
    program.bind(**_surface(frame), **receiver.textures)
    if light.projected is not None:
        program.bind(u_cookie=frame.cookies.get(light.projected[0]))
    if light.tables:
        program.bind(**{name: partial(_table, frame, made) for name, made in light.tables.items()})
    if share.tint is not None:
        program.bind(u_tint=share.tint.texture)
    if per_sample is not None:
        _draw_per_sample(program, frame, per_sample)
    else:
        if not first:
            program.bind(u_sum=targets.sums[(share.number - 1) % 2])
        targets.framebuffer(targets.image if last else targets.sums[share.number % 2], share.number).use()
        draw_over(frame.context, program, frame.camera_view)
    program.unbind()


def _table(frame: FrameContext, made: Callable[[], LightTable]) -> moderngl.Texture:
    return frame.cookies.get_table(made())


def count_seen(
    frame: FrameContext,
    light: Light,
    receiver: Receiver,
    per_sample: PerSample | None,
    weights: int = 0,
    added: bool = True,
) -> None:
    """Add 1 to the bound framebuffer wherever a light without size is visible: for the image, or for samples of some pixels.

    `weights` 1: add the cosine at the surface instead of 1, and in a second channel the cosine wherever it is positive. 2: add these times
    the light's colour, to two colours of the framebuffer. Not `added`: write what the receiver's defines say.
    """
    defines: dict[str, int | str] = {"GLS_ALONE": 1, "GLS_WEIGHED": weights}
    _draw_alone(frame, light, receiver, per_sample, defines, (2 if weights == 2 else 1) if added else 0)


def write_visibility(frame: FrameContext, light: Light, receiver: Receiver) -> None:
    """Write the visibility that an image would show to the bound framebuffer."""
    _draw_alone(frame, light, receiver, None, {"GLS_ALONE": 2}, 0)


def _draw_alone(
    frame: FrameContext, light: Light, receiver: Receiver, per_sample: PerSample | None, defines: dict[str, int | str],
    added: int,
) -> None:  # fmt: skip
    """Draw without an image. `added`: colours to blend."""
    targets = frame.targets
    program = frame.programs.get(
        "pass/resolve.vert",
        "pass/resolve.frag",
        dialect=receiver.dialect,
        slots=receiver.slots,
        defines={
            **_common_defines(frame, light, receiver, per_sample),
            **defines,
        },
    )
    none = np.zeros(3)
    share = Share(light, receiver, 0, 1, np.zeros((2, 3)), none)
    _set(program, frame, share, (0.0, 0.0) if per_sample else targets.aside)
    if defines.get("GLS_WEIGHED") == 2:  # without the base colour
        program.set(u_radiance=light.color)
    program.bind(**_surface(frame), **receiver.textures)
    if light.tables:
        program.bind(**{name: partial(_table, frame, made) for name, made in light.tables.items()})
    if per_sample is not None:
        _draw_per_sample(program, frame, per_sample, added)
    else:
        draw_over(frame.context, program, frame.camera_view, added=added)
    program.unbind()


def _common_defines(
    frame: FrameContext, light: Light, receiver: Receiver, per_sample: PerSample | None
) -> dict[str, int | str]:
    """Defines of light, scene and camera."""
    return {
        **receiver.defines,
        "GLS_ORTHO": int(not frame.camera_view.camera.is_perspective),
        "GLS_AT_INFINITY": int(light.at_infinity),
        "GLS_SELECTIVE": int(frame.scene.selective),
        "GLS_ROUNDED": int(frame.scene.rounded is not None),
        "GLS_CAPSULES": frame.scene.capsules,
        "GLS_POINTS": frame.targets.points,
        "GLS_PER_SAMPLE": int(per_sample is not None),
        **(per_sample.defines if per_sample else {}),
    }


def _surface(frame: FrameContext) -> dict[str, Any]:
    """Textures of the surface; for smooth surfaces and capsules also the triangles' vertices."""
    needed = frame.scene.rounded is not None or frame.scene.capsules
    vertices = frame.scene.world.textures if needed else {}
    return {**vertices, **surface_textures(frame.samplers, frame.scene, frame.targets)}


def _draw_per_sample(program: Program, frame: FrameContext, per_sample: PerSample, colors: int = 1) -> None:
    targets = frame.targets
    program.set(**per_sample.uniforms, u_samples=targets.fine.surface.size)
    fine = {"u_surface": targets.fine.surface, "u_camera_depth": (targets.fine.depth, frame.samplers.plain)}
    program.bind(**fine, u_pixels=per_sample.pixels)
    if targets.fine.emission is not None:
        program.bind(u_emission=targets.fine.emission)
    frame.context.ctx.enable_only(moderngl.NOTHING)
    with blended(frame.context, colors):
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)


def _set(program: Program, frame: FrameContext, share: Share, aside: tuple[float, float]) -> None:
    scene, light, receiver = frame.scene, share.light, share.receiver
    values = {
        **camera_uniforms(scene, frame.camera_view, receiver.axes, receiver.offset, aside),
        **receiver.uniforms,
        **light.uniforms(receiver.axes),
    }
    if light.projected is not None:
        world_from_lv = np.eye(4)
        world_from_lv[:3, :3], world_from_lv[:3, 3] = receiver.axes.T, scene.origin - receiver.axes.T @ receiver.offset
        values["u_cookie_from_lv"] = light.projected[1] @ world_from_lv
    if share.tint is not None:
        values |= share.tint.uniforms(receiver.axes, receiver.offset, scene.origin)
    color = np.ones(3) if scene.color is None else np.asarray(scene.color)
    radiance = np.minimum(color * np.asarray(light.color) * light.intensity, BRIGHTEST_RADIANCE)
    above, below = np.minimum(share.ambient * color, BRIGHTEST_RADIANCE)
    values |= {"u_ambient": tuple(above), "u_ambient_below": tuple(below), "u_radiance": tuple(radiance)}
    values["u_light"] = tuple(np.minimum(np.asarray(light.color) * light.intensity, BRIGHTEST_RADIANCE))
    values["u_background"] = tuple(share.background)
    program.set(**values, u_strength=light.shadow.strength if light.shadow else 1.0)
