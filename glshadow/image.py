"""Images through OpenImageIO, JPEG through Pillow: textures as RGBA bytes; PNG, JPEG, TIFF and EXR written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_path, numbers_in, refuse, text
from glshadow.errors import SceneError, SettingsError
from glshadow.files import replacing, temporary
from glshadow.jpeg import MAGIC_JPEG, SCAN, jpeg, jpeg_size
from glshadow.signals import undisturbed

__all__ = ["Header", "header", "read", "write"]

Pixels = NDArray[Any]
Attributes = Mapping[str, float | str]

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr")
FRAME_SUFFIXES = (*SUFFIXES, ".npz")  # what a frame is saved as
FLOAT_SUFFIXES = (".exr", ".tif", ".tiff")
# pixels: 16384 x 16384, the largest texture of common drivers; checked before memory is allocated
LARGEST_IMAGE = 1 << 28
# zlib level, and PNG_FILTER_SUB alone: 1280 x 720 in 20 ms, all filters need 50 for the same size (measured)
PNG_LEVEL, PNG_FILTER = 2, 16
PNG_END = bytes.fromhex("0000000049454e44ae426082")  # the IEND chunk
MAGIC = ((b"\x89PNG", ".png"), (MAGIC_JPEG, ".jpg"), (b"RIFF", ".webp"), (b"II*\0", ".tif"), (b"MM\0*", ".tif"))


@dataclass(frozen=True)
class Header:
    """Properties of an image file, known before decoding.

    Parameters
    ----------
    size : (2,) ints
        Width and height in pixels.
    decoded_bytes : int
        Least memory for decoding: RGBA, or the stored format if that is larger; for a JPEG once more per pixel for every further scan,
        because each scan covers the whole image again.
    """

    size: tuple[int, int]
    decoded_bytes: int


def header(source: str | os.PathLike[str] | bytes) -> Header:
    """Read the properties of an image without decoding its pixels.

    Parameters
    ----------
    source : path, or the bytes of an image file

    Raises
    ------
    SceneError
        If it is not a readable image.
    """
    data = (
        bytes(source)
        if isinstance(source, bytes | bytearray | memoryview)
        else _bytes(as_path("image", source), MAGIC_JPEG)
    )
    if data.startswith(MAGIC_JPEG):
        width, height = jpeg_size(data)
        return Header((width, height), width * height * (3 + data.count(SCAN)))
    with opened(source) as (reader, _):
        spec = reader.spec()
        pixels = max(spec.width * spec.height * spec.depth, spec.tile_width * spec.tile_height)
        return Header((spec.width, spec.height * spec.depth), pixels * max(4, spec.pixel_bytes(True)))


def _bytes(path: Path, magic: bytes = b"") -> bytes:
    """Content of a file; if it does not start with `magic`, only its first bytes."""
    if not path.is_file():
        raise SceneError(f"{path}: image file not found")
    with path.open("rb") as file:
        head = file.read(len(magic))
        return head + file.read() if head == magic else head


def read(source: str | os.PathLike[str] | bytes) -> NDArray[np.uint8]:
    """An image as straight (not premultiplied) RGBA bytes.

    Parameters
    ----------
    source : path, or the bytes of an image file
        Any format of OpenImageIO. Grey, grey with alpha, palette, RGB and 16-bit images are converted.

    Returns
    -------
    (H, W, 4) uint8
        Row 0 at the top; alpha 255 where the image has none.

    Raises
    ------
    SceneError
        If it is not a readable image, or larger than 2^28 pixels.
    SettingsError
        If it is neither a path nor bytes.
    """
    with opened(source) as (reader, name):
        spec = reader.spec()
        if spec.width * spec.height > LARGEST_IMAGE or spec.depth > 1:
            raise SceneError(
                f"{name}: {spec.width} x {spec.height} x {spec.depth} pixels; at most 16384 x 16384 x 1 are read"
            )
        pixels = reader.read_image(0, 0, 0, min(spec.nchannels, 4), "uint8")
        if pixels is None:
            raise SceneError(f"{name} cannot be read as an image: {reader.geterror().strip()}")
    return _rgba(np.asarray(pixels, dtype=np.uint8).reshape(spec.height, spec.width, -1))


@contextmanager
def opened(source: str | os.PathLike[str] | bytes) -> Iterator[tuple[Any, str]]:
    """OpenImageIO's reader of an image, and the image's name in messages."""
    with undisturbed():
        import OpenImageIO as oiio

    with _file(source) as (path, name):
        wanted = oiio.ImageSpec()
        wanted.attribute("oiio:UnassociatedAlpha", 1)  # otherwise OpenImageIO multiplies colour by alpha when reading
        reader = oiio.ImageInput.open(str(path), wanted)
        if reader is None:
            raise SceneError(f"{name} cannot be read as an image: {oiio.geterror().strip() or 'unknown format'}")
        try:
            yield reader, name
        finally:
            reader.close()


@contextmanager
def _file(source: str | os.PathLike[str] | bytes) -> Iterator[tuple[Path, str]]:
    """A file that OpenImageIO's Python module can open (it reads nothing else), and the image's name in messages."""
    if not isinstance(source, bytes | bytearray | memoryview):
        name = str(path := as_path("image", source))
        if path.is_file() and _utf8(path):
            yield path, name
            return
        source = _bytes(path)
    else:
        name = f"an embedded image of {len(source)} bytes"
    suffix = next((known for magic, known in MAGIC if bytes(source[: len(magic)]) == magic), ".img")
    with temporary(suffix) as path:
        path.write_bytes(source)
        yield path, name


def _rgba(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width, channels = pixels.shape
    if channels == 4:
        return pixels
    result = np.full((height, width, 4), 255, dtype=np.uint8)
    result[..., :3] = pixels[..., :3] if channels == 3 else pixels[..., :1]
    if channels == 2:
        result[..., 3] = pixels[..., -1]
    return result


def image_path(name: str, value: Any, suffixes: tuple[str, ...] = SUFFIXES) -> Path:
    """Check a path for writing an image: a known suffix, in an existing folder."""
    path = as_path(name, value)
    if path.suffix.lower() not in suffixes:
        raise SettingsError(
            f"{path}: an image file must end in one of {', '.join(suffixes)}, got {path.suffix or 'no ending'!r}"
        )
    if not path.parent.is_dir():
        raise SettingsError(f"{path}: folder not found: {str(path.parent)!r}")
    return path


def frame_path(name: str, value: Any) -> Path:
    """Check a path for saving a frame: that of an image, or .npz."""
    return image_path(name, value, FRAME_SUFFIXES)


def write(
    path: str | os.PathLike[str], image: Pixels | Mapping[str, Pixels], attributes: Attributes | None = None
) -> None:  # fmt: skip
    """Write an image. The write is atomic, and equal pixels give equal bytes.

    Parameters
    ----------
    path : path
        The suffix selects the format: .png .jpg .jpeg .tif .tiff .exr
    image : (H, W, 3) or (H, W, 4) or (H, W) uint8, or float for .exr and .tif; or a mapping
        Row 0 at the top. A mapping gives named channels, for .exr and .tif: name -> (H, W) is the channel ``name``,
        name -> (H, W, 3) or (H, W, 4) are ``name.R``, ``name.G``, ``name.B``, ``name.A``, where the names "", "RGB" and
        "RGBA" leave plain R, G, B, A.
        Floating-point and integer arrays become float32.
    attributes : mapping, optional
        Numbers and texts by their names, for the header of an .exr.

    Raises
    ------
    SettingsError
        For an unknown suffix, or an image that the format cannot store.
    GlshadowError
        If the file cannot be written.
    """
    path = image_path("path", path)
    suffix = path.suffix.lower()
    names, pixels = _channels(path, image)
    if pixels.dtype != np.uint8 and suffix not in FLOAT_SUFFIXES:
        known = ", ".join(FLOAT_SUFFIXES)
        raise SettingsError(
            f"{path}: {suffix} holds uint8 images, got {pixels.dtype}; write {known} or convert to uint8 first"
        )
    if suffix == ".exr":
        pixels = pixels.astype(np.float32) / (255.0 if pixels.dtype == np.uint8 else 1.0)
    if suffix in (".jpg", ".jpeg") and pixels.shape[2] == 4:
        raise SettingsError(f"{path}: JPEG has no alpha; give (H, W, 3)")
    _replace(path, suffix, names, np.ascontiguousarray(pixels), (attributes or {}) if suffix == ".exr" else {})


def _channels(path: Path, image: Pixels | Mapping[str, Pixels]) -> tuple[list[str], Pixels]:
    """Channel names and pixels (H, W, C), uint8 or float32."""
    if not isinstance(image, Mapping):
        pixels = _planes(f"{path}: an image", image)
        names = ["Y"] if pixels.shape[2] == 1 else list("RGBA"[: pixels.shape[2]])
        return names, pixels if pixels.dtype == np.uint8 else _single(pixels)
    names, planes = [], []
    for name, value in image.items():
        pixels = _planes(f"{path}: channel {text()('the name of a channel', name)!r}", value)
        prefix = "" if name in ("", "RGB", "RGBA") else f"{name}."
        names += [name] if pixels.shape[2] == 1 else [prefix + letter for letter in "RGBA"[: pixels.shape[2]]]
        planes.append(_single(pixels))
    sizes = {plane.shape[:2] for plane in planes}
    if len(sizes) != 1 or len(set(names)) != len(names):
        raise SettingsError(
            f"{path}: channels must have one size and different names, got {names} of sizes {sorted(sizes)}"
        )
    return names, np.concatenate(planes, axis=2)


def _planes(name: str, value: Any) -> Pixels:
    """Pixels (H, W, C) of an image or a channel."""
    array = numbers_in(value)
    if array is not None and array.ndim == 2:
        array = array[..., None]
    if array is None or array.ndim != 3 or array.shape[2] not in (1, 3, 4) or 0 in array.shape:
        raise refuse(name, "(H, W), (H, W, 3) or (H, W, 4) numbers", value)
    if array.shape[0] * array.shape[1] > LARGEST_IMAGE:
        raise SettingsError(f"{name} must have at most {LARGEST_IMAGE} pixels, got {array.shape[1]} x {array.shape[0]}")
    return array


def _single(pixels: Pixels) -> Pixels:
    with np.errstate(all="ignore"):  # values beyond float32 become infinite
        return pixels.astype(np.float32)


def _replace(path: Path, suffix: str, names: list[str], pixels: Pixels, attributes: Attributes) -> None:
    """Write next to `path`, then rename: readers never see half a file, even after Ctrl-C."""
    with replacing(path) as part:
        if not _utf8(part):
            raise OSError("the name of its folder is not UTF-8; write elsewhere and move it")
        try:
            _write_file(part, suffix, names, pixels, attributes)
        except OSError as error:
            _reserve_space(part, pixels.nbytes)
            raise OSError(str(error).replace(str(part), path.name)) from None


def _reserve_space(part: Path, count: int) -> None:
    """Raise the system's error for a file of `count` bytes: OpenImageIO does not report why it could not write."""
    if hasattr(os, "posix_fallocate"):
        with part.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, count)


