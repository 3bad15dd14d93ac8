"""What the renderer caches between frames, and what happens when triangle lists do not fit into buffers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import translation
from glshadow.derive.lists import CELLS, LEAST_CELLS
from glshadow.gl.techniques.cells import CellLists
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

from ..robustness.gl_objects import counted
from .compare import shone
from .test_casters import CAMERA, LIGHTS, ground, leaf, leaves

SIZE = (96, 64)
LINK_BYTES = 16

every_light = pytest.mark.parametrize("light", LIGHTS.values(), ids=list(LIGHTS))


@pytest.fixture
def scene() -> Scene:
    ball = Mesh(*shapes.icosphere(3, 0.5))
    nodes = [Node(ball, translation(place), name) for name, place in (("a", (-0.8, 0.9, 0.1)), ("b", (0.8, 1.5, -0.3)))]
    return Scene((ground(), *nodes), CAMERA, name="two balls")


def turned(k: int) -> gs.PerspectiveCamera:
    return replace(CAMERA, position=(3.0 + 0.1 * k, 5.0, 6.0 - 0.1 * k))


def drawn(renderer: Renderer, scene: Scene, light: Light, camera: gs.PerspectiveCamera | None = None) -> int:
    return renderer.render(scene, camera, [light], SIZE, outputs=("visibility",), samples=1).used[0].draws


# Building lists takes one draw, drawing maps takes more: six faces of a point light's map times two nodes.
SHADOWS = {
    "exact": gs.Shadow(filter=gs.Exact()),
    "map": gs.Shadow(resolution=256, filter=gs.Pcf(1), fit=gs.SceneFit()),
}


@pytest.mark.parametrize("shadow", SHADOWS.values(), ids=list(SHADOWS))
@every_light
def test_unchanged_lists_and_maps_are_reused(scene: Scene, light: Light, shadow: gs.Shadow) -> None:
    light = replace(light, shadow=shadow)
    exact = isinstance(shadow.filter, gs.Exact)
    moved_light: Light = (
        replace(light, direction=(-0.41, -1.0, 0.3))
        if isinstance(light, gs.DirectionalLight)
        else replace(light, position=(0.31, 2.61, 0.2))
    )
    with Renderer("egl") as renderer:

        def made(scene: Scene, light: Light, camera: gs.PerspectiveCamera | None = None) -> bool:
            draws = drawn(renderer, scene, light, camera)
            assert draws in (0, 1) or not exact
            return draws > 0

        assert made(scene, light)
        assert not any(made(scene, light, turned(k)) for k in range(3))
        assert not made(scene, replace(light, intensity=0.5, color=(1.0, 0.0, 0.0)))
        assert not made(scene, replace(light, shadow=replace(shadow, strength=0.5)))
        assert made(scene, moved_light)
        assert made(scene, light)
        other = scene.moved({"a": translation((-0.7, 1.0, 0.1))})
        assert made(other, light)
        assert not made(other, light, turned(1))
        assert made(other, replace(light, shadow=replace(shadow, faces=gs.Faces.BOTH)))
        assert not made(other, replace(light, shadow=replace(shadow, faces=gs.Faces.BOTH)), turned(2))


@every_light
def test_reused_lists_give_the_image_of_new_ones(scene: Scene, light: Light) -> None:
    light = replace(light, shadow=gs.Shadow(filter=gs.Exact()))
    other = scene.moved({"b": translation((0.2, 1.3, 0.4))})

    def picture(renderer: Renderer, scene: Scene, k: int) -> np.ndarray:
        values = renderer.render(scene, turned(k), [light], SIZE, outputs=("visibility",), samples=1).visibility
        assert values is not None
        return values

    with Renderer("egl") as kept:
        pictures = [picture(kept, which, k) for which in (scene, other, scene) for k in range(3)]
    jobs = [(which, k) for which in (scene, other, scene) for k in range(3)]
    for values, (which, k) in zip(pictures, jobs, strict=True):
        with Renderer("egl") as fresh:
            np.testing.assert_array_equal(values, picture(fresh, which, k))


def test_exact_lights_and_mapped_lights_do_not_interfere(scene: Scene) -> None:
    """Each exact light has lists of its own, and samples no other light's."""
    exact, mapped = gs.Shadow(filter=gs.Exact()), gs.Shadow(resolution=256)
    chosen = [replace(LIGHTS[name], shadow=shadow) for name, shadow in
              (("sun", exact), ("spot", mapped), ("point light", exact), ("spot", exact))]  # fmt: skip
    with Renderer("egl") as renderer:
        together = renderer.render(scene, None, chosen, SIZE, outputs=("visibility",), samples=1)
        assert [used.draws > 0 for used in together.used] == [True] * 4
        for number, light in enumerate(chosen):
            alone = renderer.render(scene, None, [light], SIZE, outputs=("visibility",), samples=1).visibility
            assert alone is not None
            np.testing.assert_allclose(together.visibility[number], alone[0], atol=1e-5)


