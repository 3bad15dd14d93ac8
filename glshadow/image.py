"""Images through OpenImageIO, JPEG through Pillow: textures as RGBA bytes; PNG, JPEG, TIFF and EXR written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import GlshadowError, SceneError, SettingsError

Pixels = NDArray[Any]

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr")
FLOAT_SUFFIXES = (".exr", ".tif", ".tiff")
LARGEST_IMAGE = (
    1 << 28
)  # pixels: 16384 x 16384, the largest texture of the common drivers; refused before memory is asked for
PNG_LEVEL, PNG_FILTER = (
    2,
    16,
)  # zlib level, and PNG_FILTER_SUB alone: 1280 x 720 in 20 ms, all filters need 50 for the same size (measured)
PNG_END = bytes.fromhex("0000000049454e44ae426082")  # the IEND chunk
JPEG_QUALITY = 95
MAGIC = ((b"\x89PNG", ".png"), (b"\xff\xd8", ".jpg"), (b"RIFF", ".webp"), (b"II*\0", ".tif"), (b"MM\0*", ".tif"))


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
    """
    if not isinstance(source, (bytes, bytearray, memoryview)):
        return _read_file(Path(source), str(source))
    suffix = next((known for magic, known in MAGIC if bytes(source[: len(magic)]) == magic), ".img")
    with tempfile.TemporaryDirectory(prefix="glshadow-") as folder:  # OpenImageIO's Python module reads only from files
        path = Path(folder) / f"image{suffix}"
        path.write_bytes(source)
        return _read_file(path, f"an embedded image of {len(source)} bytes")


def _read_file(path: Path, name: str) -> NDArray[np.uint8]:
    import OpenImageIO as oiio

    if not path.is_file():
        raise SceneError(f"{name}: there is no such image file")
    if not _utf8(path):
        return read(path.read_bytes())
    wanted = oiio.ImageSpec()
    wanted.attribute("oiio:UnassociatedAlpha", 1)  # otherwise colour is multiplied by alpha on the way in
    reader = oiio.ImageInput.open(str(path), wanted)
    if reader is None:
        raise SceneError(f"{name} cannot be read as an image: {oiio.geterror().strip() or 'unknown format'}")
    try:
        spec = reader.spec()
        if spec.width * spec.height > LARGEST_IMAGE or spec.depth > 1:
            raise SceneError(
                f"{name}: {spec.width} x {spec.height} x {spec.depth} pixels; at most 16384 x 16384 x 1 are read"
            )
        pixels = reader.read_image(0, 0, 0, min(spec.nchannels, 4), "uint8")
        if pixels is None:
            raise SceneError(f"{name} cannot be read as an image: {reader.geterror().strip()}")
    finally:
        reader.close()
    return _rgba(np.asarray(pixels, dtype=np.uint8).reshape(spec.height, spec.width, -1))


def pixel_count(path: Path) -> int:
    """Pixels of an image file as its header states them; nothing is decoded.

    Raises
    ------
    SceneError
        If it is not a readable image.
    """
    import OpenImageIO as oiio

    reader = oiio.ImageInput.open(str(path))
    if reader is None:
        raise SceneError(f"{path.name} cannot be read as an image: {oiio.geterror().strip() or 'unknown format'}")
    spec = reader.spec()
    reader.close()
    return int(spec.width) * int(spec.height) * max(int(spec.depth), 1)


