"""Our caster pass, given Babylon.js's matrices and points, stores the values that Babylon.js stored."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest

from glshadow.core.spaces import Array, project, translation
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Program, Programs
from glshadow.gl.passes.atlases import Atlas
from glshadow.gl.passes.caster import metric_uniform
from glshadow.shader.slots import metric_slot
from glshadow.shadows.bias import bias_factor
from glshadow.shadows.metric import Target, unpack

from .babylon import F32_TOLERANCE, PROJECTIONS, Reading, load_readings

TARGETS = {"f32": Target.R32F, "f16": Target.R16F, "u8": Target.RGBA8}
# World units: the normal bias moves a square of this half width sideways by up to 0.05; it must still cover the texel.
HALF_QUAD = 0.5
ZOOM = 1e4  # width of the window around the texel


@pytest.fixture(scope="module")
def readings() -> list[Reading]:
    return load_readings()


class Caster:
    """Draws one reading at a time with pass/caster into targets of one texel."""

    def __init__(self, context: GLContext) -> None:
        self.context, self.programs = context, Programs(context)
        self.atlases = {target: Atlas(context, target, (1, 1)) for target in (*TARGETS.values(), Target.DEPTH32F)}
        self.idle = context.ctx.simple_framebuffer((1, 1))
        self.idle.use()

    def release(self) -> None:
        self.programs.release()
        for atlas in self.atlases.values():
            atlas.release()
        self.idle.use()

    def _program(self, reading: Reading, target: Target, biased: bool, dialect: str) -> Program:
        config, metric = reading.config, not target.is_depth
        program = self.programs.get(
            "pass/caster.vert",
            "pass/caster.frag",
            dialect,
            {"metric": metric_slot(PROJECTIONS[config.kind])},
            {"GLS_METRIC": int(metric), "GLS_PACKED": int(target is Target.RGBA8), "GLS_CLIP_BIAS": int(biased)},
        )
        program.set(u_metric=metric_uniform(config.shadow_view, config.bias))
        return program

    def store(self, reading: Reading, target: Target, dialect: str = "core330", quad: Array | None = None) -> Array:
        """The texel's value after drawing the reading's point, or a quad (4, 3) of its plane with the normal bias."""
        config, face = reading.config, reading.face
        on_depth = config.filter in ("pcf", "pcss")
        program = self._program(reading, target, on_depth or quad is not None, dialect)
        # Relative to the point, as the renderer draws meshes relative to their origin: float32 keeps small differences.
        origin = translation(reading.world_point)
        view = config.view[face] @ origin
        clip = config.projection[face] @ view
        if target.is_depth:
            program.set(u_clip_bias=config.clip.sign * config.bias * bias_factor(config.clip))
        elif on_depth:
            # Babylon's metric uses the z that its depth-texture filters have moved; ours keeps the two biases apart.
            clip = clip.copy()
            clip[2] += config.clip.sign * config.bias * bias_factor(config.clip) * clip[3]
        x, y, _, w = project(clip, np.zeros(3))
        zoom = np.eye(4)
        zoom[:2, :2] *= ZOOM
        zoom[:2, 3] = (-ZOOM * x / w, -ZOOM * y / w)
        program.set(u_clip_from_mesh=zoom @ clip, u_view_from_mesh=view, u_normal_bias=0.0)
        corners = np.zeros((1, 3))
        if quad is not None:
            assert config.direction is not None
            corners = quad - reading.world_point
            program.set(u_clip_bias=0.0, u_normal_bias=config.normal_bias, u_light=(*-config.direction, 0.0))
        return self._draw(program, self.atlases[target], corners, reading)

    def _draw(self, program: Program, atlas: Atlas, corners: Array, reading: Reading) -> Array:
        ctx, clip = self.context.ctx, reading.config.clip
        buffers = [ctx.buffer(corners.astype(np.float32).tobytes())]
        content: list[Any] = [(buffers[0], "3f", "a_position")]
        if "a_normal" in program:
            buffers.append(ctx.buffer(np.tile(reading.plane_normal, (len(corners), 1)).astype(np.float32).tobytes()))
            content.append((buffers[1], "3f", "a_normal"))
        array = ctx.vertex_array(program.gl, content)
        self.context.gl.clip_control(clip.zero_to_one) if self.context.caps.clip_control else None
        atlas.framebuffer.use()
        atlas.framebuffer.clear(1.0, 1.0, 1.0, 1.0, depth=clip.clear_depth)
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = ">=" if clip.reversed else "<="
        ctx.depth_clamp_range = (0.0, 1.0)
        array.render(moderngl.POINTS if len(corners) == 1 else moderngl.TRIANGLE_STRIP)
        ctx.depth_clamp_range = None
        ctx.enable_only(moderngl.NOTHING)
        kinds = {Target.RGBA8: np.uint8, Target.R16F: np.float16}
        values = np.frombuffer(atlas.texture.read(), kinds.get(atlas.target, np.float32)).astype(np.float64)
        self.idle.use()
        for thing in (array, *buffers):
            thing.release()
        return values


@pytest.fixture
def caster(glcontext: GLContext) -> Iterator[Caster]:
    drawer = Caster(glcontext)
    yield drawer
    drawer.release()


def metric_of(values: Array, target: Target) -> float:
    return float(unpack(values / 255.0)) if target is Target.RGBA8 else float(values[0])


def quad_around(point: Array, normal: Array) -> Array:
    """Four corners (4, 3) of a square in the plane, as a strip."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    return point + HALF_QUAD * np.array([-u - v, u - v, -u + v, u + v])


