"""KHR_materials_transmission: how much light passes through a surface, as a factor and a texture."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.errors import SceneError
from glshadow.io.gltf.document import as_object, extensions

NAME = "KHR_materials_transmission"


def transmission_of(given: dict[str, Any], where: str, notes: list[str]) -> tuple[float, dict[str, Any] | None]:
    """Factor, clipped to 0..1, and textureInfo of a glTF material; 0 if it has none.

    Raises
    ------
    SceneError
        If the factor is not a finite number.
    """
    block = extensions(given).get(NAME)
    if block is None:
        return 0.0, None
    block = as_object(block, f"{where}.{NAME}")
    try:
        factor = float(block.get("transmissionFactor", 0.0))
    except (TypeError, ValueError):
        factor = np.nan
    if not np.isfinite(factor):
        raise SceneError(f"{where}: transmissionFactor must be a number, got {block.get('transmissionFactor')!r}")
    if not 0.0 <= factor <= 1.0:
        notes.append(f"{where}: its transmissionFactor {factor:g} is clipped to 0..1")
    factor = min(max(factor, 0.0), 1.0)
    if factor == 0.0:
        return 0.0, None
    info = block.get("transmissionTexture")
    return factor, None if info is None else as_object(info, f"{where}.transmissionTexture")
