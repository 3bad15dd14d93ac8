"""SunPath: the sun's directions over a span of time, in equal steps; and `sun`, the light of one moment."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import setting
from glshadow.core.spaces import Array, Triple
from glshadow.errors import SettingsError
from glshadow.lights.directional import DirectionalLight
from glshadow.shadows.shadow import Shadow
from glshadow.solar import moments
from glshadow.solar.moments import Moments
from glshadow.solar.position import sun_angles
from glshadow.solar.site import Site

SUN_ANGLE = 0.53
"""Angular diameter of the sun, degrees; it varies from 0.524 in July to 0.542 in January."""

MOST_STEPS = 10**7
_HOUR = 3600 * 10**9  # nanoseconds


@dataclass(frozen=True)
class SunPath(Site):
    """The sun's path over a span of time, in equal steps. Each step stands for its middle; the last one may be shorter.

    Parameters
    ----------
    latitude, longitude : float
        Degrees, north and east positive.
    start, end : datetime or str
        With a time zone: a datetime that has one, or ISO 8601 text with an offset. Months and hours of the day are those of the zone of
        `start`.
    step : timedelta or float
        Length of a step; a number is minutes.
    altitude, north, up, refraction, pressure, temperature
        See `Site`: metres above sea level, world directions of north and the zenith, whether the atmosphere lifts the sun and its state.

    Raises
    ------
    SettingsError
        If a value is out of range, a time has no time zone, the end is not after the start, or there are more than 10 million steps.
    GlshadowError
        If pvlib is not installed (when positions are computed).
    """

    start: datetime = setting(moments.moment, help="first moment, with a time zone")
    end: datetime = setting(moments.moment, help="last moment, with a time zone")
    step: timedelta = setting(moments.duration, timedelta(hours=1), help="timedelta, or minutes")

    if TYPE_CHECKING:  # what may be given, and is converted

        def __init__(
            self,
            latitude: float,
            longitude: float,
            start: datetime | str,
            end: datetime | str,
            step: timedelta | float = ...,
            *,
            altitude: float = 0.0,
            north: Triple = ...,
            up: Triple = ...,
            refraction: bool = True,
            pressure: float | None = None,
            temperature: float = 12.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.end <= self.start:
            raise SettingsError(
                f"{self.label} end must be after start, got start {self.start.isoformat()} and end {self.end.isoformat()}"
            )
        if (self.end - self.start) / self.step > MOST_STEPS:
            raise SettingsError(
                f"{self.label} has {(self.end - self.start) / self.step:.3g} steps, more than {MOST_STEPS:,}: take a longer step"
            )

    @classmethod
    def of_year(
        cls, latitude: float, longitude: float, year: int, zone: Any = None, step: Any = 60.0, **settings: Any
    ) -> SunPath:
        """The path of a whole year, from midnight to midnight of a time zone.

        Parameters
        ----------
        latitude, longitude : float
            Degrees, north and east positive.
        year : int
            Such as 2026.
        zone : tzinfo or str
            Its time zone, such as "Europe/Berlin". It is needed: there is no default.
        step : timedelta or float
            A number is minutes.
        **settings
            See `SunPath`.
        """
        number, place = moments.year("year", year), moments.time_zone("zone", zone)
        first, last = datetime(number, 1, 1, tzinfo=place), datetime(number + 1, 1, 1, tzinfo=place)
        return cls(latitude, longitude, first, last, step, **settings)

    @cached_property
    def _spans(self) -> tuple[Moments, Moments]:
        """Moments (N,) of the middles of the steps, and the steps' lengths (N,) in nanoseconds."""
        first, last = moments.nanoseconds(self.start), moments.nanoseconds(self.end)
        length = round(self.step.total_seconds() * 1e9)
        edges = np.append(np.arange(first, last, length, dtype=np.int64), last)
        lengths = np.diff(edges)
        return edges[:-1] + lengths // 2, lengths

    @property
    def times(self) -> NDArray[np.datetime64]:
        """(N,) datetime64[ns] in UTC: the middles of the steps."""
        return self._spans[0].astype("datetime64[ns]")

    @property
    def hours(self) -> Array:
        """(N,) float64: lengths of the steps in hours."""
        return np.asarray(self._spans[1] / _HOUR)

    @cached_property
    def _angles(self) -> tuple[Array, Array]:
        return sun_angles(self, self._spans[0])

    @property
    def azimuth(self) -> Array:
        """(N,) float64: degrees clockwise from north, in [0, 360)."""
        return self._angles[0]

    @property
    def elevation(self) -> Array:
        """(N,) float64: degrees of the sun's centre above the horizon, with refraction if the path has it."""
        return self._angles[1]

    @property
    def is_up(self) -> NDArray[np.bool_]:
        """(N,) bool: whether the sun's centre is above the horizon; never in the polar night."""
        return np.asarray(self.elevation > 0.0)

    @cached_property
    def directions(self) -> Array:
        """(N, 3) float64: world unit vectors to the sun, also where it is below the horizon."""
        return self.towards(*self._angles)

    @cached_property
    def _calendar(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        local = moments.at(self._spans[0], self.start.tzinfo)
        return np.array([each.month for each in local]), np.array([each.hour for each in local])

    @property
    def month(self) -> NDArray[np.int64]:
        """(N,) int64: 1 to 12, of the zone of `start`."""
        return self._calendar[0]

    @property
    def hour(self) -> NDArray[np.int64]:
        """(N,) int64: hour of the day, 0 to 23, by the clock of the zone of `start`, with its daylight saving time."""
        return self._calendar[1]

    def lights(self, **settings: Any) -> tuple[DirectionalLight, ...]:
        """A light for each step with the sun above the horizon, in order of time.

        Parameters
        ----------
        **settings
            Of `DirectionalLight`, without its direction; `angle` is 0.53 degrees.
        """
        return tuple(sunlight(each, **settings) for each in self.directions[self.is_up])


def sunlight(towards: Array, **settings: Any) -> DirectionalLight:
    """The light of a sun seen in a world direction (3,)."""
    return DirectionalLight(direction=tuple((-towards).tolist()), **{"angle": SUN_ANGLE, **settings})


def sun(
    latitude: float,
    longitude: float,
    when: datetime | str,
    *,
    altitude: float = 0.0,
    north: Triple = (0.0, 0.0, -1.0),
    up: Triple = (0.0, 1.0, 0.0),
    refraction: bool = True,
    pressure: float | None = None,
    temperature: float = 12.0,
    color: Triple = (1.0, 1.0, 1.0),
    intensity: float = 1.0,
    angle: float = SUN_ANGLE,
    shadow: Shadow | None = Shadow(),  # noqa: B008  # frozen
) -> DirectionalLight:
    """The sun's light at a place and time.

    Parameters
    ----------
    latitude, longitude : float
        Degrees, north and east positive.
    when : datetime or str
        With a time zone: a datetime that has one, or ISO 8601 text with an offset, such as "2026-06-21T12:00+02:00".
    altitude : float
        Metres above sea level.
    north, up : (3,) floats
        World directions of north and of the zenith.
    refraction : bool
        Whether the atmosphere lifts the sun, by 0.5 degrees at the horizon.
    pressure, temperature : float
        Of the air, pascals (None: by the altitude) and degrees Celsius.
    color, intensity, angle, shadow
        Of the `DirectionalLight`; `angle` is the sun's diameter in degrees.

    Returns
    -------
    DirectionalLight

    Raises
    ------
    SettingsError
        If a value is out of range, `when` has no time zone, or the sun is below the horizon then.
    GlshadowError
        If pvlib is not installed.
    """
    when = moments.moment("when", when)
    site = Site(
        latitude, longitude, altitude=altitude, north=north, up=up, refraction=refraction, pressure=pressure, temperature=temperature
    )  # fmt: skip
    azimuth, elevation = sun_angles(site, np.array([moments.nanoseconds(when)]))
    if not elevation[0] > 0.0:
        raise SettingsError(
            f"the sun is {-elevation[0]:.2f} degrees below the horizon at {when.isoformat()}, {latitude}, {longitude}: "
            f"{_daylight(site, when)}"
        )
    towards = site.towards(azimuth, elevation)[0]
    return sunlight(towards, color=color, intensity=intensity, angle=angle, shadow=shadow)


def _daylight(site: Site, when: datetime) -> str:
    """When the sun is above the horizon within half a day, to the minute."""
    minute = 60 * 10**9
    around = moments.nanoseconds(when) + minute * np.arange(-720, 721)
    up = np.flatnonzero(sun_angles(site, around)[1] > 0.0)
    if len(up) == 0:
        return "it does not rise within half a day of that (polar night)"
    nearest = int(up[np.abs(up - 720).argmin()])
    return f"it is above the horizon at {moments.at(around[[nearest]], when.tzinfo)[0].isoformat(timespec='minutes')}"
