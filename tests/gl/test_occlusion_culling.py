"""Occlusion culling: the map of a moving light is drawn with fewer triangles than the last one, and no texel changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, translation
from glshadow.gl.scene import occlusion, runs
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

SIZE = (96, 64)
LIGHTS = {
    "sun": gs.DirectionalLight(direction=(-0.4, -1.0, -0.3)),
    "spot": gs.SpotLight(position=(1.0, 4.0, 1.5), direction=(-1.0, -4.0, -1.5), inner_angle=20, outer_angle=30),
    "point": gs.PointLight(position=(0.1, 0.9, 0.2)),
}
SHADOWS = {
    "float": gs.Shadow(resolution=1024),
    "16 bits, offset": gs.Shadow(filter=gs.Hard(), target=gs.Target.DEPTH16, resolution=128, bias=gs.SlopeScaledBias()),
    "both sides": gs.Shadow(resolution=128, faces=gs.Faces.BOTH),
    "a metric": gs.Shadow(target=gs.Target.R32F, resolution=128),
}


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Cull in every frame, however few the triangles; returns how many triangles each call drew."""
    counts: list[int] = []
    for name, value in {
        "LEAST_TRIANGLES": 0,
        "_TEXEL": 0.0,
        "_CLUSTER": -1.0,
        "_FEWER": 2.0,
        "_FIRST_PAUSE": 0,
    }.items():
        monkeypatch.setattr(occlusion, name, value)
    monkeypatch.setattr(occlusion, "_PAUSE", 0)
    made = runs.Runs

    def counted(*args: object) -> runs.Runs:
        found = made(*args)  # type: ignore[arg-type]
        counts.append(found.triangles)
        return found

    monkeypatch.setattr(occlusion, "Runs", counted)
    return counts


@pytest.fixture
def pair() -> Iterator[tuple[Renderer, Renderer]]:
    with Renderer("egl") as one, Renderer("egl") as other:
        yield one, other


def nested() -> Scene:
    """Balls in balls on a floor: one mirrored and stretched, one open, one of a mesh that is a single cluster."""
    ball, few = Mesh(*shapes.icosphere(4, 0.5)), Mesh(*shapes.icosphere(1, 0.2))
    open_ball = Mesh(ball.positions, ball.triangles[100:], material=Material((0.9, 0.4, 0.1, 1.0)))
    ground = Mesh(*shapes.rectangle((-3.0, 0.0, 3.0), (6.0, 0.0, 0.0), (0.0, 0.0, -6.0)))

    def placed(x: float, z: float, scale: tuple[float, float, float]) -> Array:
        return translation((x, 0.8, z)) @ np.diag([*scale, 1.0])

    nodes = [Node(ground, np.eye(4), "ground"), Node(few, placed(0.0, 1.0, (1.0, 1.0, 1.0)), "few")]
    for k in range(3):
        for scale in (1.0, 0.9, 0.7, 0.5):
            nodes.append(Node(ball, placed(1.2 * k - 1.2, 0.0, (scale, scale, scale)), f"{k} {scale}"))
    nodes.append(Node(ball, placed(-0.5, -1.2, (-1.5, 0.5, 1.0)), "mirrored"))
    nodes.append(Node(open_ball, placed(0.9, -1.2, (1.0, 1.0, 1.0)), "open"))
    return Scene(tuple(nodes), gs.PerspectiveCamera((2.0, 3.0, 4.0), (0.0, 0.3, 0.0)))


def moved(light: gs.Light, k: int) -> gs.Light:
    step = np.array([0.02, 0.0, -0.01]) * k
    if isinstance(light, gs.DirectionalLight):
        return replace(light, direction=tuple(np.asarray(light.direction) + step))
    return replace(light, position=tuple(np.asarray(light.position) + step))


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shadow", SHADOWS)
def test_culling_changes_no_texel(
    pair: tuple[Renderer, Renderer], eager: list[int], monkeypatch: pytest.MonkeyPatch, light: str, shadow: str
) -> None:
    spared, plain = pair
    scene = nested()
    total = sum(len(node.mesh.triangles) for node in scene.nodes)
    for k in range(5):
        lamp = moved(replace(LIGHTS[light], shadow=SHADOWS[shadow]), k)
        eager.clear()
        asked = ("image", "visibility", "triangle", "shadow_maps")
        one = spared.render(scene, None, [lamp], SIZE, outputs=asked, samples=1)
        drawn = list(eager)
        with monkeypatch.context() as off:
            off.setattr(occlusion, "LEAST_TRIANGLES", 1 << 60)
            other = plain.render(scene, None, [lamp], SIZE, outputs=asked, samples=1)
        for name in ("image", "visibility", "triangle"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=f"{name} {k}")
        np.testing.assert_array_equal(one.shadow_maps[0], other.shadow_maps[0])
        assert one.used[0].draws == other.used[0].draws
    views = len(one.used[0].views)
    if shadow == "a metric":
        assert not drawn
    else:
        assert 0 < sum(drawn) < (0.85 if shadow == "float" else 1.0) * total * views


def test_disoccluded_triangles_are_drawn(pair: tuple[Renderer, Renderer], eager: list[int]) -> None:
    """A light that jumps to the other side sees triangles that were hidden in the last map."""
    spared, plain = pair
    scene = nested()
    for k in range(6):
        sun = gs.DirectionalLight(direction=((-1.0) ** k, -0.3, 0.2), shadow=gs.Shadow(resolution=128))
        one, other = (
            renderer.render(scene, None, [sun], SIZE, outputs=("shadow_maps",), samples=1).shadow_maps[0]
            for renderer in (spared, plain)
        )
        np.testing.assert_array_equal(one, other)
        plain._cache.atlases.release()  # without its previous map this renderer never culls


def test_early_submission_changes_nothing(pair: tuple[Renderer, Renderer], monkeypatch: pytest.MonkeyPatch) -> None:
    often, once = pair
    scene = nested()
    asked = ("image", "triangle", "depth", "shadow_maps")
    other = once.render(scene, size=SIZE, outputs=asked, samples=1)
    monkeypatch.setattr(runs, "AT_ONCE", 100)
    one = often.render(scene, size=SIZE, outputs=asked, samples=1)
    for name in ("image", "triangle", "depth"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    np.testing.assert_array_equal(one.shadow_maps[0], other.shadow_maps[0])
