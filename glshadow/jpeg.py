"""JPEG files: their size by their markers, and encoding by Pillow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError

JPEG_QUALITY = 95
# The start of a JPEG, and of each of its scans; within their data FF never occurs alone.
MAGIC_JPEG, SCAN = b"\xff\xd8", b"\xff\xda"


def jpeg_size(data: bytes) -> tuple[int, int]:
    """Width and height from the frame header; OpenImageIO would decode every scan first. Markers are found as in libjpeg."""
    at = data.find(b"\xff", 2)
    while 0 <= at < len(data) - 8:
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            return int.from_bytes(data[at + 7 : at + 9], "big"), int.from_bytes(data[at + 5 : at + 7], "big")
        if marker == 0xFF:  # fill byte
            at += 1
        elif marker in (0x00, 0x01) or 0xD0 <= marker <= 0xD8:  # markers without a length
            at = data.find(b"\xff", at + 2)
        else:
            at = data.find(b"\xff", at + 2 + int.from_bytes(data[at + 2 : at + 4], "big"))
    raise SceneError("a JPEG without a frame header cannot be read as an image")


def jpeg(pixels: NDArray[np.uint8]) -> bytes:
    """Encode with Pillow: on a full disk the libjpeg inside OpenImageIO (3.0) ends the process."""
    import io

    from PIL import Image

    stream = io.BytesIO()
    picture = Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
    picture.save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)  # 4:4:4: thin shadow edges keep their colour
    return stream.getvalue()
