"""glshadow render: one image into a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.cli import values
from glshadow.cli.blank import refuse_blank
from glshadow.cli.options import (
    Request,
    common,
    light_facts,
    picture_options,
    request,
    scene_facts,
    warn_fallbacks,
)
from glshadow.cli.orbit import named_after, refuse_field, refuse_video
from glshadow.cli.running import Work
from glshadow.cli.sections import Command, option
from glshadow.core.outputs import FLOATS, STORED, holds_arrays
from glshadow.core.sampling import DEFAULT_SAMPLES
from glshadow.core.tone import TONES
from glshadow.numbered import MOST_IMAGES

if TYPE_CHECKING:
    from glshadow.frame import Frame
    from glshadow.scene.nodes import Scene

EXAMPLES = """
\b
Examples:
  glshadow render
  glshadow render chess_board.glb -o chess.png
  glshadow render rover.stl --up-axis z --light sun:-1,-2,-1
  glshadow render house.glb --eye 0.4,0.3,0.5 --target 0,0.05,0 --fov 40
  glshadow render room.glb --light point:0,2,0:range=8:intensity=3 --filter pcf:2
  glshadow render --light spot:6,6,6:-1,-1,-1:35:20:color=1,0.9,0.7 --overlay lights,map
  glshadow render --bias none --filter hard --resolution 512    (shadow acne)
  glshadow render model.glb -o model.exr --json
  glshadow render model.glb -o model.npz --outputs image,depth,node
  glshadow render model.glb --catcher --background none -o cutout.png
  glshadow render model.glb --orbit 36 -o view_{:03d}.png
  glshadow render model.glb --orbit 120 -o turn.mp4
  glshadow render walk.glb --time 0.5
  glshadow render walk.glb --animate 30 -o walk.mp4
"""


@click.command(cls=Command, epilog=EXAMPLES)
@picture_options
@option(
    "Image",
    "--overlay",
    metavar="LIST",
    read=values.overlays,
    default=(),
    help="Draw on top, separated by commas: map (the shadow maps in a corner), lights (gizmos and what their maps cover), "
    "axes, grid.",
)
@option(
    "Image",
    "--samples",
    metavar="N",
    read=values.samples,
    default=str(DEFAULT_SAMPLES),
    show_default=True,
    help="Samples per pixel, 1, 4, 8 or 16, for smooth edges of surfaces and shadows.",
)
@option(
    "Image",
    "--exposure",
    metavar="EV|auto|scene|none",
    read=values.exposure,
    default="scene",
    show_default=True,
    help="Scale of the light: a number of stops; auto: metered, so that the lights come out as bright as the default light; "
    "scene: auto where the lights are in lux and candela, as those of .glb files, else none.",
)
@option(
    "Image",
    "--tone",
    type=click.Choice(TONES),
    default="neutral",
    show_default=True,
    help="Tone map: Khronos PBR Neutral, which keeps colours up to 0.8 as they are; none clips at 1.",
)
@option(
    "Image",
    "--outputs",
    metavar="LIST",
    read=values.outputs,
    help="Outputs that .npz and .exr hold, separated by commas, or all: see the image page of the documentation. Default: of .npz all but "
    "depth_metric, shadow_maps and timings, of .exr all floats.",
)
@option(
    "Image",
    "--orbit",
    metavar="N",
    type=click.IntRange(1, MOST_IMAGES),
    help="N images around the model, in equal steps about the vertical. -o then needs a field for the image's number: "
    "-o view_{:03d}.png. Existing images are kept, so that an interrupted command can be resumed. Or -o names a video, "
    ".mp4 .gif .webp, of 30 images per second.",
)
@option(
    "Image",
    "--animate",
    metavar="FPS",
    read=values.images_per_second,
    help="The file's animation at FPS images per second, into a video (.mp4 .gif .webp) or numbered images as with --orbit. "
    "The camera stays where it sees the whole motion, or follows the file's.",
)
@option(
    "Shadow (of every light)",
    "--max-wrong",
    metavar="SHARE",
    read=values.share,
    help="Derive the cheapest shadow settings with at most this share of wrong pixels: 0.1% or 0.001. Renders about "
    "fifty images first.",
)
@option(
    "Shadow (of every light)",
    "--max-ms",
    metavar="MS",
    read=values.milliseconds,
    help="Derive the most accurate shadow settings that take at most this time per image.",
)
@common
def command(
    as_json: bool,
    debug: bool,
    overlay: tuple[str, ...],
    samples: int,
    outputs: tuple[str, ...] | None,
    orbit: int | None,
    animate: float | None,
    max_wrong: float | None,
    max_ms: float | None,
    **options: Any,
) -> None:
    """Render MODEL with shadows; without MODEL, the built-in courtyard.

    MODEL is a .glb .gltf .obj .ply .stl .off or .tif file. No option is needed: camera, light, bias, formats and what the
    shadow map covers are derived. Without -o the image is written as MODEL's name with .png, in the current folder.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        if "map" in overlay and options["filter_"] is None:
            options["filter_"] = values.shadow_filter("pcf:1")
        wanted = request(**options, usual="studio")
        wanted = replace(wanted, pictures=wanted.background is not None and not holds_arrays(wanted.output))
        budget = {"max_wrong": max_wrong, "max_ms": max_ms}
        several = orbit is not None or animate is not None
        path = wanted.output or named_after(Path(wanted.name).stem, several)
        if orbit is not None and animate is not None:
            raise click.UsageError("--orbit and --animate cannot be combined")
        if animate is not None and wanted.time is not None:
            raise click.UsageError("--animate shows all times: leave out --time")
        if animate is None and wanted.time is None and wanted.animation is not None:
            raise click.UsageError("--animation needs --time or --animate: without, the file is drawn at rest")
        if animate is not None and (max_wrong is not None or max_ms is not None):
            raise click.UsageError(
                "--max-wrong and --max-ms try settings on each scene, and with --animate each image is one"
            )
        if overlay and path.suffix.lower() == ".exr":
            raise click.UsageError(
                "--overlay draws into an 8-bit image, and .exr stores floats: use .png, .jpg or .tif"
            )
        opaque = {".jpg": "JPEG", ".jpeg": "JPEG", ".mp4": "a video", ".gif": "a GIF's image"}.get(path.suffix.lower())
        if wanted.background is None and opaque:
            raise click.UsageError(
                f"--background none needs alpha, and {opaque} has none: use .png, .tif, .exr or .webp"
            )
        if wanted.background is None and overlay:
            raise click.UsageError("--overlay needs an opaque background: not with --background none")
        if outputs is not None and path.suffix.lower() not in (".npz", ".exr"):
            raise click.UsageError("--outputs needs -o with .npz or .exr: other files hold the image alone")
        if not several:
            if wanted.output is not None:
                refuse_field(path)
                refuse_video(path)
            _render(work, wanted, path, overlay, outputs, samples, budget)
            return
        from glshadow.cli.several import ORBIT_FPS, Shots, animation_shots, check_output, orbit_shots, render_several

        check_output(path, ORBIT_FPS if animate is None else animate)

        def shots() -> Shots:
            if orbit is not None:
                return orbit_shots(wanted, orbit)
            assert animate is not None
            return animation_shots(wanted, animate)

        drawn = {"outputs": _outputs(path, overlay, outputs, False), "samples": samples, **budget, **wanted.shown}
        render_several(
            work,
            wanted,
            path,
            shots,
            drawn,
            lambda frame: _kept(_overlaid(frame, overlay) if overlay else frame, path, outputs),
            (wanted.size, samples, budget, wanted.shown, overlay, outputs),
        )