@pytest.mark.parametrize("dialect", ["core330", "es100"])
@pytest.mark.parametrize("texture", TARGETS)
@pytest.mark.parametrize("kind", ["directional", "spot", "point"])
def test_babylon_metric_from_our_shader(
    caster: Caster, readings: list[Reading], kind: str, texture: str, dialect: str
) -> None:
    target = TARGETS[texture]
    chosen = [r for r in readings if f"metric {kind} {texture}" in r.kinds]
    within = 0
    for reading in chosen:
        assert reading.read_metric is not None
        found, read = metric_of(caster.store(reading, target, dialect), target), reading.read_metric
        tolerance = reading.tolerance(read)
        if reading.config.filter == "esm":
            # None of our techniques stores this exponential: convert back to the metric, 2^-24 for its own rounding.
            read, tolerance = -np.log(read) / reading.config.depth_scale, F32_TOLERANCE + 2.0**-24
        # Babylon's float targets hold the metric beyond far too; ours is clamped, because its receivers clamp theirs.
        within += read < 1.0
        off = abs(found - min(read, 1.0))
        assert off <= tolerance, f"{reading.config.name} {reading.texel}: {off}"
    assert within >= 4


@pytest.mark.parametrize("name", ["pcf", "pcss"])
@pytest.mark.parametrize("kind", ["directional", "spot"])
def test_babylon_depth_from_our_shader(caster: Caster, readings: list[Reading], kind: str, name: str) -> None:
    chosen = [r for r in readings if f"depth {kind} {name}" in r.kinds]
    assert chosen
    assert any(reading.config.bias for reading in chosen)
    for reading in chosen:
        if reading.config.clip.zero_to_one and not caster.context.caps.clip_control:
            pytest.skip("optional: this driver has no glClipControl")
        (found,) = caster.store(reading, Target.DEPTH32F)
        assert reading.read_depth is not None
        off = abs(found - reading.read_depth)
        assert off <= F32_TOLERANCE, f"{reading.config.name} {reading.texel}: {off}"


def test_babylon_normal_bias_from_our_shader(caster: Caster, readings: list[Reading]) -> None:
    """A square in an unbiased reading's plane, moved by our vertex shader, as seen at the texel."""
    biased = [reading for reading in readings if reading.config.normal_bias]
    plain = {reading.texel: reading for reading in readings if plain_twin(reading)}
    assert biased
    for reading in biased:
        before = plain[reading.texel]
        quad = quad_around(before.world_point, reading.plane_normal)
        (found,) = caster.store(reading, Target.R32F, quad=quad)
        assert reading.read_metric is not None
        assert abs(found - reading.read_metric) <= F32_TOLERANCE, f"{reading.config.name} {reading.texel}"
        (unmoved,) = caster.store(before, Target.R32F)
        assert abs(unmoved - reading.read_metric) > 100 * F32_TOLERANCE


def plain_twin(reading: Reading) -> bool:
    """Whether it belongs to the configuration that the normal bias was added to."""
    config = reading.config
    unbiased = config.bias == 0 and config.normal_bias == 0 and not config.clip.zero_to_one and not config.clip.reversed
    return unbiased and (config.kind, config.filter, config.texture) == ("directional", "none", "f32")


def test_babylon_bytes_from_our_shader(caster: Caster, readings: list[Reading]) -> None:
    """Our RGBA8 is Babylon's RGBA8: same order of the bytes, same base."""
    chosen = [r for r in readings if "raw u8" in r.kinds and r.config.filter == "none"]
    coarse = Counter[bool]()
    for reading in chosen:
        assert reading.read_raw is not None
        found = caster.store(reading, Target.RGBA8)
        # The finer two bytes hold less than a float32 metric's own error (255^-2 = 1.5e-5 / 255 a step).
        coarse[bool((found[2:] == reading.read_raw[2:]).all())] += 1
    assert chosen
    # A carry between bytes depends on the last bit of the metric.
    assert coarse[True] >= 0.9 * len(chosen), coarse
