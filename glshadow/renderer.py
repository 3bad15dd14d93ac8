"""Renderer: the one place where a picture comes together. Camera pass, then light by light: draw its map, resolve, add up."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.bias import ReceiverPlaneBias
from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.fit import SceneFit, frustum_corners, visible_corners
from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.metric import Target, metric_range, projected_metric
from glshadow.core.shadow import Shadow
from glshadow.core.spaces import Array, ClipSpace, finite_vector, perspective
from glshadow.core.view import ShadowView, shadow_views
from glshadow.errors import GlshadowError, SceneError, SettingsError
from glshadow.frame import OUTPUTS, Frame, Used
from glshadow.gl.caster import CasterSettings, casters, draw_casters
from glshadow.gl.context import Backend, GLContext, open_context
from glshadow.gl.geometry import GpuScene, Meshes, pack_matrices
from glshadow.gl.program import UNITS, Program, Programs
from glshadow.gl.receiver import (
    Map,
    comparison_sampler,
    light_view,
    receiver_defines,
    receiver_slots,
    set_light,
    set_receiver,
)
from glshadow.gl.targets import Atlas, CameraTargets, layout
from glshadow.scene.mesh import AlphaMode, Scene, box_corners, warn

NEAREST_SHARE = 1e-5  # of the camera's far plane: how close a derived near plane comes


@dataclass(frozen=True)
class _Eye:
    """A camera at one size, its depth range decided."""

    camera: PerspectiveCamera
    size: tuple[int, int]
    near: float
    far: float
    clip: ClipSpace

    @property
    def clip_from_view(self) -> Array:
        return perspective(*self.camera.window(self.size), self.near, self.far, self.clip)


class Renderer:
    """Renders scenes with shadows in an OpenGL context of its own, or in a given one.

    Parameters
    ----------
    backend : {"auto", "egl", "osmesa", "window"}
        How to get a headless context; auto tries them in this order.
    context : moderngl.Context, optional
        A context of the calling program: never released, and given back the state it had.

    Raises
    ------
    ContextError
        If there is no usable context: names every attempt and its remedy.
    """

    def __init__(self, backend: Backend = "auto", context: moderngl.Context | None = None) -> None:
        self._context = open_context(backend, context)
        with self._context.drawing():
            ctx = self._context.ctx
            self._programs = Programs(self._context)
            self._meshes = Meshes(self._context)
            self._samplers = {flag: comparison_sampler(ctx, flag) for flag in (False, True)}
            self._plain = ctx.sampler(filter=(moderngl.NEAREST, moderngl.NEAREST), repeat_x=False, repeat_y=False)
            self._idle = ctx.simple_framebuffer((1, 1))
            self._idle.use()
        self._scene: GpuScene | None = None
        self._targets: CameraTargets | None = None
        self._atlases: dict[Target, Atlas] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Free what the renderer owns on the GPU, and its context if it is its own. May be called twice."""
        if self._context.released:
            return
        with self._context.drawing():
            for thing in (self._programs, self._meshes, self._scene, self._targets, *self._atlases.values()):
                if thing is not None:
                    thing.release()
            for thing in (*self._samplers.values(), self._plain, self._idle):
                thing.release()
        self._atlases.clear()
        self._context.release()

    @property
    def info(self) -> dict[str, Any]:
        """Backend, driver and its limits."""
        return dict(vars(self._context.caps))

    def render(
        self,
        scene: Scene,
        camera: PerspectiveCamera | None = None,
        lights: Sequence[Light] | None = None,
        size: tuple[int, int] = (1280, 720),
        ambient: float | ArrayLike = 0.1,
        background: ArrayLike = (0.0, 0.0, 0.0),
        outputs: Sequence[str] = ("image", "visibility"),
    ) -> Frame:
        """One picture.

        Parameters
        ----------
        scene : Scene
        camera, lights : optional
            None: the scene's own.
        size : (2,) ints
            Width and height in pixels.
        ambient : float or (3,) floats
            Linear light that reaches every surface from everywhere.
        background : (3,) floats
            sRGB, 0..1.
        outputs : sequence of str
            What to read back: "image", "visibility", "linear", "depth", "depth_metric", "triangle", "shadow_maps", "timings".

        Raises
        ------
        SettingsError, SceneError, ResourceError, ShaderError
            Named errors; never a blank picture.
        """
        if self._context.released:
            raise GlshadowError("this renderer was released: make a new one")
        camera, lights = _checked(scene, camera, lights, size, outputs)
        ambient_rgb = finite_vector("ambient", np.broadcast_to(np.asarray(ambient, dtype=np.float64), (3,)))
        background_rgb = finite_vector("background", background)
        with self._context.drawing(), _Frame(self, scene, camera, lights, size, outputs) as work:
            return work.run(ambient_rgb, background_rgb)


