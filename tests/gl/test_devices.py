"""EGL devices: listed, selected, refused by name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow.cli import main
from glshadow.gl.driver.backends import EGL_LIBRARY
from glshadow.gl.driver.egl import load_egl

SCENE = gs.scenes.box().scene
SIZE = (64, 48)


def test_first_device_renders_the_same_as_auto() -> None:
    assert load_egl(EGL_LIBRARY).devices
    with gs.Renderer() as usual, gs.Renderer(device=0) as first, gs.Renderer(backend="egl:0") as named:  # type: ignore[arg-type]
        assert first.info["backend"] == "egl:0"
        expected = usual.render(SCENE, size=SIZE, samples=1).image
        for each in (first, named):
            np.testing.assert_array_equal(each.render(SCENE, size=SIZE, samples=1).image, expected)


def test_unknown_device_is_named() -> None:
    count = len(load_egl(EGL_LIBRARY).devices)
    with pytest.raises(gs.ContextError, match=f"there is no device {count}; there are 0: "):
        gs.Renderer(device=count)


@pytest.mark.parametrize("device", [-1, 1.5, "0", True, 1000])
def test_invalid_device_numbers_are_refused(device: object) -> None:
    with pytest.raises(gs.SettingsError, match="device must be"):
        gs.Renderer(device=device)  # type: ignore[arg-type]


@pytest.mark.parametrize("backend", ["osmesa", "window"])
def test_other_backends_refuse_a_device(backend: str) -> None:
    with pytest.raises(gs.SettingsError, match="one of EGL's"):
        gs.Renderer(backend, device=0)  # type: ignore[arg-type]


def test_command_accepts_a_device_and_doctor_lists_them(tmp_path: Path) -> None:
    runner, picture = CliRunner(), str(tmp_path / "a.png")
    done = runner.invoke(main, ["render", "--size", "64x48", "--device", "0", "-o", picture])
    assert done.exit_code == 0, done.output
    assert "egl:0" in done.stderr
    missing = runner.invoke(main, ["render", "--size", "64x48", "--device", "99", "-o", picture])
    assert missing.exit_code == 1
    assert "there is no device 99" in missing.stderr
    found = json.loads(runner.invoke(main, ["doctor", "--json"]).stdout)
    first = found["devices"][0]
    assert first["number"] == 0
    assert first["works"]
    assert first["driver"] == found["backends"]["egl"]["caps"]["renderer"]
