"""Cameras on an orbit around a target."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs

CAMERAS = (
    gs.PerspectiveCamera((3.0, 2.0, 0.0), (1.0, 0.5, 0.0), fov_y=40.0, near=0.1),
    gs.OrthographicCamera((3.0, 2.0, 0.0), (1.0, 0.5, 0.0), (0.1, 1.0, 0.0), height=4.0),
    gs.IntrinsicsCamera(500.0, 510.0, 300.0, 200.0, (3.0, 2.0, 0.0), (1.0, 0.5, 0.0)),
)


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: type(camera).__name__)
def test_full_turn_has_equal_steps(camera: gs.PerspectiveCamera) -> None:
    turn = gs.orbit(camera, 8)
    assert turn[0] == camera
    assert {type(each) for each in turn} == {type(camera)}
    for k, each in enumerate(turn):
        angle = k * np.pi / 4.0
        # counterclockwise from above: x turns to -z
        expected = (1.0 + 2.0 * np.cos(angle), 2.0, -2.0 * np.sin(angle))
        np.testing.assert_allclose(each.position, expected, atol=1e-12)
        assert each.target == camera.target
        assert each.lens == camera.lens
        # rotating the world back gives the first camera's view
        back = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
        np.testing.assert_allclose(each.view_from_world[:3, :3], camera.view_from_world[:3, :3] @ back, atol=1e-12)


def test_one_view_is_the_camera_itself() -> None:
    assert gs.orbit(CAMERAS[0], 1) == (CAMERAS[0],)


@pytest.mark.parametrize(
    ("camera", "count"), [(CAMERAS[0], 0), (CAMERAS[0], 100_001), (CAMERAS[0], 2.5), (None, 3), ("x", 3)]
)
def test_bad_arguments_are_refused(camera: object, count: object) -> None:
    with pytest.raises(gs.SettingsError, match=r"(camera|count) must be"):
        gs.orbit(camera, count)  # type: ignore[arg-type, type-var]
