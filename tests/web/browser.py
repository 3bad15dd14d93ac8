"""Data that an exported page reports of itself when it is opened with #testWIDTHxHEIGHT."""

from __future__ import annotations

import base64
import re

import numpy as np


def pixels_of(page: str, name: str, width: int) -> np.ndarray:
    """(H, W, 4) uint8, row 0 at the top."""
    found = re.search(rf'<pre id="{name}">(.*?)</pre>', page)
    assert found, page[-500:]
    data = np.frombuffer(base64.b64decode(found[1]), np.uint8)
    return data.reshape(-1, width, 4)[::-1]
