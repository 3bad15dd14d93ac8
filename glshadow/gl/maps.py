"""From a light's settings to a place for its map: every None decided, views fitted, tiles laid out."""

from __future__ import annotations

import numpy as np

from glshadow.core.bias import ReceiverPlaneBias
from glshadow.core.fit import SceneFit
from glshadow.core.kernels import Exact
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.metric import Target
from glshadow.core.shadow import Shadow
from glshadow.core.spaces import ClipSpace
from glshadow.core.used import Used
from glshadow.core.view import ShadowView, shadow_views
from glshadow.gl.camera import Sight
from glshadow.gl.caster import CasterSettings, Map, casters_on_others
from glshadow.gl.context import Caps, GLContext
from glshadow.gl.geometry import GpuScene
from glshadow.gl.targets import Atlas, layout
from glshadow.scene.mesh import Scene

_NOT_EXACT = (
    "Exact() asks the triangles of a map of numbers, 4 x 4 texels, not lists of all: not exact, casters thinner than a texel may be "
    "missed, and one point in each pixel; lists need OpenGL 4.3, {} has {:.1f}"
)


def plan(light: Light, scene: Scene, gpu: GpuScene, sight: Sight, caps: Caps, whole: bool) -> Used:
    """Everything about a light's shadow decided; its views are not placed yet. `whole`: with casters that darken nothing."""
    shadow = light.shadow
    if shadow is None:
        return Used()
    if isinstance(shadow.filter, Exact):
        missing = () if caps.compute else (_NOT_EXACT.format(caps.renderer, caps.version_code / 100),)
        return Used(filter=shadow.filter, faces=shadow.faces, fallbacks=_sized(light, shadow) + missing)
    target = shadow.target or Target.DEPTH32F
    clip, fallbacks = _clip(light, shadow, target, caps)
    fallbacks += _sized(light, shadow)
    casting = gpu.casts if whole else casters_on_others(gpu, light)
    views: tuple[ShadowView, ...] = ()
    if casting.any():
        receivers = list(scene.corners) if isinstance(shadow.fit, SceneFit) else sight.receivers
        guard = int(np.ceil(shadow.filter.reach_texels)) + 1
        views = shadow_views(light, receivers, scene.corners[casting].reshape(-1, 3), clip, shadow.resolution, guard)
    return Used(views, shadow.filter, shadow.bias or ReceiverPlaneBias(), target, clip, shadow.faces, 0, fallbacks)


def _sized(light: Light, shadow: Shadow) -> tuple[str, ...]:
    if getattr(light, "radius", 0.0) == 0.0 and getattr(light, "angle", 0.0) == 0.0:
        return ()
    return (f"the light's size is ignored: {shadow.filter!r} knows only points, so its shadow is hard",)


def _clip(light: Light, shadow: Shadow, target: Target, caps: Caps) -> tuple[ClipSpace, tuple[str, ...]]:
    """Reversed 0..1 pays for perspective views in float depth only; a sun's depth is linear."""
    reversed_pays = not isinstance(light, DirectionalLight) and target is Target.DEPTH32F
    wanted = shadow.clip or ClipSpace(True, reversed_pays)
    if not wanted.zero_to_one or caps.clip_control:
        return wanted, ()
    have = ClipSpace(False, wanted.reversed if shadow.clip else False)
    return have, (f"clip {wanted} became {have}: this driver has no glClipControl ({caps.renderer})",)


def place(context: GLContext, atlases: dict[Target, Atlas], plans: list[Used], whole: list[bool]) -> list[Map | None]:
    """One atlas per format, kept in `atlases` while its size holds, and in it the tiles of all lights of that format."""
    maps: list[Map | None] = [None] * len(plans)
    for target in dict.fromkeys(plan.target for plan in plans if plan.target and plan.views):
        which = [i for i, each in enumerate(plans) if each.target is target and each.views]
        views, size = layout([view for i in which for view in plans[i].views], context.caps.max_texture_size)
        atlas = atlases.get(target)
        if atlas is None or atlas.size != size:
            if atlas is not None:
                del atlases[target]
                atlas.release()
            atlas = atlases[target] = Atlas(context, target, size)
        tiles = tuple((view.tile, view.resolution, view.gutter) for view in views)
        if atlas.tiles != tiles:
            atlas.tiles = tiles
            atlas.drawn.clear()
        start = 0
        for i in which:
            each, count = plans[i], len(plans[i].views)
            assert each.bias is not None
            assert each.filter is not None
            settings = CasterSettings(target, each.bias, each.faces)
            maps[i] = Map(views[start : start + count], atlas, settings, each.filter, whole[i])
            start += count
    return maps
