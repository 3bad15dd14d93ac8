"""The resolve pass: one light on every visible surface, added to the picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import moderngl
import numpy as np

from glshadow.core.spaces import Array
from glshadow.gl.driver.program import Program
from glshadow.gl.frame_context import Work
from glshadow.gl.passes.per_sample import Dense
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.screen import blended, camera_uniforms, draw_over, surface_textures
from glshadow.gl.passes.translucent import Panes
from glshadow.gl.scene.geometry import GpuScene
from glshadow.lights import BRIGHTEST_RADIANCE, Light


@dataclass(frozen=True, eq=False)
class Share:
    """One light's part of a picture.

    Parameters
    ----------
    light : Light
    receiver : Receiver
        How it is asked.
    number, count : int
        Which light this is, of how many: the first adds the ambient term, the last writes the display image.
    ambient : (2, 3) float64
        Linear, from above and from below.
    background : (3,) float64
        Linear: what is seen through surfaces that show nothing but a shadow.
    panes : Panes, optional
        What tints the light.
    """

    light: Light
    receiver: Receiver
    number: int
    count: int
    ambient: Array
    background: Array
    panes: Panes | None = None


def colors_of(scene: GpuScene) -> int:
    """Where passes find the base colour: 0 one for all, 1 per node, 2 per pixel."""
    return 2 if scene.textured else 0 if scene.color is not None else 1


def resolve(work: Work, share: Share, dense: Dense | None = None) -> None:
    """Add a light to the picture, or to the samples of some of its pixels, whose framebuffer is then bound."""
    scene, targets, light, asked = work.scene, work.targets, share.light, share.receiver
    if dense is not None and asked.densely is not None:
        asked = asked.densely(dense)
        share = replace(share, receiver=asked)
    first, last = share.number == 0, share.number >= share.count - 1
    program = work.programs.get(
        "pass/resolve.vert",
        "pass/resolve.frag",
        dialect=asked.dialect,
        slots=asked.slots,
        defines={
            **_common_defines(work, light, asked, dense),
            "GLS_SURFACE": targets.surface.components,
            "GLS_COLORS": colors_of(scene),
            "GLS_FIRST": int(first),
            "GLS_LAST": int(last and dense is None),
            "GLS_HEMISPHERE": int(first and (share.ambient[0] != share.ambient[1]).any()),
            "GLS_WEAK": int(light.shadow is not None and light.shadow.strength < 1.0),
            "GLS_VISIBILITY": int(bool(targets.visibility) if dense is None else dense.visibility),
            "GLS_SUM": int(last and targets.linear is not None and dense is None),
            "GLS_CATCHES": int(scene.catches),
            "GLS_COOKIE": int(light.projected is not None),
            **(share.panes.defines if share.panes else {}),
            **(asked.marks if dense is None and targets.samples > 1 else {}),
        },
    )
    program.set(u_sampled=targets.sampled)
    # each pixel shows the surface of one of its samples, and is shaded where that lies
    _set(program, work, share, (0.0, 0.0) if dense else targets.aside)
    program.bind(**_surface(work), **asked.textures)
    if light.projected is not None:
        program.bind(u_cookie=work.cookies.get(light.projected[0]))
    if share.panes is not None:
        program.bind(u_glass=share.panes.colors, u_glass_depth=(share.panes.depths, work.samplers.plain))
    if dense is not None:
        _draw_dense(program, work, dense)
    else:
        if not first:
            program.bind(u_sum=targets.sums[(share.number - 1) % 2])
        targets.framebuffer(targets.image if last else targets.sums[share.number % 2], share.number).use()
        draw_over(work.context, program, work.sight)
    program.unbind()


def count_seen(work: Work, light: Light, asked: Receiver, dense: Dense | None, weighed: bool = False) -> None:
    """Add 1 wherever a light without size is seen, into the bound framebuffer: over the picture, or over samples of some pixels.

    `weighed`: the cosine at the surface instead of 1, and beside it the cosine wherever it is positive.
    """
    targets = work.targets
    program = work.programs.get(
        "pass/resolve.vert",
        "pass/resolve.frag",
        dialect=asked.dialect,
        slots=asked.slots,
        defines={
            **_common_defines(work, light, asked, dense),
            "GLS_ALONE": 1,
            "GLS_WEIGHED": int(weighed),
        },
    )
    none = np.zeros(3)
    share = Share(light, asked, 0, 1, np.zeros((2, 3)), none)
    _set(program, work, share, (0.0, 0.0) if dense else targets.aside)
    program.bind(**_surface(work), **asked.textures)
    if dense is not None:
        _draw_dense(program, work, dense)
    else:
        draw_over(work.context, program, work.sight, added=True)
    program.unbind()


def _common_defines(work: Work, light: Light, asked: Receiver, dense: Dense | None) -> dict[str, int | str]:
    """Those of light, scene and camera."""
    return {
        **asked.defines,
        "GLS_ORTHO": int(not work.sight.camera.is_perspective),
        "GLS_SUN": int(light.at_infinity),
        "GLS_SELECTIVE": int(work.scene.selective),
        "GLS_ROUNDED": int(work.scene.rounded is not None),
        "GLS_DENSE": int(dense is not None),
        **(dense.defines if dense else {}),
    }


def _surface(work: Work) -> dict[str, Any]:
    """What passes read of the surface; of a smooth one also its triangles' vertices."""
    vertices = {} if work.scene.rounded is None else work.scene.world.textures
    return {**vertices, **surface_textures(work.samplers, work.scene, work.targets)}


def _draw_dense(program: Program, work: Work, dense: Dense) -> None:
    targets = work.targets
    program.set(**dense.uniforms, u_samples=targets.fine.surface.size)
    fine = {"u_surface": targets.fine.surface, "u_camera_depth": (targets.fine.depth, work.samplers.plain)}
    program.bind(**fine, u_pixels=dense.pixels)
    work.context.ctx.enable_only(moderngl.NOTHING)
    with blended(work.context):
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)


def _set(program: Program, work: Work, share: Share, aside: tuple[float, float]) -> None:
    scene, light, asked = work.scene, share.light, share.receiver
    values = {
        **camera_uniforms(scene, work.sight, asked.axes, asked.offset, aside),
        **asked.uniforms,
        **light.uniforms(asked.axes),
    }
    if light.projected is not None:
        world_from_lv = np.eye(4)
        world_from_lv[:3, :3], world_from_lv[:3, 3] = asked.axes.T, scene.origin - asked.axes.T @ asked.offset
        values["u_cookie_from_lv"] = light.projected[1] @ world_from_lv
    if share.panes is not None:
        values |= share.panes.uniforms(asked.axes, asked.offset, scene.origin)
    color = np.ones(3) if scene.color is None else np.asarray(scene.color)
    radiance = np.minimum(color * np.asarray(light.color) * light.intensity, BRIGHTEST_RADIANCE)
    above, below = np.minimum(share.ambient * color, BRIGHTEST_RADIANCE)
    values |= {"u_ambient": tuple(above), "u_ambient_below": tuple(below), "u_radiance": tuple(radiance)}
    values["u_background"] = tuple(share.background)
    program.set(**values, u_strength=light.shadow.strength if light.shadow else 1.0)
