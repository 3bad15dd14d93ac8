"""The depth metric, its packing and its formats, against Babylon's table and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.spaces import CLIP_SPACES, Array, ClipSpace, orthographic, perspective, project
from glshadow.errors import SettingsError
from glshadow.shadows.metric import (
    Target,
    metric_range,
    pack,
    projected_metric,
    radial_metric,
    unpack,
    window_depth,
)

NEAR, FAR = 2.0, 20.0
CLIP_IDS = [str(clip) for clip in CLIP_SPACES]

# The summary table of "Mathematics of the depth metric": per convention (minZ, maxZ), n and f the near and far planes.
TABLE = {
    ("orthographic", "-1..1"): ("1", "1"),
    ("orthographic", "-1..1,reversed"): ("1", "1"),
    ("orthographic", "0..1"): ("0", "1"),
    ("orthographic", "0..1,reversed"): ("1", "0"),
    ("perspective", "-1..1"): ("n", "f"),
    ("perspective", "-1..1,reversed"): ("n", "f"),
    ("perspective", "0..1"): ("0", "f"),
    ("perspective", "0..1,reversed"): ("n", "0"),
    ("cube", "-1..1"): ("n", "f"),
    ("cube", "-1..1,reversed"): ("n", "f"),
    ("cube", "0..1"): ("n", "f"),
    ("cube", "0..1,reversed"): ("n", "f"),
}


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
@pytest.mark.parametrize("kind", ["orthographic", "perspective", "cube"])
def test_range_is_babylons_table(kind: str, clip: ClipSpace) -> None:
    value = {"0": 0.0, "1": 1.0, "n": NEAR, "f": FAR}
    low, high = TABLE[kind, str(clip)]
    assert metric_range(kind, clip, NEAR, FAR) == (value[low], value[high])


def metric_at(kind: str, clip: ClipSpace, distances: Array, near: float = NEAR, far: float = FAR) -> Array:
    build = orthographic if kind == "orthographic" else perspective
    points = np.stack([0.0 * distances, 0.0 * distances, -distances], axis=-1)
    clip_z = project(build(-1, 1, -1, 1, near, far, clip), points)[:, 2]
    return projected_metric(clip_z, clip, *metric_range(kind, clip, near, far))


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
@pytest.mark.parametrize(("near", "far"), [(NEAR, FAR), (0.01, 5000.0), (999.0, 1000.0)])
def test_projected_metric_is_linear_from_near_to_far(kind: str, clip: ClipSpace, near: float, far: float) -> None:
    distances = np.linspace(near, far, 33)
    # Every cell of the table reduces to the same line. Terms up to f / (f - n) times the result's scale cancel.
    atol = 8 * np.finfo(float).eps * far / (far - near)
    expected = (distances - near) / (far - near)
    metric = metric_at(kind, clip, distances, near, far)
    np.testing.assert_allclose(metric, expected, rtol=1e-12, atol=atol)
    assert (np.diff(metric) > 0).all()


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
def test_ends_of_the_projected_metric(kind: str, clip: ClipSpace) -> None:
    np.testing.assert_allclose(metric_at(kind, clip, np.array([NEAR, FAR])), [0.0, 1.0], rtol=1e-12, atol=1e-14)


def test_point_metric() -> None:
    """(d + n) / (n + f): 1 at the far plane, but 2 n / (n + f) at the near one, as the source itself admits."""
    distances = np.array([0.0, NEAR, 0.5 * FAR, FAR, 2 * FAR])
    expected = [NEAR / (NEAR + FAR), 2 * NEAR / (NEAR + FAR), (0.5 * FAR + NEAR) / (NEAR + FAR), 1.0, 42.0 / 22.0]
    np.testing.assert_allclose(radial_metric(distances, NEAR, FAR), expected, rtol=1e-15)
    assert (np.diff(radial_metric(np.linspace(0, FAR, 50), NEAR, FAR)) > 0).all()


def test_spot_at_near_zero_is_refused_only_where_it_divides_by_zero() -> None:
    with pytest.raises(SettingsError, match=r"near > 0.*got near=0"):
        metric_range("perspective", ClipSpace(True, True), 0.0, FAR)
    assert metric_range("perspective", ClipSpace(True, False), 0.0, FAR) == (0.0, FAR)
    assert metric_range("perspective", ClipSpace(False, True), 0.0, FAR) == (0.0, FAR)
    assert metric_range("cube", ClipSpace(True, True), 0.0, FAR) == (0.0, FAR)


def test_unknown_kind_is_refused() -> None:
    for clip in CLIP_SPACES:
        with pytest.raises(SettingsError, match="'area'"):
            metric_range("area", clip, NEAR, FAR)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
def test_window_depth(clip: ClipSpace) -> None:
    zw = np.array([[0.0, 4.0], [2.0, 4.0], [4.0, 4.0], [-4.0, 4.0]])
    expected = [0.0, 0.5, 1.0, -1.0] if clip.zero_to_one else [0.5, 0.75, 1.0, 0.0]
    np.testing.assert_array_equal(window_depth(zw, clip), expected)


def test_pack_closed_form() -> None:
    """Digits to base 255, the coarsest last: 3/255 + 138/255^2 + 31/255^3 + 251/255^4."""
    digits = np.array([251.0, 31.0, 138.0, 3.0]) / 255.0
    value = 3 / 255 + 138 / 255**2 + 31 / 255**3 + 251 / 255**4
    assert unpack(digits) == pytest.approx(value, rel=1e-15)
    np.testing.assert_allclose(np.rint(pack(value) * 255.0), [251, 31, 138, 3])
    np.testing.assert_array_equal(pack(0.0), [0, 0, 0, 0])
    np.testing.assert_allclose(pack(0.5) * 255.0, [127.5, 127, 127, 127], atol=1e-6)
    # Each of the three coarser digits is a whole byte, so that UNORM8 stores it without rounding.
    for value in (0.1, 0.7310585786, 0.9999):
        coarse = pack(value)[1:] * 255.0
        np.testing.assert_allclose(coarse, np.rint(coarse), atol=1e-6)


def test_pack_survives_the_bytes() -> None:
    values = np.linspace(0.0, 1.0 - 2.0**-24, 10_001)
    stored = np.rint(pack(values) * 255.0) / 255.0
    # Half a step of the finest byte, and float64 rounding of v 255^3 (2^-53 * 255^3 / 255^3).
    np.testing.assert_allclose(unpack(stored), values, rtol=0, atol=0.5 * 255.0**-4 + 2.0**-52)
    assert stored.min() >= 0.0
    assert stored.max() <= 1.0


def test_pack_clamps_instead_of_wrapping() -> None:
    """A wrapped far value would read as the nearest of all: everything behind it dark."""
    np.testing.assert_allclose(unpack(np.rint(pack([1.0, 1.05, 40.0]) * 255.0) / 255.0), 1.0, atol=2.0**-23)
    np.testing.assert_allclose(unpack(pack([-0.25, -1e-9])), 0.0, atol=1e-12)


def test_pack_shape() -> None:
    assert pack(np.zeros((3, 5))).shape == (3, 5, 4)
    assert unpack(np.zeros((3, 5, 4))).shape == (3, 5)


@pytest.mark.parametrize("target", list(Target))
def test_target_quantum(target: Target) -> None:
    """The largest gap between neighbours in 0..1, from the format itself."""
    float_gap = {Target.DEPTH32F: np.float32, Target.R32F: np.float32, Target.R16F: np.float16}
    bits = {Target.DEPTH16: 16, Target.DEPTH24: 24, Target.R8: 8}
    if target in float_gap:
        one = float_gap[target](1.0)
        assert target.quantum == float(one) - float(np.nextafter(one, float_gap[target](0.0)))
    elif target in bits:
        assert target.quantum == pytest.approx(1.0 / (2 ** bits[target] - 1), rel=1e-15)
    else:
        assert 255.0**-4 < 2.0**-24 <= target.quantum <= 2.0**-22  # bytes finer than the float32 that feeds them
    assert target.is_depth == target.value.startswith("depth")
