"""Videos: read back by the libraries that wrote them; whole or not at all, and equal images give equal bytes."""

from __future__ import annotations

import builtins
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

from glshadow import video
from glshadow.errors import GlshadowError, SettingsError

FPS = 24.0


def images(count: int = 9, size: tuple[int, int] = (64, 48), channels: int = 3) -> list[np.ndarray[Any, Any]]:
    """A square that moves by four pixels an image, over one colour."""
    made = []
    for number in range(count):
        pixels = np.full((size[1], size[0], channels), (200, 60, 30, 255)[:channels], np.uint8)
        pixels[8:24, 4 * number : 4 * number + 16, :3] = (20, 200, 90)
        made.append(pixels)
    return made


def shown(path: Path) -> list[np.ndarray[Any, Any]]:
    if path.suffix == ".mp4":
        av = pytest.importorskip("av")
        with av.open(str(path)) as container:
            return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    with Image.open(path) as file:
        return [np.asarray(each.convert("RGBA")) for each in ImageSequence.Iterator(file)]


@pytest.mark.parametrize("suffix", video.SUFFIXES)
def test_equal_images_give_equal_bytes(tmp_path: Path, suffix: str) -> None:
    one, two = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
    assert [video.write(path, iter(images()), FPS) for path in (one, two)] == [9, 9]
    assert one.read_bytes() == two.read_bytes()
    assert len(shown(one)) == 9
    assert sorted(path.name for path in tmp_path.iterdir()) == [one.name, two.name]


def test_webp_has_every_pixel(tmp_path: Path) -> None:
    given = images(channels=4)
    for number, each in enumerate(given):
        each[30:, :, 3] = 20 + 20 * number  # without alpha no colour is shown
    video.write(tmp_path / "a.webp", given, FPS)
    np.testing.assert_array_equal(shown(tmp_path / "a.webp"), given)


def test_gif_has_every_pixel_of_few_colours(tmp_path: Path) -> None:
    video.write(tmp_path / "a.gif", images(), FPS)
    np.testing.assert_array_equal([each[..., :3] for each in shown(tmp_path / "a.gif")], images())


def test_gif_delays_add_up(tmp_path: Path) -> None:
    """24 a second are 4.17 hundredths each: every sixth is 5."""
    video.write(tmp_path / "a.gif", images(12), FPS)
    with Image.open(tmp_path / "a.gif") as file:
        delays = [each.info["duration"] for each in ImageSequence.Iterator(file)]
        assert file.info["loop"] == 0
    assert delays == [40, 40, 40, 50, 40, 40, 40, 40, 50, 40, 40, 40]
    assert sum(delays) == 500


@pytest.mark.parametrize("size", [(64, 48), (63, 47), (1, 1)])
def test_mp4_has_the_images(tmp_path: Path, size: tuple[int, int]) -> None:
    """Colours within 6 of 255 away from edges: 4:2:0 mixes the colours of two neighbours, and H.264 rounds. An odd size is padded."""
    av = pytest.importorskip("av")
    given = images(size=size)
    video.write(tmp_path / "a.mp4", given, 23.976)
    found = shown(tmp_path / "a.mp4")
    assert len(found) == 9
    for mine, theirs in zip(given, found, strict=True):
        assert theirs.shape[:2] == (size[1] + size[1] % 2, size[0] + size[0] % 2)
        far = np.abs(theirs[: size[1], : size[0]].astype(int) - mine).max(axis=-1)
        inner = np.ones(far.shape, bool)
        edges = (np.diff(mine.astype(int), axis=1) != 0).any(axis=-1)
        for shift in (-3, -2, -1, 0, 1, 2, 3):
            inner[:, :-1] &= ~np.roll(edges, shift, axis=1)
        inner[5:28] &= inner[16:17] if size[1] > 16 else inner[0:1]
        inner[5:11] = inner[21:28] = False
        assert far[inner].max() <= 6
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert float(stream.average_rate) == pytest.approx(23.976, abs=1e-3)


@pytest.mark.parametrize("suffix", video.SUFFIXES)
def test_interrupted_video_leaves_the_old_one(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")

    def interrupted() -> Iterator[np.ndarray[Any, Any]]:
        yield from images(3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        video.write(path, interrupted(), FPS)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "given", "fps", "said"),
    [
        ("a.avi", images(), FPS, "a video must end in one of .mp4, .gif, .webp, got '.avi'"),
        ("nowhere/a.gif", images(), FPS, "folder not found"),
        ("a.gif", images(), 60.0, ".gif holds at most 50 images per second, got 60: use .mp4"),
        ("a.webp", images(), 0.0, "fps must be"),
        ("a.webp", images(), float("nan"), "fps must be"),
        ("a.gif", [], FPS, "there are no images to write"),
        ("a.gif", 3, FPS, "images must be a sequence of images, got 3"),
        (
            "a.gif",
            [images()[0], images(size=(8, 8))[0]],
            FPS,
            r"images\[1\] has the shape \(8, 8, 3\), the others have \(48, 64, 3\)",
        ),
        (
            "a.mp4",
            images(channels=4),
            FPS,
            r"images\[0\] must be \(H, W, 3\) uint8, got .* alpha is stored by .webp alone",
        ),
        ("a.webp", [np.zeros((4, 4, 3))], FPS, "uint8"),
        ("a.webp", ["image"], FPS, "uint8"),
    ],
)
def test_what_cannot_be_written(tmp_path: Path, name: str, given: Any, fps: float, said: str) -> None:
    with pytest.raises(SettingsError, match=said):
        video.write(tmp_path / name, given, fps)
    assert list(tmp_path.iterdir()) == []


def test_too_many_pixels_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video, "MOST_PIXELS", 64 * 48 * 4)
    video.write(tmp_path / "a.gif", images(4), FPS)
    with pytest.raises(SettingsError, match=r"more than 12,288 pixels: use \.mp4, fewer images or a smaller size"):
        video.write(tmp_path / "b.gif", images(5), FPS)
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def test_mp4_without_its_library_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = builtins.__import__

    def without(name: str, *given: Any, **more: Any) -> Any:
        if name == "av":
            raise ImportError(name)
        return before(name, *given, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(GlshadowError, match=r'pip install "glshadow\[video\]"'):
        video.write(tmp_path / "a.mp4", images())
    video.write(tmp_path / "a.webp", images())
    assert [path.name for path in tmp_path.iterdir()] == ["a.webp"]


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "a.gif").mkdir()
    with pytest.raises(GlshadowError, match="cannot be written"):
        video.write(tmp_path / "a.gif", images())
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]
