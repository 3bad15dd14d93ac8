"""Mapped: a light's shadow map, fitted, drawn, kept and sampled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, transform
from glshadow.derive.compare import map_uniforms, rounding_of
from glshadow.derive.resolved import ResolvedSettings, resolve_settings
from glshadow.derive.used import Used
from glshadow.errors import warn
from glshadow.gl.driver.context import Caps, GLContext
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.atlases import Place
from glshadow.gl.passes.caster import Map, draw_casters
from glshadow.gl.passes.depth_tiles import find_depth_tiles
from glshadow.gl.passes.readback import pixels
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.scene.bodies import casters_seen
from glshadow.gl.techniques.technique import Technique, fetching_dialect, frame_of, open_receiver
from glshadow.lights import Light
from glshadow.shader.slots import Compare, Shape, mapped_defines, mapped_slots
from glshadow.shadows.filters import Filter
from glshadow.shadows.fit_request import FitRequest
from glshadow.shadows.metric import Target, unpack
from glshadow.shadows.shadow import ResolvedShadow
from glshadow.shadows.view import ShadowView

MOST_PIXELS = 2.0**16
"""Warn above this side of a map, in pixels of the nearest receiver: one texel of a 2048 map then spans 32 pixels."""


class Mapped(Technique):
    """One light's shadow map. There is none if no receiver of it is in view."""

    def __init__(self, context: GLContext) -> None:
        self.map: Map | None = None
        self._place: Place | None = None
        self._settings: ResolvedSettings
        self._request: FitRequest
        self._casting: NDArray[np.bool_]
        self._shaded: Array | None = None
        self._looked_at = -1  # identity of the scene whose texel size was checked last

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Resolve the settings and fit the views."""
        assert shadow is not None
        self.light, self._why = light, shadow.why
        caps, scene = frame.caps, frame.scene
        self._settings = settings = resolve_settings(light, shadow, caps.clip_control, caps.renderer)
        self._casting = scene.casts
        if settings.caster.bias.certain:  # no self-shadowing: casters that darken nothing else can be skipped
            self._casting = casters_seen(scene, light, frame.camera_view)
        self._place = self.map = None
        if not self._casting.any():
            return
        camera_view, reach = frame.camera_view, shadow.filter.reach_texels + settings.caster.bias.shift_texels
        self._request = FitRequest(
            light, scene.corners, scene.boxes, camera_view.receivers, scene.corners[self._casting].reshape(-1, 3),
            camera_view.camera, camera_view.size, camera_view.near, camera_view.far, settings.clip,
            shadow.resolution, int(np.ceil(reach)) + 1, settings.fine,
        )  # fmt: skip
        fitted = settings.fit.fitted(self._request)
        self._shaded = fitted.shaded
        if fitted.views:
            self._place = frame.atlases.allocate(settings.caster.target, fitted.views, settings.caster.channel)

    def update(self, frame: FrameContext) -> Used:
        """Draw the map."""
        draws, settings, caster = 0, self._settings, self._settings.caster
        if self._place is not None:
            views, atlas = self._place()
            if settings.fit.measures and frame.measured:
                views = self._measured(frame, views)
            self.map = Map(views, atlas, caster, settings.filter)
            draws = draw_casters(frame.context, frame.programs, frame.scene, self.light, self._casting, self.map)
            if self._looked_at != frame.scene.identity and frame.measured:
                self._looked_at = frame.scene.identity
                self._warn_of_large_texels(frame, self.map.views[0])
        views = self.map.views if self.map else ()
        return Used(
            views,
            settings.filter,
            caster.bias,
            caster.target,
            settings.clip,
            caster.faces,
            draws,
            settings.fallbacks + self._too_small(),
            why=self._why,
        )

    def _too_small(self) -> tuple[str, ...]:
        """The fallback of a bias too small to prevent self-shadowing of planes, where that can be told."""
        if self.map is None or self._settings.filter.encoding:  # the mean depth of a plane lies on the plane
            return ()
        texel = max(
            max(view.texel) * (1.0 if view.projection == "orthographic" else view.far) for view in self.map.views
        )
        said = self._settings.caster.bias.shortfall(self._settings.filter.reach_texels, texel)
        return (said,) if said else ()

    def _measured(self, frame: FrameContext, placed: tuple[ShadowView, ...]) -> tuple[ShadowView, ...]:
        """Views fitted to the depth that the camera really sees, in the tiles that were allocated."""
        fitted = self._settings.fit.fitted(replace(self._request, depth_tiles=find_depth_tiles(frame)))
        self._shaded = fitted.shaded
        return tuple(view.placed(there.tile) for view, there in zip(fitted.views, placed, strict=False)) or placed

    def _warn_of_large_texels(self, frame: FrameContext, view: ShadowView) -> None:
        """Warn once per scene if the map covers so much that casters near the camera may fall between its texels."""
        bodies = [points for points in frame.camera_view.receivers if len(points)]
        if not bodies:
            return
        seen = np.concatenate(bodies)
        camera = frame.camera_view.camera.view_from_world
        least = max(float((-(seen @ camera[2, :3] + camera[2, 3])).min()), frame.camera_view.near)
        if _side(frame, view, seen, least) <= MOST_PIXELS:
            return
        window = pixels(
            frame.targets.depth, np.float32
        )  # boxes may be nearer than their content: read the depth buffer
        surface = window != frame.camera_view.clip.clear_depth
        if not surface.any():
            return
        side = _side(
            frame, view, seen, float(np.quantile(frame.camera_view.depth(window[surface].astype(np.float64)), 0.01))
        )
        if side > MOST_PIXELS:
            warn(
                f"a texel of the light's {view.resolution} map is as wide as {side / view.resolution:.0f} pixels of what is nearest to the "
                "camera: shadows there may be lost; use Exact(), a larger resolution, or a smaller scene",
                stacklevel=6,
            )

    def receiver(self, frame: FrameContext) -> Receiver:
        """A receiver that samples the map."""
        if self.map is None:
            return open_receiver(frame, self.light)
        scene, caps = frame.scene, frame.caps
        axes, offset = frame_of(self.light.frame(self.map.views, scene.origin), scene.origin)
        reach = max(self._reach(frame), float(np.abs(offset).max()))
        compared = frame.samplers.nearer_reversed if self.map.views[0].clip.reversed else frame.samplers.nearer
        raw = (caps.texture_gather and caps.software) or self.map.filter.reads_depths
        sampler = frame.samplers.plain if raw else compared
        plain = self.map.filter.encoding or not self.map.settings.target.is_depth
        return Receiver(
            map_slots(self.light, self.map, caps),
            axes,
            offset,
            map_defines(self.light, self.map),
            fetching_dialect(caps.texture_gather),
            {
                **uniforms_of(self.map, rounding_of(reach)),
                "u_size": size_in_texels(self.light, self.map),
                "u_falloff": falloff_of(self.light),
            },
            {"u_map": (self.map.atlas.texture, None if plain else sampler)},
        )

    def marking_receiver(self, frame: FrameContext) -> Receiver:
        """Mark pixels if a texel may be smaller than a pixel. Prefiltered maps need no marks: their mip level has the pixel's size."""
        receiver = self.receiver(frame)
        if self.map is None or self.map.filter.encoding:
            return receiver
        return replace(receiver, marks={"GLS_MARKS": 1}, collected={"GLS_MARKED": 1})

    def _reach(self, frame: FrameContext) -> float:
        """Largest coordinate in the computation of a receiver's position in the map: eye, ray x depth, and their sum."""
        camera_view, origin = frame.camera_view, frame.scene.origin
        eye = float(np.abs(camera_view.eye - origin).max())
        if self._shaded is None:
            return eye + camera_view.reach
        return 2.0 * eye + float(np.abs(self._shaded - origin).max())

    def stored(self) -> NDArray[np.float32]:
        """The map's views as arrays; RGBA8 is unpacked."""
        return super().stored() if self.map is None else stored_values(self.map)


