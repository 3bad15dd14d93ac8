"""Site: a place on the earth, and how its sky lies in a scene's world."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np

from glshadow.core.setting import Settings, flag, number, optional, setting
from glshadow.core.spaces import Array, Triple, cross, direction
from glshadow.errors import SettingsError

_LEAST_SINE = 1e-6  # of the angle between north and up: below, rounding would decide where north is


@dataclass(frozen=True)
class Site(Settings):
    """A place on the earth, with the world's axes.

    Parameters
    ----------
    latitude : float
        Geodetic latitude, degrees, north positive, in [-90, 90].
    longitude : float
        Degrees, east positive, in [-180, 180].
    altitude : float
        Metres above sea level. It sets the air pressure, and with that the refraction.
    north, up : (3,) floats
        World directions of north and of the zenith, any length. The part of `north` along `up` is removed; east is cross(north, up).
    refraction : bool
        Whether the atmosphere lifts the sun, by 0.5 degrees at the horizon: what an observer sees. False: the geometric position.
    pressure : float, optional
        Yearly average air pressure, pascals; None: of the standard atmosphere at this altitude.
    temperature : float
        Yearly average air temperature, degrees Celsius.

    Raises
    ------
    SettingsError
        If a value is out of range, or north is along up.
    """

    latitude: float = setting(number(-90.0, 90.0, unit="degrees"), help="degrees, north positive")
    longitude: float = setting(number(-180.0, 180.0, unit="degrees"), help="degrees, east positive")
    _: KW_ONLY
    altitude: float = setting(number(-500.0, 20e3, unit="m"), 0.0, help="metres above sea level")
    north: Triple = setting(direction, (0.0, 0.0, -1.0), help="world direction of north")
    up: Triple = setting(direction, (0.0, 1.0, 0.0), help="world direction of the zenith")
    refraction: bool = setting(flag(), True, help="the atmosphere lifts the sun")
    pressure: float | None = setting(
        optional(number(0.0, 2e5, unit="Pa"), "of the altitude"), None, help="air pressure, pascals"
    )
    temperature: float = setting(
        number(-100.0, 100.0, unit="degrees Celsius"), 12.0, help="air temperature, degrees Celsius"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.linalg.norm(cross(np.array(self.north), np.array(self.up))) < _LEAST_SINE:
            raise SettingsError(
                f"{self.label} north must not be along up: north is {self.north}, up is {self.up}; "
                "give a horizontal direction as north, or the world's up axis as up"
            )

    @cached_property
    def axes(self) -> Array:
        """Rows (3, 3): world directions of east, north and up; orthonormal."""
        up = np.array(self.up)
        east = cross(np.array(self.north), up)
        east /= np.linalg.norm(east)
        return np.stack([east, cross(up, east), up])

    def towards(self, azimuth: Array, elevation: Array) -> Array:
        """World unit vectors (..., 3) to azimuths, clockwise from north, and elevations, both in degrees (...)."""
        around, above = np.radians(azimuth), np.radians(elevation)
        flat = np.cos(above)
        local = np.stack([flat * np.sin(around), flat * np.cos(around), np.sin(above)], axis=-1)
        return np.asarray(local @ self.axes)
