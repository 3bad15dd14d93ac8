"""Location of the GLSL snippets: inside an installed wheel, or next to the package in a checkout."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from glshadow.errors import ShaderError


@cache
def root() -> Path:
    """Folder of the snippets.

    Raises
    ------
    ShaderError
        If neither the wheel nor the checkout has the folder.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "glsl", package.parent / "glsl"):
        if folder.is_dir():
            return folder
    raise ShaderError(f"the glsl folder is missing from {package} and {package.parent}: reinstall glshadow")


@cache
def read(name: str) -> str:
    """Text of the snippet `name`, a path below the glsl folder such as "filter/pcf.glsl"."""
    path = root() / name
    if ".." in Path(name).parts or not path.is_file():
        raise ShaderError(f'no snippet "{name}" in {root()}')
    return path.read_text(encoding="utf-8")
