"""Images: written files read back the same, completely or not at all, and errors name the path."""

import os
import time

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from glshadow import image
from glshadow.errors import GlshadowError, SceneError, SettingsError


@pytest.fixture
def picture(rng):
    return rng.integers(0, 256, (5, 7, 3), dtype=np.uint8)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tiff"])
def test_bytes_round_trip(tmp_path, picture, suffix):
    path = tmp_path / f"a{suffix}"
    image.write(path, picture)
    assert np.array_equal(image.read(path)[..., :3], picture)
    assert (image.read(path)[..., 3] == 255).all()
    assert np.array_equal(image.read(path.read_bytes()), image.read(path))


@pytest.mark.parametrize("suffix", [".jpg", ".jpeg"])
def test_jpeg_round_trip_is_close(tmp_path, suffix):
    ramp = np.broadcast_to(np.linspace(0, 255, 64).astype(np.uint8)[None, :, None], (32, 64, 3))
    image.write(tmp_path / f"a{suffix}", ramp)
    # 6 of 255: quality 95 on a smooth ramp
    assert np.abs(image.read(tmp_path / f"a{suffix}")[..., :3].astype(int) - ramp).max() <= 6


def test_straight_alpha_is_kept(tmp_path):
    pixels = np.array([[[200, 100, 50, 0], [200, 100, 50, 10]]], dtype=np.uint8)
    image.write(tmp_path / "a.png", pixels)
    assert np.array_equal(image.read(tmp_path / "a.png"), pixels)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (Image.new("L", (2, 1), 77), [77, 77, 77, 255]),
        (Image.new("LA", (2, 1), (77, 12)), [77, 77, 77, 12]),
        (Image.new("1", (2, 1), 1), [255, 255, 255, 255]),
        (Image.new("RGB", (2, 1), (1, 2, 3)), [1, 2, 3, 255]),
        (Image.new("RGB", (2, 1), (1, 2, 3)).quantize(4), [1, 2, 3, 255]),
        (Image.fromarray(np.full((1, 2), 0x8080, dtype=np.uint16)), [128, 128, 128, 255]),
    ],
    ids=["grey", "grey and alpha", "1 bit", "RGB", "palette", "16 bits"],
)
def test_every_kind_becomes_rgba(tmp_path, made, expected):
    made.save(tmp_path / "a.png")
    assert image.read(tmp_path / "a.png").shape == (1, 2, 4)
    assert image.read(tmp_path / "a.png")[0, 0].tolist() == expected


def test_named_channels(tmp_path, rng):
    depth = np.array([[1.5, np.inf], [np.nan, 1e-30]])
    visibility, linear = rng.random((2, 2), dtype=np.float32), rng.random((2, 2, 3), dtype=np.float32)
    image.write(tmp_path / "a.exr", {"RGB": linear, "visibility.sun": visibility, "depth": depth, "normal": linear})
    reader = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    names = list(reader.spec().channelnames)
    pixels = reader.read_image(0, 0, 0, len(names), "float")
    reader.close()
    assert set(names) == {"R", "G", "B", "visibility.sun", "depth", "normal.R", "normal.G", "normal.B"}
    np.testing.assert_array_equal(pixels[..., names.index("depth")], depth.astype(np.float32))
    np.testing.assert_array_equal(pixels[..., names.index("visibility.sun")], visibility)
    np.testing.assert_array_equal(pixels[..., [names.index(c) for c in "RGB"]], linear)


def test_float_tiff(tmp_path, rng):
    linear = rng.random((3, 4, 3), dtype=np.float32) * 5
    image.write(tmp_path / "a.tif", linear)
    reader = oiio.ImageInput.open(str(tmp_path / "a.tif"))
    np.testing.assert_array_equal(reader.read_image(0, 0, 0, 3, "float"), linear)
    reader.close()


@pytest.mark.parametrize("suffix", image.SUFFIXES)
def test_equal_pixels_give_equal_bytes(tmp_path, picture, suffix):
    first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    image.write(first, picture)
    time.sleep(1.1)  # EXR and TIFF would contain the second of writing
    image.write(second, picture)
    assert first.read_bytes() == second.read_bytes()


def test_an_interrupted_write_leaves_the_old_file(tmp_path, picture, monkeypatch):
    path = tmp_path / "a.png"
    image.write(path, picture)
    before = path.read_bytes()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(image, "_write_file", interrupted)
    with pytest.raises(KeyboardInterrupt):
        image.write(path, picture * 0)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]


def test_permissions_follow_the_umask(tmp_path, picture):
    image.write(tmp_path / "a.png", picture)
    mask = os.umask(0)
    os.umask(mask)
    assert (tmp_path / "a.png").stat().st_mode & 0o777 == 0o666 & ~mask


@pytest.mark.parametrize(
    ("name", "pixels", "pattern"),
    [
        ("a.bmp", np.zeros((2, 2, 3), np.uint8), r"must end in one of \.png, \.jpg.*'\.bmp'"),
        ("a", np.zeros((2, 2, 3), np.uint8), "no ending"),
        ("a.png", np.zeros((2, 2, 3), np.float32), "holds uint8 images"),
        ("a.png", np.zeros((2, 2, 5), np.uint8), r"\(2, 2, 5\)"),
        ("a.png", np.zeros((0, 2, 3), np.uint8), r"\(0, 2, 3\)"),
        ("a.jpg", np.zeros((2, 2, 4), np.uint8), "JPEG has no alpha"),
        ("a.exr", {"a": np.zeros((2, 2)), "b": np.zeros((3, 2))}, "one size"),
        ("a.exr", {}, "one size"),
    ],
)
def test_unsupported_images_are_refused(tmp_path, name, pixels, pattern):
    with pytest.raises(SettingsError, match=pattern):
        image.write(tmp_path / name, pixels)
    assert list(tmp_path.iterdir()) == []


def test_unwritable_path(tmp_path, picture):
    with pytest.raises(GlshadowError, match=r"nowhere/a\.png: folder not found"):
        image.write(tmp_path / "nowhere" / "a.png", picture)


@pytest.mark.parametrize("data", [b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"text"])
def test_unreadable_data_is_refused(tmp_path, data):
    with pytest.raises(SceneError, match="cannot be read as an image"):
        image.read(data)
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(SceneError, match=r"a\.png"):
        image.read(tmp_path / "a.png")
    with pytest.raises(SceneError, match="image file not found"):
        image.read(tmp_path / "b.png")


def test_truncated_image_is_refused(tmp_path, rng):
    image.write(tmp_path / "a.png", rng.integers(0, 256, (64, 64, 3), dtype=np.uint8))
    data = (tmp_path / "a.png").read_bytes()
    with pytest.raises(SceneError, match="cannot be read as an image"):
        image.read(data[: len(data) // 2])


def test_huge_image_is_refused_before_allocation(tmp_path):
    import struct
    import zlib

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", 100_000, 100_000, 8, 6, 0, 0, 0)
    with pytest.raises(SceneError, match=r"100000 x 100000|cannot be read"):
        image.read(
            b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
        )
