"""Lens distortion: where a real lens images a direction, and which direction it images at a point.

Points are (..., 2) in the plane at distance 1 of the camera, x right, y down. `distorted` is the model as OpenCV defines it;
`undistorted` is its inverse by Newton's method, within the field where the model is one to one.

References
----------
OpenCV, "Camera Calibration and 3D Reconstruction" (calib3d: radial and tangential distortion, after Brown 1971) and "Fisheye camera model"
(after Kannala and Brandt 2006).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import Field, dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import Settings, as_floats, number, refuse, setting
from glshadow.core.spaces import Array
from glshadow.errors import SettingsError

_STEPS = 40  # of Newton's method; quadratic convergence takes 3 to 6 from the table
_TABLE = 2048  # radii, from which Newton starts
_FARTHEST = 1e4  # tangent of the widest angle, 89.994 degrees: beyond it no plane at distance 1 is of use
CONVERGED = 1e-12  # relative, in the plane at distance 1


class Distortion(Settings, ABC):
    """Base of lens distortions; see `BrownDistortion` and `FisheyeDistortion`."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]  # every subclass is a frozen dataclass

    @property
    @abstractmethod
    def _radial(self) -> tuple[float, ...]:
        """Coefficients a of the distorted radius s (1 + a[0] s^2 + a[1] s^4 + ...), where s is the radius or the angle."""

    @abstractmethod
    def distorted(self, points: ArrayLike) -> Array:
        """Points (..., 2) where the lens images the directions (x, y, 1)."""

    @abstractmethod
    def slopes(self, points: ArrayLike) -> Array:
        """Derivatives (..., 2, 2) of `distorted`."""

    @abstractmethod
    def undistorted(self, points: ArrayLike) -> Array:
        """Points (..., 2) x, y whose directions (x, y, 1) the lens images at `points`.

        Raises
        ------
        SettingsError
            For a point that no direction less than 90 degrees from the axis is imaged at, or more than one.
        """

    def _profile(self, s: Array) -> tuple[Array, Array]:
        """The distorted radius at s, and its derivative."""
        q, value, slope = s * s, np.zeros_like(s), np.zeros_like(s)
        for k in range(len(self._radial), 0, -1):
            value = (value + self._radial[k - 1]) * q
            slope = (slope + (2 * k + 1) * self._radial[k - 1]) * q
        return s * (1.0 + value), 1.0 + slope

    def _end(self, most: float) -> float:
        """The largest s up to which the distorted radius increases, at most `most`."""
        slope = [1.0, *((2 * k + 3) * value for k, value in enumerate(self._radial))]
        while len(slope) > 1 and slope[-1] == 0.0:
            slope.pop()
        roots = np.roots(slope[::-1]) if len(slope) > 1 else np.zeros(0)
        real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
        return float(np.sqrt(real.min(initial=most * most)))

    def _inverse(self, radii: Array, most: float) -> Array:
        """s of distorted radii, by a table and Newton's method in one dimension."""
        end = self._end(most)
        needed, reach = float(radii.max(initial=0.0)), min(end, 1.0)
        while reach < end and self._profile(np.array(reach))[0] < needed:
            reach = min(2.0 * reach, end)
        if self._profile(np.array(reach))[0] < needed:
            raise self._refused(needed)
        table = np.linspace(0.0, reach, _TABLE)
        s: Array = np.interp(radii, self._profile(table)[0], table)
        for _ in range(_STEPS):
            value, slope = self._profile(s)
            # at the end of the field the slope vanishes: a step stays inside
            step = (value - radii) / np.maximum(slope, 1e-9)
            s = np.clip(s - step, 0.0, reach)
            if (np.abs(step) <= CONVERGED * np.maximum(s, CONVERGED)).all():
                return s
        # at the very end, where the slope vanishes, no more than this can be said
        lost = np.abs(self._profile(s)[0] - radii) > 1e3 * CONVERGED * np.maximum(radii, CONVERGED)
        if lost.any():
            raise self._refused(float(radii[lost].min()))
        return s

    def _refused(self, radius: float) -> SettingsError:
        return SettingsError(
            f"{self.label}: the image reaches {radius:.4g} focal lengths from the principal point, where the lens images nothing, or "
            "more than one direction, less than 90 degrees from its axis: use a smaller image, or other coefficients"
        )


def _coefficient() -> Any:
    return setting(number(-1e6, 1e6), 0.0)


