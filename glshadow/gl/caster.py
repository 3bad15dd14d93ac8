"""Draws what casts, seen from a light, into its tiles of the shadow atlas."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.bias import Bias, ClipBias, SlopeScaledBias, bias_factor
from glshadow.core.casting import darkens
from glshadow.core.kernels import Filter
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.metric import Target, metric_range
from glshadow.core.shadow import Faces
from glshadow.core.spaces import Array, project, transform
from glshadow.core.view import ShadowView
from glshadow.gl.context import GLContext
from glshadow.gl.geometry import GpuScene, pack_matrices
from glshadow.gl.program import Defines, Program, Programs
from glshadow.gl.targets import Atlas
from glshadow.shader.slots import metric_slot

_FEW = 12  # triangles of a body that is asked whether it darkens anything
_KEPT = 64  # places of lights for which the answers are kept


@dataclass(frozen=True)
class CasterSettings:
    """What a light's maps are drawn with, every choice made."""

    target: Target
    bias: Bias
    faces: Faces | None


@dataclass(frozen=True)
class Map:
    """A light's shadow map: its views and the atlas that holds them; `whole`: with what casts on nothing."""

    views: tuple[ShadowView, ...]
    atlas: Atlas
    settings: CasterSettings
    filter: Filter
    whole: bool = True


def casters_on_others(scene: GpuScene, light: Light) -> NDArray[np.bool_]:
    """Which nodes (N,) darken anything: not a floor under everything, whose rasterising would cost as much as all the rest."""
    place = (True, light.direction) if isinstance(light, DirectionalLight) else (False, light.position)
    kept = scene.casting.get(place)
    if kept is not None:
        return kept
    casting = scene.casts.copy()
    size = np.linalg.norm(np.ptp(scene.corners, axis=1), axis=1)
    whole = float(np.linalg.norm(np.ptp(scene.corners.reshape(-1, 3), axis=0)))
    for i in np.flatnonzero(casting & (size > 0.5 * whole)):
        mesh = scene.nodes[i].mesh
        if len(mesh.triangles) <= _FEW and len(scene.nodes) > 1:
            triangles = transform(scene.nodes[i].world_from_mesh, mesh.positions)[mesh.triangles]
            casting[i] = darkens(triangles, np.delete(scene.corners, i, axis=0), light)
    if len(scene.casting) >= _KEPT:
        scene.casting.clear()
    scene.casting[place] = casting
    return casting


def draw_casters(context: GLContext, programs: Programs, scene: GpuScene, light: Light, shadow_map: Map) -> int:
    """Draw all views of a light into their tiles, unless they hold just that; returns the number of draws.

    Casters nearer than a view's near plane are clamped to it, not cut (depth clamp). Nodes outside a view are not drawn.
    """
    ctx = context.ctx
    atlas, settings, boxes = shadow_map.atlas, shadow_map.settings, scene.corners
    tiles = tuple(view.tile for view in shadow_map.views)
    source = _source(scene, light, shadow_map)
    if atlas.drawn.get(tiles) == source:
        return 0
    atlas.drawn.pop(tiles, None)
    casting = scene.casts if shadow_map.whole else casters_on_others(scene, light)
    solid = hides_back_faces(scene, light, settings.faces)
    atlas.framebuffer.use()
    draws = 0
    for view in shadow_map.views:
        tile = (*view.tile, view.resolution, view.resolution)
        context.gl.clip_control(view.clip.zero_to_one) if context.caps.clip_control else None
        ctx.depth_func = ">=" if view.clip.reversed else "<="
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_clamp_range = (0.0, 1.0)
        if isinstance(settings.bias, SlopeScaledBias):
            sign = view.clip.sign
            ctx.polygon_offset = (sign * settings.bias.factor, sign * settings.bias.units)
        atlas.framebuffer.viewport = tile
        side = view.resolution + 2 * view.gutter
        cleared = (view.tile[0] - view.gutter, view.tile[1] - view.gutter, side, side)
        atlas.framebuffer.clear(1.0, 1.0, 1.0, 1.0, depth=view.clip.clear_depth, viewport=cleared)
        chosen = np.flatnonzero(casting & seen_by(view.clip_from_world, boxes, view))
        draws += _draw(context, programs, scene, light, view, settings, chosen, solid)
    ctx.polygon_offset = (0.0, 0.0)
    ctx.depth_clamp_range = None
    ctx.front_face = "ccw"
    ctx.enable_only(moderngl.NOTHING)
    atlas.drawn[tiles] = source
    return draws


def _source(scene: GpuScene, light: Light, shadow_map: Map) -> Hashable:
    """All that a light's maps depend on."""
    place = light.direction if isinstance(light, DirectionalLight) else light.position
    views = tuple((view.clip_from_world.tobytes(), view.near, view.far, view.clip) for view in shadow_map.views)
    return (scene.identity, shadow_map.settings, shadow_map.whole, place, views)


