"""Hours of sun against closed forms and rays; weather; interrupted work; names of what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas
import pytest

import glshadow as gs
from glshadow.insolation import state
from glshadow.insolation.hours import MOST_SUNS
from glshadow.scenes import shapes
from tests.insolation.rays import RayEyes

EQUINOX = ("2026-03-20T00:00Z", "2026-03-21T00:00Z")
SPAN = 1e5  # of a wall that stands for an infinite one: the sun is along it for 12 h * 2 / 1e5


def wall(along: str, height: float, distance: float) -> gs.Mesh:
    """An upright rectangle of a height, at a distance from the origin: to the east running north and south, or to the south."""
    low, high = np.array([0.0, -SPAN]), np.array([height, SPAN])
    y, s = np.array([[low[0], low[1]], [low[0], high[1]], [high[0], high[1]], [high[0], low[1]]]).T
    flat = np.full(4, distance)
    positions = np.stack([flat, y, s] if along == "north" else [s, y, flat], axis=1)
    return gs.Mesh(positions, np.array([[0, 1, 2], [0, 2, 3]]))


def town(rng: np.random.Generator) -> gs.Scene:
    """Boxes on a ground."""
    solids = [shapes.box((60.0, 1.0, 60.0), (0.0, -0.5, 0.0))]
    for x, z in rng.uniform(-25.0, 25.0, (12, 2)):
        height = rng.uniform(4.0, 20.0)
        solids.append(shapes.box((rng.uniform(3, 8), height, rng.uniform(3, 8)), (x, 0.5 * height, z)))
    return gs.Scene([gs.Node(gs.Mesh(*each), np.eye(4), f"part {i}") for i, each in enumerate(solids)])


@pytest.mark.parametrize("height", [2.0, 10.0, 30.0])
def test_hours_before_an_infinite_wall_in_the_east(height: float) -> None:
    # At the equator on the equinox the sun climbs 15 degrees an hour, from due east: a wall of height H at distance D takes
    # arctan(H / D) / 15 hours. The sun's declination on that day, up to 0.2 degrees, and steps of a minute leave 0.02 hours.
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 1.0, refraction=False)
    found = gs.sun_hours(
        gs.Scene([wall("north", height, 10.0)]), path, [[0.0, 0.0, 0.0]], within=0.0, renderer=RayEyes()
    )
    assert found.hours[0] == pytest.approx(12.0 - np.degrees(np.arctan(height / 10.0)) / 15.0, abs=0.02)
    assert found.possible[0] == pytest.approx(12.0, abs=0.02)


@pytest.mark.parametrize(("height", "hours"), [(8.5, 12.0), (9.5, 0.0)])
def test_wall_in_the_south_shades_all_day_or_not_at_all(height: float, hours: float) -> None:
    # On the equinox the sun stays in the plane of the equator, which an infinite wall that runs east and west cuts at 90 - latitude: at
    # 48 degrees and 10 m the limit is 9.004 m. In the minutes after sunrise the declination of up to 0.2 degrees decides.
    path = gs.SunPath(48.0, 0.0, *EQUINOX, 2.0, refraction=False)
    found = gs.sun_hours(
        gs.Scene([wall("east", height, 10.0)]), path, [[0.0, 0.0, 0.0]], within=0.0, renderer=RayEyes()
    )
    assert found.hours[0] == pytest.approx(hours, abs=0.5)


def test_faces_of_a_cube_by_closed_forms() -> None:
    # At the equator on the equinox: the top has the whole day, east and west faces half of it each, the bottom nothing.
    cube = gs.Scene([gs.Mesh(*shapes.box((2.0, 2.0, 2.0)))])
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 5.0, refraction=False)
    found = gs.sun_hours(cube, path, "faces", renderer=RayEyes())
    assert found.faces is not None
    corners = cube.nodes[0].mesh.positions[cube.nodes[0].mesh.triangles[found.faces]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 4.0
    for axis, hours in (((0, 1, 0), 12.0), ((0, -1, 0), 0.0), ((1, 0, 0), 6.0), ((-1, 0, 0), 6.0)):
        rows = (normals == axis).all(axis=1)
        assert rows.sum() == 2
        assert found.hours[rows] == pytest.approx(hours, abs=0.1)
        assert found.possible[rows] == pytest.approx(hours, abs=0.1)
    assert found.shaded_by_month[2] == pytest.approx(
        0.0, abs=1e-12
    )  # a convex body shades no face that the sun is before
    assert np.isnan(found.shaded_by_month[0])


def test_sums_are_those_of_rays(rng: np.random.Generator) -> None:
    # Without sharing: the same visibilities, added up one step at a time.
    scene = town(rng)
    path = gs.SunPath(48.1, 11.6, "2026-02-10T00:00+01:00", "2026-02-12T00:00+01:00", 30.0)
    eyes = RayEyes()
    points = rng.uniform(-28.0, 28.0, (300, 3)) * (1.0, 0.0, 1.0) + (0.0, 1e-3, 0.0)
    found = gs.sun_hours(scene, path, points, within=0.0, renderer=eyes)
    seen = RayEyes().visibility(scene, points, path.lights(angle=0.0))
    hours = path.hours[path.is_up] @ seen
    np.testing.assert_allclose(found.hours, hours, rtol=1e-6, atol=1e-9)
    assert found.hours.sum() == pytest.approx(hours.sum(), rel=1e-3)
    assert found.suns == path.is_up.sum() == eyes.suns
    assert eyes.calls == -(-found.suns // MOST_SUNS)
    by_hour = np.zeros(24)
    np.add.at(by_hour, path.hour[path.is_up], path.hours[path.is_up] * seen.mean(axis=1))
    np.testing.assert_allclose(found.table_hours[1], by_hour, rtol=1e-6)
    np.testing.assert_allclose(found.hour_hours.sum(axis=0), found.hours, rtol=1e-9)


@pytest.mark.parametrize("to", ["faces", "vertices", "points"])
def test_renderer_sums_what_rays_sum(to: str, rng: np.random.Generator, renderer: gs.Renderer) -> None:
    # Both decide by the same triangles; a point within float32's rounding of a shadow's border may differ.
    scene = town(rng)
    path = gs.SunPath(48.1, 11.6, "2026-06-10T00:00+02:00", "2026-06-11T00:00+02:00", 60.0)
    where = rng.uniform(-28.0, 28.0, (300, 3)) * (1.0, 0.0, 1.0) + (0.0, 0.5, 0.0) if to == "points" else to
    found, traced = (gs.sun_hours(scene, path, where, within=0.0, renderer=each) for each in (renderer, RayEyes()))
    assert found.hours.sum() == pytest.approx(traced.hours.sum(), rel=1e-3)
    assert np.mean(np.abs(found.hours - traced.hours) > 0.1) < 0.01
    np.testing.assert_allclose(found.possible, traced.possible)


def test_mirrored_nodes_receive_on_their_outside(renderer: gs.Renderer) -> None:
    # Mirrored in x: corners turn the other way in the world, and the front is still the outside.
    cube = gs.Mesh(*shapes.box((2.0, 2.0, 2.0)))
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 60.0, refraction=False)
    plain, mirrored = (
        gs.sun_hours(gs.Scene([gs.Node(cube, np.diag([x, 1.0, 1.0, 1.0]))]), path, renderer=renderer)
        for x in (1.0, -1.0)
    )
    assert plain.hours.max() > 11.0
    np.testing.assert_allclose(np.sort(mirrored.hours), np.sort(plain.hours), atol=1.0)
    np.testing.assert_allclose(np.sort(mirrored.possible), np.sort(plain.possible), atol=1.0)


def test_renderer_finds_the_hours_before_a_wall(renderer: gs.Renderer) -> None:
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 10.0, refraction=False)
    scene = gs.Scene([wall("north", 10.0, 10.0)])
    found = gs.sun_hours(scene, path, [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]], within=0.0, renderer=renderer)
    heights = np.degrees(np.arctan([1.0, 2.0]))
    assert found.hours == pytest.approx(12.0 - heights / 15.0, abs=0.1)  # half a step


def test_sharing_moves_hours_by_what_is_stated(rng: np.random.Generator) -> None:
    # A shadow's border moves by at most `within`, which the sun passes in 4 within / cos(declination) minutes; each point sees a few
    # borders a day. The mean hardly moves, because borders move both ways.
    scene = town(rng)
    path = gs.SunPath(48.1, 11.6, "2026-03-01T00:00+01:00", "2026-03-11T00:00+01:00", 10.0)
    points = rng.uniform(-28.0, 28.0, (400, 3)) * (1.0, 0.0, 1.0) + (0.0, 1e-3, 0.0)
    exact = gs.sun_hours(scene, path, points, within=0.0, renderer=RayEyes())
    shared = gs.sun_hours(scene, path, points, within=0.5, renderer=RayEyes())
    assert shared.suns < 0.5 * exact.suns
    assert shared.error <= 0.5
    days, borders = 10, 4
    bound = days * borders * (4.0 * 0.5 / np.cos(np.radians(8.0))) / 60.0 + days * borders * 10.0 / 60.0 / 2.0
    assert np.abs(shared.hours - exact.hours).max() < bound
    assert shared.mean == pytest.approx(exact.mean, rel=0.005)


def test_vertices_take_the_faces_around_them() -> None:
    roof = gs.Mesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 30.0, refraction=False)
    found = gs.sun_hours(gs.Scene([roof]), path, "vertices", renderer=RayEyes())
    assert found.hours == pytest.approx(12.0, abs=0.5)
    assert found.areas.tolist() == pytest.approx([4 / 3, 2 / 3, 4 / 3, 2 / 3])
    assert found.places.shape == (4, 3)
    cube = gs.sun_hours(gs.Scene([gs.Mesh(*shapes.box((2.0, 2.0, 2.0)))]), path, "vertices", renderer=RayEyes())
    high = cube.places[:, 1] > 0.0
    assert cube.hours[high].mean() > cube.hours[~high].mean() > 0.0


@pytest.fixture
def weather() -> pandas.DataFrame:
    """A clear spring day: 800 W/m^2 direct and 100 diffuse while the sun is up, hour by hour."""
    index = pandas.date_range("2026-03-20", periods=24, freq="h", tz="UTC")
    return pandas.DataFrame({"DNI": 800.0, "DHI": 100.0, "temp_air": 5.0}, index=index)


def test_irradiation_of_a_flat_roof_is_the_integral(weather: pandas.DataFrame) -> None:
    # Of a horizontal face at the equator on the equinox: 800 W/m^2 times the integral of the sine of 15 degrees an hour, 24 / pi = 7.639 h.
    roof = gs.Mesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 5.0, refraction=False)
    found = gs.sun_hours(gs.Scene([roof]), path, weather=weather, renderer=RayEyes())
    assert found.direct is not None
    assert found.diffuse is not None
    assert found.sky_view is not None
    assert found.direct == pytest.approx(0.8 * 24.0 / np.pi, rel=2e-3)
    assert found.sky_view == pytest.approx(1.0, abs=1e-3)
    assert found.diffuse == pytest.approx(0.1 * 12.0, rel=1e-2)
    free = gs.sun_hours(gs.Scene([roof]), path, [[0.0, 1.0, 0.0]], weather=weather, renderer=RayEyes())
    assert free.direct == pytest.approx(0.8 * 12.0, rel=0.01)  # steps of 5 minutes at both ends


def test_upright_wall_sees_half_of_the_sky(weather: pandas.DataFrame) -> None:
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 60.0)
    mesh = gs.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    found = gs.sun_hours(gs.Scene([mesh]), path, weather=weather, renderer=RayEyes())
    assert found.sky_view == pytest.approx(0.5, abs=0.01)


def test_text_in_a_column_is_named(weather: pandas.DataFrame) -> None:
    text = weather.astype(object)
    text.iloc[0, list(text.columns).index("DNI")] = "abc"
    path = gs.SunPath(48.1, 11.6, text.index[0].to_pydatetime(), text.index[1].to_pydatetime())
    with pytest.raises(gs.SettingsError, match="weather column DNI must hold numbers"):
        gs.sun_hours(CUBE, path, weather=text, renderer=RayEyes())


def test_rows_stand_for_the_time_that_their_label_says(weather: pandas.DataFrame) -> None:
    roof = gs.Scene([gs.Mesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])])
    path = gs.SunPath(0.0, 0.0, "2026-03-20T08:00Z", "2026-03-20T16:00Z", 60.0)
    weather["DNI"] = np.where(weather.index.hour == 12, 1000.0, 0.0)
    for label, start in (("left", 12), ("right", 11)):
        found = gs.sun_hours(roof, path, weather=weather, weather_label=label, renderer=RayEyes())
        alone = gs.SunPath(0.0, 0.0, f"2026-03-20T{start}:00Z", f"2026-03-20T{start + 1}:00Z", 60.0)
        assert found.direct == pytest.approx(alone.directions[0, 1], rel=1e-9)


class Interrupted(RayEyes):
    """Fails after a number of calls."""

    def __init__(self, calls: int) -> None:
        super().__init__()
        self.left = calls

    def visibility(self, *given: object, **more: object) -> np.ndarray:
        if self.left == 0:
            raise KeyboardInterrupt
        self.left -= 1
        return super().visibility(*given, **more)


def test_interrupted_sums_go_on(tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state, "EVERY_S", 0.0)
    scene = town(rng)
    path = gs.SunPath(48.1, 11.6, "2026-02-10T00:00+01:00", "2026-02-14T00:00+01:00", 30.0)
    keep = tmp_path / "hours.npz"
    with pytest.raises(KeyboardInterrupt):
        gs.sun_hours(scene, path, per_face=1, within=0.0, keep=keep, renderer=Interrupted(2))
    rest = RayEyes()
    found = gs.sun_hours(scene, path, per_face=1, within=0.0, keep=keep, renderer=rest)
    whole = gs.sun_hours(scene, path, per_face=1, within=0.0, renderer=RayEyes())
    assert rest.suns == found.suns - 2 * MOST_SUNS
    assert np.array_equal(found.hours, whole.hours)
    assert np.array_equal(found.table_hours, whole.table_hours)
    other = RayEyes()
    gs.sun_hours(scene, path, per_face=1, within=0.0, seed=1, keep=keep, renderer=other)
    assert other.suns == found.suns  # other points: nothing is kept


def test_polar_night_has_no_hours(rng: np.random.Generator) -> None:
    path = gs.SunPath(78.0, 15.0, "2026-12-20T00:00Z", "2026-12-22T00:00Z")
    eyes = RayEyes()
    found = gs.sun_hours(town(rng), path, renderer=eyes)
    assert eyes.calls == 0
    assert found.hours.max() == found.mean == 0.0
    assert np.isnan(found.shaded_by_month).all()


def test_table_is_written(tmp_path: Path, weather: pandas.DataFrame) -> None:
    cube = gs.Scene([gs.Node(gs.Mesh(*shapes.box((2.0, 2.0, 2.0))), np.eye(4), "cube")])
    path = gs.SunPath(0.0, 0.0, *EQUINOX, 60.0)
    found = gs.sun_hours(cube, path, weather=weather, renderer=RayEyes())
    table = pandas.read_csv(found.save(tmp_path / "hours.csv"))
    assert len(table) == 12
    assert table.node.unique().tolist() == ["cube"]
    np.testing.assert_allclose(table.hours, found.hours, rtol=1e-7)
    np.testing.assert_allclose(table.direct_kwh_m2, found.direct, rtol=1e-7)
    np.testing.assert_allclose(table.hours_mar, found.hours, rtol=1e-7)
    assert "12 faces" in repr(found)


CUBE = gs.Scene([gs.Mesh(*shapes.box((2.0, 2.0, 2.0)))])
PATH = gs.SunPath(0.0, 0.0, *EQUINOX, 60.0)
NAIVE = pandas.DataFrame({"dni": [1.0, 1.0]}, index=pandas.DatetimeIndex(["2026-03-20 00:00", "2026-03-20 01:00"]))
SHORT = NAIVE.tz_localize("UTC")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gs.sun_hours(gs.Scene([gs.Points([[0, 0, 0], [1, 1, 1]], 0.1)]), PATH), "has no faces"),
        (lambda: gs.sun_hours(gs.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), PATH), "nothing to render"),
        (lambda: gs.sun_hours(CUBE, "2026"), "path must be SunPath"),
        (lambda: gs.sun_hours(CUBE, PATH, "edges"), 'to must be "faces", "vertices" or an array'),
        (lambda: gs.sun_hours(CUBE, PATH, [[0.0, np.nan, 0.0]]), "to must be .*got"),
        (lambda: gs.sun_hours(CUBE, PATH, np.zeros((0, 3))), r"to must be .*shape=\(0, 3\)"),
        (lambda: gs.sun_hours(CUBE, PATH, normals=[[0, 1, 0]]), "normals belong to points"),
        (lambda: gs.sun_hours(CUBE, PATH, [[0, 9, 0]], normals=[[0, 0, 0]]), "normals must not be zero"),
        (lambda: gs.sun_hours(CUBE, PATH, [[0, 9, 0]], normals=[[0, 0]]), "normals must be finite, with shape"),
        (lambda: gs.sun_hours(CUBE, PATH, per_face=0), "per_face must be"),
        (lambda: gs.sun_hours(CUBE, PATH, seed=-1), "seed must be"),
        (lambda: gs.sun_hours(CUBE, PATH, cell=0), "cell must be"),
        (lambda: gs.sun_hours(CUBE, PATH, cell=1e-6), "cell 1e-06 would divide .* take a larger cell"),
        (lambda: gs.sun_hours(CUBE, PATH, "vertices", cell=1), "cell divides faces"),
        (lambda: gs.sun_hours(CUBE, PATH).save("a.png"), "must be a file that ends in .csv or .html"),
        (lambda: gs.sun_hours(CUBE, PATH, within=-1), "within must be"),
        (lambda: gs.sun_hours(CUBE, PATH, keep="a.txt"), "keep must be a file that ends in .npz"),
        (lambda: gs.sun_hours(CUBE, PATH, renderer=3), "renderer must be"),
        (lambda: gs.sun_hours(CUBE, PATH, weather=[1, 2]), "weather must be a pandas DataFrame"),
        (lambda: gs.sun_hours(CUBE, PATH, weather=SHORT.rename(columns={"dni": "beam"})), "no column dni.*are beam"),
        (lambda: gs.sun_hours(CUBE, PATH, weather=NAIVE), "no time zone.*tz_localize"),
        (lambda: gs.sun_hours(CUBE, PATH, weather=SHORT), "does not cover 12 of 12 .*coerce_year=2026"),
        (lambda: gs.sun_hours(CUBE, PATH, weather=SHORT, weather_label="x"), "weather_label must be"),
    ],
)
def test_bad_input_is_named(call: Callable[[], object], words: str) -> None:
    with pytest.raises(gs.GlshadowError, match=words):
        call()
