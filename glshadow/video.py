"""Moving images as files: .gif and .webp through Pillow, .mp4 through PyAV; written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_path, number, numbers_in, shown
from glshadow.errors import GlshadowError, SettingsError
from glshadow.files import replacing
from glshadow.signals import undisturbed

__all__ = ["write"]

Pixels = NDArray[np.uint8]

SUFFIXES = (".mp4", ".gif", ".webp")
IN_MEMORY = (".gif", ".webp")
MOST_PIXELS = 1 << 29
"""Pixels of all images of a file that is encoded in memory: 1.5 GiB, 582 images of 1280 x 720."""
FASTEST = {".gif": 50.0, ".webp": 1000.0, ".mp4": 1000.0}
"""Images per second: a GIF's delays are hundredths of a second, and players replace one of less than two by ten."""
_FPS = number(0.01, 1000.0, unit="images per second")
_BT709, _SRGB, _BITEXACT = 1, 13, 1 << 23  # ITU-T H.273: primaries and matrix; transfer. AV_CODEC_FLAG_BITEXACT


def video_path(name: str, value: Any, fps: float = 30.0) -> Path:
    """Check a path for writing a video: a known suffix, in an existing folder, with what writes it installed.

    Raises
    ------
    SettingsError
        If it is not one, or holds no such number of images per second.
    GlshadowError
        If PyAV is needed and not installed.
    """
    path = as_path(name, value)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise SettingsError(
            f"{path}: a video must end in one of {', '.join(SUFFIXES)}, got {path.suffix or 'no ending'!r}"
        )
    if not path.parent.is_dir():
        raise SettingsError(f"{path}: folder not found: {str(path.parent)!r}")
    if fps > FASTEST[suffix]:
        raise SettingsError(
            f"{path}: {suffix} holds at most {FASTEST[suffix]:g} images per second, got {fps:g}: use .mp4"
        )
    if suffix == ".mp4":
        _av()
    return path


def write(path: str | os.PathLike[str], images: Iterable[Pixels], fps: float = 30.0) -> int:
    """Write images as a video. The write is atomic, and equal images give equal bytes. Returns the number of images.

    Parameters
    ----------
    path : path
        The suffix selects the format. .mp4: H.264, 4:2:0, played everywhere; a last column or row is repeated where the size is odd.
        .webp: without loss, also of alpha. .gif: 256 colours, without alpha. Both repeat forever.
    images : iterable of (H, W, 3) or, for .webp, (H, W, 4) uint8
        sRGB, row 0 at the top, all of one size; taken one by one. All images of a .gif or .webp are kept in memory until the end: at most
        2^29 pixels.
    fps : float
        Images per second; for .gif at most 50.

    Raises
    ------
    SettingsError
        For an unknown suffix, or images that the format cannot store.
    GlshadowError
        If the file cannot be written, or .mp4 is to be written without PyAV: `pip install "glshadow[video]"`.
    """
    fps = _FPS("fps", fps)
    path = video_path("path", path, fps)
    checked = _checked(path, images)
    with replacing(path) as part:
        if path.suffix.lower() in IN_MEMORY:
            return _write_frames(part, checked, fps)
        try:
            return _write_mp4(part, checked, fps)
        except GlshadowError:
            raise
        except ValueError as error:  # of PyAV
            raise OSError(str(error)) from error


def _checked(path: Path, images: Iterable[Pixels]) -> Iterator[Pixels]:
    suffix, size, count = path.suffix.lower(), None, 0
    channels = (3, 4) if suffix == ".webp" else (3,)
    try:
        taken = iter(images)
    except TypeError:
        raise SettingsError(f"images must be a sequence of images, got {shown(images)}") from None
    for count, image in enumerate(taken, start=1):
        given = numbers_in(image)
        what = f"{path}: images[{count - 1}]"
        if (
            given is None
            or given.dtype != np.uint8
            or given.ndim != 3
            or given.shape[2] not in channels
            or not given.size
        ):
            kinds = " or ".join(f"(H, W, {each})" for each in channels)
            raise SettingsError(f"{what} must be {kinds} uint8, got {shown(image)}; alpha is stored by .webp alone")
        if given.shape != (size or given.shape):
            raise SettingsError(f"{what} has the shape {given.shape}, the others have {size}")
        size = given.shape
        if suffix in IN_MEMORY and count * size[0] * size[1] > MOST_PIXELS:
            raise SettingsError(f"{path}: more than {MOST_PIXELS:,} pixels: use .mp4, fewer images or a smaller size")
        yield np.ascontiguousarray(given)
    if count == 0:
        raise SettingsError(f"{path}: there are no images to write")


def _write_frames(path: Path, images: Iterator[Pixels], fps: float) -> int:
    """An animated GIF or WebP."""
    from PIL import Image

    gif = path.suffix.lower() == ".gif"
    frames = [Image.fromarray(image) for image in images]
    unit = 10 if gif else 1  # milliseconds
    # each image ends at the nearest unit, so that no error accumulates
    ends = [unit * round((k + 1) * 1000.0 / (fps * unit)) for k in range(len(frames))]
    options: dict[str, Any] = {"save_all": True, "append_images": frames[1:], "loop": 0}
    options["duration"] = [int(each) for each in np.diff([0, *ends])]
    if gif:
        frames[0].save(path, "GIF", optimize=False, disposal=1, **options)
    else:
        frames[0].save(path, "WEBP", lossless=True, quality=30, method=2, exact=True, **options)
    return len(frames)


def _av() -> Any:
    """PyAV."""
    try:
        with undisturbed():
            import av
    except ImportError:
        raise GlshadowError('.mp4 needs PyAV, which is not installed: pip install "glshadow[video]"') from None
    return av


def _write_mp4(path: Path, images: Iterator[Pixels], fps: float) -> int:
    av = _av()
    first = next(images)
    height, width = (each + each % 2 for each in first.shape[:2])
    rate = Fraction(fps).limit_denominator(1001)
    count = 0
    with ExitStack() as opened:
        container = opened.enter_context(
            av.open(str(path), "w", format="mp4", options={"movflags": "+faststart", "fflags": "+bitexact"})
        )
        # one thread: how many there are changes what x264 writes
        stream = container.add_stream("libx264", rate=rate, options={"crf": "16", "preset": "medium", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        codec = stream.codec_context
        codec.thread_count = 1
        codec.flags |= _BITEXACT
        codec.colorspace = codec.color_primaries = _BT709
        codec.color_trc, codec.color_range = _SRGB, 1
        for image in _chain(first, images):
            padded = np.pad(image, ((0, height - image.shape[0]), (0, width - image.shape[1]), (0, 0)), mode="edge")
            frame = av.VideoFrame.from_ndarray(padded, format="rgb24")
            frame = frame.reformat(
                format="yuv420p", dst_colorspace="ITU709", src_color_range="JPEG", dst_color_range="MPEG"
            )
            frame.pts, frame.time_base = count, 1 / rate
            container.mux(stream.encode(frame))
            count += 1
        container.mux(stream.encode())
    return count


def _chain(first: Pixels, rest: Iterator[Pixels]) -> Iterator[Pixels]:
    yield first
    yield from rest
