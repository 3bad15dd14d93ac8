"""EXT_meshopt_compression and KHR_meshopt_compression through the package meshopt, if it is installed."""

from __future__ import annotations

import numpy as np

from glshadow.errors import SceneError
from glshadow.io.limits import Budget

NAMES = ("EXT_meshopt_compression", "KHR_meshopt_compression")
MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")


def is_installed() -> bool:
    """Whether the package can be imported."""
    try:
        import meshopt  # noqa: F401
    except ImportError:
        return False
    return True


def decompressed(
    data: memoryview, count: int, stride: int, mode: object, filter: object, budget: Budget, where: str
) -> memoryview:
    """The content of a buffer view: `count` elements of `stride` bytes.

    Raises
    ------
    SceneError
        If the data is broken, mode or filter are not those of the extension, or the result exceeds the budget.
    """
    import meshopt

    if mode not in MODES or filter not in FILTERS:
        raise SceneError(f"{where}: meshopt mode {mode!r} with filter {filter!r}; {MODES} and {FILTERS} are known")
    if mode == "ATTRIBUTES" and stride > 256:
        raise SceneError(f"{where}: a compressed element has at most 256 bytes, got {stride}")
    budget.take(count * stride, where)
    try:
        values = meshopt.decode_gltf_buffer(bytes(data), count, stride, mode, None if filter == "NONE" else filter)
    except (ValueError, TypeError) as error:
        raise SceneError(f"{where}: its meshopt data cannot be decoded ({error})") from error
    return memoryview(np.ascontiguousarray(values).tobytes())
