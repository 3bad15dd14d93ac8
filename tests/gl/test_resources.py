"""GPU memory: no allocation per frame once warm, unused objects are freed, and too large requests are named errors."""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from glshadow import scenes as builtin
from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import translation
from glshadow.errors import ResourceError, SettingsError
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.shadows.filters import Hard
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow

SIZE = (64, 48)
MAKERS = (
    "buffer",
    "texture",
    "depth_texture",
    "framebuffer",
    "simple_framebuffer",
    "vertex_array",
    "program",
    "sampler",
)


@pytest.fixture
def renderer() -> Iterator[Renderer]:
    with Renderer("egl") as renderer:
        yield renderer


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Counts every object that moderngl creates."""
    counts: Counter[str] = Counter()

    def counted(name: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def make(*arguments: Any, **settings: Any) -> Any:
            counts[name] += 1
            return original(*arguments, **settings)

        return make

    for name in MAKERS:
        monkeypatch.setattr(moderngl.Context, name, counted(name, getattr(moderngl.Context, name)))
    return counts


@pytest.fixture
def scene() -> Scene:
    return builtin.box().scene


def lights(step: int) -> list[Light]:
    shift = 0.1 * step
    cone = Shadow(resolution=64, filter=Hard(), target=Target.RGBA8)
    return [
        DirectionalLight(direction=(-0.6 + shift, -1.0, 0.4), shadow=Shadow(resolution=128)),
        SpotLight(position=(2.0 + shift, 5.0, 2.0), direction=(-2.0, -5.0, -2.0), shadow=cone),
        PointLight(position=(-2.0 + shift, 4.0, 1.0), shadow=Shadow(resolution=64)),
    ]


def camera(step: int) -> PerspectiveCamera:
    return PerspectiveCamera((4.0 + 0.2 * step, 5.0, 6.0), (0.0, 0.1 * step, 0.0))


def test_warm_renderer_allocates_nothing(renderer: Renderer, scene: Scene, made: Counter[str]) -> None:
    """Moving lights, camera and nodes: no texture, buffer, framebuffer, vertex array or program after the second frame."""
    outputs = ("image", "visibility", "depth", "linear", "shadow_maps")
    for step in range(6):
        renderer.render(scene, camera(step), lights(step), SIZE, outputs=outputs, samples=1)
        if step == 0:
            assert {"texture", "framebuffer", "vertex_array", "program", "buffer"} <= set(made)
        if step == 1:
            made.clear()
    assert made == {}


def test_moving_a_node_uploads_no_mesh(renderer: Renderer, scene: Scene, made: Counter[str]) -> None:
    for step in range(5):
        moved = scene.moved({"box": translation((0.1 * step, 0.0, 0.0))})
        renderer.render(moved, camera(0), lights(0), SIZE, samples=1)
        if step == 1:
            made.clear()
    # per frame at most the scene's tables: planes and colours, vertices, triangles and their neighbours
    assert set(made) <= {"buffer"}
    assert made["buffer"] <= 5 * 3


def test_same_settings_share_a_program(renderer: Renderer, scene: Scene, made: Counter[str]) -> None:
    renderer.render(scene, camera(0), lights(0), SIZE, samples=1)
    renderer.render(scene, camera(0), lights(0), SIZE, samples=1)
    made.clear()
    changed = [replace(light, shadow=replace(light.shadow, resolution=32)) for light in lights(1)]
    renderer.render(scene, camera(0), changed, (32, 32), samples=1)
    assert made["program"] == 0


def fresh_scene(number: int) -> Scene:
    source = builtin.box().scene
    box = source.nodes[1].mesh
    copy = Mesh(box.positions * (1.0 + 0.01 * number), box.triangles)
    return replace(source, nodes=(source.nodes[0], Node(copy, np.eye(4), "box")))


def test_gpu_mesh_is_freed_with_its_mesh(renderer: Renderer) -> None:
    first = fresh_scene(0)
    renderer.render(first, lights=lights(0), size=SIZE, samples=1)
    gpu = renderer._cache.meshes.get(first.nodes[1].mesh)
    ground = renderer._cache.meshes.get(first.nodes[0].mesh)
    buffer = gpu.shape.positions
    other = fresh_scene(1)
    other = replace(other, nodes=(first.nodes[0], other.nodes[1]))  # shares the ground
    del first
    gc.collect()
    renderer.render(other, lights=lights(0), size=SIZE, samples=1)
    gc.collect()
    renderer.render(other, lights=lights(0), size=SIZE, samples=1)
    assert isinstance(buffer.mglo, moderngl.InvalidObject), "the vertex buffer of a deleted mesh was kept"
    assert renderer._cache.meshes.get(other.nodes[0].mesh) is ground
    assert len(renderer._cache.meshes._meshes) == 2


def test_many_scenes_keep_the_memory_flat(renderer: Renderer) -> None:
    for number in range(30):
        renderer.render(fresh_scene(number), lights=lights(number % 3), size=(32 + number % 3, 24), samples=1)
    gc.collect()
    renderer.render(fresh_scene(99), lights=lights(0), size=SIZE, samples=1)
    assert len(renderer._cache.meshes._meshes) <= 4


def test_renderer_does_not_keep_a_scene_alive(renderer: Renderer) -> None:
    import weakref

    scene = fresh_scene(0)
    renderer.render(scene, lights=lights(0), size=SIZE, samples=1)
    mesh = weakref.ref(scene.nodes[1].mesh)
    alive = weakref.ref(scene)
    del scene
    gc.collect()
    assert alive() is None
    renderer.render(fresh_scene(1), lights=lights(0), size=SIZE, samples=1)
    gc.collect()
    assert mesh() is None


def still_works(renderer: Renderer, scene: Scene) -> None:
    frame = renderer.render(scene, camera(0), lights(0), SIZE, samples=1)
    assert 0.2 < np.nanmean(frame.visibility) < 0.99
    assert renderer._context.ctx.error == "GL_NO_ERROR"


def test_image_size_beyond_the_driver_limit(renderer: Renderer, scene: Scene) -> None:
    limit = renderer.info["max_texture_size"]
    still_works(renderer, scene)
    for size in ((limit + 1, 4), (4, 2 * limit)):
        with pytest.raises(
            SettingsError, match=rf"the image must be 1 to \d+ pixels wide and high .* got {size[0]} x {size[1]}"
        ):
            renderer.render(scene, size=size, lights=lights(0), samples=1)
        still_works(renderer, scene)


def test_map_size_beyond_the_driver_limit(renderer: Renderer, scene: Scene) -> None:
    """Six faces of 16384 need an atlas of three times that side."""
    huge = PointLight(position=(-2.0, 4.0, 1.0), shadow=Shadow(resolution=16384))
    with pytest.raises((ResourceError, SettingsError), match=r"shadow map .*16384"):
        renderer.render(scene, camera(0), [huge], SIZE, samples=1)
    still_works(renderer, scene)


def test_out_of_memory(renderer: Renderer, scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """moderngl does not raise when a texture cannot be allocated; the driver reports it only through its error queue."""
    still_works(renderer, scene)
    kind = type(renderer._context.gl)
    drain, said = kind._drain, []

    def out_of_memory(self: Any) -> list[int]:
        codes = drain(self)
        if not said:
            said.append(0x0505)
            return [*codes, *said]
        return codes

    monkeypatch.setattr(kind, "_drain", out_of_memory)
    with pytest.raises(ResourceError, match="memory"):
        renderer.render(scene, camera(0), lights(0), (80, 60), samples=1)
    assert said
    still_works(renderer, scene)
    still_works(renderer, scene)


def test_release_frees_everything(made: Counter[str]) -> None:
    """Objects of a foreign context outlive the renderer: it must free each one that it created."""
    names = {"libgl": "libEGL.so.1", "libegl": "libEGL.so.1"}
    with moderngl.create_context(standalone=True, backend="egl", require=330, **names) as ctx:
        before = objects(ctx)
        with Renderer(context=ctx) as renderer:
            for step in range(3):
                renderer.render(
                    fresh_scene(step),
                    camera(step),
                    lights(step),
                    SIZE,
                    outputs=("image", "visibility", "linear"),
                    samples=1,
                )
            assert objects(ctx) != before
        assert objects(ctx) == before
    ctx.release()


def objects(ctx: moderngl.Context) -> Counter[str]:
    """Names of the textures, buffers, framebuffers and programs that exist, found by testing each name."""
    from ctypes import CFUNCTYPE, c_ubyte, c_uint

    found: Counter[str] = Counter()
    for kind in ("Texture", "Buffer", "Framebuffer", "Program", "VertexArray", "Sampler"):
        is_object = CFUNCTYPE(c_ubyte, c_uint)(ctx.mglo._context.load_opengl_function(f"glIs{kind}"))
        found[kind] = sum(bool(is_object(number)) for number in range(1, 400))
    return found
