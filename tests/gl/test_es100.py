"""The WebGL 1 path: GLSL ES 1.00 programs give the same map and the same image as core programs, pixel for pixel."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from glshadow.core.spaces import ClipSpace
from glshadow.derive.resolved import CasterSettings
from glshadow.errors import SettingsError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Programs
from glshadow.gl.foreign.forward import draw_map, receiver_source
from glshadow.gl.passes.atlases import Atlas, layout
from glshadow.gl.passes.caster import Map, metric_uniform
from glshadow.gl.passes.translucent import Tint
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.matrices import pack_matrices
from glshadow.gl.techniques.mapped import map_defines, map_slots
from glshadow.lights import DirectionalLight, SpotLight
from glshadow.shader.slots import metric_slot, open_slots
from glshadow.shadows.bias import Bias, ConstantBias, NoBias, NormalOffsetBias, ReceiverPlaneBias
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.filters import Filter, Pcf
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow
from scripts.shaders.variants import MAPPED, MOMENTS

from .small_scene import Forward, light_of, on_gpu, small_scene, stored, views_of

CLIP = ClipSpace(False, False)  # WebGL's
# Both dialects compile to the same operations, but Mesa 22.3 orders sums and products of ES 1.00 differently: a filter of
# (2 R + 2)^2 weights in 0..1 may differ by a rounding each.
ROUNDING = 100 * 2.0**-24
KINDS = ("directional", "spot", "point")
TARGETS = (Target.R32F, Target.R8, Target.RGBA8)
BIASES: tuple[Bias, ...] = (ReceiverPlaneBias(), ConstantBias(0.05), NormalOffsetBias(), NoBias())
# a rotated disc is noise, which a rounding turns into other noise
FILTERS: tuple[Filter, ...] = tuple(each for each in MAPPED if not getattr(each, "rotate", False))


@pytest.fixture
def gpu(glcontext: GLContext) -> Iterator[tuple[GpuScene, Programs]]:
    with on_gpu(glcontext, small_scene()) as both:
        yield both


@pytest.fixture
def forward(glcontext: GLContext) -> Iterator[Forward]:
    with Forward(glcontext, small_scene()) as drawer:
        yield drawer


def es_map(context: GLContext, gpu: GpuScene, programs: Programs, kind: str, shadow: Shadow, dialect: str) -> Map:
    """A map drawn by the caster pass in a dialect, without features that GL ES 2.0 lacks (depth clamp, clip control)."""
    assert shadow.target is not None
    assert shadow.bias is not None
    light, target = light_of(kind, shadow), shadow.target
    views, size = layout(views_of(small_scene(), light, CLIP), context.caps.max_texture_size)
    atlas = Atlas(context, target, size)
    program = programs.get(
        "pass/caster.vert",
        "pass/caster.frag",
        dialect,
        {"metric": metric_slot(light_of(kind, shadow).projection)},
        {"GLS_METRIC": 1, "GLS_PACKED": int(target is Target.RGBA8)},
    )
    ctx = context.ctx
    before = ctx.fbo
    atlas.framebuffer.use()
    if context.caps.clip_control:
        context.gl.clip_control(False)
    ctx.enable_only(moderngl.DEPTH_TEST)
    ctx.depth_func = "<="
    for view in views:
        atlas.framebuffer.viewport = (*view.tile, view.resolution, view.resolution)
        atlas.framebuffer.clear(1.0, 1.0, 1.0, 1.0, depth=1.0, viewport=atlas.framebuffer.viewport)
        clip = pack_matrices(view.clip_from_world @ gpu.world_from_origin)
        local = pack_matrices(view.view_from_world @ gpu.world_from_origin)
        program.set(u_metric=metric_uniform(view, 0.0))
        for i, mesh in enumerate(gpu.meshes):
            program.write("u_clip_from_mesh", clip[i])
            program.write("u_view_from_mesh", local[i])
            mesh.vertex_array(program).render()
    ctx.enable_only(moderngl.NOTHING)
    before.use()
    return Map(views, atlas, CasterSettings(target, shadow.bias, None), shadow.filter)


def test_programs_really_are_es100(glcontext: GLContext, gpu: tuple[GpuScene, Programs]) -> None:
    shadow_map = es_map(glcontext, *gpu, "spot", Shadow(filter=Pcf(), bias=NoBias(), target=Target.RGBA8), "es100")
    text = receiver_source(glcontext, light_of("spot", Shadow()), shadow_map, "es100")
    shadow_map.atlas.release()
    assert text.startswith("#version 100\n")
    assert "textureLod" not in text.replace("#define GLS_TEXTURE_2D(map, uv) textureLod(map, uv, 0.0)", "")


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("kind", KINDS)
def test_map_is_the_same_in_both_dialects(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], kind: str, target: Target
) -> None:
    shadow = Shadow(filter=Pcf(), bias=NoBias(), target=target)
    maps = [es_map(glcontext, *gpu, kind, shadow, dialect) for dialect in ("core330", "es100")]
    core, es = (stored(each) for each in maps)
    for each in maps:
        each.atlas.release()
    assert len(np.unique(core)) > 5, "nothing was drawn"
    np.testing.assert_array_equal(es, core)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("kind", KINDS)
def test_image_is_the_same_in_both_dialects(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, kind: str, target: Target
) -> None:
    # All biases with one filter and all filters with one bias: they do not interact in the code.
    pairs = {
        *itertools.product(BIASES, [Pcf(1)]),
        *itertools.product([ReceiverPlaneBias()], FILTERS if target is not Target.R8 else ()),
    }
    drawn = es_map(glcontext, *gpu, kind, Shadow(filter=Pcf(), bias=NoBias(), target=target), "es100")
    for each, kernel in sorted(pairs, key=repr):
        bias = each.derived(kernel.reach_texels)
        light = light_of(kind, Shadow(bias=bias, target=target, filter=kernel))
        shadow_map = replace(drawn, settings=CasterSettings(target, bias, None), filter=kernel)
        slots, defines = map_slots(light, shadow_map, glcontext.caps), map_defines(light, shadow_map)
        core, es = (
            forward.draw(
                gpu[1].get("pass/forward.vert", "pass/forward.frag", dialect, slots, defines), light, shadow_map
            )
            for dialect in ("core330", "es100")
        )
        seen = core.values[core.hit][:, 0]
        assert (seen < 0.5).any(), (bias, kernel)
        assert (seen > 0.5).any() or isinstance(bias, NoBias), (bias, kernel)
        assert np.abs(es.values - core.values).max() <= ROUNDING, (bias, kernel)
    drawn.atlas.release()


@pytest.mark.parametrize("kind", KINDS)
def test_prefiltered_maps_are_sampled_alike_in_both_dialects(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, kind: str
) -> None:
    for kernel in (each for each in MOMENTS if not getattr(each, "mip_maps", False)):  # GLSL ES 1.00 reads the finest
        light = light_of(kind, Shadow(filter=kernel, clip=CLIP))
        shadow_map = draw_map(glcontext, gpu[1], gpu[0], light, views_of(small_scene(), light, CLIP))
        slots, defines = map_slots(light, shadow_map, glcontext.caps), map_defines(light, shadow_map)
        core, es = (
            forward.draw(
                gpu[1].get("pass/forward.vert", "pass/forward.frag", dialect, slots, defines), light, shadow_map
            )
            for dialect in ("core330", "es100")
        )
        shadow_map.atlas.release()
        seen = core.values[core.hit][:, 0]
        assert (seen < 0.5).any(), kernel
        assert (seen > 0.5).any(), kernel
        assert np.abs(es.values - core.values).max() <= ROUNDING, kernel
        assert receiver_source(glcontext, light, shadow_map, "es100").startswith("#version 100\n")


@pytest.mark.parametrize("output", [1, 2])
def test_shaded_image_is_the_same_in_both_dialects(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, output: int
) -> None:
    shadow = Shadow(filter=Pcf(), bias=ReceiverPlaneBias(), target=Target.RGBA8)
    light = light_of("spot", shadow)
    shadow_map = es_map(glcontext, *gpu, "spot", shadow, "es100")
    slots, defines = map_slots(light, shadow_map, glcontext.caps), map_defines(light, shadow_map)
    core, es = (
        forward.draw(
            gpu[1].get("pass/forward.vert", "pass/forward.frag", dialect, slots, {**defines, "GLS_OUTPUT": output}),
            light,
            shadow_map,
        )
        for dialect in ("core330", "es100")
    )
    shadow_map.atlas.release()
    assert len(np.unique(core.values)) > 100
    # sRGB encodes with pow, whose error is a few units in the last place of its result.
    assert np.abs(es.values - core.values).max() <= ROUNDING


@pytest.mark.parametrize("kind", ["directional", "spot"])
def test_cookies_and_tints_are_the_same_in_both_dialects(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, kind: str
) -> None:
    """Random texels as the cookie, and as colours and depths of translucent casters."""
    rng, side, ctx = np.random.default_rng(6), 64, glcontext.ctx
    light = replace(light_of(kind, Shadow()), cookie=Cookie(rng.integers(0, 256, (8, 12, 3)).astype(np.uint8)))
    assert isinstance(light, DirectionalLight | SpotLight)
    (view,) = (replace(each, resolution=side) for each in views_of(small_scene(), light, CLIP))
    image = ctx.texture((12, 8), 3, rng.integers(0, 256, (8, 12, 3)).astype(np.uint8).tobytes(), alignment=1)
    image.filter = (moderngl.LINEAR, moderngl.LINEAR)
    layers = ctx.texture((side, 2 * side), 4, rng.random((2 * side, side, 4)).astype(np.float32).tobytes(), dtype="f4")
    layers.filter = (moderngl.NEAREST, moderngl.NEAREST)
    tint = Tint((view,), layers, side)
    axes = view.view_from_world[:3, :3]
    values = tint.uniforms(axes, view.view_from_world[:3, 3], np.zeros(3))
    values["u_cookie_from_lv"] = light.projected[1] @ np.linalg.inv(view.view_from_world)
    for unit, (name, texture) in enumerate((("u_cookie", image), ("u_tint", layers)), 1):
        texture.use(unit)
        values[name] = unit
    drawn = Map((view,), Atlas(glcontext, Target.R8, (side, side)), CasterSettings(Target.R8, NoBias(), None), Pcf(0))
    pictures = {}
    for dialect, tinted in itertools.product(("core330", "es100"), (0, 1)):
        defines: dict[str, int | str] = {
            "GLS_OUTPUT": 1,
            "GLS_COOKIE": tinted,
            **(tint.defines if tinted else {"GLS_TINT": 0}),
        }
        defines["GLS_AT_INFINITY"] = int(kind == "directional")
        program = gpu[1].get("pass/forward.vert", "pass/forward.frag", dialect, open_slots(light), defines)
        for name, value in values.items():
            if tinted and isinstance(value, bytes):
                program.write(name, value)
            elif tinted:
                program.set(**{name: value})
        pictures[dialect, tinted] = forward.draw(program, light, drawn).values
    for thing in (image, layers, drawn.atlas):
        thing.release()
    changed = np.abs(pictures["core330", 1] - pictures["core330", 0]).max(axis=-1) > 0.01
    assert changed.mean() > 0.1
    assert len(np.unique(pictures["core330", 1])) > 1000
    # an 8-bit image is filtered in 8 bits; the last bit decides depths at the edge of a translucent caster, and texel borders
    gap = np.abs(pictures["es100", 1] - pictures["core330", 1]).max(axis=-1)
    assert (gap > 2.0**-9).mean() < 2e-3


def test_depth_targets_are_refused(glcontext: GLContext, gpu: tuple[GpuScene, Programs]) -> None:
    light = light_of("directional", Shadow(target=Target.DEPTH16))
    shadow_map = draw_map(glcontext, gpu[1], gpu[0], light, views_of(small_scene(), light, CLIP))
    with pytest.raises(SettingsError, match=r"depth16.*R32F, R16F, R8 or RGBA8"):
        receiver_source(glcontext, light, shadow_map, "es100")
    shadow_map.atlas.release()
