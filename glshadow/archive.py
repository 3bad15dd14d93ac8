"""Writes arrays as an .npz file, whole or not at all; equal arrays give equal bytes."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import refuse
from glshadow.files import replacing

LEVEL = 1  # of zlib; the default of numpy, 6, takes several times as long for a tenth less


def write(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays by name; `np.load` reads them without pickle.

    Raises
    ------
    SettingsError
        If the folder does not exist.
    GlshadowError
        If the file cannot be written.
    """
    if not path.parent.is_dir():
        raise refuse("path", f"in an existing folder ({str(path.parent)!r} was not found)", str(path))
    with (
        replacing(path) as part,
        zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as file,
    ):
        for name, array in arrays.items():
            with file.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asarray(array, order="C"), allow_pickle=False)