def _utf8(path: Path) -> bool:
    """Whether OpenImageIO can open the path, whose name must be UTF-8."""
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError:
        return False
    return True


def _check_png(path: Path) -> None:
    """Raise an OSError for a truncated PNG: OpenImageIO (3.0) does not notice a full disk."""
    with path.open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - len(PNG_END), 0))
        if file.read() != PNG_END:
            raise OSError("its end is missing; is the disk full?")


def _write_file(path: Path, suffix: str, names: list[str], pixels: Pixels, attributes: Attributes) -> None:
    if suffix in (".jpg", ".jpeg"):
        path.write_bytes(jpeg(pixels))
        return
    with undisturbed():
        import OpenImageIO as oiio

    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, "uint8" if pixels.dtype == np.uint8 else "float")
    spec.channelnames = tuple(names)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("DateTime", "")  # otherwise EXR and TIFF contain the time of writing
    for name, value in attributes.items():
        spec.attribute(name, value)
    if suffix == ".png":
        spec.attribute("png:compressionLevel", PNG_LEVEL)
        spec.attribute("png:filter", PNG_FILTER)
    else:
        spec.attribute("Compression", "zip")
    writer = oiio.ImageOutput.create(str(path))
    if writer is None:
        raise OSError(oiio.geterror().strip())
    try:
        if not writer.open(str(path), spec) or not writer.write_image(pixels):
            raise OSError(writer.geterror().strip())
    finally:
        if not writer.close():
            raise OSError(writer.geterror().strip())
    if suffix == ".png":
        _check_png(path)
