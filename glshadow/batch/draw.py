"""Draws one job in this process: a renderer and the last scene are kept from job to job."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from glshadow.batch.job import Job
from glshadow.core.orbit import orbit
from glshadow.errors import listening
from glshadow.scene.nodes import Scene
from glshadow.shadows.shadow import Shadow


@dataclass(frozen=True)
class Drawn:
    """What a job took: seconds to load and to draw, and what was said of it."""

    load: float
    draw: float
    warnings: tuple[str, ...]


class Drawer:
    """One OpenGL context, and one scene: memory does not grow with the number of jobs."""

    def __init__(self, backend: Any = "auto") -> None:
        from glshadow.renderer import Renderer

        self._renderer = Renderer(backend)
        self._scene: tuple[Any, Scene] | None = None

    def draw(self, job: Job, folder: Path) -> Drawn:
        """Its pictures into their files, each put in place whole.

        Raises
        ------
        GlshadowError
            As of `load`, `render` and `save`.
        """
        said: list[str] = []
        with listening(said.append):
            start = time.perf_counter()
            scene = self._loaded(job)
            loaded = time.perf_counter()
            cameras = orbit(scene.camera, job.orbit) if job.orbit else job.cameras or (scene.camera,)
            lights = scene.lights if job.lights is None else job.lights
            if job.shadow is not None:
                own = Shadow()
                lights = tuple(
                    replace(each, shadow=job.shadow) if each.shadow == own else each for each in lights or ()
                )
            paths = job.outputs(folder)
            exr = paths[0].suffix.lower() == ".exr"
            wanted = ("linear", "alpha", "depth", "normal", "position", "visibility", "node") if exr else ("image",)
            for camera, path in zip(cameras, paths, strict=True):
                frame = self._renderer.render(
                    scene, camera, lights, job.size, background=job.background, outputs=wanted, samples=job.samples
                )
                path.parent.mkdir(parents=True, exist_ok=True)
                frame.save(path)
        return Drawn(loaded - start, time.perf_counter() - loaded, tuple(dict.fromkeys(said)))

    def _loaded(self, job: Job) -> Scene:
        key = (job.scene, job.ground, job.up_axis)
        if self._scene is None or self._scene[0] != key:
            self._scene = None  # the old one goes before the new one comes
            self._scene = key, _load(job)
        return self._scene[1]

    def release(self) -> None:
        """Free the context."""
        self._renderer.release()


def _load(job: Job) -> Scene:
    from glshadow import scenes as builtin
    from glshadow.batch.job import BUILTIN
    from glshadow.io.load import load

    if job.scene not in BUILTIN:
        return load(job.scene, ground=job.ground, up_axis=job.up_axis)
    name, _, number = job.scene.partition(":")
    scene: Scene = getattr(builtin, name)(*([int(number)] if number else []))
    return scene.with_ground() if job.ground else scene
