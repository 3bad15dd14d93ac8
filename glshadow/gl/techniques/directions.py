"""Light from many directions: a small shadow map for each in one atlas, and a pass that samples them all."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import ClipSpace
from glshadow.derive.compare import rounding_of
from glshadow.derive.direction_maps import FINE, MOST_SLACK, REACH, DirectionViews, direction_views, rows_of
from glshadow.derive.near_casters import ALL, LARGE, NearCasters, near_casters
from glshadow.derive.resolved import CasterSettings
from glshadow.derive.used import Used
from glshadow.errors import SettingsError
from glshadow.gl.driver.buffers import BufferTexture, texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R32UI, RG32UI, RGBA32F
from glshadow.gl.driver.targets import release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.direction_maps import DirectionAtlas
from glshadow.gl.passes.per_sample import PerSample
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.resolve import count_seen
from glshadow.gl.scene.bodies import casters_among
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.counts import Counts
from glshadow.gl.techniques.technique import Technique, open_receiver
from glshadow.lights import Light
from glshadow.shader.slots import direction_slots, precomputed_slots
from glshadow.shadows.bias import FACET_SLOPE, ReceiverPlaneBias
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import ResolvedShadow

_SMALLEST = 4.0  # texels


class Directions(Technique):
    """One light's maps, and the sums of its light over directions for the pixels of the image and for the samples of collected pixels."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._shadow: ResolvedShadow
        self._atlas = DirectionAtlas(context)
        self._drawn: Hashable = None  # key of what the atlas holds
        self._table: BufferTexture | None = None
        self._towards: BufferTexture | None = None
        self._horizon = np.zeros(3)
        self._written: Hashable = None  # key of what they hold
        self._lights: tuple[Light, ...] = ()
        self._sets, self._length = 1, 0
        self.found: DirectionViews | None = None
        self._coarse: tuple[str, ...] = ()
        self._near: NearCasters | None = None
        self._near_buffers: tuple[BufferTexture, ...] = ()
        self._counted: Hashable = None
        self._image_counts, self._sample_counts = Counts(context), Counts(context)

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Set the light and its settings."""
        assert shadow is not None
        self.light, self._shadow = light, shadow

    def update(self, frame: FrameContext) -> Used:
        """Draw the maps, unless those of this scene and light are kept."""
        scene, shadow = frame.scene, self._shadow
        triangles = int(np.array([gpu.count for gpu in scene.meshes])[scene.casts].sum())
        filter_ = shadow.filter.of_scene(triangles, self.light.per_channel)
        count = filter_.points_of_light
        clip = ClipSpace(frame.caps.clip_control, False)
        settings = CasterSettings(Target.DEPTH32F, ReceiverPlaneBias(), shadow.requested.faces)
        key = (scene.identity, self.light.geometry, count, shadow.resolution, settings)
        draws = 0
        if self._drawn != key:
            self._drawn = self._counted = None
            draws = self._draw(frame, count, clip, settings)
            self._drawn = key
        views = self.found.views if self.found else ()
        why = f"{shadow.why}; {len(views)} maps of {shadow.resolution} x {shadow.resolution}"
        usual = shadow.filter.points_of_light
        if count != usual and self.found:
            why += f", not {usual} since the scene is {'large' if count < usual else 'small'}"
        fallbacks = self._coarse if self.found else ()
        return Used((), filter_, settings.bias, settings.target, clip, settings.faces, draws, fallbacks, why=why)

    def _draw(self, frame: FrameContext, count: int, clip: ClipSpace, settings: CasterSettings) -> int:
        scene = frame.scene
        lights = self.light.hard_lights(count)
        casting = casters_among(scene, lights)
        self.found = None
        if not casting.any():
            return 0
        found = direction_views(lights, scene.corners[casting].reshape(-1, 3), clip, self._shadow.resolution)
        limit = frame.caps.max_texture_size
        if max(found.size) > limit:
            raise SettingsError(
                f"{len(found.views)} maps of {self._shadow.resolution} texels need an atlas of {found.size[0]} x {found.size[1]}, "
                f"the driver's limit is {limit}: lower Shadow.resolution or the count of DirectionMaps"
            )
        draws = self._atlas.draw(frame, self.light, casting, found, settings, self._shadow.filter)
        self._list_near(frame, casting, found, settings)
        self._coarse = self._lost(scene, casting, found.texel)
        self.found, self._lights = found, lights
        return draws

    def _lost(self, scene: GpuScene, casting: NDArray[np.bool_], texel: float) -> tuple[str, ...]:
        """The fallback of maps whose texels are as large as most of what casts."""
        if self._near is not None and self._near.complete:
            return ()
        sizes = np.linalg.norm(np.ptp(scene.corners[casting], axis=1), axis=1)
        counts = np.array([gpu.count for gpu in scene.meshes])[casting]
        small = sizes < _SMALLEST * texel
        if 2 * counts[small].sum() <= counts.sum():
            return ()
        return (
            f"{small.sum()} of {len(small)} casting nodes are smaller than {_SMALLEST:g} texels of the maps, which are {texel:.2g} wide "
            "since they cover all casters: their contact shadows are lost; give a larger Shadow.resolution, or Exact()",
        )

    def _list_near(
        self, frame: FrameContext, casting: NDArray[np.bool_], found: DirectionViews, settings: CasterSettings
    ) -> None:
        """List the opaque triangles that are near receivers."""
        release(*self._near_buffers)
        self._near, self._near_buffers = None, ()
        scene = frame.scene
        if settings.faces is not None or not self.light.wide:  # within one disc maps have many more texels
            return
        plain = casting & ~scene.round & ~np.array([gpu.cut_out for gpu in scene.meshes])
        triangles, places = scene.world.triangles, scene.world.positions
        corners = places[triangles[plain[triangles[:, 3]], :3]]
        few = len(corners) <= ALL
        if not few:  # in float32: most are left out
            corners = corners[np.ptp(corners, axis=1).max(axis=1) > 0.5 * LARGE * found.texel]
        moved = corners.astype(np.float64) - (found.middle - scene.origin)
        alone = bool((plain == casting).all())
        near = near_casters(moved @ self.light.frame((), scene.origin)[:3, :3].T, found.texel, few, alone)
        if near is None or max(len(near.links), len(near.heads)) > frame.caps.max_texture_buffer_size:
            return
        self._near = near
        padded = np.zeros((len(self._near.corners), 3, 4), dtype=np.float32)
        padded[..., :3] = self._near.corners
        made = ((self._near.heads, RG32UI), (self._near.links, R32UI), (padded.reshape(-1, 4), RGBA32F))
        self._near_buffers = tuple(texture_buffer(self._context, data, format_) for data, format_ in made)

    def _write_table(self, frame: FrameContext) -> None:
        """Upload the rows of the directions that each pixel samples."""
        assert self.found is not None
        fine = int(np.prod(frame.camera_view.size)) >= FINE
        key = (self._drawn, fine)
        if self._written == key:
            return
        axes = self.light.frame((), frame.scene.origin)[:3, :3]
        rows = rows_of(
            self.found, self._lights, axes, self.light.per_channel, fine, self._shadow.filter.points_of_light
        )
        self._sets, self._length = rows.shape[:2]
        release(self._table, self._towards)
        self._table = self._towards = self._written = None
        self._table = texture_buffer(self._context, rows.reshape(-1, 4), RGBA32F)
        towards = np.zeros((self._sets * self._length, 4), dtype=np.float32)
        towards[:, :3] = np.cross(rows[:, :, 0, :3], rows[:, :, 1, :3]).reshape(-1, 3)
        self._towards = texture_buffer(self._context, towards, RGBA32F)
        axis = towards[:, :3].sum(axis=0)
        axis /= max(float(np.linalg.norm(axis)), 1e-30)
        self._horizon = axis if (towards[:, :3] @ axis).min() > 0.0 else np.zeros(3)
        self._written = key

    @property
    def _weights(self) -> int:
        return 2 if self.light.per_channel else 1

    def receiver(self, frame: FrameContext) -> Receiver:
        """A receiver that reads the sums. They are computed again only if light, scene or camera view changed since the last frame."""
        if self.found is None:
            return open_receiver(frame, self.light)
        self._write_table(frame)
        key = (self._drawn, frame.camera_view, frame.targets.identity)
        if self._counted != key:
            self._counted = None
            self._count(frame, self._image_counts, None)
            self._counted = key
        pattern = self._counts_receiver(frame, self._image_counts)
        if self._sets > 1:
            pattern = replace(
                pattern,
                defines={**pattern.defines, "GLS_PATTERN": self._sets},
                uniforms={**pattern.uniforms, "u_pixel": frame.camera_view.pixel(1.0)},
            )
        return replace(pattern, per_sample=lambda per_sample: self._per_sample_receiver(frame, per_sample))

    def _per_sample_receiver(self, frame: FrameContext, per_sample: PerSample) -> Receiver:
        self._count(frame, self._sample_counts, per_sample)
        assert per_sample.framebuffer is not None
        per_sample.framebuffer.use()
        return self._counts_receiver(frame, self._sample_counts)

    def _count(self, frame: FrameContext, counts: Counts, per_sample: PerSample | None) -> None:
        counts.use(frame, per_sample, 4, "f4", self._weights)
        for number in range(self._weights):
            self._context.gl.clear_floats(number, (0.0,) * 4)
        count_seen(frame, self.light, self._sampling_receiver(frame), per_sample, self._weights, added=False)

    def _sampling_receiver(self, frame: FrameContext) -> Receiver:
        """The receiver of the pass that samples the maps."""
        found, atlas = self.found, self._atlas
        assert found is not None
        receiver = open_receiver(frame, self.light)
        middle = receiver.axes @ (found.middle - frame.scene.origin) + receiver.offset
        view = frame.camera_view
        reach = float(np.abs(view.eye - frame.scene.origin).max()) + view.reach
        near_uniforms: dict[str, tuple[float, ...]] = {}
        if self._near is not None:
            rounding = 2.0 * rounding_of(reach) + 1e-6 * found.radius
            near_uniforms = {
                "u_near_horizon": (*self._horizon, rounding if self._horizon.any() else -1.0),
                "u_near_grid": (*self._near.low, 1.0 / self._near.cell),
                "u_near_cells": self._near.shape,
                "u_near_reach": (found.texel, rounding, self._near.reach),
            }
        return replace(
            receiver,
            slots=direction_slots(),
            defines={
                "GLS_DIRECTIONS": self._length,
                "GLS_SETS": self._sets,
                "GLS_BITS": int(atlas.in_bits),
                "GLS_NEAR": int(self._near is not None),
            },
            uniforms={
                **near_uniforms,
                "u_ball": (*middle, found.radius),
                "u_direction_slack": (FACET_SLOPE, REACH, MOST_SLACK),
                "u_direction_map": (self._shadow.resolution - 1.0, rounding_of(reach)),
            },
            textures={
                "u_directions": self._table,
                "u_maps": (atlas.texture, frame.samplers.plain),
                **dict(zip(("u_near_heads", "u_near_links", "u_near_corners"), self._near_buffers, strict=False)),
                **({"u_towards": self._towards} if self._near is not None else {}),
            },
        )

    def _counts_receiver(self, frame: FrameContext, counts: Counts) -> Receiver:
        return replace(
            open_receiver(frame, self.light),
            slots=precomputed_slots(self.light),
            defines={"GLS_WEIGHED": self._weights},
            textures=dict(zip(("u_counts", "u_unshadowed"), counts.textures, strict=False)),
        )

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._atlas, self._table, self._towards, *self._near_buffers, self._image_counts, self._sample_counts)