def _checked(
    scene: Scene,
    camera: PerspectiveCamera | None,
    lights: Sequence[Light] | None,
    size: tuple[int, int],
    outputs: Sequence[str],
) -> tuple[PerspectiveCamera, tuple[Light, ...]]:
    if not isinstance(scene, Scene):
        raise SceneError(f"render needs a glshadow.Scene (see glshadow.load), got {type(scene).__name__}")
    if camera is not None and not isinstance(camera, PerspectiveCamera):
        raise SettingsError(f"camera must be a glshadow.PerspectiveCamera or None, got {camera!r}")
    if isinstance(lights, DirectionalLight | SpotLight | PointLight):
        lights = (lights,)
    lights = scene.lights if lights is None else tuple(lights)
    for light in lights:
        if not isinstance(light, DirectionalLight | SpotLight | PointLight):
            raise SettingsError(f"lights must be DirectionalLight, SpotLight or PointLight, got {light!r}")
    if len(size) != 2 or not all(isinstance(n, int | np.integer) and n >= 1 for n in size):
        raise SettingsError(f"size must be two positive integers (width, height), got {size!r}")
    unknown = set(outputs) - set(OUTPUTS)
    if unknown or not outputs:
        raise SettingsError(f"outputs must be some of {', '.join(OUTPUTS)}, got {list(outputs)!r}")
    return scene.camera if camera is None else camera, lights


