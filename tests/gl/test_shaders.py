"""A foreign program with foreign vertex arrays samples our shadow maps: against rays, with several lights, and with its state restored."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import ClipSpace, perspective
from glshadow.gl.driver.state import read_state
from glshadow.gl.foreign.shaders import _renamed

SIZE = (240, 160)
SCENE = gs.scenes.courtyard()
CAMERA = SCENE.camera
LIGHTS: dict[str, gs.Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, 0.35)),
    "spot": gs.SpotLight(position=(7.0, 9.0, 6.0), direction=(-7.0, -9.0, -6.0), outer_angle=40.0, inner_angle=40.0),
    "point": gs.PointLight(position=(1.0, 6.0, 2.0)),
}
VERTEX = """#version 330
uniform mat4 camera;
in vec3 place;
in vec3 direction;
out vec3 position;
out vec3 normal;
void main() {
    position = place;
    normal = direction;
    gl_Position = camera * vec4(place, 1.0);
}
"""
REST = """
uniform vec3 eye;
in vec3 position;
in vec3 normal;
out vec4 color;
void main() {
    vec3 n = dot(normal, position - eye) > 0.0 ? -normal : normal;
    color = vec4(%s);
}
"""


class Foreign:
    """A plain moderngl program of a caller: its own context, buffers and matrices."""

    def __init__(self) -> None:
        self.ctx = moderngl.create_standalone_context(require=330, backend="egl")
        corners = np.concatenate(
            [
                (node.mesh.positions @ node.world_from_mesh[:3, :3].T + node.world_from_mesh[:3, 3])[
                    node.mesh.triangles
                ]
                for node in SCENE.nodes
            ]
        )
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        self.places = self.ctx.buffer(corners.astype("f4").tobytes())
        self.normals = self.ctx.buffer(np.repeat(normals, 3, axis=0).astype("f4").tobytes())
        self.color = self.ctx.texture(SIZE, 4, dtype="f4")
        self.target = self.ctx.framebuffer([self.color], self.ctx.depth_renderbuffer(SIZE))
        self.bounds = SCENE.bounds

    def cast(self, caster: gs.Caster) -> None:
        caster.program["u_clip_from_model"].write(caster.bytes_from())  # type: ignore[union-attr]
        array = self.ctx.vertex_array(caster.program, [(self.places, "3f", "in_position")])
        array.render()
        array.release()

    def shade(self, light: gs.Light, shown: str, cast: Callable[[gs.Caster], Any] | None = None) -> np.ndarray:
        """An image of GLSL expressions for a light named lamp."""
        with gs.ShadowMap(self.ctx, light, self.bounds) as shadow:
            program = self.ctx.program(vertex_shader=VERTEX, fragment_shader=shadow.source("lamp") + REST % shown)
            shadow.draw(cast or self.cast)
            shadow.apply(program, "lamp", unit=2)
            return self.picture(program)

    def picture(self, program: moderngl.Program) -> np.ndarray:
        """(H, W, 4), row 0 at the top; what is not drawn stays -1."""
        matrix = perspective(*CAMERA.window(SIZE), 0.5, 60.0, ClipSpace(False, False)) @ CAMERA.view_from_world
        program["camera"].write(np.ascontiguousarray(matrix.T, dtype="f4").tobytes())  # type: ignore[union-attr]
        if "eye" in program:
            program["eye"].value = CAMERA.position  # type: ignore[union-attr]
        content = [(self.places, "3f", "place"), (self.normals, "3f", "direction")]
        array = self.ctx.vertex_array(program, [each for each in content if each[2] in program])
        self.target.use()
        self.target.clear(-1.0, -1.0, -1.0, -1.0)
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        array.render()
        array.release()
        return np.frombuffer(self.color.read(), np.float32).reshape(SIZE[1], SIZE[0], 4)[::-1]


@pytest.fixture
def foreign() -> Iterator[Foreign]:
    made = Foreign()
    yield made
    made.ctx.release()


@pytest.mark.parametrize("filter", [gs.Hard(), gs.Pcf(1), gs.Gaussian(2), gs.Pcss(), gs.Evsm(1)], ids=str)
@pytest.mark.parametrize("name", list(LIGHTS))
def test_shadows_match_rays(foreign: Foreign, name: str, filter: gs.Filter) -> None:
    light = replace(LIGHTS[name], shadow=gs.Shadow(filter=filter, resolution=2048))
    truth = gs.trace(SCENE, None, [light], SIZE, samples=1)
    seen = foreign.shade(light, "vec3(lamp_visibility(position, n)), 1.0")[..., 0]
    known = (truth.cosine[0] > 0.05) & truth.reached[0] & (seen >= 0.0) & (truth.node >= 0)
    assert known.mean() > 0.25
    wrong = np.abs(seen - truth.visibility[0])[known] > 0.5
    assert wrong.mean() < 0.03, "silhouettes are included, where a pixel may show the neighbour"
    assert 0.03 < (seen[known] < 0.5).mean() < 0.9


@pytest.mark.parametrize("name", list(LIGHTS))
def test_back_facing_surface_is_dark(foreign: Foreign, name: str) -> None:
    """Regardless of the map: nothing casts here."""
    shown = "lamp_visibility(position, n), dot(lamp_towards(position), n), lamp_arriving(position), 1.0"
    seen = foreign.shade(LIGHTS[name], shown, lambda caster: None)
    drawn = seen[..., 3] > 0.0
    away, towards = drawn & (seen[..., 1] < -1e-3), drawn & (seen[..., 1] > 1e-3) & (seen[..., 2] > 1e-6)
    assert away.sum() > 300
    np.testing.assert_array_equal(seen[away, 0], 0.0)
    assert (seen[towards, 0] > 1.0 - 1e-6).all(), "the weights of four texels, rounded"


@pytest.mark.parametrize("name", list(LIGHTS))
def test_light_directions_and_irradiance(foreign: Foreign, name: str) -> None:
    light = LIGHTS[name] if name == "sun" else replace(LIGHTS[name], falloff=2.0, range=30.0)
    seen = foreign.shade(light, "lamp_towards(position), lamp_arriving(position)")
    truth = gs.trace(SCENE, None, [light], SIZE, samples=1)
    known = (truth.node >= 0) & (seen[..., 3] >= 0.0)
    towards, distance = light.to_light(np.nan_to_num(truth.position))
    gap = np.abs(seen[..., :3] - towards).max(axis=-1)[known]
    assert np.quantile(gap, 0.95) < 2e-2, "a pixel's own triangle, except at silhouettes"
    expected = np.ones(truth.node.shape) if name == "sun" else (1.0 - (distance / 30.0) ** 4) ** 2 / distance**2
    inside = known & truth.reached[0]  # of the spot's cone
    assert np.quantile(np.abs(seen[..., 3] - expected)[inside], 0.95) < 1e-3


def test_several_lights_in_one_program_by_include(foreign: Foreign) -> None:
    ctx = foreign.ctx
    shadows = {name: gs.ShadowMap(ctx, LIGHTS[name], foreign.bounds) for name in LIGHTS}
    asked = ", ".join(f"{name}_visibility(position, n)" for name in LIGHTS)
    includes = "".join(f'#include "{shadow.include(name)}"\n' for name, shadow in shadows.items())
    program = ctx.program(
        vertex_shader=VERTEX, fragment_shader="#version 330\n" + includes + REST % f"vec3({asked}), 1.0"
    )
    for unit, (name, shadow) in enumerate(shadows.items()):
        shadow.draw(foreign.cast)
        shadow.apply(program, name, unit)
    together = foreign.picture(program)
    for number, (name, shadow) in enumerate(shadows.items()):
        alone = ctx.program(
            vertex_shader=VERTEX,
            fragment_shader=shadow.source(name) + REST % f"vec3({name}_visibility(position, n)), 1.0",
        )
        shadow.apply(alone, name, 0)
        np.testing.assert_allclose(foreign.picture(alone)[..., 0], together[..., number], atol=1e-5)
        shadow.release()


def test_moving_light_keeps_its_shader_source(foreign: Foreign) -> None:
    with gs.ShadowMap(foreign.ctx, LIGHTS["sun"], foreign.bounds) as shadow:
        text = shadow.source()
        program = foreign.ctx.program(
            vertex_shader=VERTEX, fragment_shader=text + REST % "vec3(shadow_visibility(position, n)), 1.0"
        )
        pictures = []
        for direction in ((-0.55, -0.8, 0.35), (0.6, -0.8, 0.1)):
            shadow.fit(gs.DirectionalLight(direction=direction))
            shadow.draw(foreign.cast)
            shadow.apply(program)
            pictures.append(foreign.picture(program)[..., 0])
        assert shadow.source() == text
    assert (np.abs(pictures[0] - pictures[1]) > 0.5).mean() > 0.05


def test_gl_state_is_restored(foreign: Foreign) -> None:
    ctx = foreign.ctx
    with gs.ShadowMap(ctx, LIGHTS["spot"], foreign.bounds) as shadow:
        foreign.target.use()
        ctx.viewport = (3, 5, 70, 60)
        ctx.enable_only(moderngl.BLEND | moderngl.CULL_FACE)
        ctx.blend_func = moderngl.SRC_ALPHA, moderngl.ONE
        context = shadow._context
        picture = []
        for _ in range(2):
            before = read_state(ctx, context.gl)
            shadow.draw(foreign.cast)
            assert read_state(ctx, context.gl) == before
            picture.append(shadow._sampled.atlas.texture.read())
        assert picture[0] == picture[1]
        assert ctx.error == "GL_NO_ERROR"

        def fails(caster: gs.Caster) -> None:
            raise ZeroDivisionError

        before = read_state(ctx, context.gl)
        with pytest.raises(ZeroDivisionError):
            shadow.draw(fails)
        assert read_state(ctx, context.gl) == before
        shadow.draw(foreign.cast)
        assert shadow._sampled.atlas.texture.read() == picture[0]
    shadow.release()
    with pytest.raises(gs.SettingsError, match="was released"):
        shadow.draw(foreign.cast)


@pytest.mark.parametrize(
    ("light", "bounds", "said"),
    [
        (gs.DirectionalLight(shadow=None), np.array([[0, 0, 0], [1, 1, 1]]), "with a Shadow"),
        (gs.SkyLight(), np.array([[0, 0, 0], [1, 1, 1]]), "with a Shadow"),
        (gs.DirectionalLight(shadow=gs.Shadow(target=gs.Target.R8)), np.array([[0, 0, 0], [1, 1, 1]]), "draws depth"),
        (gs.DirectionalLight(), np.array([[1, 0, 0], [0, 1, 1]]), "bounds must be"),
        (gs.DirectionalLight(), None, "bounds must be"),
        (gs.DirectionalLight(), "all", "bounds must be"),
        (None, np.eye(3)[:2], "with a Shadow"),
    ],
)
def test_bad_arguments_are_refused(foreign: Foreign, light: Any, bounds: Any, said: str) -> None:
    with pytest.raises(gs.SettingsError, match=said):
        gs.ShadowMap(foreign.ctx, light, bounds)


def test_names(foreign: Foreign) -> None:
    with gs.ShadowMap(foreign.ctx, LIGHTS["sun"], foreign.bounds) as shadow:
        for wrong in ("", "Sun", "a b", "1a", "gl__x", None, 3):
            with pytest.raises(gs.SettingsError, match="name must be"):
                shadow.source(wrong)  # type: ignore[arg-type]
        with pytest.raises(gs.SettingsError, match="world_from_model"):
            gs.Caster(np.eye(4), None).bytes_from(np.eye(3))  # type: ignore[arg-type]
    code = "uniform vec4 u_a;\n#define GLS_B 1\nstruct Thing {\n    float x;\n};\n"
    text = _renamed(code + "float asked(Thing thing) {\n    return u_a.x + thing.x;\n}\n", "sun")
    assert "uniform vec4 sun_u_a;" in text
    assert "#define sun_GLS_B 1" in text
    assert "float sun_asked(sun_Thing thing) {\n    return sun_u_a.x + thing.x;" in text
