"""The forward receiver: every shader compiles, a pairwise choice of settings gives the exact shadow, foreign programs can include it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from glshadow.core.spaces import Array, ClipSpace
from glshadow.errors import SettingsError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Program, Programs
from glshadow.gl.foreign.forward import draw_map, receiver_source
from glshadow.gl.passes.caster import Map
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.mapped import map_defines, map_slots
from glshadow.lights import DirectionalLight, Light
from glshadow.shader.compose import Text
from glshadow.shadows.bias import ReceiverPlaneBias
from glshadow.shadows.filters import Hard, Pcf
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow
from scripts.shaders.variant import KINDS, Variant
from scripts.shaders.variants import BIASES, MAPPED, distinct, receivers, variants

from .small_scene import BACKGROUND, CAMERA, SIZE, Forward, light_of, on_gpu, small_scene, views_of

OTHER_STAGE = {
    "core330": ("#version 330 core\nvoid main() { gl_Position = vec4(0.0); }", "#version 330 core\nvoid main() {}"),
    "es100": ("#version 100\nvoid main() { gl_Position = vec4(0.0); }", "#version 100\nvoid main() {}"),
}


@pytest.fixture
def gpu(glcontext: GLContext) -> Iterator[tuple[GpuScene, Programs]]:
    with on_gpu(glcontext, small_scene()) as both:
        yield both


@pytest.fixture
def forward(glcontext: GLContext) -> Iterator[Forward]:
    with Forward(glcontext, small_scene()) as drawer:
        yield drawer


def forward_program(
    context: GLContext, programs: Programs, light: Light, shadow_map: Map, dialect: str, **defines: int
) -> Program:
    caps = replace(context.caps, texture_gather=dialect == "core330_gather", software=False)
    slots, settings = map_slots(light, shadow_map, caps), {**map_defines(light, shadow_map), "GLS_BOUNDED": 1}
    return programs.get("pass/forward.vert", "pass/forward.frag", dialect, slots, {**settings, **defines})


@cache
def texts() -> dict[str, dict[str, Variant]]:
    """Distinct shader sources by pass and dialect."""
    groups: dict[str, dict[str, Variant]] = {}
    for code, variant in distinct().items():
        groups.setdefault(f"{variant.name} {variant.dialect}", {})[code] = variant
    return groups


GROUPS = sorted({f"{v.name} {v.dialect}" for v in variants()})


SOME = 12
"""One text of so many is compiled by the driver in every run; glslang reads all of them in `scripts/check`."""


@pytest.mark.parametrize("step", [SOME, pytest.param(1, marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("group", GROUPS)
def test_every_shader_compiles(glcontext: GLContext, group: str, step: int) -> None:
    if "gather" in group and not glcontext.caps.texture_gather:
        pytest.skip("optional: this driver has no textureGather")
    if group.endswith("core430") and not glcontext.caps.compute:
        pytest.skip("optional: this driver has no compute passes")
    for code, variant in itertools.islice(texts()[group].items(), 0, None, step):
        body = code + ("void main() {}\n" if variant.name == "pass/include.frag" else "")
        shader = _compile(glcontext, body, variant.name.rpartition(".")[2])
        assert shader == "", variant.compose().explain(f"{variant.label}\n{shader}")


def _compile(context: GLContext, code: str, stage: str) -> str:
    """The driver's compile error of one stage, or nothing."""
    import moderngl

    dialect = "es100" if code.startswith("#version 100") else "core330"
    other_vertex, other_fragment = OTHER_STAGE[dialect]
    try:
        if stage == "comp":
            context.ctx.compute_shader(code).release()
        elif stage == "vert":
            context.ctx.program(code, other_fragment).release()
        elif stage == "geom":
            context.ctx.program(other_vertex, other_fragment, geometry_shader=code).release()
        else:
            context.ctx.program(other_vertex, code).release()
    except moderngl.Error as error:
        message = str(error)
        # Without a partner stage varyings have no source: an error of the linker, after a successful compilation.
        return "" if message.startswith("GLSL Linker failed") else message
    return ""


# -- reference by brute force: a ray against every triangle