class _Frame(contextlib.AbstractContextManager["_Frame"]):
    """The work of one frame, and its clock."""

    def __init__(
        self,
        renderer: Renderer,
        scene: Scene,
        camera: PerspectiveCamera,
        lights: tuple[Light, ...],
        size: tuple[int, int],
        outputs: Sequence[str],
    ) -> None:
        self.r, self.context, self.ctx = renderer, renderer._context, renderer._context.ctx
        self.scene, self.lights, self.outputs = scene, lights, set(outputs)
        self.caps = self.context.caps
        self.timings: dict[str, float] = {}
        self.eye = _eye(scene, camera, (int(size[0]), int(size[1])), self.caps.clip_control)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # moderngl binds again what was bound before, also a framebuffer that was released meanwhile: leave one that stays
        self.r._idle.use()
        self.r._meshes.sweep()

    def run(self, ambient: Array, background: Array) -> Frame:
        scene = self._gpu_scene()
        channels = 4 if scene.textured else 2 if scene.smooth else 1
        targets = self._camera_targets(channels)
        plans = [self._plan(light) for light in self.lights]
        maps = self._place(plans)
        with self._clock("surface"):
            self._draw_surface(scene, targets)
        with self._clock("clear"):
            self._clear(targets, background)
        used = []
        for i, (light, plan) in enumerate(zip(self.lights, plans, strict=True)):
            draws = 0
            if maps[i] is not None:
                with self._clock("shadow"):
                    draws = draw_casters(
                        self.context, self.r._programs, maps[i].atlas, scene, light, maps[i].views, maps[i].settings  # type: ignore[union-attr]
                    )
            with self._clock("resolve"):
                self._resolve(scene, targets, i, maps[i], ambient)
            used.append(replace(plan, views=maps[i].views if maps[i] else (), draws=draws))  # type: ignore[union-attr]
        if not self.lights:
            self._resolve(scene, targets, None, None, ambient)
        with self._clock("read"):
            results = self._read(targets, maps, background)
        self.context.check_errors("rendering")
        eye = self.eye
        return Frame(scene=self.scene, camera=eye.camera, lights=self.lights, size=eye.size, near=eye.near, far=eye.far,
                     used=tuple(used), timings=self.timings if "timings" in self.outputs else None, **results)  # fmt: skip

    @contextlib.contextmanager
    def _clock(self, name: str) -> Iterator[None]:
        if "timings" not in self.outputs:
            yield
            return
        self.ctx.finish()
        start = time.perf_counter()
        yield
        self.ctx.finish()
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - start

    def _gpu_scene(self) -> GpuScene:
        current = self.r._scene
        if current is None or current.scene() is not self.scene:
            if current is not None:
                current.release()
                self.r._scene = None
            self.r._scene = GpuScene(self.context, self.r._meshes, self.scene)
        assert self.r._scene is not None
        return self.r._scene

    def _camera_targets(self, channels: int) -> CameraTargets:
        key = (self.eye.size, channels, len(self.lights), "visibility" in self.outputs, "linear" in self.outputs)
        if self.r._targets is None or self.r._targets.key != key:
            if self.r._targets is not None:
                self.r._targets.release()
                self.r._targets = None
            self.r._targets = CameraTargets(self.context, *key)
        return self.r._targets

    # -- shadow maps

    def _plan(self, light: Light) -> Used:
        """Everything about a light's shadow decided; its views are not placed yet."""
        shadow = light.shadow
        if shadow is None:
            return Used()
        fallbacks = []
        target = shadow.target or Target.DEPTH32F
        clip, reason = self._clip(light, shadow, target)
        if reason:
            fallbacks.append(reason)
        if getattr(light, "radius", 0.0) > 0.0 or getattr(light, "angle", 0.0) > 0.0:
            fallbacks.append(f"the light's size is ignored: {shadow.filter!r} knows only points, so its shadow is hard")
        bounds, placed = self.scene.boxes
        corners = box_corners(bounds, placed)
        if isinstance(shadow.fit, SceneFit):
            receivers = list(corners)
        else:
            receivers = visible_corners(bounds, placed, _frustum(self.eye))
        scene = self.r._scene
        assert scene is not None
        casting = casters(scene)
        views: tuple[ShadowView, ...] = ()
        if casting.any():
            guard = int(np.ceil(shadow.filter.reach_texels)) + 1
            views = shadow_views(light, receivers, corners[casting].reshape(-1, 3), clip, shadow.resolution, guard)
        return Used(views, shadow.filter, shadow.bias or ReceiverPlaneBias(), target, clip, shadow.faces, 0, tuple(fallbacks))

    def _clip(self, light: Light, shadow: Shadow, target: Target) -> tuple[ClipSpace, str | None]:
        wanted = shadow.clip or ClipSpace(
            True, reversed=not isinstance(light, DirectionalLight) and target is Target.DEPTH32F
        )
        if wanted.zero_to_one and not self.caps.clip_control:
            have = ClipSpace(False, wanted.reversed if shadow.clip else False)
            return have, f"clip {wanted} became {have}: this driver has no glClipControl ({self.caps.renderer})"
        return wanted, None

    def _place(self, plans: list[Used]) -> list[Map | None]:
        """One atlas per format, and in it the tiles of all lights of that format."""
        maps: list[Map | None] = [None] * len(plans)
        for target in dict.fromkeys(plan.target for plan in plans if plan.target and plan.views):
            which = [i for i, plan in enumerate(plans) if plan.target is target and plan.views]
            views, size = layout([view for i in which for view in plans[i].views], self.caps.max_texture_size)
            atlas = self.r._atlases.get(target)
            if atlas is None or atlas.size != size:
                if atlas is not None:
                    atlas.release()
                    del self.r._atlases[target]
                atlas = self.r._atlases[target] = Atlas(self.context, target, size)
            start = 0
            for i in which:
                plan = plans[i]
                count = len(plan.views)
                assert plan.bias is not None and plan.filter is not None
                settings = CasterSettings(target, plan.bias, plan.faces)
                maps[i] = Map(views[start : start + count], atlas, settings, plan.filter)
                start += count
        return maps

    # -- passes

    def _draw_surface(self, scene: GpuScene, targets: CameraTargets) -> None:
        ctx, eye = self.ctx, self.eye
        if self.caps.clip_control:
            self.context.gl.clip_control(eye.clip.zero_to_one)
        targets.surface_framebuffer.use()
        ctx.depth_func = ">=" if eye.clip.reversed else "<="
        ctx.enable_only(moderngl.DEPTH_TEST)
        targets.surface_framebuffer.clear(depth=eye.clip.clear_depth)
        clip_from_world = eye.clip_from_view @ eye.camera.view_from_world
        matrices = pack_matrices(clip_from_world @ scene.world_from_origin)
        boxes = box_corners(*self.scene.boxes)
        position = np.asarray(eye.camera.position)
        outside = ~((boxes.min(axis=1) <= position) & (position <= boxes.max(axis=1))).all(axis=1)
        culled: str | None = None
        for i in np.flatnonzero(_seen(eye, boxes)):
            gpu, material = scene.meshes[i], scene.nodes[i].mesh.material
            program = self._surface_program(scene, gpu.smooth, gpu.textured, material.alpha_mode is AlphaMode.MASK)
            program.write("u_clip_from_mesh", matrices[i])
            program.set(u_first_triangle=int(scene.first[i]) + 1, u_color=material.color)
            if gpu.smooth:
                program.set(u_normal_from_mesh=scene.normal_from_mesh[i])
            if gpu.texture is not None:
                program.set(u_cutoff=material.cutoff)
                gpu.texture.use(0)
            # nobody outside a closed mesh sees its back faces
            cull = ("front" if scene.mirrored[i] else "back") if gpu.closed and outside[i] else None
            if cull != culled:
                culled = cull
                ctx.enable(moderngl.CULL_FACE) if cull else ctx.disable(moderngl.CULL_FACE)
                ctx.cull_face = cull or "back"
            gpu.vertex_array(program, numbered=True).render()
        ctx.enable_only(moderngl.DEPTH_TEST)

    def _surface_program(self, scene: GpuScene, smooth: bool, textured: bool, masked: bool) -> Program:
        return self.r._programs.get(
            "pass/surface.vert",
            "pass/surface.frag",
            defines={
                "GLS_SURFACE": 4 if scene.textured else 2 if scene.smooth else 1,
                "GLS_SMOOTH": int(smooth),
                "GLS_TEXTURED": int(textured),
                "GLS_ALPHA": int(masked and textured),
            },
        )

    def _clear(self, targets: CameraTargets, background: Array) -> None:
        """Background colour, and NaN where the light cannot be asked."""
        for i in range(max(len(targets.visibility), 1)):
            targets.framebuffer(targets.image, i).use()
            if targets.visibility:
                self.context.gl.clear_floats(1, (np.nan,) * 4)
        self.context.gl.clear_floats(0, (*background, 1.0))
        if targets.linear is not None:
            self.context.gl.clear_floats(2, (*_decode(background), 1.0))

    def _resolve(
        self, scene: GpuScene, targets: CameraTargets, i: int | None, shadow_map: Map | None, ambient: Array
    ) -> None:
        """Add light `i` (None: only the ambient term) to the image."""
        light: Light = DirectionalLight() if i is None else self.lights[i]
        first = i in (None, 0)
        last = i is None or i == len(self.lights) - 1
        program = self.r._programs.get(
            "pass/resolve.vert",
            "pass/resolve.frag",
            dialect="core330_gather" if self.caps.texture_gather else "core330",
            slots=receiver_slots(light, shadow_map, self.caps),
            defines={
                **receiver_defines(light, shadow_map),
                "GLS_SURFACE": targets.surface.components,
                "GLS_COLORS": 2 if scene.textured else 0 if scene.color is not None else 1,
                "GLS_FIRST": int(first),
                "GLS_LAST": int(last),
                "GLS_LIT": int(i is not None),
                "GLS_VISIBILITY": int(bool(targets.visibility)),
                "GLS_SUM": int(last and targets.linear is not None),
            },
        )
        self._set_resolve(program, scene, light, shadow_map, ambient)
        self._bind(program, scene, targets, shadow_map)
        number = i or 0
        if not first:
            targets.sums[(number - 1) % 2].use(UNITS["u_sum"])
        targets.framebuffer(targets.image if last else targets.sums[number % 2], number).use()
        if self.caps.clip_control:
            self.context.gl.clip_control(self.eye.clip.zero_to_one)
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func = "<" if self.eye.clip.reversed else ">"
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        self.ctx.clear_samplers(0, max(UNITS.values()) + 1)

    def _set_resolve(
        self, program: Program, scene: GpuScene, light: Light, shadow_map: Map | None, ambient: Array
    ) -> None:
        eye = self.eye
        view = eye.camera.view_from_world
        position = np.asarray(eye.camera.position)
        left, right, bottom, top = eye.camera.window(eye.size)
        x, y = (right - left) / eye.size[0], (top - bottom) / eye.size[1]
        rays_v = np.array([[x, 0.0, left], [0.0, y, bottom], [0.0, 0.0, -1.0]])
        lv_from_world = light_view(light, shadow_map.views if shadow_map else _unmapped_view(light, scene.origin))
        axes = lv_from_world[:3, :3]
        offset = lv_from_world[:3, 3] + axes @ scene.origin
        program.set(
            u_far_z=(0.0 if eye.clip.zero_to_one else -1.0) if eye.clip.reversed else 1.0,
            u_unproject=_unproject(eye),
            u_ray_l=axes @ view[:3, :3].T @ rays_v,
            u_eye_l=tuple(axes @ (position - scene.origin)),
            u_lv_from_l=tuple(offset),
            u_axes_l=axes,
            u_ambient=tuple(ambient),
            u_strength=light.shadow.strength if light.shadow else 1.0,
        )
        if scene.color is not None:
            program.set(u_color=scene.color)
        set_light(program, light)
        if shadow_map is not None:
            reach = float(np.abs(position - scene.origin).max() + eye.far * np.hypot(1.0, np.abs([left, right]).max()))
            reach = max(reach, float(np.abs(offset).max()))
            set_receiver(program, self.context, light, shadow_map, ROUNDINGS * 2.0**-24 * reach)

    def _bind(self, program: Program, scene: GpuScene, targets: CameraTargets, shadow_map: Map | None) -> None:
        targets.surface.use(UNITS["u_surface"])
        targets.depth.use(UNITS["u_camera_depth"])
        self.r._plain.use(UNITS["u_camera_depth"])
        scene.planes.use(UNITS["u_planes"])
        if "u_colors" in program:
            scene.owners.use(UNITS["u_owners"])
            scene.colors.use(UNITS["u_colors"])
        if shadow_map is not None and shadow_map.settings.target.is_depth:
            raw = self.caps.texture_gather and self.caps.software
            (self.r._plain if raw else self.r._samplers[shadow_map.views[0].clip.reversed]).use(UNITS["u_map"])

    # -- read-back

    def _read(self, targets: CameraTargets, maps: list[Map | None], background: Array) -> dict[str, Any]:
        size = self.eye.size
        results: dict[str, Any] = {}
        if "image" in self.outputs:
            results["image"] = _pixels(targets.image, size, np.uint8, 4)[..., :3]
        if "visibility" in self.outputs:
            planes = np.zeros((len(self.lights), size[1], size[0]), dtype=np.float32)
            for plane, texture in zip(planes, targets.visibility, strict=False):
                plane[:] = _pixels(texture, size, np.float32, 1)[..., 0]
            results["visibility"] = planes
        if targets.linear is not None:
            results["linear"] = _pixels(targets.linear, size, np.float32, 4)[..., :3]
        if {"depth", "depth_metric", "triangle"} & self.outputs:
            window = _pixels(targets.depth, size, np.float32, 1)[..., 0]
            results.update(self._depths(window))
            if "triangle" in self.outputs:
                number = _pixels(targets.surface, size, np.uint32, targets.surface.components)[..., 0].astype(np.int32)
                results["triangle"] = np.where(window == self.eye.clip.clear_depth, -1, number - 1)
        if "shadow_maps" in self.outputs:
            results["shadow_maps"] = tuple(_stored(shadow_map) for shadow_map in maps)
        return results

    def _depths(self, window: NDArray[np.float32]) -> dict[str, Any]:
        eye = self.eye
        nothing = window == eye.clip.clear_depth
        x, y = _unproject(eye)
        depth = 1.0 / np.where(nothing, 1.0, x + y * window.astype(np.float64))
        results = {}
        if "depth" in self.outputs:
            results["depth"] = np.where(nothing, np.inf, depth).astype(np.float32)
        if "depth_metric" in self.outputs:
            clip_z = -eye.clip_from_view[2, 2] * depth + eye.clip_from_view[2, 3]
            metric = projected_metric(clip_z, eye.clip, *metric_range("spot", eye.clip, eye.near, eye.far))
            results["depth_metric"] = np.where(nothing, 1.0, metric).astype(np.float32)
        return results


