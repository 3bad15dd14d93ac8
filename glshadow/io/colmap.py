"""Reads cameras and poses of a COLMAP model in its text format: cameras.txt and images.txt.

References
----------
COLMAP documentation, "Output Format" and "Camera Models".
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glshadow.core.calibration import rotation_of_quaternion
from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.distortion import BrownDistortion, Distortion, FisheyeDistortion
from glshadow.core.setting import as_path, shown
from glshadow.errors import GlshadowError, SceneError, SettingsError
from glshadow.io.limits import Budget

IMAGE_WORDS = 12  # more than an image has before the second word of its name
LONGEST = 1 << 28  # characters of a line: an image's line of points has some thirty a point

# model -> number of focal lengths, and the names of its further parameters
_BROWN = {
    "SIMPLE_PINHOLE": (1, ()),
    "PINHOLE": (2, ()),
    "SIMPLE_RADIAL": (1, ("k1",)),
    "RADIAL": (1, ("k1", "k2")),
    "OPENCV": (2, ("k1", "k2", "p1", "p2")),
}
_FISHEYE = {
    "SIMPLE_RADIAL_FISHEYE": (1, ("k1",)),
    "RADIAL_FISHEYE": (1, ("k1", "k2")),
    "OPENCV_FISHEYE": (2, ("k1", "k2", "k3", "k4")),
}
MODELS = {**_BROWN, **_FISHEYE}


@dataclass(frozen=True)
class ColmapImage:
    """One image of a COLMAP model.

    Parameters
    ----------
    camera : PerspectiveCamera
        Pose and intrinsics, in COLMAP's world coordinates.
    size : (2,) ints
        Width and height in pixels.
    distortion : Distortion, optional
        For `render_distorted`; None: a pinhole camera.
    """

    camera: PerspectiveCamera
    size: tuple[int, int]
    distortion: Distortion | None = None


@dataclass(frozen=True)
class _Lens:
    matrix: tuple[tuple[float, ...], ...]
    size: tuple[int, int]
    distortion: Distortion | None


def read_colmap(folder: str | os.PathLike[str]) -> dict[str, ColmapImage]:
    """Read the images of a COLMAP model by name.

    Parameters
    ----------
    folder : path
        With cameras.txt and images.txt; `colmap model_converter --output_type TXT` writes them. Points are not read.

    Raises
    ------
    SceneError
        If a file is missing or broken, or a camera's model is not known; the message names file and line.
    """
    try:
        place = as_path("folder", folder)
    except SettingsError as error:
        raise SceneError(str(error)) from None
    budget = Budget()
    lenses = {}
    for number, line in _lines(place, "cameras.txt", budget):
        if line.strip() and not line.startswith("#"):
            try:
                name, lens = _lens(line.split())
            except (GlshadowError, ValueError) as error:
                raise SceneError(f"cameras.txt line {number}: {error}") from None
            lenses[name] = lens
    found: dict[str, ColmapImage] = {}
    points = False  # whether this line may have the points of the image before it; it may be empty
    for number, line in _lines(place, "images.txt", budget):
        if points and _has_points(line):
            points = False
        elif line.strip() and not line.startswith("#"):
            try:
                name, image = _image(line, lenses)
            except (GlshadowError, ValueError) as error:
                raise SceneError(f"images.txt line {number}: {error}") from None
            if name in found:
                raise SceneError(f"images.txt line {number}: a second image has the name {shown(name)}")
            found[name] = image
            points = True
    if not found:
        raise SceneError(f"{place / 'images.txt'} has no images")
    return found


def _has_points(line: str) -> bool:
    """Whether a line behind an image has its points, X Y POINT3D_ID each: some programs leave these lines out."""
    words = line.split()
    try:
        [float(each) for each in words[:IMAGE_WORDS]]
    except ValueError:  # the name of an image
        return False
    return len(words) % 3 == 0


def _lines(folder: Path, name: str, budget: Budget) -> Iterator[tuple[int, str]]:
    path = folder / name
    if not path.is_file():
        binary = (folder / name).with_suffix(".bin").is_file()
        advice = (
            f"; it is there in COLMAP's binary format: colmap model_converter --input_path {folder} --output_path {folder} "
            "--output_type TXT"
        )
        raise SceneError(f"file not found: {path}{advice if binary else ''}")
    budget.announce(path, name)
    try:
        with path.open(encoding="utf-8-sig") as file:
            number = 0
            while line := file.readline(LONGEST):
                number += 1
                yield number, line
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{path} cannot be read: {error}") from None


def _lens(words: list[str]) -> tuple[str, _Lens]:
    if len(words) < 5:
        raise SceneError(f"a camera needs CAMERA_ID MODEL WIDTH HEIGHT PARAMS, got {len(words)} words")
    name, model, size = words[0], words[1], (int(words[2]), int(words[3]))
    if model not in MODELS:
        raise SceneError(
            f"the camera model {shown(model)} is not read ({', '.join(MODELS)} are): colmap image_undistorter makes PINHOLE of it"
        )
    focals, further = MODELS[model]
    values = [float(each) for each in words[4:]]
    if len(values) != focals + 2 + len(further):
        raise SceneError(f"{model} has {focals + 2 + len(further)} parameters, got {len(values)}")
    fx, fy, (cx, cy) = values[0], values[focals - 1], values[focals : focals + 2]
    matrix = ((fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0))
    coefficients = dict(zip(further, values[focals + 2 :], strict=True))
    distortion: Distortion | None = FisheyeDistortion(**coefficients) if model in _FISHEYE else None
    if model in _BROWN and any(coefficients.values()):
        distortion = BrownDistortion(**coefficients)
    return name, _Lens(matrix, size, distortion)


def _image(line: str, lenses: dict[str, _Lens]) -> tuple[str, ColmapImage]:
    words = line.split(maxsplit=9)
    if len(words) < 10:
        raise SceneError(f"an image needs IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, got {len(words)} words")
    w, x, y, z, *offset = (float(each) for each in words[1:8])
    if words[8] not in lenses:
        raise SceneError(f"it refers to camera {shown(words[8])}, which cameras.txt does not have")
    if not 0.0 < w * w + x * x + y * y + z * z < np.inf:
        raise SceneError("its quaternion must be four finite numbers, not all zero")
    lens = lenses[words[8]]
    camera = PerspectiveCamera.from_opencv(
        lens.matrix, rotation_of_quaternion(w, x, y, z), offset, lens.size, center=0.5
    )
    return words[9].rstrip("\r\n"), ColmapImage(camera, lens.size, lens.distortion)
