"""KHR_texture_basisu: KTX 2 images through the package opengl_basisu, if it is installed.

References
----------
Khronos, "KTX File Format Specification", version 2.0, section 3: the header.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError
from glshadow.image import Header

MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEAD = struct.Struct("<12s2I2I")


def is_ktx2(source: bytes | Path) -> bool:
    """Whether a file or its content begins as KTX 2 does."""
    return _head(source).startswith(MAGIC)


def _head(source: bytes | Path) -> bytes:
    if isinstance(source, bytes):
        return source[: _HEAD.size]
    with source.open("rb") as file:
        return file.read(_HEAD.size)


def ktx2_header(source: bytes | Path) -> Header:
    """Size and memory of a KTX 2 image, before it is decoded.

    Raises
    ------
    SceneError
        If it is cut off, has no pixels, or the package is not installed.
    """
    head = _head(source)
    if len(head) < _HEAD.size:
        raise SceneError("a KTX 2 image is cut off within its header")
    _, _, _, width, height = _HEAD.unpack(head)
    if width == 0 or height == 0:
        raise SceneError(f"a KTX 2 image must have pixels, got {width} x {height}")
    try:
        import opengl_basisu  # noqa: F401
    except ImportError:
        raise SceneError(
            "its image is Basis Universal (KTX 2), which the package opengl_basisu decodes: pip install 'glshadow[gltf]'"
        ) from None
    return Header((width, height), 4 * width * height)


def read_ktx2(source: bytes | Path) -> NDArray[np.uint8]:
    """The largest level as RGBA bytes (H, W, 4).

    Raises
    ------
    SceneError
        If it cannot be decoded.
    """
    import opengl_basisu

    data = source if isinstance(source, bytes) else source.read_bytes()
    try:
        decoded = opengl_basisu.open(data).transcode(opengl_basisu.Target.RGBA8)
    except (opengl_basisu.BasisuError, ValueError) as error:
        raise SceneError(f"its KTX 2 image cannot be decoded ({error})") from error
    return np.ascontiguousarray(decoded.data, dtype=np.uint8).reshape(decoded.height, decoded.width, 4)