# A receiver's position is a sum of products in float32: ray x depth, the eye added, back on the plane, into the light's view, and
# the caster's vertex takes a matrix product of its own. 16 roundings of relative size 2^-24 bound the sum.
ROUNDINGS = 16.0


def _eye(scene: Scene, camera: PerspectiveCamera, size: tuple[int, int], clip_control: bool) -> _Eye:
    """The camera's depth range: what it was given, else what the scene's boxes need."""
    corners = box_corners(*scene.boxes).reshape(-1, 3)
    row = camera.view_from_world[2]
    depth = -(corners @ row[:3] + row[3])
    far = camera.far if camera.far is not None else 1.001 * float(depth.max())
    if far <= 0.0 or (camera.near is not None and far <= camera.near):
        warn("the camera sees nothing: the whole scene is behind it or nearer than its near plane")
        far = 2.0 * (camera.near or 1.0)
    near = camera.near if camera.near is not None else max(0.999 * float(depth.min()), NEAREST_SHARE * far)
    return _Eye(camera, size, min(near, 0.999 * far), far, ClipSpace(True, True) if clip_control else ClipSpace(False, False))


def _frustum(eye: _Eye) -> Array:
    return frustum_corners(eye.camera.window(eye.size), eye.near, eye.far, eye.camera.view_from_world)


