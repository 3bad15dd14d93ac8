"""glshadow render --orbit and --animate: several images as files, or as a video."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from glshadow.cli.bar import Bar
from glshadow.cli.blank import covered_by_model, refuse_blank
from glshadow.cli.options import Request, scene_facts, warn_fallbacks
from glshadow.cli.orbit import kept_beside, make_all, pattern, request_of
from glshadow.cli.running import Work
from glshadow.errors import SceneError, SettingsError
from glshadow.journal import digest_of
from glshadow.numbered import MOST_IMAGES
from glshadow.video import SUFFIXES, video_path, write

if TYPE_CHECKING:
    from glshadow.core.cameras import Camera
    from glshadow.frame import Frame
    from glshadow.lights import Light
    from glshadow.renderer import Renderer
    from glshadow.scene.nodes import Scene

ORBIT_FPS = 30.0
"""Images per second in a video of an orbit."""
_ROUNDED = 2.0**-22  # relative: key times and their ends are float32

Shot = tuple["Scene", "Camera", tuple["Light", ...]]


@dataclass(frozen=True, eq=False)
class Shots:
    """The images of a command.

    Parameters
    ----------
    scene : Scene
    count : int
    at : function
        Scene, camera and lights of an image.
    fps : float
        Images per second of a video.
    moves : bool
        Whether the scene moves, not only the camera.
    """

    scene: Scene
    count: int
    at: Callable[[int], Shot]
    fps: float
    moves: bool = False

    def facts(self) -> tuple[Any, ...]:
        """What decides what the images show, besides the scene at rest."""
        shots = map(self.at, range(self.count))
        return tuple((camera, digest_of(lights), _pose(scene, self.scene)) for scene, camera, lights in shots)


def is_video(path: Path) -> bool:
    """Whether the file holds moving images."""
    return path.suffix.lower() in SUFFIXES


def check_output(path: Path, fps: float) -> None:
    """Check where the images go, before anything is loaded."""
    if not is_video(path):
        pattern(path)
        return
    try:
        video_path("-o", path, fps)
    except SettingsError as error:
        raise click.UsageError(str(error)) from None


def orbit_shots(wanted: Request, count: int) -> Shots:
    """Images around the model."""
    from glshadow.core.orbit import orbit

    scene = wanted.load()
    cameras, lights = orbit(wanted.camera(scene, turns=True), count), wanted.lit(scene)
    return Shots(scene, count, lambda number: (scene, cameras[number], lights), ORBIT_FPS)


def animation_shots(wanted: Request, fps: float) -> Shots:
    """The file's animation, from its beginning to its end."""
    scene = wanted.load()
    if scene.duration == 0.0:
        raise SceneError(f"{wanted.name} has no animation that takes time: render it without --animate")
    # not the end itself, which a loop shows again as its beginning
    count = max(1, int(np.ceil(scene.duration * fps * (1.0 - _ROUNDED))))
    if count > MOST_IMAGES:
        raise click.UsageError(
            f"--animate {fps:g} makes {count} images of {scene.duration:g} s: the limit is {MOST_IMAGES}"
        )
    times = [number / fps for number in range(count)]
    scene = scene.framed(times)
    camera, placed = wanted.camera(scene), wanted.eye is not None or wanted.target is not None

    def at(number: int) -> Shot:
        now = scene.at(times[number])
        followed = camera if now.camera == scene.camera or placed else wanted.camera(now)
        return now, followed, wanted.lit(now)

    return Shots(scene, count, at, fps, moves=True)


def render_several(
    work: Work,
    wanted: Request,
    path: Path,
    shots_of: Callable[[], Shots],
    options: dict[str, Any],
    finish: Callable[[Frame], Frame],
    decisive: tuple[Any, ...],
) -> None:
    """Render the images of a command into files of a name pattern, or into a video.

    Parameters
    ----------
    options : dict
        Further arguments of `Renderer.render`.
    finish : function
        Draws overlays.
    decisive : tuple
        What decides what the images show, besides the scene, the cameras and the lights.
    """
    with work.stage("load", f"loading {wanted.name}"):
        shots = shots_of()
    with work.stage("open", "opening OpenGL"):
        from glshadow.renderer import Renderer

        renderer = Renderer(wanted.driver)
    with renderer, work.stage("render", f"rendering {wanted.name}"):

        def draw(numbers: Sequence[int]) -> Iterator[tuple[int, Frame]]:
            return _frames(work, renderer, shots, numbers, wanted, options, finish)

        if is_video(path):
            with Bar(work) as bar:

                def images() -> Iterator[Any]:
                    for number, frame in draw(range(shots.count)):
                        yield frame.image
                        bar(number + 1, shots.count, path.name)

                bar(0, shots.count, path.name)
                write(path, images(), shots.fps)
            rows, made = [], shots.count
        else:
            name = pattern(path)
            files = [name(number) for number in range(shots.count)]
            request = request_of(shots.scene, shots.facts(), *decisive, renderer.info["renderer"])
            rows = make_all(work, files, kept_beside(path), request, draw, wanted.name)
            made = sum(row["made"] for row in rows)
    work.say(f"{path}: {made} of {shots.count} images rendered, {work.timings['render']:.2f} s")
    report: dict[str, Any] = {"pictures": rows, "size": wanted.size, "scene": scene_facts(shots.scene)}
    if is_video(path):
        report |= {"path": str(path), "images": made, "fps": shots.fps}
        if path.suffix.lower() == ".mp4" and (wanted.size[0] % 2 or wanted.size[1] % 2):
            work.say("H.264 needs an even width and height: the last column or row is there twice")
    work.finish(report)


def _frames(
    work: Work,
    renderer: Renderer,
    shots: Shots,
    numbers: Sequence[int],
    wanted: Request,
    options: dict[str, Any],
    finish: Callable[[Frame], Frame],
) -> Iterator[tuple[int, Frame]]:
    seen = False
    for number in numbers:
        scene, camera, lights = shots.at(number)
        frame = renderer.render(scene, camera, lights, wanted.size, **options)
        if not seen and (not shots.moves or number == numbers[-1]):
            refuse_blank(frame, renderer, work)
        seen = seen or covered_by_model(frame, renderer) > 0.0
        warn_fallbacks(work, frame.used, scene, wanted)
        yield number, finish(frame)


def _pose(scene: Scene, rest: Scene) -> str:
    """Digest of the nodes of a scene that have moved since another."""
    digest = hashlib.sha256()
    for node, other in zip(scene.nodes, rest.nodes, strict=True):
        if node is not other:
            digest.update(node.world_from_mesh.tobytes())
            if node.mesh is not other.mesh:
                digest.update(node.mesh.positions.tobytes())
    return digest.hexdigest()
