"""A small scene with a forward renderer, for tests that compare shader programs pixel by pixel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array, ClipSpace, perspective
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Program, Programs
from glshadow.gl.foreign.forward import bind_map, lv_from_world, receiver_uniforms, rounding_of
from glshadow.gl.passes.caster import Map
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.kept_meshes import Meshes
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import ShadowView, shadow_views

SIZE = (192, 128)
REACH = 20.0  # maximum coordinate of the scene in any frame
RESOLUTION = 256
CAMERA = PerspectiveCamera(position=(5.0, 4.0, 6.0), target=(0.0, 0.4, 0.0), fov_y=36.0)
BACKGROUND = 0.25


def small_scene() -> Scene:
    """A ground, three columns, a roof and an icosahedron: 80 flat triangles."""
    columns = shapes.joined(
        [shapes.box((0.4, 1.5, 0.4), (x, 0.75, z)) for x, z in ((-1.2, 0.3), (0.1, -1.0), (1.1, 0.7))]
    )
    positions, triangles = shapes.icosphere(0, 0.5)
    parts = {"ground": shapes.box((6.0, 0.2, 6.0), (0.0, -0.1, 0.0)), "columns": columns}
    parts["ball"] = (positions + np.array((-1.4, 1.2, -1.2)), triangles)
    parts["roof"] = shapes.box((2.4, 0.1, 2.4), (0.6, 1.7, -0.3))
    return Scene(tuple(Node(Mesh(*solid), np.eye(4), name) for name, solid in parts.items()), CAMERA)


def light_of(kind: str, shadow: Shadow) -> Light:
    """A light of the given kind that casts shadows in the small scene."""
    if kind == "directional":
        return DirectionalLight(direction=(-0.55, -0.8, 0.35), shadow=shadow)
    if kind == "spot":
        position = np.array([2.5, 4.5, 1.5])
        return SpotLight(position=tuple(position), direction=tuple(-position), outer_angle=38.0, shadow=shadow)
    return PointLight(position=(0.6, 3.1, 0.9), shadow=shadow)


def views_of(scene: Scene, light: Light, clip: ClipSpace, guard: int = 6) -> tuple[ShadowView, ...]:
    """The light's views of the whole scene."""
    corners = scene.corners
    return shadow_views(light, list(corners), corners.reshape(-1, 3), clip, RESOLUTION, guard)


@contextmanager
def on_gpu(context: GLContext, scene: Scene) -> Iterator[tuple[GpuScene, Programs]]:
    """The scene's buffers and an empty program cache, freed at the end."""
    # moderngl rebinds the previously bound framebuffer, even one that was released meanwhile: bind one that stays alive.
    idle = context.ctx.simple_framebuffer((1, 1))
    idle.use()
    meshes, programs = Meshes(context), Programs(context)
    gpu = GpuScene(context, meshes, scene)
    try:
        yield gpu, programs
    finally:
        for thing in (gpu, meshes, programs):
            thing.release()
        # `idle` stays bound: collected with the context


@dataclass
class Picture:
    """What the forward renderer drew: (H, W, 4) float32, row 0 at the bottom, and where there is a surface."""

    values: NDArray[np.float32]

    @property
    def hit(self) -> NDArray[np.bool_]:
        return self.values[..., 0] != BACKGROUND


class Forward:
    """Draws the scene as a foreign program would: unindexed triangles with face normals, one draw call."""

    def __init__(self, context: GLContext, scene: Scene) -> None:
        corners = np.concatenate([node.mesh.positions[node.mesh.triangles] for node in scene.nodes])
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.context, self.triangles = context, len(corners)
        self._buffers = {
            "a_position": context.ctx.buffer(corners.astype(np.float32).tobytes()),
            "a_normal": context.ctx.buffer(np.repeat(normals, 3, axis=0).astype(np.float32).tobytes()),
        }

    def __enter__(self) -> Forward:
        return self

    def __exit__(self, *_: object) -> None:
        for buffer in self._buffers.values():
            buffer.release()

    def vertex_array(self, program: Program) -> moderngl.VertexArray:
        """The triangles as vertex input of a program."""
        content = [(buffer, "3f", name) for name, buffer in self._buffers.items() if name in program]
        return self.context.ctx.vertex_array(program.gl, content)

    def draw(self, program: Program, light: Light, shadow_map: Map | None, **more: Any) -> Picture:
        """One image in float32."""
        ctx = self.context.ctx
        eye_clip = perspective(*CAMERA.window(SIZE), 0.5, 30.0, ClipSpace(False, False))
        view = lv_from_world(light, shadow_map) if shadow_map else np.eye(4)
        rounding = rounding_of(REACH)
        values: Mapping[str, Any] = {
            **light.uniforms(np.eye(3)),
            **(receiver_uniforms(light, shadow_map, rounding) if shadow_map else {}),
        }
        for name, value in values.items():
            program.write(name, value) if isinstance(value, bytes) else program.set(**{name: value})
        program.set(
            u_clip_from_mesh=eye_clip @ CAMERA.view_from_world,
            u_lv_from_mesh=view,
            u_normal_lv_from_mesh=view[:3, :3],
            u_eye_lv=(*(view[:3, :3] @ np.asarray(CAMERA.position) + view[:3, 3]), 1.0),
            u_ambient=(0.1, 0.1, 0.1),
            u_color=(0.8, 0.7, 0.6),
            u_strength=1.0,
            **more,
        )
        sampler = bind_map(ctx, shadow_map) if shadow_map else None
        color, depth = ctx.texture(SIZE, 4, dtype="f4"), ctx.depth_renderbuffer(SIZE)
        before, framebuffer, array = ctx.fbo, ctx.framebuffer([color], depth), self.vertex_array(program)
        framebuffer.use()
        if self.context.caps.clip_control:
            self.context.gl.clip_control(False)
        framebuffer.clear(*[BACKGROUND] * 4, depth=1.0)
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = "<="
        array.render(moderngl.TRIANGLES)
        values_read = np.frombuffer(color.read(), np.float32).reshape(SIZE[1], SIZE[0], 4)
        ctx.clear_samplers(0, 1)
        ctx.enable_only(moderngl.NOTHING)
        before.use()
        for thing in (array, framebuffer, color, depth, sampler):
            if thing is not None:
                thing.release()
        return Picture(values_read)


def stored(shadow_map: Map) -> Array:
    """Contents of a map's atlas: (H, W, components), depth and float targets unchanged, 8-bit ones in 0..1."""
    atlas = shadow_map.atlas
    raw = atlas.texture.read()
    kind = {Target.R8: np.uint8, Target.RGBA8: np.uint8, Target.R16F: np.float16}.get(atlas.target, np.float32)
    values = np.frombuffer(raw, kind).reshape(atlas.size[1], atlas.size[0], -1).astype(np.float64)
    return values / 255.0 if kind is np.uint8 else values
