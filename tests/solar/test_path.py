"""The sun's position against NREL's published example and closed forms; its light; names of what is refused."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest

import glshadow as gs
from glshadow.solar.moments import index_moments, nanoseconds
from glshadow.solar.position import sun_angles
from glshadow.solar.sharing import shared_suns
from glshadow.solar.site import Site

GOLDEN = (39.742476, -105.1786)
BERLIN = ZoneInfo("Europe/Berlin")


def test_position_is_that_of_the_published_example() -> None:
    # Reda and Andreas 2004, appendix A.5; their 67 s of delta T, where the date's own is 64.8 s, move the azimuth by 4e-5 degrees.
    site = Site(*GOLDEN, altitude=1830.14, pressure=82000.0, temperature=11.0)
    when = nanoseconds(datetime.fromisoformat("2003-10-17T12:30:30-07:00"))
    azimuth, elevation = sun_angles(site, np.array([when]))
    assert azimuth[0] == pytest.approx(194.34024, abs=1e-4)
    assert 90.0 - elevation[0] == pytest.approx(50.11162, abs=1e-4)


def test_light_travels_from_the_published_position() -> None:
    light = gs.sun(*GOLDEN, "2003-10-17T12:30:30-07:00", altitude=1830.14)
    east, up, south = -np.array(light.direction)  # x is east and -z is north
    assert np.degrees(np.arctan2(east, -south)) % 360.0 == pytest.approx(194.34024, abs=0.01)
    assert np.degrees(np.arccos(up)) == pytest.approx(50.11162, abs=0.01)
    assert light.angle == 0.53


@pytest.mark.parametrize("north", [(1.0, 0.0, 0.0), (0.0, 3.0, 5.0)])
def test_north_and_up_turn_the_world(north: tuple[float, float, float]) -> None:
    # At a June noon at 48 degrees the sun is due south: north of the observer is away from it. The part of north along up does not count.
    when = datetime(2026, 6, 21, 13, 15, 30, tzinfo=BERLIN)
    up = (0.0, 0.0, 1.0)
    towards = -np.array(gs.sun(48.1, 11.6, when, north=north, up=up, refraction=False).direction)
    flat = np.array([*north[:2], 0.0]) / np.linalg.norm(north[:2])
    assert towards[2] == pytest.approx(np.sin(np.radians(90.0 - 48.1 + 23.436)), abs=1e-4)
    assert towards @ flat == pytest.approx(-np.cos(np.radians(90.0 - 48.1 + 23.436)), abs=1e-4)


def test_noon_at_the_pole_is_the_declination_all_day() -> None:
    path = gs.SunPath(90.0, 0.0, "2026-06-21T00:00Z", "2026-06-22T00:00Z", 60, refraction=False)
    assert path.elevation == pytest.approx(23.436, abs=3e-3)  # the obliquity, less 9 arc seconds of parallax
    assert np.diff(path.azimuth) % 360.0 == pytest.approx(15.0, abs=1e-2)


def test_refraction_lifts_the_sun_by_half_a_degree_at_the_horizon() -> None:
    # Geometrically between -0.5 and 0 degrees.
    moments = nanoseconds(datetime(2026, 3, 20, 6, tzinfo=UTC)) + 10**9 * np.arange(0, 1800, 10)
    seen, true = (sun_angles(Site(0.0, 0.0, refraction=each), moments)[1] for each in (True, False))
    assert seen[np.abs(true).argmin()] == pytest.approx(0.48, abs=0.02)


def test_a_year_has_all_its_hours_and_half_of_them_are_days() -> None:
    path = gs.SunPath.of_year(0.0, 0.0, 2026, "UTC", refraction=False)
    assert path.hours.sum() == 8760.0
    assert path.hours[path.is_up].sum() / 8760.0 == pytest.approx(0.5, abs=1e-3)  # at the equator every day
    assert len(path.lights()) == path.is_up.sum()


def test_months_and_hours_are_those_of_the_clock_with_summer_time() -> None:
    path = gs.SunPath.of_year(48.1, 11.6, 2026, "Europe/Berlin")
    assert len(path.hours) == 8760
    assert np.bincount(path.month)[1:].tolist() == [744, 672, 743, 720, 744, 720, 744, 744, 720, 745, 720, 744]
    assert np.bincount(path.hour)[[1, 2, 3]].tolist() == [365, 365, 365]  # one hour lost in March, one twice in October
    assert path.times[0] == np.datetime64("2025-12-31T23:30")


def test_last_step_is_shorter() -> None:
    path = gs.SunPath(0.0, 0.0, "2026-01-01T00:00Z", "2026-01-01T02:30Z", timedelta(hours=1))
    assert path.hours.tolist() == [1.0, 1.0, 0.5]
    assert path.times[-1] == np.datetime64("2026-01-01T02:15")


def test_polar_night_has_no_suns() -> None:
    path = gs.SunPath(78.2, 15.6, "2026-12-20T00:00Z", "2026-12-23T00:00Z")
    assert path.lights() == ()


@pytest.mark.parametrize("within", [0.0, 0.5, 2.0])
def test_shared_suns_stay_within_the_angle(within: float) -> None:
    path = gs.SunPath.of_year(48.1, 11.6, 2026, "Europe/Berlin")
    shared = shared_suns(path, within)
    up = shared.group >= 0
    assert (up == path.is_up).all()
    chord = np.linalg.norm(path.directions[up] - shared.directions[shared.group[up]], axis=1)
    angle = np.degrees(2.0 * np.arcsin(0.5 * chord))
    assert angle.max() == pytest.approx(shared.error, abs=1e-9)
    assert angle.max() <= within + 1e-9
    assert len(shared.directions) <= {0.0: 4441, 0.5: 1200, 2.0: 320}[within]


def test_pandas_times_need_a_zone() -> None:
    import pandas

    index = pandas.DatetimeIndex(["2026-01-01 01:00"])
    with pytest.raises(gs.SettingsError, match=r"has no time zone.*tz_localize"):
        index_moments("weather.index", index)
    assert index_moments("weather.index", index.tz_localize("Europe/Berlin"))[0] == 1767225600 * 10**9


NAIVE, AWARE = datetime(2026, 1, 1), datetime(2026, 1, 1, tzinfo=UTC)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gs.sun(48.1, 11.6, NAIVE), r"when must have a time zone.*replace\(tzinfo=ZoneInfo"),
        (lambda: gs.sun(48.1, 11.6, "2026-06-21T12:00"), r"must have a time zone.*\+01:00"),
        (lambda: gs.sun(48.1, 11.6, "noon"), "a date and time with a time zone"),
        (lambda: gs.sun(48.1, 11.6, 12), "datetime with a time zone"),
        (lambda: gs.sun(48.1, 11.6, AWARE), r"below the horizon at .*it is above the horizon at 2026-01-01T07:0"),
        (lambda: gs.sun(78.2, 15.6, AWARE), "polar night"),
        (lambda: gs.sun(91, 11.6, AWARE), r"latitude must be .*\[-90, 90\] degrees, got 91"),
        (lambda: gs.sun(48, 181, AWARE), r"longitude must be .*\[-180, 180\]"),
        (lambda: gs.sun(48, 11, AWARE.replace(year=1600)), "in the years 1700 to 2200"),
        (lambda: gs.sun(48, 11, AWARE, north=(0, 1, 0)), "north must not be along up"),
        (lambda: gs.SunPath(48, 11, AWARE, NAIVE), "end must have a time zone"),
        (lambda: gs.SunPath(48, 11, AWARE, AWARE), "end must be after start, got start 2026"),
        (lambda: gs.SunPath(48, 11, AWARE, AWARE.replace(year=2025)), "end must be after start"),
        (lambda: gs.SunPath(48, 11, AWARE, AWARE.replace(year=2027), 0), "step must be .*above 0"),
        (lambda: gs.SunPath(48, 11, AWARE, AWARE.replace(year=2199), 0.01), "take a longer step"),
        (lambda: gs.SunPath.of_year(48, 11, 2026), "zone is needed.*Europe/Berlin"),
        (lambda: gs.SunPath.of_year(48, 11, 2026, "Berlin"), "zone must be a time zone such as"),
        (lambda: gs.SunPath.of_year(48, 11, 20.26, "UTC"), "year must be"),
    ],
)
def test_bad_input_is_named(call: Callable[[], object], words: str) -> None:
    with pytest.raises(gs.SettingsError, match=words):
        call()
