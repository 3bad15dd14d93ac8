"""The caster pass: draws shadow casters, seen from a light, into its tiles of the shadow atlas."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.culling import hidden_sides, seen_by
from glshadow.derive.resolved import CasterSettings
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Defines, Program, Programs
from glshadow.gl.passes.atlases import Atlas
from glshadow.gl.passes.capsules import draw_capsule_casters
from glshadow.gl.scene.bodies import hides_back_faces
from glshadow.gl.scene.drawing import Begin, draw_nodes
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.matrices import pack_matrices
from glshadow.gl.scene.meshes import Order
from glshadow.gl.scene.occlusion import OcclusionCulling, can_cull
from glshadow.gl.scene.runs import Whole
from glshadow.lights import Light
from glshadow.shader.slots import metric_slot
from glshadow.shadows.bias import bias_factor
from glshadow.shadows.filters import Filter
from glshadow.shadows.metric import Target, metric_range
from glshadow.shadows.view import ShadowView


@dataclass(frozen=True)
class Map:
    """A light's shadow map: its views, its atlas, and the settings it is drawn and sampled with."""

    views: tuple[ShadowView, ...]
    atlas: Atlas
    settings: CasterSettings
    filter: Filter


def draw_casters(
    context: GLContext, programs: Programs, scene: GpuScene, light: Light, casting: NDArray[np.bool_], shadow_map: Map
) -> int:
    """Draw all views of a light into their tiles, unless the tiles are up to date; returns the number of draws.

    Casters nearer than a view's near plane are clamped to it, not clipped (depth clamp). Nodes (N,) that do not cast or lie outside a
    view are skipped.
    """
    ctx = context.ctx
    atlas, settings, boxes = shadow_map.atlas, shadow_map.settings, scene.corners
    channel = settings.channel
    tiles: tuple[Hashable, ...] = tuple(view.tile for view in shadow_map.views)
    tiles = tiles if channel is None else (*tiles, channel.number)
    key = _content_key(scene, light, casting, shadow_map)
    if atlas.drawn.get(tiles) == key:
        return 0
    previous = atlas.drawn.pop(tiles, None)
    hidden = hidden_sides(settings.faces, hides_back_faces(scene, light, settings.faces))
    culling = None
    # building clusters costs more than drawing a map once
    if previous is not None and previous[0] == scene.identity and can_cull(scene, settings, shadow_map.views):
        culling = OcclusionCulling(context, scene, atlas, settings, hidden)
    if channel is not None:
        atlas.framebuffer.color_mask = channel.mask
    atlas.framebuffer.use()
    draws = 0
    for view in shadow_map.views:
        atlas.framebuffer.depth_mask = channel is None or sum(channel.depth_range) > atlas.unused_depth
        begin_view(context, atlas, view, settings, view.clip.clear_depth if channel is None else 1.0)
        atlas.framebuffer.depth_mask = True
        if channel is not None:  # the fragment shader writes depth, which grows with distance in every convention
            atlas.unused_depth = channel.depth_range[0]
            ctx.depth_func = "<="
        chosen = np.flatnonzero(casting & seen_by(view.clip_from_world, boxes, view))
        if scene.capsules:
            around, chosen = chosen[scene.round[chosen]], chosen[~scene.round[chosen]]
            draws += draw_capsule_casters(context, programs, scene, around, view, settings, metric_uniform(view, 0.0))
        begin = partial(_begin, programs, scene, light, view, settings)
        if culling is None:
            draws += draw_nodes(ctx, scene, chosen, hidden, begin("shared"), Whole(context, scene.count))
        else:
            draws += culling.draw(view, chosen, begin("shared"), begin("clustered"))
    ctx.polygon_offset = (0.0, 0.0)
    ctx.depth_clamp_range = None
    ctx.front_face = "ccw"
    ctx.enable_only(moderngl.NOTHING)
    atlas.drawn[tiles] = key
    return draws