def hits(origin: Array, direction: Array, corners: Array) -> Array:
    """Distance (N, T) from rays to triangles in units of `direction`; inf where they miss. Moeller, Trumbore 1997."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction[:, None], ac)
    det = (p * ab).sum(-1)
    det = np.where(np.abs(det) < 1e-12, 1e300, det)
    s = origin[:, None] - a
    u = (s * p).sum(-1) / det
    q = np.cross(s, ab)
    v, t = (q * direction[:, None]).sum(-1) / det, (q * ac).sum(-1) / det
    return np.where((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0), t, np.inf)


@cache
def surface() -> tuple[Array, Array, NDArray[np.int64]]:
    """Per pixel, row 0 at the bottom: world point, normal towards the eye, triangle (-1: none)."""
    corners = np.concatenate([node.mesh.positions[node.mesh.triangles] for node in small_scene().nodes])
    left, right, bottom, top = CAMERA.window(SIZE)
    x = left + (right - left) * (np.arange(SIZE[0]) + 0.5) / SIZE[0]
    y = bottom + (top - bottom) * (np.arange(SIZE[1]) + 0.5) / SIZE[1]
    rays_v = np.stack([*np.meshgrid(x, y), np.full((SIZE[1], SIZE[0]), -1.0)], axis=-1).reshape(-1, 3)
    rays = rays_v @ CAMERA.view_from_world[:3, :3]
    eye = np.broadcast_to(np.asarray(CAMERA.position, dtype=np.float64), rays.shape)
    t = hits(eye, rays, corners)
    t[t <= 0.0] = np.inf
    nearest = t.argmin(axis=1)
    hit = np.isfinite(t.min(axis=1))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[nearest]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= -np.sign((normal * rays).sum(-1, keepdims=True))
    points = eye + rays * np.where(hit, t.min(axis=1), 0.0)[:, None]
    return points, normal, np.where(hit, nearest, -1)


@cache
def truth(kind: str) -> Array:
    """(H, W) 1 lit, 0 dark or turned away, NaN where there is no surface."""
    light = light_of(kind, Shadow())
    corners = np.concatenate([node.mesh.positions[node.mesh.triangles] for node in small_scene().nodes])
    points, normal, triangle = surface()
    if isinstance(light, DirectionalLight):
        way = np.broadcast_to(-20.0 * np.asarray(light.direction), points.shape)
    else:
        way = np.asarray(light.position) - points
    t = hits(points, way, corners)
    t[np.arange(len(t)), triangle] = np.inf
    dark = ((t > 1e-9) & (t < 1.0)).any(axis=1) | ((normal * way).sum(-1) <= 0.0)
    return np.where(triangle >= 0, 1.0 - dark, np.nan).reshape(SIZE[1], SIZE[0])


def interior(image: Array, reach: int) -> NDArray[np.bool_]:
    """Pixels whose neighbourhood of `reach` pixels lies on one triangle, all lit or all dark: no edge is near."""
    triangle = surface()[2].reshape(SIZE[1], SIZE[0])
    same = np.zeros(image.shape, dtype=np.bool_)
    same[reach:-reach, reach:-reach] = triangle[reach:-reach, reach:-reach] >= 0
    for dy, dx in itertools.product(range(-reach, reach + 1), repeat=2):
        shifted = (np.roll(each, (dy, dx), axis=(0, 1)) for each in (image, triangle))
        same &= (next(shifted) == image) & (next(shifted) == triangle)
    return same


def pairwise() -> list[tuple[object, ...]]:
    """A few receivers that cover every pair of settings (greedy)."""
    reads = dict.fromkeys((r.target, r.dialect) for r in receivers() if r.compare != "depth_gather_raw")
    rows = [
        (kind, read[0], bias, kernel, read[1])
        for kind, read, bias, kernel in itertools.product(KINDS, reads, BIASES, MAPPED)
    ]

    def pairs(row: tuple[object, ...]) -> set[tuple[int, str, int, str]]:
        return {(i, repr(row[i]), j, repr(row[j])) for i, j in itertools.combinations(range(len(row)), 2)}

    wanted, chosen = set().union(*map(pairs, rows)), []
    while wanted:
        best = max(rows, key=lambda row: len(pairs(row) & wanted))
        chosen.append(best)
        wanted -= pairs(best)
    return chosen


def test_pairwise_choice_has_every_setting() -> None:
    columns = [set(map(repr, column)) for column in zip(*pairwise(), strict=True)]
    assert [len(column) for column in columns] == [len(KINDS), 3, len(BIASES), len(MAPPED), 3]


# Pixels that an edge may affect, and one more per texel of the radius: a texel of these maps is up to 0.05 units at the
# ground, a pixel 0.045 at the image's centre.
EDGE_PIXELS = 2


@pytest.mark.parametrize(
    "row",
    pairwise(),
    ids=lambda row: "-".join(re.sub(r"radius=|world=.*|texels=.*|[()]", "", str(getattr(v, "value", v))) for v in row),
)
def test_forward_gives_the_exact_shadow(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, row: tuple[object, ...]
) -> None:
    kind, target, bias, kernel, dialect = row
    if dialect == "core330_gather" and not glcontext.caps.texture_gather:
        pytest.skip("optional: this driver has no textureGather")
    shadow = Shadow(bias=bias, target=target, filter=kernel)  # type: ignore[arg-type]
    light = light_of(kind, shadow)  # type: ignore[arg-type]
    shadow_map = draw_map(glcontext, gpu[1], gpu[0], light, views_of(small_scene(), light, ClipSpace(False, False)))
    program = forward_program(glcontext, gpu[1], light, shadow_map, str(dialect), GLS_OUTPUT=0)
    picture = forward.draw(program, light, shadow_map)
    shadow_map.atlas.release()
    found, true = picture.values[..., 0].astype(np.float64), truth(kind)  # type: ignore[arg-type]
    assert ((found >= 0.0) & (found <= 1.0 + 1e-6)).all()
    inside = interior(true, EDGE_PIXELS + int(np.ceil(kernel.radius)))  # type: ignore[attr-defined]
    assert (inside & (true == 1.0)).sum() > 100
    assert (inside & (true == 0.0)).sum() > 20
    if not isinstance(bias, ReceiverPlaneBias):
        inside &= true == 0.0  # other biases leave acne on the lit side; these scenes show it on purpose
    np.testing.assert_allclose(found[inside], true[inside], atol=1e-6)


@pytest.mark.parametrize("target", [Target.DEPTH32F, Target.R32F])
@pytest.mark.parametrize("kind", KINDS)
def test_derived_normal_gives_the_same_image(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, kind: str, target: Target
) -> None:
    shadow = Shadow(target=target, filter=Pcf(1))
    light = light_of(kind, shadow)  # type: ignore[arg-type]
    shadow_map = draw_map(glcontext, gpu[1], gpu[0], light, views_of(small_scene(), light, ClipSpace(False, False)))
    pictures = []
    for derived in (0, 1):
        program = forward_program(glcontext, gpu[1], light, shadow_map, "core330", GLS_DERIVATIVES=derived)
        assert ("a_normal" in program) == (not derived)
        pictures.append(forward.draw(program, light, shadow_map).values[..., 0])
    shadow_map.atlas.release()
    # Differences of neighbouring positions keep about 2^-24 * 20 / 0.045 = 3e-5 of a pixel's width: the plane
    # differs by less than the slack, so that at most one comparison at an edge flips.
    differs = np.abs(pictures[0] - pictures[1]) > 1e-5
    assert differs.sum() <= 0.002 * (pictures[0] != BACKGROUND).sum()


FOREIGN_FRAGMENT = """
in vec3 v_position_lv;
in vec3 v_normal_lv;
uniform vec3 u_towards;
out vec4 o_anything;
void main() {
    vec3 normal = normalize(v_normal_lv);
    float cosine = dot(normal, u_towards);
    o_anything = vec4(cosine > 0.0 ? light_visibility(v_position_lv, normal, cosine) : 0.0);
}
"""


@pytest.mark.parametrize("target", [Target.DEPTH24, Target.RGBA8])
@pytest.mark.parametrize("kernel", [Hard(), Pcf(2)])
def test_foreign_program_includes_the_receiver(
    glcontext: GLContext, gpu: tuple[GpuScene, Programs], forward: Forward, target: Target, kernel: Hard | Pcf
) -> None:
    light = light_of("directional", Shadow(target=target, filter=kernel))
    shadow_map = draw_map(glcontext, gpu[1], gpu[0], light, views_of(small_scene(), light, ClipSpace(False, False)))
    source = receiver_source(glcontext, light, shadow_map) + FOREIGN_FRAGMENT
    ours = forward_program(glcontext, gpu[1], light, shadow_map, "core330")
    vertex = Variant("pass/forward.vert", "core330", {}, {}).compose()
    lines = source.splitlines()
    theirs = Program(
        glcontext, vertex, Text(source, (("stranger", 1),) * len(lines), ("stranger", "stranger"), frozenset())
    )
    expected = forward.draw(ours, light, shadow_map)
    found = forward.draw(theirs, light, shadow_map, u_towards=(0.0, 0.0, 1.0))
    theirs.gl.release()
    shadow_map.atlas.release()
    # The foreign program has no eye position: a face edge-on to it, which ours flips towards the camera, may differ.
    assert (found.values != expected.values).any(axis=-1).sum() <= 2
    assert (found.values[found.hit] < 0.5).any()


def test_light_without_a_map_is_unshadowed(glcontext: GLContext) -> None:
    text = receiver_source(glcontext, DirectionalLight(shadow=None), None, "es100")
    assert "float light_visibility(" in text
    assert "u_map" not in text


def test_unknown_dialect_and_missing_shadow_are_named(glcontext: GLContext, gpu: tuple[GpuScene, Programs]) -> None:
    with pytest.raises(SettingsError, match=r"core330_gather.*got 'es300'"):
        receiver_source(glcontext, DirectionalLight(), None, "es300")
    with pytest.raises(SettingsError, match="a light with a Shadow"):
        draw_map(glcontext, gpu[1], gpu[0], DirectionalLight(shadow=None), ())
