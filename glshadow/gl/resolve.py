"""The resolve pass: one light on every visible surface, added to the picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.spaces import Array
from glshadow.gl.lighting import BRIGHTEST, light_uniforms
from glshadow.gl.program import Program
from glshadow.gl.screen import camera_uniforms, draw_over, surface_textures
from glshadow.gl.sources.source import Receiver
from glshadow.gl.work import Work


@dataclass(frozen=True, eq=False)
class Share:
    """One light's part of a picture.

    Parameters
    ----------
    light : Light
    receiver : Receiver
        How it is asked.
    lit : bool
        False: no light at all, only the ambient term.
    number, count : int
        Which light this is, of how many: the first adds the ambient term, the last writes the display image.
    ambient : (3,) float64
        Linear.
    """

    light: Light
    receiver: Receiver
    lit: bool
    number: int
    count: int
    ambient: Array


def resolve(work: Work, share: Share) -> None:
    """Add a light to the picture."""
    scene, targets, light, asked = work.scene, work.targets, share.light, share.receiver
    first, last = share.number == 0, share.number >= share.count - 1
    program = work.programs.get(
        "pass/resolve.vert",
        "pass/resolve.frag",
        dialect=asked.dialect,
        slots=asked.slots,
        defines={
            **asked.defines,
            "GLS_ORTHO": int(not work.sight.camera.is_perspective),
            "GLS_SUN": int(isinstance(light, DirectionalLight)),
            "GLS_SURFACE": targets.surface.components,
            "GLS_COLORS": 2 if scene.textured else 0 if scene.color is not None else 1,
            "GLS_FIRST": int(first),
            "GLS_LAST": int(last),
            "GLS_SELECTIVE": int(scene.selective),
            "GLS_LIT": int(share.lit),
            "GLS_WEAK": int(light.shadow is not None and light.shadow.strength < 1.0),
            "GLS_VISIBILITY": int(bool(targets.visibility)),
            "GLS_SUM": int(last and targets.linear is not None),
        },
    )
    _set(program, work, share)
    program.bind(**surface_textures(work.samplers, scene, targets), **asked.textures)
    if not first:
        program.bind(u_sum=targets.sums[(share.number - 1) % 2])
    targets.framebuffer(targets.image if last else targets.sums[share.number % 2], share.number).use()
    draw_over(work.context, program, work.sight)
    program.unbind()


def _set(program: Program, work: Work, share: Share) -> None:
    scene, light, asked = work.scene, share.light, share.receiver
    values = {**camera_uniforms(scene, work.sight, asked.axes, asked.offset), **asked.uniforms, **light_uniforms(light)}
    color = np.ones(3) if scene.color is None else np.asarray(scene.color)
    radiance = np.minimum(color * np.asarray(light.color) * light.intensity, BRIGHTEST)
    values |= {"u_ambient": tuple(np.minimum(share.ambient * color, BRIGHTEST)), "u_radiance": tuple(radiance)}
    program.set(**values, u_strength=light.shadow.strength if light.shadow else 1.0)