def begin_view(context: GLContext, atlas: Atlas, view: ShadowView, settings: CasterSettings, far: float | None) -> None:
    """Set the state for drawing a view's casters into its tile, and clear the tile and its gutter to a depth; None: keep its content."""
    ctx = context.ctx
    context.gl.clip_control(view.clip.zero_to_one) if context.caps.clip_control else None
    ctx.depth_func = ">=" if view.clip.reversed else "<="
    ctx.enable_only(moderngl.DEPTH_TEST)
    ctx.depth_clamp_range = (0.0, 1.0)
    factor, units = settings.bias.polygon_offset
    ctx.polygon_offset = (view.clip.sign * factor, view.clip.sign * units)
    atlas.framebuffer.viewport = (*view.tile, view.resolution, view.resolution)
    if far is None:
        return
    side = view.resolution + 2 * view.gutter
    cleared = (view.tile[0] - view.gutter, view.tile[1] - view.gutter, side, side)
    atlas.framebuffer.clear(1.0, 1.0, 1.0, 1.0, depth=far, viewport=cleared)


def _content_key(scene: GpuScene, light: Light, casting: NDArray[np.bool_], shadow_map: Map) -> tuple[Hashable, ...]:
    """Cache key of a light's maps: all that they depend on."""
    views = tuple((view.clip_from_world.tobytes(), view.near, view.far, view.clip) for view in shadow_map.views)
    return (scene.identity, shadow_map.settings, light.geometry, casting.tobytes(), views)


def _begin(
    programs: Programs, scene: GpuScene, light: Light, view: ShadowView, settings: CasterSettings, order: Order
) -> Begin:
    clip = pack_matrices(view.clip_from_world @ scene.world_from_origin)
    local = None if settings.target.is_depth else pack_matrices(view.view_from_world @ scene.world_from_origin)
    moves = settings.bias.of_caster is not None

    def begin(node: int) -> tuple[Callable[[int], None], moderngl.VertexArray]:
        gpu, material = scene.meshes[node], scene.nodes[node].mesh.material
        program = caster_program(programs, settings, view, gpu.alpha_test)
        program.set(u_alpha=(material.color[3], gpu.cutoff))
        if gpu.texture is not None:
            program.bind(u_texture=gpu.texture)

        def place(i: int) -> None:
            program.write("u_clip_from_mesh", clip[i])
            if local is not None:
                program.write("u_view_from_mesh", local[i])
            if moves:
                program.set(u_light=_light_in_mesh(light, scene.world_from_origin[i]))

        return place, gpu.vertex_array(program, order)

    return begin


def caster_program(
    programs: Programs, settings: CasterSettings, view: ShadowView, alpha_test: Defines, dialect: str = "core330"
) -> Program:
    """The caster program of a view, with the uniforms set that do not change between draws."""
    target, moved = settings.target, settings.bias.of_caster
    metric = not target.is_depth
    program = programs.get(
        "pass/caster.vert",
        "pass/caster.frag",
        dialect,
        slots={"metric": metric_slot(view.projection)},
        defines={
            "GLS_METRIC": int(metric),
            **alpha_test,
            "GLS_PACKED": int(target is Target.RGBA8),
            "GLS_CLIP_BIAS": int(moved is not None),
            "GLS_CHANNELS": int(settings.channel is not None),
        },
    )
    clip, normal = moved or (0.0, 0.0)
    if settings.channel is not None:
        program.set(u_depth_range=settings.channel.depth_range)
    if metric:
        program.set(u_metric=metric_uniform(view, clip))
    if moved is not None:
        shift = 0.0 if metric else view.clip.sign * clip * bias_factor(view.clip)
        program.set(u_clip_bias=shift, u_normal_bias=normal)
    return program


def metric_uniform(view: ShadowView, bias: float) -> tuple[float, float, float]:
    """Scale, offset and bias of the metric shader for a view."""
    low, high = metric_range(view.projection, view.clip, view.near, view.far)
    sign = 1.0 if view.projection == "cube" else view.clip.sign
    return (sign / (low + high), low / (low + high), bias)


def _light_in_mesh(light: Light, world_from_mesh: Array) -> tuple[float, float, float, float]:
    inverse = np.linalg.pinv(world_from_mesh[:3, :3])  # a flattened node has no inverse
    *place, w = light.place
    x, y, z = inverse @ (np.asarray(place) - w * world_from_mesh[:3, 3])
    return (x, y, z, w)