def _draw(
    context: GLContext,
    programs: Programs,
    scene: GpuScene,
    light: Light,
    view: ShadowView,
    settings: CasterSettings,
    chosen: NDArray[np.int64],
    solid: NDArray[np.bool_],
) -> int:
    ctx = context.ctx
    clip = pack_matrices(view.clip_from_world @ scene.world_from_origin)
    local = None if settings.target.is_depth else pack_matrices(view.view_from_world @ scene.world_from_origin)
    caster_bias = isinstance(settings.bias, ClipBias) and settings.bias.caster
    hidden = {flag: _cull(settings.faces, flag) for flag in (False, True)}
    solid_list = solid.tolist()
    culled: str | None = None
    previous, program, array = None, None, None
    for i in sorted(chosen.tolist(), key=scene.mesh_number.__getitem__):  # instances one after another
        gpu = scene.meshes[i]
        if gpu is not previous:
            previous, material = gpu, scene.nodes[i].mesh.material
            program = caster_program(programs, settings, view, gpu.alpha_test)
            program.set(u_alpha=(material.color[3], gpu.cutoff))
            array = gpu.vertex_array(program)
            if gpu.texture is not None:
                gpu.texture.use(0)
        assert program is not None
        assert array is not None
        program.write("u_clip_from_mesh", clip[i])
        if local:
            program.write("u_view_from_mesh", local[i])
        if caster_bias:
            program.set(u_light=_light_in_mesh(light, scene.world_from_origin[i]))
        cull = hidden[solid_list[i]]
        if cull is not None and scene.mirrored[i]:  # winding is turned over by the matrix
            cull = "front" if cull == "back" else "back"
        if cull != culled:
            culled = cull
            ctx.enable(moderngl.CULL_FACE) if cull else ctx.disable(moderngl.CULL_FACE)
            ctx.cull_face = cull or "back"
        array.render()
    return len(chosen)


def caster_program(
    programs: Programs, settings: CasterSettings, view: ShadowView, alpha_test: Defines, dialect: str = "core330"
) -> Program:
    """The caster program of a view, its uniforms that do not change from draw to draw set."""
    target, bias = settings.target, settings.bias
    caster_bias = bias if isinstance(bias, ClipBias) and bias.caster else None
    metric = not target.is_depth
    program = programs.get(
        "pass/caster.vert",
        "pass/caster.frag",
        dialect,
        slots={"metric": metric_slot(view.kind)},
        defines={
            "GLS_METRIC": int(metric),
            **alpha_test,
            "GLS_PACKED": int(target is Target.RGBA8),
            "GLS_CLIP_BIAS": int(caster_bias is not None),
        },
    )
    if metric:
        program.set(u_metric=metric_uniform(view, caster_bias.clip if caster_bias else 0.0))
    if caster_bias is not None:
        moved = 0.0 if metric else view.clip.sign * caster_bias.clip * bias_factor(view.clip)
        program.set(u_clip_bias=moved, u_normal_bias=caster_bias.normal)
    return program


def metric_uniform(view: ShadowView, bias: float) -> tuple[float, float, float]:
    """Scale, offset and bias of the metric shader for a view."""
    low, high = metric_range(view.kind, view.clip, view.near, view.far)
    sign = 1.0 if view.kind == "point" else view.clip.sign
    return (sign / (low + high), low / (low + high), bias)


def seen_by(clip_from_world: Array, boxes: Array, view: ShadowView) -> NDArray[np.bool_]:
    """Which boxes (N, 8, 3) may be seen by a view: not wholly beyond one of its sides or its far plane, nor behind a lamp."""
    clip = project(clip_from_world, boxes)
    w = clip[..., 3]
    beyond = (np.abs(clip[..., 0]) > w) & (np.sign(clip[..., 0]) == np.sign(clip[:, :1, 0]))
    above = (np.abs(clip[..., 1]) > w) & (np.sign(clip[..., 1]) == np.sign(clip[:, :1, 1]))
    depth = -(boxes @ view.view_from_world[2, :3] + view.view_from_world[2, 3])
    far = depth > view.far
    behind = w <= 0.0
    outside: NDArray[np.bool_] = beyond.all(1) | above.all(1) | far.all(1) | behind.all(1)
    return ~outside


def hides_back_faces(scene: GpuScene, light: Light, faces: Faces | None) -> NDArray[np.bool_]:
    """Which nodes (N,) may be drawn without their back faces: closed ones that do not contain the light."""
    closed = scene.closed
    if faces is not None or isinstance(light, DirectionalLight):
        return closed
    position = np.asarray(light.position)
    boxes = scene.corners
    inside = ((boxes.min(axis=1) <= position) & (position <= boxes.max(axis=1))).all(axis=1)
    return np.asarray(closed & ~inside)


def _cull(faces: Faces | None, solid: bool) -> str | None:
    """Which side is left out; of a closed mesh the one that looks away, if nothing else was asked for."""
    return {Faces.FRONT: "back", Faces.BACK: "front", Faces.BOTH: None, None: "back" if solid else None}[faces]


def _light_in_mesh(light: Light, world_from_mesh: Array) -> tuple[float, float, float, float]:
    inverse = np.linalg.pinv(world_from_mesh[:3, :3])  # a node squashed flat has no other
    if isinstance(light, DirectionalLight):
        x, y, z = inverse @ -np.asarray(light.direction)
        return (x, y, z, 0.0)
    x, y, z = inverse @ (np.asarray(light.position) - world_from_mesh[:3, 3])
    return (x, y, z, 1.0)
