"""Renderers next to pyrender, whose delete() terminates its display; test_displays.py runs each check in a process of its own."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import glshadow as gs
from glshadow.gl.driver.current import current

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts" / "benchmarks"))
from peers import pyrender_module, pyrender_scene

SIZE = (96, 64)
PYRENDER: Any = pyrender_module()
SCENE = gs.scenes.box().scene


def ours(renderer: gs.Renderer) -> np.ndarray:
    return renderer.render(SCENE, size=SIZE).image


def theirs() -> tuple[Any, np.ndarray]:
    offscreen = PYRENDER.OffscreenRenderer(*SIZE)
    return offscreen, drawn_by(offscreen)


def drawn_by(offscreen: Any) -> np.ndarray:
    image, _ = offscreen.render(pyrender_scene(PYRENDER, SCENE, gs.DirectionalLight())[0])
    return np.asarray(image)


def after() -> None:
    """pyrender starts and ends while two renderers live."""
    with gs.Renderer("egl") as first, gs.Renderer("egl") as second:
        expected = ours(first)
        for _ in range(2):
            offscreen, _ = theirs()
            offscreen.delete()
            np.testing.assert_array_equal(ours(first), expected)
            np.testing.assert_array_equal(ours(second), expected)


def before() -> None:
    """pyrender starts, and in the second round ends, before the first renderer is created."""
    offscreen, painted = theirs()
    with gs.Renderer("egl") as renderer:
        expected = ours(renderer)
        np.testing.assert_array_equal(drawn_by(offscreen), painted)
        offscreen.delete()
        np.testing.assert_array_equal(ours(renderer), expected)
    with gs.Renderer("egl") as renderer:
        np.testing.assert_array_equal(ours(renderer), expected)


def interleaved() -> None:
    """Each renderer keeps its own context current, and its own image."""
    offscreen, painted = theirs()
    theirs_is_current = current()
    with gs.Renderer("egl") as renderer:
        expected = ours(renderer)
        for _ in range(3):
            np.testing.assert_array_equal(ours(renderer), expected)
            assert current() == theirs_is_current
            np.testing.assert_array_equal(drawn_by(offscreen), painted)
    np.testing.assert_array_equal(drawn_by(offscreen), painted)
    offscreen.delete()
    with gs.Renderer("egl") as renderer:
        second, _ = theirs()
        np.testing.assert_array_equal(ours(renderer), expected)
        second.delete()
        np.testing.assert_array_equal(ours(renderer), expected)


def threads() -> None:
    """pyrender starts and ends on this thread, again and again, while other threads render."""

    def draw(_: int) -> list[np.ndarray]:
        with gs.Renderer("egl") as renderer:
            return [ours(renderer) for _ in range(6)]

    with gs.Renderer("egl") as renderer:
        expected = ours(renderer)
    with ThreadPoolExecutor(2) as pool:
        jobs = [pool.submit(draw, i) for i in range(2)]
        for _ in range(4):
            offscreen, _ = theirs()
            offscreen.delete()
        for job in jobs:
            for image in job.result(timeout=60.0):
                np.testing.assert_array_equal(image, expected)


CHECKS = {check.__name__: check for check in (after, before, interleaved, threads)}

if __name__ == "__main__":
    CHECKS[sys.argv[1]]()
