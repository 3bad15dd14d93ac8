"""Frames of a moving scene: each equals that of a fresh renderer to the bit, in any order, and only what moves is computed and uploaded."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.scene import geometry, meshes, world

SIZE = (96, 64)
SHADOWS = (gs.Shadow(), gs.Shadow(filter=gs.Pcf(1)))


@pytest.fixture
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


def turned(degrees: float, place: tuple[float, float, float]) -> np.ndarray[Any, Any]:
    matrix = np.eye(4)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    matrix[:3, 3] = place
    return matrix


def sphere(normals: bool) -> gs.Mesh:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 13), np.linspace(0.01, np.pi - 0.01, 7))
    points = np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], axis=-1).reshape(-1, 3)
    corner = (np.arange(6)[:, None] * 13 + np.arange(12)).reshape(-1, 1)
    triangles = np.concatenate([corner + np.array([0, 1, 13]), corner + np.array([1, 14, 13])])
    return gs.Mesh(points, triangles, normals=points if normals else None)


def crowd() -> gs.Scene:
    """Forty balls, flat and smooth, and a ground; ball 7 is a stretched one."""
    balls = (sphere(True), sphere(False))
    nodes = [gs.Node(balls[k % 2], turned(9 * k, (3 * (k % 8), 1, 3 * (k // 8))), f"ball {k}") for k in range(40)]
    return gs.Scene(nodes).with_ground()


def data(renderer: gs.Renderer) -> dict[str, Any]:
    """The GPU data of the last scene."""
    assert renderer._cache is not None
    scene = renderer._cache.scene.thing
    assert scene is not None
    with renderer._context.drawing():
        buffers = {
            "planes": scene.planes,
            "owners": scene.owners,
            **scene.world.textures,
            "neighbours": scene.world.neighbours,
        }
        read = {name: texture.buffer.read() for name, texture in buffers.items()}
        read["rounded"] = b"" if scene.rounded is None else scene.rounded.buffer.read()
    kept = (
        scene.lifts.tolist(),
        scene.origin.tolist(),
        scene.world.reach,
        scene.world.huge,
        scene.raised_corners.tolist(),
    )
    return {**read, "kept": kept}


def assert_like_fresh(renderer: gs.Renderer, scene: gs.Scene) -> None:
    with gs.Renderer() as fresh:
        for shadow in SHADOWS:
            lights = [gs.DirectionalLight(shadow=shadow)]
            frames = [each.render(scene, None, lights, SIZE, samples=4) for each in (renderer, fresh)]
            for name in ("image", "visibility"):
                np.testing.assert_array_equal(*(frame.outputs[name] for frame in frames))
        mine, new = data(renderer), data(fresh)
    assert [name for name in new if mine[name] != new[name]] == []


def test_moved_nodes_equal_a_fresh_scene(renderer: gs.Renderer) -> None:
    scene = crowd()
    assert_like_fresh(renderer, scene)
    one = scene.moved({"ball 7": turned(20, (9, 4, 2)) @ np.diag((1, 3, 1, 1))})
    two = one.moved({"ball 7": turned(50, (9, 4, 2)), "ball 8": turned(10, (0, 5, 0)), "ball 30": turned(0, (8, 3, 8))})
    away = scene.moved({f"ball {k}": turned(0, (k, 40, 0)) for k in range(30)})  # the middle of the scene moves
    for each in (one, two, one, scene, away, two, gs.Scene(scene.nodes[:-1]), scene):
        assert_like_fresh(renderer, each)


@pytest.mark.parametrize("name", ["cesium_man.glb", "milk_truck.glb"])
def test_frames_do_not_depend_on_those_before(renderer: gs.Renderer, models: Path, name: str) -> None:
    scene = gs.load(models / name, ground=True, look="plain")
    times = [0.3, 0.0, 0.8, 0.3]
    frames = list(renderer.animation(scene, times, size=SIZE, samples=4))
    np.testing.assert_array_equal(frames[0].image, frames[3].image)
    np.testing.assert_array_equal(frames[0].visibility, frames[3].visibility)
    assert len({frame.image.tobytes() for frame in frames}) == 3
    for seconds in times[:3]:
        assert_like_fresh(renderer, scene.at(seconds))


def test_large_coordinates_of_what_moves(renderer: gs.Renderer) -> None:
    """A node that goes far away and comes back: `reach` and `huge` are those of the scene, not of the one before."""
    scene = crowd()
    # in the scene's corner, so that the middle of the scene stays and the buffers are taken
    huge = scene.moved({"ball 0": turned(0, (-1e6, 1, -1e6))})
    for each in (scene, huge, scene):
        assert_like_fresh(renderer, each)
    assert data(renderer)["kept"][2] < 1e3


def test_only_what_moves_is_computed(renderer: gs.Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    placed, smoothed, uploaded = [0], [0], [0]
    round_, heights, make = world._round, geometry.heights, meshes.GpuMesh.__init__

    def counted_round(places: Any, points: Any) -> None:
        placed[0] += len(points)
        round_(places, points)

    def counted_heights(*given: Any) -> Any:
        smoothed[0] += 1
        return heights(*given)

    def counted_make(self: Any, *given: Any) -> None:
        uploaded[0] += 1
        make(self, *given)

    monkeypatch.setattr(world, "_round", counted_round)
    monkeypatch.setattr(geometry, "heights", counted_heights)
    monkeypatch.setattr(meshes.GpuMesh, "__init__", counted_make)
    scene = crowd()
    renderer.render(scene, size=SIZE, samples=1)
    vertices = len(scene.nodes[0].mesh.positions)
    assert (placed[0], smoothed[0], uploaded[0]) == (40 * vertices + 4, 20, 3)
    for step in range(1, 4):
        placed[0] = smoothed[0] = uploaded[0] = 0
        renderer.render(scene.moved({"ball 10": turned(9 * step, (6, 1 + step, 3))}), size=SIZE, samples=1)
        assert (placed[0], smoothed[0], uploaded[0]) == (vertices, 1, 0)


def test_animation_takes_times_one_by_one(renderer: gs.Renderer, models: Path) -> None:
    scene = gs.load(models / "milk_truck.glb", look="plain")
    taken = []

    def times() -> Iterator[float]:
        for seconds in (0.0, 0.5, 1.0):
            taken.append(seconds)
            yield seconds

    camera = gs.PerspectiveCamera((9, 5, 9), (0, 1, 0))
    frames = renderer.animation(scene, times(), camera, [gs.DirectionalLight()], SIZE, samples=1)
    assert taken == []
    frame = next(frames)
    assert (taken, frame.camera, frame.scene.nodes[0].name) == ([0.0], camera, scene.nodes[0].name)
    frames.close()


def test_wrong_arguments_of_animation(renderer: gs.Renderer, models: Path) -> None:
    scene = gs.load(models / "milk_truck.glb", look="plain")
    for bad in (
        {"samples": 3},
        {"outputs": "nothing"},
        {"size": (0, 1)},
        {"lights": 3},
        {"sample": 4},
        {"max_ms": 9},
        {"camera": 1},
    ):
        with pytest.raises(gs.SettingsError):
            renderer.animation(scene, [0.0], **bad)  # type: ignore[arg-type]
    with pytest.raises(gs.SettingsError, match="times must be a sequence of seconds, got 3"):
        renderer.animation(scene, 3)  # type: ignore[arg-type]
    frames = renderer.animation(scene, [0.0, "late"], size=SIZE, samples=1)  # type: ignore[list-item]
    next(frames)
    with pytest.raises(gs.SettingsError, match=r"times\[1\] must be a finite number of seconds, got 'late'"):
        next(frames)