def _render(
    work: Work,
    wanted: Request,
    path: Path,
    overlay: tuple[str, ...],
    chosen: tuple[str, ...] | None,
    samples: int,
    budget: dict[str, Any],
) -> None:
    with work.stage("load", f"loading {wanted.name}"):
        scene = wanted.load()
    camera, lights = wanted.camera(scene), wanted.lit(scene)
    outputs = _outputs(path, overlay, chosen, work.as_json)
    with work.stage("open", "opening OpenGL"):
        from glshadow.renderer import Renderer

        renderer = Renderer(wanted.driver)
    with renderer:
        with work.stage("render", f"rendering {wanted.name}"):
            frame = renderer.render(
                scene, camera, lights, wanted.size, outputs=outputs, samples=samples, **budget, **wanted.shown
            )
        info = renderer.info
        covered = refuse_blank(frame, renderer, work)
    warn_fallbacks(work, frame.used, scene, wanted)
    if overlay:
        with work.stage("overlay", "drawing overlays"):
            frame = _overlaid(frame, overlay)
    with work.stage("write", f"writing {path.name}"):
        _kept(frame, path, chosen).save(path)
    facts = scene_facts(scene)
    loose = "".join(f", {facts[kind]} {kind}" for kind in ("points", "line segments") if kind in facts)
    work.say(
        f"{path}: {wanted.size[0]}x{wanted.size[1]}, {facts['triangles']} triangles{loose}, {_counted(len(lights), 'light')}, "
        f"{sum(work.timings.values()):.2f} s ({info['backend']}, {info['renderer'].partition(' (')[0]})"
    )
    work.finish(_report(frame, path, scene, covered, info))


def _overlaid(frame: Frame, overlay: tuple[str, ...]) -> Frame:
    from glshadow.overlay import overlay as draw

    return replace(frame, outputs={**frame.outputs, "image": draw(frame, overlay)})


def _stored(path: Path, chosen: tuple[str, ...] | None) -> tuple[str, ...]:
    """Outputs that a file holds."""
    return chosen or {".exr": FLOATS, ".npz": STORED}.get(path.suffix.lower(), ("image",))


def _kept(frame: Frame, path: Path, chosen: tuple[str, ...] | None) -> Frame:
    """The frame with the outputs that its file holds, without those that only checks and overlays need."""
    names = _stored(path, chosen)
    return replace(frame, outputs={name: value for name, value in frame.outputs.items() if name in names})


def _outputs(path: Path, overlay: tuple[str, ...], chosen: tuple[str, ...] | None, timed: bool) -> tuple[str, ...]:
    outputs = ["alpha", "node", *_stored(path, chosen)]  # alpha and node: to check whether the model is in view
    if overlay:
        from glshadow.overlay import required_outputs

        outputs += required_outputs(overlay)
    return tuple(dict.fromkeys(outputs + ["timings"] * timed))


def _counted(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _report(frame: Frame, path: Path, scene: Scene, covered: float, info: dict[str, Any]) -> dict[str, Any]:
    camera = frame.camera
    return {
        "path": str(path),
        "size": frame.size,
        "scene": scene_facts(scene),
        "exposure": frame.exposure,
        "tone": frame.tone,
        "camera": {"position": camera.position, "target": camera.target, "up": camera.up, **camera.lens,
                   "near": frame.near, "far": frame.far},
        "covered": covered,
        "lights": [light_facts(light, used) for light, used in zip(frame.lights, frame.used, strict=True)],
        "driver": {name: info[name] for name in ("backend", "renderer", "version")},
        "timings": {"passes": dict(frame.outputs.get("timings", {}))},
    }  # fmt: skip
