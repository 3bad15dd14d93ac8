"""Sequences of one scene: each frame equals that of render, and data that does not depend on the camera is computed once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import glshadow as gs

SIZE = (96, 64)


@pytest.fixture
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


def test_frames_equal_those_of_render(renderer: gs.Renderer, scene: gs.Scene) -> None:
    cameras = gs.orbit(scene.camera, 5)
    lights = [gs.DirectionalLight(), gs.PointLight(position=(1, 3, 2), shadow=gs.Shadow(filter=gs.Pcf()))]
    options = {"outputs": ("image", "visibility", "alpha"), "samples": 4, "background": None, "ambient": 0.2}
    frames = list(renderer.sequence(scene, cameras, lights, SIZE, **options))
    assert [frame.camera for frame in frames] == list(cameras)
    with gs.Renderer() as other:
        for frame, camera in zip(frames, cameras, strict=True):
            alone = other.render(scene, camera, lights, SIZE, **options)
            for name in alone.outputs:
                np.testing.assert_array_equal(frame.outputs[name], alone.outputs[name])
    assert len({frame.image.tobytes() for frame in frames}) == len(frames)


def test_lists_and_scene_maps_are_built_once(renderer: gs.Renderer, scene: gs.Scene) -> None:
    for shadow in (gs.Shadow(), gs.Shadow(fit=gs.SceneFit())):
        frames = list(
            renderer.sequence(scene, gs.orbit(scene.camera, 4), [gs.DirectionalLight(shadow=shadow)], SIZE, samples=1)
        )
        assert frames[0].used[0].draws > 0
        assert [frame.used[0].draws for frame in frames[1:]] == [0, 0, 0]


def test_cameras_are_consumed_lazily(renderer: gs.Renderer, scene: gs.Scene) -> None:
    taken = []

    def cameras() -> Iterator[gs.PerspectiveCamera]:
        for number, camera in enumerate(gs.orbit(scene.camera, 3)):
            taken.append(number)
            yield camera

    frames = renderer.sequence(scene, cameras(), None, SIZE, samples=1)
    assert taken == []
    next(frames)
    assert taken == [0]
    frames.close()
    assert renderer.render(scene, size=SIZE, samples=1).image.any()


def test_errors_are_immediate_and_name_the_camera(renderer: gs.Renderer, scene: gs.Scene) -> None:
    for bad in (
        {"samples": 3},
        {"background": "red"},
        {"outputs": ("nothing",)},
        {"size": (0, 1)},
        {"lights": 3},
        {"sample": 4},
    ):
        with pytest.raises(gs.SettingsError):
            renderer.sequence(scene, [scene.camera], **bad)  # type: ignore[arg-type]
    with pytest.raises(gs.SettingsError, match="cameras must be a sequence of cameras, got 3"):
        renderer.sequence(scene, 3, samples=1)  # type: ignore[arg-type]
    frames = renderer.sequence(scene, [scene.camera, "left"], None, SIZE, samples=1)  # type: ignore[list-item]
    assert next(frames).image.any()
    with pytest.raises(gs.SettingsError, match=r"cameras\[1\] must be a camera, got 'left'"):
        next(frames)
