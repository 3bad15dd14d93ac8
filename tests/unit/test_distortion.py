"""Lens distortion: OpenCV's formulas, and their inverse to rounding."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import SettingsError

LENSES = (
    gs.BrownDistortion(),
    gs.BrownDistortion(-0.28, 0.07),
    gs.BrownDistortion(-0.28, 0.07, 0.002, -0.0015, 0.01),
    gs.BrownDistortion(0.2, -0.05, p2=0.01),
    gs.FisheyeDistortion(),
    gs.FisheyeDistortion(-0.02, 0.004, -0.001, 0.0002),
)
Y, X = np.mgrid[-0.6:0.6:25j, -0.8:0.8:33j]
POINTS = np.stack([X, Y], axis=-1)  # the axis is among them


def opencv(points: np.ndarray, lens: gs.Distortion) -> np.ndarray:
    """Point by point, as the pages of cv2.projectPoints and cv2.fisheye.projectPoints write them."""
    result = np.zeros_like(points)
    for index in np.ndindex(points.shape[:-1]):
        x, y = points[index]
        r = np.sqrt(x * x + y * y)
        if isinstance(lens, gs.BrownDistortion):
            k1, k2, p1, p2, k3 = lens.k1, lens.k2, lens.p1, lens.p2, lens.k3
            radial = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
            result[index] = (
                x * radial + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2),
                y * radial + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y,
            )
        elif r > 0:
            t = np.arctan(r)
            bent = t * (1 + lens.k1 * t**2 + lens.k2 * t**4 + lens.k3 * t**6 + lens.k4 * t**8)
            result[index] = (bent / r * x, bent / r * y)
    return result


@pytest.mark.parametrize("lens", LENSES, ids=str)
def test_forward_is_opencv(lens: gs.Distortion) -> None:
    np.testing.assert_allclose(lens.distorted(POINTS), opencv(POINTS, lens), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("lens", LENSES, ids=str)
def test_inverse(lens: gs.Distortion) -> None:
    np.testing.assert_allclose(lens.undistorted(lens.distorted(POINTS)), POINTS, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(lens.distorted(lens.undistorted(POINTS)), POINTS, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("lens", LENSES, ids=str)
def test_slopes_are_derivatives(lens: gs.Distortion) -> None:
    step = 1e-5
    for column, change in enumerate(((step, 0.0), (0.0, step))):
        central = (lens.distorted(POINTS + change) - lens.distorted(POINTS - np.array(change))) / (2.0 * step)
        # 1e-9: the third derivative times step squared, and rounding over step
        np.testing.assert_allclose(lens.slopes(POINTS)[..., column], central, rtol=0.0, atol=1e-9)


def test_equidistant_fisheye_in_closed_form() -> None:
    """Without coefficients the radius is the angle: .5 focal lengths are .5 radians."""
    np.testing.assert_allclose(gs.FisheyeDistortion().undistorted([0.5, 0.0]), [np.tan(0.5), 0.0], rtol=1e-14)
    np.testing.assert_allclose(gs.FisheyeDistortion().undistorted([0.0, -1.5]), [0.0, -np.tan(1.5)], rtol=1e-12)


def test_points_beyond_the_field_are_refused() -> None:
    """x (1 - x^2 / 4) rises to 4 / (3 sqrt 3) = .7698 at x = 1.1547, and falls again."""
    lens = gs.BrownDistortion(-0.25)
    np.testing.assert_allclose(lens.undistorted([0.7697, 0.0]), [1.1446, 0.0], atol=2e-3)
    for beyond in ([0.77, 0.0], [0.0, 5.0]):
        with pytest.raises(SettingsError, match="more than one direction"):
            lens.undistorted(beyond)
        with pytest.raises(SettingsError, match="more than one direction"):
            gs.BrownDistortion(-0.25, p1=1e-3).undistorted(beyond)
    with pytest.raises(SettingsError, match="less than 90 degrees"):
        gs.FisheyeDistortion().undistorted([np.pi / 2, 0.0])


def test_wild_coefficients_never_pass_silently() -> None:
    """Whatever the coefficients: the inverse is right, or refused by name."""
    rng = np.random.default_rng(1)
    refused = 0
    for _ in range(200):
        lens = gs.BrownDistortion(*rng.normal(0.0, 0.5, 5) * (1, 1, 0.1, 0.1, 1))
        if rng.random() < 0.5:
            lens = gs.FisheyeDistortion(*rng.normal(0.0, 0.3, 4))
        try:
            found = lens.undistorted(POINTS)
        except SettingsError:
            refused += 1
            continue
        np.testing.assert_allclose(lens.distorted(found), POINTS, rtol=0.0, atol=1e-9)
        assert (np.linalg.det(lens.slopes(found)) > 0.0).all()
    assert 20 < refused < 180


@pytest.mark.parametrize("value", [np.nan, "strong", 1e300])
def test_coefficients_are_checked(value: object) -> None:
    with pytest.raises(SettingsError, match="k2"):
        gs.BrownDistortion(0.1, value)  # type: ignore[arg-type]
