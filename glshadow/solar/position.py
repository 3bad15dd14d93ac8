"""Azimuth and elevation of the sun by the Solar Position Algorithm, as pvlib computes it."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.core.spaces import Array
from glshadow.errors import required
from glshadow.solar.moments import Moments
from glshadow.solar.site import Site


def sun_angles(site: Site, moments: Moments) -> tuple[Array, Array]:
    """Where the sun's centre is seen from a site.

    Parameters
    ----------
    site : Site
    moments : (N,) int64
        Nanoseconds since 1970 in UTC.

    Returns
    -------
    (N,) float64, (N,) float64
        Azimuth, degrees clockwise from north in [0, 360); elevation above the horizon, degrees, with refraction if the site has it.

    Raises
    ------
    GlshadowError
        If pvlib is not installed.

    References
    ----------
    Reda and Andreas 2004, "Solar position algorithm for solar radiation applications", Solar Energy 76(5), 577-589: within 0.0003
    degrees for the years -2000 to 6000. Refraction (eq. 42) is added where the sun's upper limb is above the horizon.
    """
    pandas, pvlib = _libraries()
    if len(moments) == 0:
        return np.zeros(0), np.zeros(0)
    pressure = pvlib.atmosphere.alt2pres(site.altitude) if site.pressure is None else site.pressure
    found = pvlib.solarposition.spa_python(
        pandas.DatetimeIndex(moments.astype("datetime64[ns]"), tz="UTC"),
        site.latitude,
        site.longitude,
        site.altitude,
        pressure,
        site.temperature,
        delta_t=None,  # by date
    )
    elevation = found["apparent_elevation" if site.refraction else "elevation"]
    return np.asarray(found["azimuth"], dtype=np.float64), np.asarray(elevation, dtype=np.float64)


def _libraries() -> tuple[Any, Any]:
    """pandas and pvlib; a second to import."""
    required("the sun's position", "sun", "pandas", "pvlib")
    import pandas
    import pvlib

    return pandas, pvlib
