"""Moments of time: datetimes with a time zone as nanoseconds since 1970 in UTC, and back."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, tzinfo
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_float, as_int, refuse, shown
from glshadow.errors import SettingsError

Moments = NDArray[np.int64]
"""Nanoseconds since 1970-01-01 in UTC."""

YEARS = (1700, 2200)
"""First and last year; nanoseconds hold 1678 to 2262."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_EXAMPLE = 'datetime(2026, 6, 21, 12, tzinfo=ZoneInfo("Europe/Berlin")) or "2026-06-21T12:00+02:00"'


def moment(name: str, value: Any) -> datetime:
    """Rule of a moment: a datetime with a time zone, or ISO 8601 text with an offset from UTC."""
    if isinstance(value, str):
        try:
            value = datetime.fromisoformat(value)
        except ValueError:
            raise refuse(name, f"a date and time with a time zone, such as {_EXAMPLE}", value) from None
    if not isinstance(value, datetime):
        raise refuse(name, f"a datetime with a time zone, such as {_EXAMPLE}", value)
    if value.tzinfo is None or value.utcoffset() is None:
        raise SettingsError(
            f"{name} must have a time zone, got {value.isoformat()} without one: write "
            f'{name}.replace(tzinfo=ZoneInfo("Europe/Berlin")) with the zone of the place (from zoneinfo import ZoneInfo), or '
            f'"{value.isoformat(timespec="seconds")}+01:00" with its offset from UTC'
        )
    if not YEARS[0] <= value.year <= YEARS[1]:
        raise refuse(name, f"in the years {YEARS[0]} to {YEARS[1]}", value)
    return value


def duration(name: str, value: Any) -> timedelta:
    """Rule of a step in time: a timedelta, or a number of minutes; above 0, at most a day."""
    minutes = value.total_seconds() / 60.0 if isinstance(value, timedelta) else as_float(value)
    if not 1e-3 <= minutes <= 24.0 * 60.0:  # also not a number
        raise refuse(name, "a timedelta or a number of minutes, above 0 and at most a day", value)
    return timedelta(minutes=minutes)


def year(name: str, value: Any) -> int:
    """Rule of a year."""
    kept = as_int(value)
    if kept is None or not YEARS[0] <= kept <= YEARS[1]:
        raise refuse(name, f"a year from {YEARS[0]} to {YEARS[1]}", value)
    return kept


def time_zone(name: str, value: Any) -> tzinfo:
    """Rule of a time zone: a tzinfo, or a name of the IANA database."""
    if isinstance(value, tzinfo):
        return value
    if value is None:
        raise SettingsError(
            f'{name} is needed: a year begins at midnight of its place; give "Europe/Berlin", "America/Denver" or "UTC"'
        )
    try:
        return ZoneInfo(value)
    except Exception:  # of a wrong type, an unknown name, or a name that is a path
        raise refuse(name, 'a time zone such as "Europe/Berlin", "America/Denver" or "UTC"', value) from None


def nanoseconds(when: datetime) -> int:
    """A moment in nanoseconds since 1970."""
    since = when - _EPOCH
    return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1000


def at(moments: Moments, zone: tzinfo | None) -> list[datetime]:
    """Moments (N,) as datetimes of a zone."""
    return [(_EPOCH + timedelta(microseconds=each // 1000)).astimezone(zone) for each in moments.tolist()]


def index_moments(name: str, index: Any) -> Moments:
    """Moments (N,) of a pandas DatetimeIndex with a time zone.

    Raises
    ------
    SettingsError
        If it is no such index, or has no time zone.
    """
    convert, zone = getattr(index, "tz_convert", None), getattr(index, "tz", None)
    if convert is None:
        raise refuse(name, "a pandas DatetimeIndex with a time zone", index)
    if zone is None:
        raise SettingsError(
            f"{name} has no time zone, its first is {shown(str(index[0])) if len(index) else 'missing'}: "
            'write frame.tz_localize("Europe/Berlin"), with the zone of the data'
        )
    return np.asarray(convert("UTC").tz_localize(None).to_numpy(dtype="datetime64[ns]").astype(np.int64))
