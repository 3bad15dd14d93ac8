"""Draws one job in this process; the renderer and the last scene are kept from job to job."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from glshadow.batch.job import BUILTIN, OF_FILES, Job
from glshadow.core.orbit import orbit
from glshadow.errors import GlshadowError, listening
from glshadow.files import inside
from glshadow.journal import digest_of_file
from glshadow.scene.nodes import Scene
from glshadow.shadows.shadow import Shadow

Inputs = tuple[tuple[str, str | None], ...]


@dataclass(frozen=True)
class Drawn:
    """Result of a job: seconds to load and to draw, warnings, and hashes of its inputs and outputs.

    `inputs`: each file of the model, relative to the model's folder, with None for a missing one. `images`: in the order of the job's
    names.
    """

    load: float
    draw: float
    warnings: tuple[str, ...]
    inputs: Inputs
    images: tuple[str | None, ...]


class Drawer:
    """One OpenGL context and one scene: memory does not grow with the number of jobs."""

    def __init__(self, backend: Any = "auto") -> None:
        from glshadow.renderer import Renderer

        self._renderer = Renderer(backend)
        self._kept: tuple[Any, Scene, Inputs] | None = None

    def draw(self, job: Job, folder: Path, batch: str = "") -> Drawn:
        """Draw the images of a job into files, written atomically. A scene is kept for jobs of the same `batch`.

        Raises
        ------
        GlshadowError
            As for `load`, `render` and `save`; also if a link leads out of the folder.
        """
        said: list[str] = []
        with listening(said.append):
            start = time.perf_counter()
            scene, inputs = self._loaded(job, batch)
            loaded = time.perf_counter()
            cameras = orbit(scene.camera, job.orbit) if job.orbit else job.cameras or (scene.camera,)
            lights = scene.lights if job.lights is None else job.lights
            if job.shadow is not None:
                own = Shadow()
                lights = tuple(
                    replace(each, shadow=job.shadow) if each.shadow == own else each for each in lights or ()
                )
            images = []
            for camera, name in zip(cameras, job.names(), strict=True):
                path = _inside(folder, name)
                frame = self._renderer.render(
                    scene, camera, lights, job.size, background=job.background, outputs=job.stored, samples=job.samples,
                    exposure=job.exposure, tone=job.tone,
                )  # fmt: skip
                frame.save(path)
                images.append(digest_of_file(path))
        drawn = time.perf_counter() - loaded
        return Drawn(loaded - start, drawn, tuple(dict.fromkeys(said)), inputs, tuple(images))

    def _loaded(self, job: Job, batch: str) -> tuple[Scene, Inputs]:
        key = (batch, job.scene, job.ground, job.up_axis, *(getattr(job, name) for name in OF_FILES))
        if self._kept is None or self._kept[0] != key:
            self._kept = None  # free the old scene before loading the new one
            self._kept = key, *_load(job)
        return self._kept[1:]

    def release(self) -> None:
        """Release the context."""
        self._renderer.release()


def _inside(folder: Path, name: str) -> Path:
    """The file of that name; its folder is created.

    Raises
    ------
    GlshadowError
        If a link leads out of the batch's folder, or the folder cannot be created.
    """
    path = folder / name
    if not inside(path.parent, folder):
        raise GlshadowError(f"{path} is outside the folder of the batch, by a link")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadowError(f"{path.parent} cannot be created: {error.strerror or error}") from None
    return path


def _load(job: Job) -> tuple[Scene, Inputs]:
    from glshadow import scenes as builtin
    from glshadow.io.limits import Budget
    from glshadow.io.load import read_scene

    if job.scene not in BUILTIN:
        budget = Budget()
        given = {name: getattr(job, name) for name in OF_FILES}
        scene = read_scene(job.scene, budget, job.ground, job.up_axis, **given)
        folder = Path(job.scene).parent
        return scene, tuple((os.path.relpath(path, folder), digest_of_file(path)) for path in sorted(budget.files))
    name, _, number = job.scene.partition(":")
    scene = getattr(builtin, name)(*([int(number)] if number else []))
    return scene.with_ground() if job.ground else scene, ()