def _side(frame: FrameContext, view: ShadowView, seen: Array, depth: float) -> float:
    """Side of the map in pixels at a view depth: where it is nearest to the light, or anywhere for a directional light."""
    away = 1.0
    if view.projection != "orthographic":
        away = float(np.linalg.norm(transform(view.view_from_world, seen), axis=1).min())
    return max(view.texel) * away * view.resolution / frame.camera_view.pixel(depth)


def map_slots(light: Light, shadow_map: Map, caps: Caps) -> dict[str, str]:
    """Snippets that sample a map."""
    settings, compare = shadow_map.settings, compared_by(shadow_map.settings.target, shadow_map.filter, caps)
    return mapped_slots(light, settings.target, settings.bias, shadow_map.filter, compare, shape_of(shadow_map))


def compared_by(target: Target, filter: Filter, caps: Caps) -> Compare:
    """How this driver reads the target for the filter."""
    if not target.is_depth:
        return "metric"
    if filter.reads_depths:
        return "depth_gather_raw" if caps.texture_gather else "depth_taps_raw"
    if not caps.texture_gather:
        return "depth_taps"
    return "depth_gather_raw" if caps.software else "depth_gather"


def shape_of(shadow_map: Map) -> Shape:
    """Layout of a directional light's map."""
    view = shadow_map.views[0]
    return "cascades" if view.cascade else "plain" if view.warp is None else "warped"


