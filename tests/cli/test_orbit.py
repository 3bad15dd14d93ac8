"""glshadow render --orbit: which images are rendered, which are kept, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow import image

from .rendered import files, made, run


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_orbit_renders_every_view(folder: Path) -> None:
    assert made("--orbit", "3", "-o", "view_{:02d}.png") == [True] * 3
    assert files(folder) == ["view_.orbit.jsonl", "view_00.png", "view_01.png", "view_02.png"]
    scene = gs.scenes.courtyard()
    with gs.Renderer("egl") as renderer:
        for number, camera in enumerate(gs.orbit(scene.camera, 3)):
            expected = renderer.render(scene, camera, size=(64, 48), samples=1).image
            np.testing.assert_array_equal(image.read(f"view_{number:02d}.png")[..., :3], expected)


def test_existing_images_are_kept(folder: Path) -> None:
    request = ("--orbit", "4", "-o", "v{}.png")
    assert made(*request) == [True] * 4
    before = [(folder / f"v{k}.png").stat().st_mtime_ns for k in range(4)]
    assert made(*request) == [False] * 4
    (folder / "v1.png").unlink()
    (folder / "v2.png").write_bytes((folder / "v3.png").read_bytes())  # another image under its name
    assert made(*request) == [False, True, True, False]
    after = [(folder / f"v{k}.png").stat().st_mtime_ns for k in range(4)]
    assert [a == b for a, b in zip(after, before, strict=True)] == [True, False, False, True]


@pytest.mark.parametrize("more", ["--filter hard", "--background 0,0,0", "--light sun:0,-1,0", "--ortho 9", "--ground"])
def test_changed_options_render_all_again(more: str) -> None:
    options = more.split()
    assert made("--orbit", "2", "-o", "v{}.png") == [True] * 2
    done = run("--orbit", "2", "-o", "v{}.png", *options)
    assert "belong to another request: rendering them again" in done.stderr
    assert made("--orbit", "2", "-o", "v{}.png", *options) == [False] * 2


def test_changed_cookie_renders_all_again(folder: Path) -> None:
    """The two cookies have the same size and print the same; only their middles differ."""
    request = ("--orbit", "1", "-o", "v{}.png", "--light", "sun:0,-1,0:cookie=c.png")
    for shade in (40, 200):
        pixels = np.full((32, 32, 3), 90, np.uint8)
        pixels[8:24, 8:24] = shade
        image.write(folder / "c.png", pixels)
        assert made(*request) == [True]
    assert made(*request) == [False]


def test_interrupted_command_resumes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save, count = gs.Frame.save, [0]

    def interrupted(frame: gs.Frame, path: Path) -> None:
        count[0] += 1
        if count[0] == 3:
            raise KeyboardInterrupt
        save(frame, path)

    with monkeypatch.context() as patch:
        patch.setattr(gs.Frame, "save", interrupted)
        assert "interrupted" in run("--orbit", "4", "-o", "v{}.png", code=130).stderr
    assert files(folder) == ["v.orbit.jsonl", "v0.png", "v1.png"]
    assert made("--orbit", "4", "-o", "v{}.png") == [False, False, True, True]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--orbit", "2", "-o", "v.png"), "one field for the image's number"),
        (("--orbit", "2", "-o", "v{}{}.png"), "one field"),
        (("--orbit", "2", "-o", "v{name}.png"), "one field"),
        (("--orbit", "2", "-o", "v{:s}.png"), "one field"),
        (("--orbit", "2", "-o", "v{!r}.png"), "one field"),
        (("--orbit", "2", "-o", "v{:.0e}.png"), "one field"),  # 10 and 14 would share a name
        (("--orbit", "2", "-o", "v{:c}.png"), "one field"),
        (("--orbit", "2", "-o", "v{:999999999}.png"), "one field"),
        (("--orbit", "2", "-o", "v{.png"), "one field"),
        (("-o", "v{:03d}.png"), "needs --orbit"),
        (("--orbit", "0", "-o", "v{}.png"), "0 is not in the range"),
        (("--orbit", "100001", "-o", "v{}.png"), "is not in the range"),
        (("--orbit", "2", "-o", "nowhere/v{}.png"), "folder not found"),
    ],
)
def test_bad_options_are_refused(folder: Path, arguments: tuple[str, ...], said: str) -> None:
    assert said in run(*arguments, code=2).stderr
    assert files(folder) == []


def test_bad_model_fails_before_any_write(folder: Path) -> None:
    (folder / "bad.glb").write_bytes(b"glTF")
    run("bad.glb", "--orbit", "2", code=1)
    assert files(folder) == ["bad.glb"]


def test_default_name_is_the_models(folder: Path) -> None:
    run("--orbit", "1", "--overlay", "axes")
    assert files(folder) == ["courtyard_.orbit.jsonl", "courtyard_000.png"]


def test_model_name_may_contain_braces(folder: Path) -> None:
    (folder / "a{b}.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n")
    run("a{b}.obj")
    run("a{b}.obj", "--orbit", "1")
    assert files(folder) == ["a{b}.obj", "a{b}.png", "a{b}_.orbit.jsonl", "a{b}_000.png"]


def test_other_entries_of_the_journal_are_left_alone(folder: Path) -> None:
    journal = folder / "v.orbit.jsonl"
    journal.write_text('{"key":"v9.png","request":"another","sha256":"0"}\n{"key":"of something else"}\n')
    done = run("--orbit", "1", "-o", "v{}.png")
    assert "made anew" not in done.stderr
    assert made("--orbit", "1", "-o", "v{}.png") == [False]
