"""Contexts: every backend, the messages if none works, nesting, threads, foreign contexts, limits."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from ctypes import CDLL
from pathlib import Path

import moderngl
import numpy as np
import pytest

from glshadow import doctor
from glshadow.errors import ContextError, GlshadowError, ResourceError, SettingsError
from glshadow.gl.driver import backends
from glshadow.gl.driver.backends import OSMESA_LIBRARIES, BackendUnavailable
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.context import GLContext, open_context
from glshadow.gl.driver.current import current
from glshadow.gl.driver.entry_points import (
    DEPTH_COMPONENT16,
    DEPTH_COMPONENT24,
    DEPTH_COMPONENT32F,
    R32F,
    R32UI,
    RGBA32F,
    RGBA32UI,
)
from glshadow.gl.driver.state import read_state

from ..tolerances import PATIENCE_S

# One triangle over the whole target at NDC depth z.
TRIANGLE = """#version 330
void main() {{ gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, {z}, 1.0); }}"""
WINDOW_CHECKS = Path(__file__).with_name("window_checks.py")


def paint(glcontext: GLContext, value: int) -> int:
    """Clear a small target to `value` and read it back."""
    with glcontext as context:
        texture = context.ctx.texture((2, 2), 4)
        framebuffer = context.ctx.framebuffer([texture])
        framebuffer.clear(*[value / 255] * 4)
        found = texture.read()[0]
        framebuffer.release()
        texture.release()
        context.check_errors("painting")
        return found


def has_osmesa() -> bool:
    for name in OSMESA_LIBRARIES:
        try:
            CDLL(name)
        except OSError:
            continue
        return True
    return False


@pytest.fixture(params=["egl", "osmesa"])
def opened(request: pytest.FixtureRequest, optional: Callable[[str, str], None]) -> Iterator[GLContext]:
    if request.param == "osmesa" and not has_osmesa():
        optional("OSMesa", "libosmesa6")
    context = open_context(request.param)
    yield context
    context.release()


@pytest.fixture
def pair() -> Iterator[tuple[GLContext, GLContext]]:
    a, b = open_context("egl"), open_context("egl")
    yield a, b
    a.release()
    b.release()


def run_python(*arguments: str, **environment: str) -> str:
    """Run a fresh interpreter; returns its standard output."""
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)} | environment
    done = subprocess.run(
        [sys.executable, "-W", "error", *arguments], env=env, capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# -- opening


def test_backend_renders_and_reports_its_name(opened: GLContext) -> None:
    assert paint(opened, 77) == 77
    caps = opened.caps
    assert caps.version_code >= 330
    assert caps.renderer
    assert caps.max_texture_size >= 4096
    assert caps.max_texture_buffer_size >= 65536  # minimum that OpenGL 3.3 allows
    assert opened.owned


def test_drawn_by_mesa_in_software(session_glcontext: GLContext) -> None:
    """CI measures and compares on llvmpipe; another driver would silently change what the numbers mean."""
    if "llvmpipe" not in session_glcontext.caps.renderer:
        pytest.skip(f"drawn by {session_glcontext.caps.renderer}")
    assert session_glcontext.caps.software
    assert session_glcontext.caps.clip_control


def test_opening_keeps_the_current_context(pair: tuple[GLContext, GLContext]) -> None:
    a, _ = pair
    assert current() == {}
    with a:
        before = current()
        third = open_context("egl")
        assert current() == before
        assert paint(third, 5) == 5
        third.release()
        assert current() == before
    assert current() == {}


@pytest.mark.parametrize("backend", ["glx", "", "EGL"])
def test_unknown_backend(backend: str) -> None:
    with pytest.raises(SettingsError, match=r"'auto', 'egl', 'osmesa', 'window', got"):
        open_context(backend)  # type: ignore[arg-type]


def test_not_a_context() -> None:
    with pytest.raises(SettingsError, match=r"moderngl\.Context, got object"):
        open_context(context=object())  # type: ignore[arg-type]


def test_auto_takes_the_first_that_works(monkeypatch: pytest.MonkeyPatch) -> None:
    assert list(backends.LOADERS) == ["egl", "osmesa", "window"]

    def refuse() -> backends.Loader:
        raise BackendUnavailable("no", "nothing")

    egl = backends.LOADERS["egl"]
    monkeypatch.setitem(backends.LOADERS, "egl", refuse)
    monkeypatch.setitem(backends.LOADERS, "osmesa", egl)
    context = open_context()
    assert context.caps.backend == "osmesa"
    context.release()


def test_auto_lists_every_attempt_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuser(reason: str, remedy: str) -> Callable[[], backends.Loader]:
        def refuse() -> backends.Loader:
            raise BackendUnavailable(reason, remedy)

        return refuse

    for name in backends.LOADERS:
        monkeypatch.setitem(backends.LOADERS, name, refuser(f"{name} is broken", f"mend {name}"))
    with pytest.raises(ContextError) as caught:
        open_context()
    for name in ("egl", "osmesa", "window"):
        assert f"{name}: {name} is broken; mend {name}" in str(caught.value)


def test_missing_library_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(backends, "EGL_LIBRARY", "libNoSuchEGL.so.1")
    with pytest.raises(ContextError, match=r"libNoSuchEGL.*apt-get install libegl1 libgl1-mesa-dri"):
        open_context("egl")
    monkeypatch.setattr(backends, "OSMESA_LIBRARIES", ("libNoSuchOSMesa.so",))
    with pytest.raises(ContextError, match=r"libNoSuchOSMesa.*apt-get install libosmesa6"):
        open_context("osmesa")


def test_egl_needs_no_libgl() -> None:
    """libGL.so.1 is not among the packages that the README requires; the default of moderngl would load it."""
    code = (
        "from glshadow.gl.driver.context import open_context\n"
        "from pathlib import Path\n"
        "with open_context('egl') as c:\n"
        "    f = c.ctx.simple_framebuffer((4, 4)); f.clear(1, 1, 1, 1); assert f.read()[0] == 255\n"
        "print([l for l in Path('/proc/self/maps').read_text().split() if '/libGL.so' in l])\n"
    )
    assert run_python("-c", code).strip() == "[]"


# -- current contexts


def test_blocks_nest_in_any_order(pair: tuple[GLContext, GLContext]) -> None:
    a, b = pair
    with a:
        place_a = current()
        with b:
            place_b = current()
            assert place_b != place_a
            with a, a:
                assert current() == place_a
            assert current() == place_b
        assert current() == place_a
    assert current() == {}


def test_egl_and_osmesa_nest(opened: GLContext, session_glcontext: GLContext) -> None:
    with session_glcontext as egl:
        texture = egl.ctx.texture((2, 2), 4, bytes([7] * 16))
        assert paint(opened, 21) == 21
        with opened, egl:
            assert texture.read()[0] == 7
        assert texture.read()[0] == 7
        assert paint(opened, 22) == 22
        texture.release()


def test_ids_of_two_contexts_do_not_mix(pair: tuple[GLContext, GLContext]) -> None:
    a, b = pair
    with a:
        texture_a = a.ctx.texture((2, 2), 4, bytes([10] * 16))
    with b:
        texture_b = b.ctx.texture((2, 2), 4, bytes([20] * 16))
    assert texture_a.glo == texture_b.glo, "the test is about equal ids"
    with a:
        assert texture_a.read()[0] == 10
        with b:
            assert texture_b.read()[0] == 20
        assert texture_a.read()[0] == 10


def test_one_context_per_thread() -> None:
    found: dict[int, list[int]] = {}
    barrier = threading.Barrier(3, timeout=PATIENCE_S)

    def work(value: int) -> None:
        context = open_context("egl")
        barrier.wait()
        found[value] = [paint(context, value + i) for i in range(20)]
        context.release()

    threads = [threading.Thread(target=work, args=(value,)) for value in (10, 60, 110)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {value: list(range(value, value + 20)) for value in (10, 60, 110)}


def test_context_moves_between_threads_but_is_never_in_two(pair: tuple[GLContext, GLContext]) -> None:
    a, _ = pair
    found: list[object] = []

    def work() -> None:
        try:
            found.append(paint(a, 33))
        except ContextError as error:
            found.append(str(error))

    def in_thread() -> object:
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
        return found.pop()

    assert in_thread() == 33
    with a:
        assert "one thread at a time" in str(in_thread())
        assert paint(a, 34) == 34
    assert in_thread() == 33


def test_release_twice_and_use_after(pair: tuple[GLContext, GLContext]) -> None:
    a, b = pair
    with a:
        a.release()
        assert current() == {}
    a.release()
    with pytest.raises(ContextError, match="released"), a:
        pass
    assert paint(b, 9) == 9


# -- foreign contexts


def host_state(ctx: moderngl.Context) -> moderngl.Framebuffer:
    """A program that changed all default state; returns the framebuffer that it has bound."""
    framebuffer = ctx.simple_framebuffer((8, 8))
    framebuffer.viewport = (1, 2, 5, 4)
    framebuffer.scissor = (2, 1, 3, 5)
    framebuffer.color_mask = (True, False, True, True)
    framebuffer.depth_mask = False
    framebuffer.use()
    ctx.clear(0.1, 0.2, 0.3, 0.4, depth=0.3)
    ctx.enable_only(moderngl.CULL_FACE | moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)
    ctx.depth_func = ">="
    ctx.cull_face = "front"
    ctx.front_face = "cw"
    ctx.blend_func = moderngl.SRC_ALPHA, moderngl.ONE
    ctx.blend_equation = moderngl.MAX
    ctx.polygon_offset = 1.5, 3.0
    ctx.wireframe = True
    ctx.depth_clamp_range = (0.2, 0.8)
    for unit in (0, 3, 15):
        ctx.texture((2, 2), 4).use(unit)
        ctx.sampler(filter=(moderngl.NEAREST, moderngl.NEAREST)).use(unit)
    ctx.buffer(reserve=64).bind_to_uniform_block(2)
    return framebuffer


def draw_everything(glcontext: GLContext) -> None:
    """All that a renderer does to a context, and more."""
    ctx, gl = glcontext.ctx, glcontext.gl
    depth = ctx.depth_texture((4, 4))
    gl.specify_depth(depth.glo, (4, 4), DEPTH_COMPONENT32F)
    colour = ctx.texture((4, 4), 4, dtype="f4")
    framebuffer = ctx.framebuffer([colour], depth)
    framebuffer.use()
    framebuffer.clear(0.5, 0.5, 0.5, 0.5, depth=0.0)
    gl.clip_control(zero_to_one=True)
    ctx.enable_only(moderngl.DEPTH_TEST)
    ctx.depth_func = "1"
    ctx.cull_face = "back"
    ctx.polygon_offset = -2.0, -4.0
    ctx.blend_func = moderngl.ONE, moderngl.ONE
    ctx.blend_equation = moderngl.MIN
    ctx.depth_clamp_range = (0.0, 1.0)
    for unit in range(16):
        colour.use(unit)
        ctx.sampler(compare_func="<=").use(unit)
    table = BufferTexture(gl, ctx.buffer(reserve=64), RGBA32F)
    table.use(3)
    ctx.buffer(reserve=16).bind_to_uniform_block(2)
    program = ctx.program(
        TRIANGLE.format(z=0.25),
        "#version 330\nout vec4 c; void main() { c = vec4(0.75); }",
    )
    ctx.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    assert memoryview(colour.read()).cast("f")[0] == 0.75
    # Four units of polygon offset, each 2^(e - 23) in a float target; 0.25 = 2^-2.
    assert memoryview(depth.read()).cast("f")[0] == 0.25 - 4 * 2.0**-25
    table.release()


def texture_units(glcontext: GLContext) -> list[tuple[int, int]]:
    """Sampler and 2-D texture of every unit that rendering touches, queried without the code under test."""
    gl, found = glcontext.gl, []
    active = gl.integer(0x84E0)
    for unit in (*range(16), glcontext.ctx.default_texture_unit):
        gl.call("glActiveTexture", 0x84C0 + unit)
        found.append((gl.integer(0x8919), gl.integer(0x8069)))
    gl.call("glActiveTexture", active)
    return found


def test_foreign_context_state_is_restored() -> None:
    host = moderngl.create_context(
        standalone=True, backend="egl", require=330, libgl="libEGL.so.1", libegl="libEGL.so.1"
    )
    framebuffer = host_state(host)
    adopted = open_context(context=host)
    before, units = read_state(host, adopted.gl), texture_units(adopted)
    with adopted.drawing():
        draw_everything(adopted)
        inside = read_state(host, adopted.gl)
        assert all(here != there for here, there in zip(units, texture_units(adopted), strict=True))
    assert read_state(host, adopted.gl) == before
    assert texture_units(adopted) == units
    assert host.fbo is framebuffer
    assert (host.cull_face, host.front_face, host.wireframe) == ("front", "cw", True)
    # moderngl's own bookkeeping: a clear goes to the host's target, a scope restores the host's flags.
    host.clear(1.0, 1.0, 1.0, 1.0)
    assert framebuffer.read(components=1)[2 * 8 + 3] == 255
    with host.scope(framebuffer, moderngl.DEPTH_TEST):
        pass
    assert read_state(host, adopted.gl)["cull face"]
    # The comparison above means something only if the rendering had changed the state.
    changed = {name for name in before if before[name] != inside[name]}
    assert changed >= {
        *("depth test", "cull face", "blend", "blend func", "blend equation", "depth func", "depth mask", "viewport"),
        *(
            "colour masks",
            "clip control",
            "textures",
            "draw framebuffer",
            "clear colour",
            "clear depth",
            "scissor test",
        ),
        *("cull face mode", "front face", "polygon mode", "depth range", "program", "uniform buffers"),
        *("polygon offset",),
    }
    host.release()


def test_foreign_context_is_restored_after_an_exception() -> None:
    host = moderngl.create_context(
        standalone=True, backend="egl", require=330, libgl="libEGL.so.1", libegl="libEGL.so.1"
    )
    host_state(host)
    adopted = open_context(context=host)
    before = read_state(host, adopted.gl)

    def fail() -> None:
        with adopted.drawing():
            draw_everything(adopted)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert read_state(host, adopted.gl) == before
    host.release()


def test_foreign_context_is_not_released(opened: GLContext) -> None:
    adopted = open_context(context=opened.ctx)
    assert not adopted.owned
    assert adopted.caps.backend == "foreign"
    assert paint(adopted, 3) == 3
    adopted.release()
    assert paint(opened, 4) == 4


@pytest.mark.parametrize("check", ["backend", "host_window", "egl_beside_window"])
def test_window(check: str, screen: str) -> None:
    run_python(str(WINDOW_CHECKS), check, DISPLAY=screen)


def test_window_without_display() -> None:
    environment = {"DISPLAY": "", "WAYLAND_DISPLAY": ""}
    code = (
        "from glshadow.gl.driver.context import open_context\n"
        "try: open_context('window')\n"
        "except Exception as e: print(type(e).__name__, e)"
    )
    said = run_python("-c", code, **environment)
    assert said.startswith("ContextError")
    assert "set DISPLAY, or run under xvfb-run" in said


# -- limits and errors


def test_too_large_texture_is_refused_by_name(glcontext: GLContext) -> None:
    limit = glcontext.caps.max_texture_size
    with pytest.raises(SettingsError, match=rf"shadow map must be 1 to \d+ pixels .*got {limit + 1} x 8"):
        glcontext.check_size((limit + 1, 8), "shadow map")
    with pytest.raises(SettingsError, match="got 0 x 8"):
        glcontext.check_size((0, 8), "shadow map")
    glcontext.check_size((1, 1024), "shadow map")


def test_opengl_errors_become_exceptions(glcontext: GLContext) -> None:
    limit = glcontext.caps.max_texture_size
    glcontext.ctx.texture((limit + 1, 1), 4)  # moderngl reports nothing
    with pytest.raises(GlshadowError, match="GL_INVALID_VALUE while making a texture"):
        glcontext.check_errors("making a texture")
    glcontext.check_errors("nothing more")


def test_out_of_memory_is_a_resource_error(glcontext: GLContext) -> None:
    if not glcontext.caps.software:
        pytest.skip("a real GPU may have the 4 GiB")
    # llvmpipe refuses a texture over 1 GiB before it touches memory (Mesa 22.3, LP_MAX_TEXTURE_SIZE).
    glcontext.ctx.texture((16384, 16384), 4, dtype="f4")
    with pytest.raises(ResourceError, match="ran out of memory while making a texture; use a smaller image"):
        glcontext.check_errors("making a texture")


# -- what moderngl lacks


@pytest.mark.parametrize(
    ("internal_format", "step"),
    [(DEPTH_COMPONENT16, 2.0**-16), (DEPTH_COMPONENT24, 2.0**-24), (DEPTH_COMPONENT32F, 2.0**-25)],
)
def test_depth_formats_quantise_as_named(glcontext: GLContext, internal_format: int, step: float) -> None:
    ctx, gl = glcontext.ctx, glcontext.gl
    texture = ctx.depth_texture((2, 2))
    bystander = ctx.texture((1, 1), 4)
    bystander.use(0)
    gl.specify_depth(texture.glo, (2, 2), internal_format)
    assert gl.integer(0x8069) == bystander.glo, "the binding of the active unit is put back"
    assert gl.texture_format(texture.glo) == (2, 2, internal_format)
    value = 0.3
    ctx.framebuffer(depth_attachment=texture).clear(depth=value)
    stored = memoryview(texture.read()).cast("f")[0]
    # Half a step of the format, and half a float32 step at 0.3 (2^-26), because read() gives float32.
    assert abs(stored - value) <= step / 2 + 2.0**-26
    if internal_format == DEPTH_COMPONENT16:
        assert abs(stored - value) > 2.0**-24, "16 bits cannot hold 0.3 better than this"


@pytest.mark.parametrize("zero_to_one", [False, True])
def test_clip_control(glcontext: GLContext, zero_to_one: bool) -> None:
    """Window depth of NDC z = 0.5 is 0.5 where NDC is 0..1, and 0.75 where it is -1..1."""
    ctx = glcontext.ctx
    depth = ctx.depth_texture((2, 2))
    framebuffer = ctx.framebuffer(depth_attachment=depth)
    framebuffer.use()
    framebuffer.clear(depth=1.0)
    program = ctx.program(
        TRIANGLE.format(z=0.5),
        "#version 330\nvoid main() {}",
    )
    ctx.enable_only(moderngl.DEPTH_TEST)
    glcontext.gl.clip_control(zero_to_one)
    ctx.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    glcontext.gl.clip_control(zero_to_one=False)
    ctx.enable_only(moderngl.NOTHING)
    stored = memoryview(depth.read()).cast("f")[0]
    assert stored == pytest.approx(0.5 if zero_to_one else 0.75, abs=2.0**-24)  # one step of 24 bits


def test_missing_function_is_named() -> None:
    from glshadow.gl.driver.entry_points import EntryPoints

    with pytest.raises(ContextError, match="no glClipControl"):
        EntryPoints(lambda name: 0).clip_control(zero_to_one=True)


@pytest.mark.parametrize(
    ("internal_format", "sampler", "kind", "values"),
    [
        (R32F, "samplerBuffer", "f4", [0.5, 1.5, 2.5, 3.5]),
        (RGBA32F, "samplerBuffer", "f4", [0.5, 1.5, 2.5, 3.5]),
        (R32UI, "usamplerBuffer", "u4", [7, 4_000_000_000, 9, 10]),
        (RGBA32UI, "usamplerBuffer", "u4", [7, 4_000_000_000, 9, 10]),
    ],
)
def test_buffer_texture(
    glcontext: GLContext, internal_format: int, sampler: str, kind: str, values: list[float]
) -> None:
    """A shader reads the first texel of the table and writes it to a target of the same type."""
    ctx = glcontext.ctx
    table = BufferTexture(glcontext.gl, ctx.buffer(np.array(values, kind).tobytes()), internal_format)
    target = ctx.texture((1, 1), 4, dtype=kind)
    framebuffer = ctx.framebuffer([target])
    framebuffer.use()
    vector = "uvec4" if kind == "u4" else "vec4"
    program = ctx.program(
        TRIANGLE.format(z=0.0),
        f"#version 330\nuniform {sampler} table; out {vector} c; void main() {{ c = texelFetch(table, 0); }}",
    )
    glcontext.gl.set_sampler(program.glo, "table", 5)
    glcontext.gl.set_sampler(program.glo, "no such name", 6)
    table.use(5)
    ctx.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    found = np.frombuffer(target.read(), kind)
    channels = 4 if internal_format in (RGBA32F, RGBA32UI) else 1
    assert found[:channels].tolist() == values[:channels]
    table.release()
    table.release()


def test_clear_of_one_target(glcontext: GLContext) -> None:
    ctx, gl = glcontext.ctx, glcontext.gl
    ids, colour = ctx.texture((2, 2), 1, dtype="u4"), ctx.texture((2, 2), 4, dtype="f4")
    ctx.framebuffer([ids, colour]).use()
    gl.clear_unsigned(0, (0xFFFFFFFF, 0, 0, 0))
    gl.clear_floats(1, (0.25, 0.0, 0.0, 1.0))
    assert memoryview(ids.read()).cast("I")[0] == 0xFFFFFFFF
    assert memoryview(colour.read()).cast("f")[0] == 0.25


# -- doctor


def test_doctor_reports_what_opens(optional: Callable[[str, str], None]) -> None:
    report = doctor.examine()
    assert list(report["backends"]) == ["egl", "osmesa", "window"]
    egl = report["backends"]["egl"]
    assert egl["works"]
    assert report["auto"] == "egl"
    assert egl["depth_formats"] == {"DEPTH16": True, "DEPTH24": True, "DEPTH32F": True}
    assert set(egl["color_formats"]) == {"R32F", "R16F", "R8", "RGBA8"}
    for backend in report["backends"].values():
        assert backend["works"] or (backend["reason"] and backend["remedy"])
    assert report["packages"]["moderngl"].startswith("5.")


def test_doctor_survives_a_crash(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fake = tmp_path / "python"
    fake.write_text("#!/bin/sh\nkill -SEGV $$\n")
    fake.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(fake))
    report = doctor.examine()
    assert report["auto"] is None
    assert "SIGSEGV" in report["backends"]["egl"]["reason"]