def _seen(eye: _Eye, boxes: Array) -> NDArray[np.bool_]:
    from glshadow.gl.caster import seen_by

    window = eye.camera.window(eye.size)
    view = ShadowView("spot", 0, eye.camera.view_from_world, window, eye.near, eye.far, eye.clip, 1)
    return seen_by(view.clip_from_world, boxes, view)


def _unproject(eye: _Eye) -> tuple[float, float]:
    """(x, y) with 1 / view depth = x + y * window depth, exact in every clip convention."""
    matrix = eye.clip_from_view
    span = 1.0 if eye.clip.zero_to_one else 2.0
    low = 0.0 if eye.clip.zero_to_one else -1.0  # ndc = low + span * window depth = -m22 + m23 / depth
    return (low + matrix[2, 2]) / matrix[2, 3], span / matrix[2, 3]


def _unmapped_view(light: Light, origin: Array) -> tuple[ShadowView, ...]:
    """The frame of a light without a map: only its axes and its origin matter."""
    from glshadow.core.spaces import rigid_inverse, view_axes

    direction = np.asarray(getattr(light, "direction", (0.0, -1.0, 0.0)))
    place = origin if isinstance(light, DirectionalLight) else np.asarray(light.position)
    view = rigid_inverse(view_axes(direction), place)
    return (ShadowView("directional", 0, view, (-1.0, 1.0, -1.0, 1.0), 0.0, 1.0, ClipSpace(), 1),)