@dataclass(frozen=True)
class BrownDistortion(Distortion):
    """Radial and tangential distortion, the order of the coefficients as OpenCV's five: `gs.BrownDistortion(*D)`.

    With r^2 = x^2 + y^2, x becomes x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and y becomes
    y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y.

    Parameters
    ----------
    k1, k2, p1, p2, k3 : float
    """

    k1: float = _coefficient()
    k2: float = _coefficient()
    p1: float = _coefficient()
    p2: float = _coefficient()
    k3: float = _coefficient()

    @property
    def _radial(self) -> tuple[float, ...]:
        return self.k1, self.k2, self.k3

    @np.errstate(all="ignore")  # NaN where there is no point, infinity beyond float64
    def distorted(self, points: ArrayLike) -> Array:
        """Points (..., 2) where the lens images the directions (x, y, 1)."""
        x, y = np.moveaxis(_numbers(points), -1, 0)
        q = x * x + y * y
        radial, _ = self._terms(q)
        return np.stack(
            [
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (q + 2.0 * x * x),
                y * radial + self.p1 * (q + 2.0 * y * y) + 2.0 * self.p2 * x * y,
            ],
            axis=-1,
        )

    @np.errstate(all="ignore")  # NaN where there is no point, infinity beyond float64
    def slopes(self, points: ArrayLike) -> Array:
        """Derivatives (..., 2, 2) of `distorted`."""
        x, y = np.moveaxis(_numbers(points), -1, 0)
        radial, growth = self._terms(x * x + y * y)
        across = growth * x * y + 2.0 * (self.p1 * x + self.p2 * y)
        rows = [
            np.stack([radial + growth * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x, across], axis=-1),
            np.stack([across, radial + growth * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x], axis=-1),
        ]
        return np.stack(rows, axis=-2)

    def _terms(self, q: Array) -> tuple[Array, Array]:
        """The radial factor at r^2 = q, and what times x is its derivative by x."""
        radial = 1.0 + q * (self.k1 + q * (self.k2 + q * self.k3))
        return radial, 2.0 * (self.k1 + q * (2.0 * self.k2 + q * 3.0 * self.k3))

    def undistorted(self, points: ArrayLike) -> Array:
        """Points (..., 2) x, y whose directions (x, y, 1) the lens images at `points`; see `Distortion.undistorted`."""
        given = _finite(points)
        radii = np.hypot(given[..., 0], given[..., 1])
        if self.p1 == 0.0 and self.p2 == 0.0:
            return given * _ratio(self._inverse(radii, _FARTHEST), radii)[..., None]
        # the tangential part moves a point by less than 3 (|p1| + |p2|) r^2
        end = self._end(_FARTHEST)
        inside = np.minimum(radii, self._profile(np.array(end))[0])
        found = given * _ratio(self._inverse(inside, _FARTHEST), radii)[..., None]
        scale = max(float(radii.max(initial=0.0)), 1e-300)
        for _ in range(_STEPS):
            (a, b), (c, d) = np.moveaxis(self.slopes(found), (-2, -1), (0, 1))
            det = a * d - b * c
            off = self.distorted(found) - given
            step = np.stack([d * off[..., 0] - b * off[..., 1], a * off[..., 1] - c * off[..., 0]], axis=-1)
            found = found - step / np.where(det > 1e-9, det, 1.0)[..., None]
            if np.abs(step).max(initial=0.0) <= CONVERGED * scale:
                break
        wrong = np.abs(self.distorted(found) - given).max(axis=-1) > 1e3 * CONVERGED * scale
        wrong |= np.linalg.det(self.slopes(found)) <= 0.0
        wrong |= np.hypot(found[..., 0], found[..., 1]) > end
        if wrong.any():
            raise self._refused(float(radii[wrong].min()))
        return found


@dataclass(frozen=True)
class FisheyeDistortion(Distortion):
    """OpenCV's fisheye model: `gs.FisheyeDistortion(*D)` with its four coefficients.

    A direction at the angle t from the axis is imaged at t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) focal lengths from the principal
    point.

    Parameters
    ----------
    k1, k2, k3, k4 : float
    """

    k1: float = _coefficient()
    k2: float = _coefficient()
    k3: float = _coefficient()
    k4: float = _coefficient()

    @property
    def _radial(self) -> tuple[float, ...]:
        return self.k1, self.k2, self.k3, self.k4

    @np.errstate(all="ignore")  # NaN where there is no point, infinity beyond float64
    def distorted(self, points: ArrayLike) -> Array:
        """Points (..., 2) where the lens images the directions (x, y, 1)."""
        given = _numbers(points)
        radii = np.hypot(given[..., 0], given[..., 1])
        return given * _ratio(self._profile(np.arctan(radii))[0], radii)[..., None]

    @np.errstate(all="ignore")  # NaN where there is no point, infinity beyond float64
    def slopes(self, points: ArrayLike) -> Array:
        """Derivatives (..., 2, 2) of `distorted`."""
        given = _numbers(points)
        radii = np.hypot(given[..., 0], given[..., 1])
        value, slope = self._profile(np.arctan(radii))
        across, along = _ratio(value, radii), slope / (1.0 + radii * radii)
        axis = given / np.where(radii > 0.0, radii, 1.0)[..., None]
        outer = axis[..., :, None] * axis[..., None, :]
        return np.asarray(across[..., None, None] * (np.eye(2) - outer) + along[..., None, None] * outer)

    def undistorted(self, points: ArrayLike) -> Array:
        """Points (..., 2) x, y whose directions (x, y, 1) the lens images at `points`; see `Distortion.undistorted`."""
        given = _finite(points)
        radii = np.hypot(given[..., 0], given[..., 1])
        return given * _ratio(np.tan(self._inverse(radii, float(np.arctan(_FARTHEST)))), radii)[..., None]


def _numbers(points: ArrayLike) -> Array:
    given = as_floats(points, (..., 2))
    if given is None:
        raise refuse("points", "numbers (..., 2)", points)
    return given


def _finite(points: ArrayLike) -> Array:
    given = _numbers(points)
    if not np.isfinite(given).all():
        raise refuse("points", "finite numbers (..., 2)", points)
    return given


def _ratio(value: Array, radii: Array) -> Array:
    """value / radii; 1 at the axis, where every model here has the slope 1."""
    return np.asarray(np.where(radii > 0.0, value, 1.0) / np.where(radii > 0.0, radii, 1.0))