@pytest.mark.parametrize("filter_", [gs.Exact(), gs.Hard()], ids=["exact", "hard"])
def test_directional_and_point_light_with_equal_vectors_are_told_apart(
    scene: Scene, filter_: gs.Exact | gs.Hard
) -> None:
    """The floor blocks nothing of a light from above, and everything of a point light below it: the cache must tell the two apart."""
    shadow = gs.Shadow(filter=filter_, resolution=256)
    sun = gs.DirectionalLight(direction=(0.0, -1.0, 0.0), shadow=shadow)
    point_light = gs.PointLight(position=(0.0, -1.0, 0.0), shadow=shadow)
    from_below = replace(CAMERA, position=(3.0, 0.2, 6.0))  # sees the undersides of the balls

    def picture(renderer: Renderer, light: Light) -> np.ndarray:
        values = renderer.render(scene, from_below, [light], SIZE, outputs=("visibility",), samples=1).visibility
        assert values is not None
        return values

    with Renderer("egl") as fresh:
        expected = picture(fresh, point_light)
    with Renderer("egl") as kept:
        picture(kept, sun)
        np.testing.assert_array_equal(picture(kept, point_light), expected)


def test_rotated_rect_light_is_recomputed() -> None:
    """The floor blocks no light of a rectangle parallel to it, and some of a rectangle that reaches below it."""
    floor = Node(Mesh(*shapes.rectangle((-3.0, 0.0, 3.0), (6.0, 0.0, 0.0), (0.0, 0.0, -6.0))), np.eye(4), "floor")
    boxes = [
        Node(Mesh(*shapes.box((side,) * 3, middle)), np.eye(4), name)
        for name, side, middle in (("low", 0.6, (1.4, 0.3, 0.0)), ("high", 0.4, (-1.4, 1.6, 0.0)))
    ]
    scene = Scene((floor, *boxes), gs.PerspectiveCamera((0.0, 1.5, 4.5), (0.0, 0.4, 0.0), fov_y=60.0))
    lying = gs.RectLight(position=(0.0, 0.5, 0.0), direction=(0.0, -1.0, 0.0), width=2.0, height=2.0)
    standing = replace(lying, direction=(1.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
    point_light = gs.PointLight(position=lying.position, radius=0.5 * float(np.hypot(2.0, 2.0)))
    with Renderer("egl") as kept:
        for light in (lying, standing, point_light, replace(standing, height=1.0), lying):
            values = kept.render(scene, None, [light], (192, 108), outputs=("visibility",), samples=1).visibility
            with Renderer("egl") as fresh:
                expected = fresh.render(scene, None, [light], (192, 108), outputs=("visibility",), samples=1).visibility
            np.testing.assert_array_equal(values, expected)


def test_camera_inside_a_closed_box_sees_it_dark() -> None:
    """A closed box around everything shadows only its own inside, which a camera outside does not see."""
    box = Node(Mesh(*shapes.box((4.0, 4.0, 4.0))), np.eye(4), "box")
    small = Node(Mesh(*shapes.box((0.4, 0.4, 0.4), (0.0, 2.2, 0.0))), np.eye(4), "small")
    scene = Scene((box, small))
    outside, inside = (gs.PerspectiveCamera((x, 0.5, 0.3), (0.0, -1.0, 0.0), fov_y=70.0) for x in (9.0, 1.0))
    cut = gs.PerspectiveCamera((9.0, 0.5, 0.3), (0.0, 0.0, 0.0), fov_y=30.0, near=8.0, far=20.0)
    filters: tuple[gs.Filter, ...] = (gs.Exact(), gs.Hard())
    for filter_ in filters:
        sun = gs.DirectionalLight(direction=(0.3, -1.0, 0.2), shadow=gs.Shadow(filter=filter_))
        with Renderer("egl") as renderer:
            links = []
            for camera in (outside, inside, outside, cut, inside):
                frame = renderer.render(scene, camera, [sun], SIZE, outputs=("visibility", "node"), samples=1)
                within = (frame.node == 0) if camera is not outside else np.zeros(frame.node.shape, dtype=bool)
                assert camera is outside or within.sum() > 1000
                assert not frame.visibility[0][within].any()
                links.append(frame.used[0].links)
            if isinstance(filter_, gs.Exact):
                assert links[0] == links[2] < links[1] == links[3] == links[4], (
                    "seen from outside the box need not cast"
                )


# -- triangle lists that do not fit


@pytest.fixture
def expected(scene: Scene) -> dict[str, tuple[np.ndarray, int]]:
    """Each light's image, and how many list entries it needs."""
    result = {}
    with Renderer("egl") as renderer:
        for name, light in LIGHTS.items():
            frame = renderer.render(scene, None, [exact(light)], SIZE, outputs=("visibility",), samples=1)
            result[name] = frame.visibility, frame.used[0].links
    return result


def exact(light: Light) -> Light:
    return replace(light, shadow=gs.Shadow(filter=gs.Exact()))


def limited(renderer: Renderer, texels: int) -> None:
    """Pretend that the driver's largest texture buffer has so many texels."""
    context = renderer._context
    context.caps = replace(context.caps, max_texture_buffer_size=texels)


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", list(LIGHTS))
def test_too_small_lists_grow(
    scene: Scene, expected: dict[str, tuple[np.ndarray, int]], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    sizes: list[int] = []
    reserve: Callable[[CellLists, int], None] = CellLists.reserve

    def tight(self: CellLists, size: int) -> None:
        sizes.append(size if sizes else 64 * LINK_BYTES)
        reserve(self, sizes[-1])

    monkeypatch.setattr(CellLists, "reserve", tight)
    with Renderer("egl") as renderer:
        frame = renderer.render(scene, None, [exact(LIGHTS[name])], SIZE, outputs=("visibility",), samples=1)
        grid = renderer._cache.techniques[0, "Listed"].grid
        assert grid.cells == CELLS[grid.projection]
    assert len(sizes) == 2, "grown once, to what was needed"
    assert sizes[1] >= LINK_BYTES * expected[name][1]
    np.testing.assert_array_equal(frame.visibility, expected[name][0])
    assert frame.used[0].links == expected[name][1]


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", list(LIGHTS))
def test_lists_at_the_buffer_limit_use_a_coarser_grid(
    scene: Scene, expected: dict[str, tuple[np.ndarray, int]], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(CellLists, "reserve", _least)
    with Renderer("egl") as renderer:
        limited(renderer, expected[name][1] // 2)
        frame = renderer.render(scene, None, [exact(LIGHTS[name])], SIZE, outputs=("visibility",), samples=1)
        grid = renderer._cache.techniques[0, "Listed"].grid
        assert LEAST_CELLS <= grid.cells < CELLS[grid.projection]
    assert 0 < frame.used[0].links <= expected[name][1] // 2
    np.testing.assert_array_equal(frame.visibility, expected[name][0])


_reserve = CellLists.reserve


def _least(self: CellLists, size: int) -> None:
    """Allocate 64 entries first, so that the limit matters and not the generous first size."""
    _reserve(self, min(size, max(64 * LINK_BYTES, self.count * LINK_BYTES)))


SOFT: dict[str, Light] = {
    "soft sun": gs.DirectionalLight(direction=(-0.4, -1.0, 0.3), angle=6.0),
    "soft lamp": gs.PointLight(position=(0.3, 2.6, 0.2), radius=0.1),
}


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("light", [*LIGHTS.values(), *SOFT.values()], ids=[*LIGHTS, *SOFT])
def test_lists_built_in_parts_equal_those_built_at_once(scene: Scene, light: Light) -> None:
    """A storage buffer holds the facets of half of the scene's triangles, and even fewer list entries."""
    ball, cut_out = Mesh(*shapes.icosphere(4, 0.4)), Node(leaf(leaves()), translation((0.2, 2.0, 0.1)), "leaf")
    scene = replace(scene, nodes=(*(replace(node, mesh=ball) for node in scene.nodes[1:]), scene.nodes[0], cut_out))
    triangles = sum(len(node.mesh.triangles) for node in scene.nodes)
    light = light if light in SOFT.values() else exact(light)
    frames, parts = [], []
    for block in (None, 24 * triangles):
        with Renderer("egl") as renderer:
            if block is not None:
                renderer._context.caps = replace(renderer._context.caps, max_storage_block=block)
            frames.append(renderer.render(scene, None, [light], SIZE, outputs=("visibility",), samples=1))
            parts.append(min(source.lists._part for source in renderer._cache.techniques.values()))
    assert parts[0] > triangles
    assert parts[1] <= triangles / 2
    assert frames[0].used[0].links == frames[1].used[0].links > 0
    assert "exact" in str(frames[1].used[0].filter)
    np.testing.assert_array_equal(frames[0].visibility, frames[1].visibility)


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", list(LIGHTS))
def test_lists_that_never_fit_raise(scene: Scene, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr(CellLists, "reserve", _least)
    triangles = sum(len(node.mesh.triangles) for node in scene.nodes)
    with Renderer("egl") as renderer:
        usual = renderer.render(scene, None, [exact(LIGHTS[name])], SIZE, outputs=("visibility",), samples=1).visibility
        before = renderer._context.caps
        renderer._cache.techniques.pop((0, "Listed")).release()
        limited(renderer, 3 * triangles)
        run = CellLists._run
        # as if there were a thousand times as many
        monkeypatch.setattr(CellLists, "_run", lambda self, *given: (1000 * run(self, *given)[0], 0))
        with pytest.raises(
            gs.ResourceError,
            match=r"even on its coarsest grid, a texture buffer of this driver holds .*: split the scene",
        ):
            renderer.render(scene, None, [exact(LIGHTS[name])], SIZE, outputs=("visibility",), samples=1)
        # the renderer still works
        monkeypatch.undo()
        renderer._context.caps = before
        again = renderer.render(scene, None, [exact(LIGHTS[name])], SIZE, outputs=("visibility",), samples=1).visibility
        assert usual is not None
        assert again is not None
        np.testing.assert_array_equal(again, usual)


@pytest.mark.usefixtures("built_on_the_gpu")
def test_too_many_triangles_for_a_buffer_raise(scene: Scene) -> None:
    with Renderer("egl") as renderer:
        limited(renderer, 3000)
        with pytest.raises(
            gs.ResourceError,
            match=r"Exact\(\) needs 3 texels for each of the scene's .* triangles.* holds 3000, those of 1000 tri",
        ):
            renderer.render(scene, None, [exact(LIGHTS["sun"])], SIZE, samples=1)


@pytest.mark.parametrize("name", list(LIGHTS))
def test_scene_without_casters_is_lit(renderer: Renderer, scene: Scene, name: str) -> None:
    """Without casters there is no grid to fit: everything that faces the light is lit."""
    quiet = replace(scene, nodes=tuple(replace(node, casts=False) for node in scene.nodes))
    frame = renderer.render(
        quiet, None, [exact(LIGHTS[name])], SIZE, outputs=("visibility", "triangle", "position"), samples=1
    )
    floor = (frame.triangle >= 0) & (frame.triangle < 2) & shone(frame)
    assert floor.any()
    assert (frame.visibility[0][floor] == 1.0).all()


# -- objects


@pytest.mark.parametrize("samples", [1, 4])
def test_moving_lights_do_not_leak_gl_objects(scene: Scene, samples: int) -> None:
    shadow = gs.Shadow(filter=gs.Exact())

    def frame(renderer: Renderer, k: int) -> None:
        light: Light = [
            gs.DirectionalLight(direction=(-0.4, -1.0, 0.01 * k), shadow=shadow),
            # from six faces to one grid and back
            gs.PointLight(position=(0.3, 1.0 + 0.1 * (k % 30), 0.2), shadow=shadow),
            gs.SpotLight(position=(1.2, 5.0, 0.01 * k), direction=(-1.2, -5.0, 0.0), shadow=shadow),
        ][k % 3]
        moved = scene.moved({"a": translation((0.01 * k, 1.0, 0.1))}) if k % 5 == 0 else scene
        renderer.render(moved, None, [light], SIZE, samples=samples)

    with Renderer("egl") as renderer:
        for k in range(30):  # every place of the point light: its six faces and its one grid have programs of their own
            frame(renderer, k)
        before = counted(renderer)
        for k in range(30, 80):
            frame(renderer, k)
        assert counted(renderer) == before