def _rgba(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width, channels = pixels.shape
    result = np.full((height, width, 4), 255, dtype=np.uint8)
    result[..., :3] = pixels[..., :3] if channels >= 3 else pixels[..., :1]
    if channels in (2, 4):
        result[..., 3] = pixels[..., -1]
    return result


def write(path: str | os.PathLike[str], image: Pixels | Mapping[str, Pixels]) -> None:
    """Write an image; the file appears complete or not at all, and equal pixels give equal bytes.

    Parameters
    ----------
    path : path
        Its ending chooses the format: .png .jpg .jpeg .tif .tiff .exr
    image : (H, W, 3) or (H, W, 4) or (H, W) uint8, or float for .exr and .tif; or a mapping
        Row 0 at the top. A mapping gives named channels, for .exr and .tif: name -> (H, W) is the channel ``name``,
        name -> (H, W, 3) or (H, W, 4) are ``name.R``, ``name.G``, ``name.B``, ``name.A``, where the names "", "RGB" and
        "RGBA" leave plain R, G, B, A.
        Floating-point and integer arrays become float32.

    Raises
    ------
    SettingsError
        For an unknown ending, or an image that the format cannot hold.
    GlshadowError
        If the file cannot be written.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise SettingsError(
            f"{path}: an image file must end in one of {', '.join(SUFFIXES)}, got {path.suffix or 'no ending'!r}"
        )
    names, pixels = _channels(path, image)
    if pixels.dtype != np.uint8 and suffix not in FLOAT_SUFFIXES:
        raise SettingsError(
            f"{path}: {suffix} holds uint8 images, got {pixels.dtype}; write {', '.join(FLOAT_SUFFIXES)} or convert "
            "to uint8 first"
        )
    if suffix == ".exr":
        pixels = pixels.astype(np.float32) / (255.0 if pixels.dtype == np.uint8 else 1.0)
    if suffix in (".jpg", ".jpeg") and pixels.shape[2] == 4:
        raise SettingsError(f"{path}: JPEG has no alpha; give (H, W, 3)")
    _replace(path, suffix, names, np.ascontiguousarray(pixels))


def _channels(path: Path, image: Pixels | Mapping[str, Pixels]) -> tuple[list[str], Pixels]:
    """Channel names and pixels (H, W, C), uint8 or float32."""
    if not isinstance(image, Mapping):
        array = np.asarray(image)
        array = array if array.ndim == 3 else array[..., None]
        if array.ndim != 3 or array.shape[2] not in (1, 3, 4) or 0 in array.shape:
            raise SettingsError(f"{path}: an image must be (H, W), (H, W, 3) or (H, W, 4), got {np.shape(image)}")
        names = ["Y"] if array.shape[2] == 1 else list("RGBA"[: array.shape[2]])
        return names, array if array.dtype == np.uint8 else array.astype(np.float32)
    names, planes = [], []
    for name, value in image.items():
        array = np.atleast_3d(np.asarray(value))
        if array.ndim != 3 or array.shape[2] not in (1, 3, 4) or 0 in array.shape:
            raise SettingsError(
                f"{path}: channel {name!r} must be (H, W), (H, W, 3) or (H, W, 4), got {np.shape(value)}"
            )
        prefix = "" if name in ("", "RGB", "RGBA") else f"{name}."
        names += [name] if array.shape[2] == 1 else [prefix + letter for letter in "RGBA"[: array.shape[2]]]
        planes.append(array.astype(np.float32))
    sizes = {plane.shape[:2] for plane in planes}
    if len(sizes) != 1 or len(set(names)) != len(names):
        raise SettingsError(
            f"{path}: channels must have one size and different names, got {names} of sizes {sorted(sizes)}"
        )
    return names, np.concatenate(planes, axis=2)


def _replace(path: Path, suffix: str, names: list[str], pixels: Pixels) -> None:
    """Write beside `path`, then rename: a reader, or Ctrl-C, never meets half a file."""
    try:
        handle, name = tempfile.mkstemp(prefix=".glshadow-", suffix=suffix, dir=path.parent)
    except OSError as error:
        raise GlshadowError(f"{path} cannot be written: {error.strerror or error}") from error
    os.close(handle)
    part = Path(name)
    try:
        if not _utf8(part):
            raise OSError("the name of its folder is not UTF-8; write elsewhere and move it")
        _write_file(part, suffix, names, pixels)
        part.chmod(0o666 & ~_umask())
        part.replace(path)
    except OSError as error:
        raise GlshadowError(f"{path} cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


def _utf8(path: Path) -> bool:
    """Whether OpenImageIO can be told its name."""
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError:
        return False
    return True


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _jpeg(pixels: NDArray[np.uint8]) -> bytes:
    """By Pillow: where the disk is full, the libjpeg inside OpenImageIO (3.0) ends the process."""
    import io

    from PIL import Image

    stream = io.BytesIO()
    picture = Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
    picture.save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)  # 4:4:4: thin shadow edges keep their colour
    return stream.getvalue()


def _check_png(path: Path) -> None:
    """OpenImageIO (3.0) does not notice a disk that was full."""
    with path.open("rb") as file:
        file.seek(-len(PNG_END), os.SEEK_END)
        if file.read() != PNG_END:
            raise OSError("its end is missing; is the disk full?")


def _write_file(path: Path, suffix: str, names: list[str], pixels: Pixels) -> None:
    if suffix in (".jpg", ".jpeg"):
        path.write_bytes(_jpeg(pixels))
        return
    import OpenImageIO as oiio

    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, "uint8" if pixels.dtype == np.uint8 else "float")
    spec.channelnames = tuple(names)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("DateTime", "")  # otherwise EXR and TIFF carry the time of writing
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