def cascades_of(shadow_map: Map) -> int:
    """Number of cascades; 0: one view, or the faces of a point light."""
    return len(shadow_map.views) if shadow_map.views[0].cascade else 0


def falloff_of(light: Light) -> float:
    """Distance from the map's border at which the shadow starts to fade; 0 for a point light."""
    return 0.0 if light.shadow is None or light.projection == "cube" else light.shadow.edge_falloff


def size_in_texels(light: Light, shadow_map: Map) -> tuple[float, float]:
    """Texels by which a shadow edge widens per unit of nearness, see glsl/depth."""
    x, y = shadow_map.views[0].texel
    scale = abs(uniforms_of(shadow_map, 0.0)["u_base"][0])
    return light.source_radius / (scale * x), light.source_radius / (scale * y)


def map_defines(light: Light, shadow_map: Map) -> Mapping[str, int | str]:
    """Defines of these snippets."""
    settings = shadow_map.settings
    reversed_depth = (
        settings.target.is_depth and shadow_map.views[0].clip.reversed
    )  # a metric always grows with distance
    bounded = shadow_map.views[0].inset > 0
    cascade = shadow_map.views[0].cascade
    by_depth = cascade is not None and cascade.by_depth
    defines = mapped_defines(light, settings.target, settings.bias, shadow_map.filter, reversed_depth, bounded)
    if falloff_of(light) > 0.0 and cascade is None:
        defines |= {"GLS_FALLOFF": 1, "GLS_BOUNDED": 1}
    channel = settings.channel
    if channel is not None:
        return {**defines, "GLS_CHANNEL": channel.number}
    several = {"GLS_CASCADES": cascades_of(shadow_map), "GLS_BY_DEPTH": int(by_depth)}
    return {**defines, **several} if cascade is not None else defines


def uniforms_of(shadow_map: Map, rounding: float) -> dict[str, Any]:
    """Uniforms of these snippets, see `derive.compare.map_uniforms`."""
    settings = shadow_map.settings
    size = shadow_map.atlas.size
    return map_uniforms(shadow_map.views, size, settings.target, settings.bias, shadow_map.filter, rounding)


def stored_values(shadow_map: Map) -> NDArray[np.float32]:
    """A map's views (V, R, R) as they are stored, row 0 at v = 1; RGBA8 is unpacked."""
    texture, target = shadow_map.atlas.texture, shadow_map.settings.target
    channel = shadow_map.settings.channel.number if shadow_map.settings.channel else 0
    if target is Target.RGBA8:
        values = np.minimum(unpack(pixels(texture, np.uint8) / 255.0), 1.0)
    elif target is Target.R8:
        values = pixels(texture, np.uint8)[..., channel] / 255.0
    else:
        values = pixels(texture, np.float16 if target is Target.R16F else np.float32)[..., channel]
    height = len(values)
    tiles = []
    for view in shadow_map.views:
        x, y = view.tile
        tiles.append(values[height - y - view.resolution : height - y, x : x + view.resolution])
    return np.stack(tiles).astype(np.float32)
