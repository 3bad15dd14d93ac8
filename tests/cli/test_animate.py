"""glshadow render --time, --animate, and videos of --orbit: which images are rendered, into which files, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

import glshadow as gs
from glshadow import image, video

from ..scene.glb import Glb
from .rendered import files, made, run


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def falling(name: str, height: float = 2.0, camera: bool = False) -> None:
    """A triangle that falls by `height` in half a second, in view of a camera that rises."""
    file = Glb(nodes=[{"mesh": 0}] + [{"camera": 0, "translation": [0, 0, 9]}] * camera)
    file.mesh({"attributes": {"POSITION": file.add([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])}})
    file.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    times = file.add([0.0, 0.5])
    moves = [file.add([[0.0, 0, 0], [0, -height, 0]]), file.add([[0.0, 0, 9], [0, 2, 9]])][: 1 + camera]
    file.json["animations"] = [
        {
            "name": "fall",
            "samplers": [{"input": times, "output": each} for each in moves],
            "channels": [{"sampler": k, "target": {"node": k, "path": "translation"}} for k in range(len(moves))],
        }
    ]
    file.save(Path(name))


def shown(path: str) -> list[np.ndarray]:
    with Image.open(path) as file:
        return [np.asarray(each.convert("RGB")) for each in ImageSequence.Iterator(file)]


def expected(scene: gs.Scene, times: list[float]) -> list[np.ndarray]:
    with gs.Renderer("egl") as renderer:
        return [frame.image for frame in renderer.animation(scene, times, size=(64, 48), samples=1)]


def test_animation_has_an_image_for_each_time() -> None:
    """Half a second at 8 a second: 0, 1/8, 2/8, 3/8; the camera and the ground serve all of them."""
    falling("fall.glb")
    run("fall.glb", "--animate", "8", "--ground", "-o", "fall.webp")
    times = [0.0, 0.125, 0.25, 0.375]
    scene = gs.load("fall.glb", ground=True).framed(times)
    np.testing.assert_array_equal(shown("fall.webp"), expected(scene, times))
    assert made("fall.glb", "--animate", "8", "--ground", "-o", "{0:04d}.png") == [True] * 4
    for number, pixels in enumerate(shown("fall.webp")):
        np.testing.assert_array_equal(image.read(f"{number:04d}.png")[..., :3], pixels)


def test_images_follow_the_files_camera_unless_options_place_it() -> None:
    falling("fall.glb", camera=True)
    scene = gs.load("fall.glb")
    run("fall.glb", "--animate", "4", "-o", "fall.webp")
    np.testing.assert_array_equal(shown("fall.webp"), expected(scene, [0.0, 0.25]))
    run("fall.glb", "--animate", "4", "-o", "still.webp", "--eye", "0,0,9", "--target", "0,0,0")
    camera = gs.PerspectiveCamera((0, 0, 9), (0, 0, 0), fov_y=scene.camera.fov_y)  # type: ignore[attr-defined]
    with gs.Renderer("egl") as renderer:
        frames = list(renderer.animation(scene, [0.0, 0.25], camera, size=(64, 48), samples=1))
    np.testing.assert_array_equal(shown("still.webp"), [frame.image for frame in frames])


def test_existing_images_are_kept_until_the_motion_changes() -> None:
    request = ("fall.glb", "--animate", "8", "-o", "v{}.png", "--eye", "3,3,3", "--target", "0,0,0")
    falling("fall.glb")
    assert made(*request) == [True] * 4
    Path("v2.png").unlink()
    assert made(*request) == [False, False, True, False]
    falling("fall.glb", height=3.0)  # the same at rest
    assert made(*request) == [True] * 4
    assert made(*request) == [False] * 4


def test_time_and_animation() -> None:
    falling("fall.glb")
    scene = gs.load("fall.glb", time=0.25, ground=None)
    for more in ([], ["--animation", "fall"], ["--animation", "0"]):
        run("fall.glb", "--time", "0.25", "-o", "at.png", *more)
        np.testing.assert_array_equal(image.read("at.png")[..., :3], expected(scene, [0.25])[0])
    jump = run("fall.glb", "--animation", "jump", "--time", "0", code=1)
    assert "no animation is 'jump'; there are 1: 'fall'" in jump.stderr
    assert "--animation needs --time or --animate" in run("fall.glb", "--animation", "fall", code=2).stderr
    assert "1 s is outside its animation" in run("fall.glb", "--time", "1").stderr


@pytest.mark.parametrize("suffix", ["mp4", "gif", "webp"])
def test_orbit_into_a_video(folder: Path, suffix: str) -> None:
    report = json.loads(run("--orbit", "3", "-o", f"turn.{suffix}", "--json").stdout)
    assert (report["path"], report["images"], report["fps"], report["pictures"]) == (f"turn.{suffix}", 3, 30.0, [])
    assert files(folder) == [f"turn.{suffix}"]
    if suffix == "webp":
        scene = gs.scenes.courtyard()
        with gs.Renderer("egl") as renderer:
            frames = renderer.sequence(scene, gs.orbit(scene.camera, 3), size=(64, 48), samples=1)
            np.testing.assert_array_equal(shown("turn.webp"), [frame.image for frame in frames])
    before = (folder / f"turn.{suffix}").read_bytes()
    run("--orbit", "3", "-o", f"turn.{suffix}")
    assert (folder / f"turn.{suffix}").read_bytes() == before


def test_odd_sizes_are_said(folder: Path) -> None:
    said = run("--orbit", "1", "-o", "a.mp4", "--size", "63x48").stderr
    assert "H.264 needs an even width and height: the last column or row is there twice" in said


def test_interrupted_video_leaves_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    render, count = gs.Renderer.render, [0]

    def interrupted(*given: object, **options: object) -> gs.Frame:
        count[0] += 1
        if count[0] == 3:
            raise KeyboardInterrupt
        return render(*given, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(gs.Renderer, "render", interrupted)
    assert "interrupted" in run("--orbit", "4", "-o", "a.mp4", code=130).stderr
    assert files(folder) == []


def test_nothing_in_view_is_an_error(folder: Path) -> None:
    falling("fall.glb")
    away = ("--eye", "0,0,9", "--target", "0,0,20")
    assert "nothing is in view" in run("fall.glb", "--animate", "4", "-o", "a.gif", *away, code=1).stderr
    assert files(folder) == ["fall.glb"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--orbit", "2", "--animate", "8", "-o", "a.gif"), "--orbit and --animate cannot be combined"),
        (("--animate", "8", "--time", "1", "-o", "a.gif"), "leave out --time"),
        (("--animate", "8", "--max-ms", "9", "-o", "a.gif"), "with --animate each image is one"),
        (("--animate", "60", "-o", "a.gif"), ".gif holds at most 50 images per second"),
        (("--animate", "8", "-o", "a.png"), "one field for the image's number"),
        (("--animate", "0", "-o", "a.gif"), "not a number of images per second"),
        (("--animate", "nan", "-o", "a.gif"), "nan"),
        (("--animate", "8", "-o", "nowhere/a.gif"), "folder not found"),
        (("-o", "a.mp4",), "is a video: that needs render --orbit N or --animate FPS"),
        (("--orbit", "2", "-o", "a.gif", "--background", "none"), "a GIF's image has none"),
        (("--time", "1"), "--time needs a MODEL"),
    ],
)  # fmt: skip
def test_bad_options_are_refused(folder: Path, arguments: tuple[str, ...], said: str) -> None:
    assert said in run(*arguments, code=2).stderr
    assert files(folder) == []


def test_models_without_animation(folder: Path) -> None:
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n")
    said = run("a.obj", "--animate", "8", "-o", "a.gif", code=1).stderr
    assert "a.obj has no animation that takes time: render it without --animate" in said
    assert files(folder) == ["a.obj"]


def test_missing_extra_is_named_before_anything_is_rendered(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise gs.GlshadowError('.mp4 needs PyAV, which is not installed: pip install "glshadow[video]"')

    monkeypatch.setattr(video, "_av", missing)
    assert 'pip install "glshadow[video]"' in run("--orbit", "2", "-o", "a.mp4", code=1).stderr
    assert files(folder) == []
