"""COLMAP's text format: cameras by image name, every model that is read, and broken files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import SceneError

CAMERAS = """# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 3
1 SIMPLE_PINHOLE 3072 2304 2559.81 1536 1152
2 OPENCV 640 480 600 610 320.5 240.25 -0.1 0.02 0.001 -0.002
7 OPENCV_FISHEYE 640 480 300 301 320 240 0.01 0.002 0 0
"""
# rows of the documentation's example, and a name with a space
IMAGES = """# Image list with two lines of data per image:
1 0.851773 0.0165051 0.503764 -0.142941 -0.737434 1.02973 3.74354 1 P1180141.JPG
2362.39 248.498 58396 1784.7 268.254 59027
2 0.851773 0.0165051 0.503764 -0.142941 -0.737434 1.02973 3.74354 2 second view.jpg

3 1 0 0 0 0 0 5 7 sub/fish.png
12.5 3.25 -1
"""


def model(folder: Path, cameras: str = CAMERAS, images: str = IMAGES) -> Path:
    (folder / "cameras.txt").write_text(cameras)
    (folder / "images.txt").write_text(images)
    return folder


def test_cameras_by_image_name(tmp_path: Path) -> None:
    images = gs.read_colmap(model(tmp_path))
    assert list(images) == ["P1180141.JPG", "second view.jpg", "sub/fish.png"]
    first, second, fish = images.values()
    assert (first.size, second.size) == ((3072, 2304), (640, 480))
    assert first.distortion is None
    assert second.distortion == gs.BrownDistortion(-0.1, 0.02, 0.001, -0.002)
    assert fish.distortion == gs.FisheyeDistortion(0.01, 0.002)
    # COLMAP's pixels: (0, 0) is the corner
    np.testing.assert_allclose(
        first.camera.K(first.size, 0.5), [[2559.81, 0, 1536], [0, 2559.81, 1152], [0, 0, 1]], rtol=1e-12
    )
    np.testing.assert_allclose(
        second.camera.K(second.size, 0.5), [[600, 0, 320.5], [0, 610, 240.25], [0, 0, 1]], rtol=1e-12
    )
    rotation, offset = first.camera.opencv()
    np.testing.assert_allclose(offset, (-0.737434, 1.02973, 3.74354), rtol=1e-12)
    w, x, y, z = np.array([0.851773, 0.0165051, 0.503764, -0.142941]) / np.linalg.norm(
        [0.851773, 0.0165051, 0.503764, -0.142941]
    )
    # q p q* of the three axes, by the product of quaternions
    for column, axis in enumerate(np.eye(3)):
        t = 2.0 * np.cross((x, y, z), axis)
        np.testing.assert_allclose(rotation[:, column], axis + w * t + np.cross((x, y, z), t), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(fish.camera.position, (0.0, 0.0, -5.0), atol=1e-12)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("PINHOLE 64 48 50 51 32 24", None),
        ("SIMPLE_RADIAL 64 48 50 32 24 0.1", gs.BrownDistortion(0.1)),
        ("SIMPLE_RADIAL 64 48 50 32 24 0", None),
        ("RADIAL 64 48 50 32 24 0.1 0.2", gs.BrownDistortion(0.1, 0.2)),
        ("SIMPLE_RADIAL_FISHEYE 64 48 50 32 24 0.1", gs.FisheyeDistortion(0.1)),
        ("RADIAL_FISHEYE 64 48 50 32 24 0.1 0.2", gs.FisheyeDistortion(0.1, 0.2)),
        ("RADIAL_FISHEYE 64 48 50 32 24 0 0", gs.FisheyeDistortion()),
    ],
)
def test_every_model(tmp_path: Path, line: str, expected: gs.Distortion | None) -> None:
    (image,) = gs.read_colmap(model(tmp_path, f"1 {line}\n", "1 1 0 0 0 0 0 5 1 a.png\n\n")).values()
    assert image.distortion == expected
    assert image.size == (64, 48)


ONE = "1 1 0 0 0 0 0 5 1 a.png\n\n"
PINHOLE = "1 PINHOLE 64 48 50 51 32 24\n"


@pytest.mark.parametrize(
    ("cameras", "images", "named"),
    [
        ("1 FOV 64 48 50 51 32 24 0.9\n", ONE, "cameras.txt line 1.*FOV.*image_undistorter"),
        ("1 PINHOLE 64 48 50 51 32\n", ONE, "cameras.txt line 1: PINHOLE has 4 parameters, got 3"),
        ("\n1 PINHOLE 64\n", ONE, "cameras.txt line 2"),
        ("1 PINHOLE 64 x 50 51 32 24\n", ONE, "cameras.txt line 1"),
        (PINHOLE, "", "no images"),
        (PINHOLE, "1 1 0 0 0 0 0 5 1\n", "images.txt line 1.*9 words"),
        (PINHOLE, "1 1 0 0 0 0 0 5 9 a.png\n", "camera '9'"),
        (PINHOLE, "1 0 0 0 0 0 0 5 1 a.png\n", "quaternion"),
        (PINHOLE, "1 nan 0 0 0 0 0 5 1 a.png\n", "quaternion"),
        (PINHOLE, "1 1 0 0 0 0 0 inf 1 a.png\n", "images.txt line 1: t must be"),
        ("1 PINHOLE 64 48 -50 51 32 24\n", ONE, "images.txt line 1: K must be"),
        ("1 PINHOLE 0 48 50 51 32 24\n", ONE, "size"),
        (PINHOLE, ONE + "2 1 0 0 0 0 0 6 1 a.png\n", "images.txt line 3: a second image has the name 'a.png'"),
    ],
)
def test_broken_files_are_named(tmp_path: Path, cameras: str, images: str, named: str) -> None:
    with pytest.raises(SceneError, match=named):
        gs.read_colmap(model(tmp_path, cameras, images))


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("points", ["\n", "", "0.5 1.5 -1 2.5 3.5 7\n"])
def test_lines_of_points_may_be_missing(tmp_path: Path, points: str, mark: str) -> None:
    """And a byte order mark may be there."""
    lines = "".join(f"{k} 1 0 0 0 0 0 5 1 {name}\n{points}" for k, name in enumerate(("a.png", "b 1.png", "c 2 3")))
    found = gs.read_colmap(model(tmp_path, mark + PINHOLE, mark + lines))
    assert list(found) == ["a.png", "b 1.png", "c 2 3"]


def test_missing_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"file not found.*cameras\.txt"):
        gs.read_colmap(tmp_path)
    (tmp_path / "cameras.bin").write_bytes(b"\0")
    with pytest.raises(SceneError, match="model_converter"):
        gs.read_colmap(tmp_path)
    (tmp_path / "cameras.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="cannot be read"):
        gs.read_colmap(tmp_path)