def _decode(color: Array) -> Array:
    """sRGB in 0..1 to linear light."""
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)


def _pixels(texture: moderngl.Texture, size: tuple[int, int], dtype: Any, components: int) -> NDArray[Any]:
    """A texture's pixels (H, W, C), row 0 at the top."""
    data = np.frombuffer(texture.read(), dtype=dtype).reshape(size[1], size[0], components)
    return np.ascontiguousarray(data[::-1])


def _stored(shadow_map: Map | None) -> NDArray[np.float32]:
    """A light's views (V, R, R), row 0 at v = 1; RGBA8 is unpacked."""
    if shadow_map is None:
        return np.zeros((0, 0, 0), dtype=np.float32)
    from glshadow.core.metric import unpack

    atlas, target = shadow_map.atlas, shadow_map.settings.target
    components = atlas.texture.components
    if target in (Target.R8, Target.RGBA8):
        raw = np.frombuffer(atlas.texture.read(), np.uint8).reshape(atlas.size[1], atlas.size[0], components)
        values = np.minimum(unpack(raw / 255.0), 1.0) if target is Target.RGBA8 else raw[..., 0] / 255.0
    else:
        dtype = {Target.R16F: np.float16}.get(target, np.float32)
        values = np.frombuffer(atlas.texture.read(), dtype).reshape(atlas.size[1], atlas.size[0])
    tiles = []
    for view in shadow_map.views:
        x, y = view.tile
        tiles.append(values[y : y + view.resolution, x : x + view.resolution][::-1])
    return np.stack(tiles).astype(np.float32)


def render(
    scene: Any,
    camera: PerspectiveCamera | None = None,
    lights: Sequence[Light] | None = None,
    size: tuple[int, int] = (1280, 720),
    path: Any = None,
    **options: Any,
) -> Frame:
    """One picture by a renderer of its own.

    Parameters
    ----------
    scene : Scene, path, trimesh.Trimesh, trimesh.Scene or pyrender.Scene
        Whatever `glshadow.load` takes.
    camera, lights, size
        As in Renderer.render.
    path : optional
        Also save it there.
    **options
        Further arguments of Renderer.render.
    """
    if not isinstance(scene, Scene):
        from glshadow.scene.load import load

        scene = load(scene)
    with Renderer() as renderer:
        frame = renderer.render(scene, camera, lights, size, **options)
    if path is not None:
        frame.save(path)
    return frame
