"""Irradiance by the hour, from a table as pvlib gives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glshadow.core.setting import refuse
from glshadow.core.spaces import Array
from glshadow.errors import SettingsError
from glshadow.solar.moments import index_moments
from glshadow.solar.path import SunPath

LABELS = ("left", "right", "middle")
_MINUTE = 60 * 10**9


@dataclass(frozen=True, eq=False)
class Weather:
    """Irradiance during the steps of a path.

    Attributes
    ----------
    direct : (N,) float64
        Direct normal irradiance (DNI), W/m^2.
    diffuse : (N,) float64 or None
        Diffuse horizontal irradiance (DHI), W/m^2.
    """

    direct: Array
    diffuse: Array | None


def weather_of(frame: Any, path: SunPath, label: str) -> Weather:
    """The rows of a table that the steps of a path are in.

    Parameters
    ----------
    frame : pandas.DataFrame
        Columns `dni` and, if diffuse light is wanted, `dhi`, in W/m^2 (any case), and an index of times with a time zone, evenly spaced.
    path : SunPath
    label : {"left", "right", "middle"}
        Whether a row's time is the beginning, the end or the middle of the time that it stands for.

    Raises
    ------
    SettingsError
        Without such columns or index, for values that are not finite or negative, or a table that does not cover the path.
    """
    if label not in LABELS:
        raise refuse("weather_label", " or ".join(map(repr, LABELS)), label)
    if not hasattr(frame, "columns") or not hasattr(frame, "index"):
        raise refuse("weather", "a pandas DataFrame with columns dni and dhi, in W/m^2", frame)
    names = {str(each).strip().lower(): each for each in frame.columns}
    if "dni" not in names:
        known = ", ".join(map(str, frame.columns))[:200]
        raise SettingsError(
            f"weather has no column dni (direct normal irradiance, W/m^2); its columns are {known}: rename with frame.rename(columns=...)"
        )
    times = index_moments("weather.index", frame.index)
    if len(times) < 2 or not (np.diff(times) > 0).all():
        raise SettingsError("weather.index must hold at least two times, ascending: frame.sort_index()")
    spacing = int(np.median(np.diff(times)))
    begins = times - {"left": 0, "right": spacing, "middle": spacing // 2}[label]
    steps = path.times.astype(np.int64)
    steps = steps[path.is_up]
    row = np.searchsorted(begins, steps, side="right") - 1
    missing = (row < 0) | (steps >= begins[np.maximum(row, 0)] + spacing + _MINUTE)
    if missing.any():
        first = steps[missing][0].astype("datetime64[ns]").astype("datetime64[m]")
        raise SettingsError(
            f"weather does not cover {int(missing.sum())} of {len(steps)} steps with the sun above the horizon, the first at {first} UTC; "
            f"it covers {frame.index[0]} to {frame.index[-1]}. A typical year has other years: pvlib's readers take "
            f"coerce_year={path.start.year}"
        )
    found = {}
    for name in ("dni", "dhi"):
        if name not in names:
            continue
        try:
            values = np.asarray(frame[names[name]], dtype=np.float64)[row]
        except (TypeError, ValueError) as error:
            raise SettingsError(f"weather column {names[name]} must hold numbers, in W/m^2: {error}") from None
        if not (np.isfinite(values) & (values >= 0.0)).all():
            bad = int((~(np.isfinite(values) & (values >= 0.0))).sum())
            raise SettingsError(
                f"weather column {names[name]} has {bad} values that are missing or negative while the sun is up"
            )
        found[name] = np.zeros(len(path.hours))
        found[name][path.is_up] = values
    return Weather(found["dni"], found.get("dhi"))
