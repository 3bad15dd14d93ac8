"""The page of hours and the command that writes it: what is on it, and what is refused by name."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pandas
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow.cli import main
from glshadow.insolation.page import write_page
from glshadow.insolation.parts import divided, spread
from glshadow.insolation.result import nice_top
from glshadow.scenes import shapes
from tests.insolation.rays import RayEyes

DAY = gs.SunPath(48.1, 11.6, "2026-06-21T00:00+02:00", "2026-06-22T00:00+02:00", 120.0)
MODEL = "o house\n" + "".join(
    f"v {x} {y} {z}\n" for x in (-1, 1) for y in (0, 2) for z in (-1, 1)
) + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"  # fmt: skip


def images_of(page: str) -> list[np.ndarray]:
    """The page's images (H, W, 3)."""
    found = re.findall(r"data:image/png;base64,([A-Za-z0-9+/=]+)", page)
    return [gs.image.read(base64.b64decode(each))[..., :3] for each in found]


def test_parts_cover_their_triangle_and_have_no_long_edge(rng: np.random.Generator) -> None:
    corners = rng.normal(size=(20, 3, 3))
    parts, own = divided(corners, 0.3)
    edges = np.linalg.norm(parts[:, [1, 2, 0]] - parts, axis=2)
    assert edges.max() <= 0.3
    assert (np.diff(own) >= 0).all()

    def vectors(triangles: np.ndarray) -> np.ndarray:
        return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])

    sums = np.zeros((20, 3))
    np.add.at(sums, own, vectors(parts))  # areas with their side: turned parts would cancel
    np.testing.assert_allclose(sums, vectors(corners), rtol=1e-9, atol=1e-12)
    points = spread(parts, 3, 0).reshape(-1, 3, 3)
    a, b, c = parts.transpose(1, 0, 2)
    normal = vectors(parts)[:, None]
    for first, second in ((a, b), (b, c), (c, a)):
        side = np.cross((second - first)[:, None], points - first[:, None])
        assert ((side * normal).sum(axis=-1) >= -1e-12).all()


def test_neighbouring_parts_meet_along_whole_edges() -> None:
    corners = np.array([[[0, 0, 0], [3, 0, 0], [0, 0, 2]], [[3, 0, 0], [3, 0, 2.5], [0, 0, 2]]], dtype=np.float64)
    parts, _ = divided(corners, 0.7)
    edges = np.sort(np.stack([parts, parts[:, [1, 2, 0]]], axis=2).reshape(-1, 2, 3).round(9), axis=1)
    _, uses = np.unique([str(sorted(map(tuple, each.tolist()))) for each in edges], return_counts=True)
    border = (uses == 1).sum()
    assert set(uses.tolist()) == {1, 2}
    assert border < 40


def test_divided_faces_have_the_mean_of_their_parts() -> None:
    cube = gs.Scene([gs.Mesh(*shapes.box((2.0, 2.0, 2.0))), gs.Mesh(*shapes.box((1.0, 4.0, 1.0), (2.5, 2.0, 0.0)))])
    whole = gs.sun_hours(cube, DAY, per_face=64, renderer=RayEyes())
    parts = gs.sun_hours(cube, DAY, per_face=1, cell=0.4, renderer=RayEyes())
    assert parts.faces is not None
    area = np.bincount(parts.faces, parts.areas)
    np.testing.assert_allclose(area, whole.areas, rtol=1e-9)
    # 64 stratified points have a standard deviation of at most 0.03 of the 16 hours
    np.testing.assert_allclose(np.bincount(parts.faces, parts.areas * parts.hours) / area, whole.hours, atol=1.0)
    assert parts.mean == pytest.approx(whole.mean, rel=0.02)


@pytest.mark.parametrize(("most", "top"), [(0.0, 1.0), (0.3, 0.3), (11.9, 15.0), (4441.0, 5000.0), (10.0, 10.0)])
def test_scale_ends_at_a_round_number(most: float, top: float) -> None:
    assert nice_top(most) == pytest.approx(top)


@pytest.mark.parametrize("to", ["faces", "vertices"])
def test_images_have_the_colours_of_the_hours(tmp_path: Path, renderer: gs.Renderer, to: str) -> None:
    from matplotlib import colormaps

    roof = gs.Mesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    found = gs.sun_hours(gs.Scene([roof]), DAY, to, renderer=RayEyes())
    page, table = write_page(found, tmp_path / "hours.html", renderer)
    text = page.read_text(encoding="utf-8")
    above = images_of(text)[4]
    expected = 255.0 * np.array(colormaps["inferno"](found.hours[0] / found.top)[:3])
    assert np.abs(above[240, 320] - expected).max() < 6.0  # 64 colours of the bar
    assert (above[2, 2] == 255).all()
    assert len(pandas.read_csv(table)) == len(found.hours)
    assert ("By node" in text) == (to == "faces")


def test_north_is_up_in_the_image_from_above(tmp_path: Path, renderer: gs.Renderer) -> None:
    # A tower in the north of a ground, in a world with z up and north along x.
    ground = shapes.box((10.0, 10.0, 0.2), (0.0, 0.0, -0.1))
    tower = shapes.box((1.0, 1.0, 6.0), (4.0, 0.0, 3.0))
    scene = gs.Scene([gs.Mesh(*ground), gs.Mesh(*tower)])
    path = gs.SunPath(
        48.1, 11.6, "2026-12-21T00:00+01:00", "2026-12-22T00:00+01:00", 60.0, north=(1, 0, 0), up=(0, 0, 1)
    )
    found = gs.sun_hours(scene, path, cell=0.5, per_face=1, renderer=RayEyes())
    page, _ = write_page(found, tmp_path / "hours.html", renderer)
    above = images_of(page.read_text(encoding="utf-8"))[4].astype(int).sum(axis=2)
    assert (above[60] < 765).any()
    middle = above[:, 320]
    inside = middle[middle < 765]
    # The tower's shadow falls to the north, at the image's top; the south of the ground has sun all day.
    assert inside[: len(inside) // 20].mean() < 0.7 * inside[len(inside) // 2 :].mean()


def test_points_have_no_page(tmp_path: Path, renderer: gs.Renderer) -> None:
    roof = gs.Scene([gs.Mesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1]], [[0, 2, 1]])])
    found = gs.sun_hours(roof, DAY, [[0, 1, 0]], renderer=RayEyes())
    with pytest.raises(gs.SettingsError, match="needs values of faces or vertices"):
        write_page(found, tmp_path / "hours.html", renderer)


@pytest.fixture
def house(tmp_path: Path) -> Path:
    path = tmp_path / "house.obj"
    path.write_text(MODEL)
    return path


YEAR = ("--place", "48.1,11.6", "--year", "2026", "--zone", "Europe/Berlin")
SHORT = ("--place", "48.1,11.6", "--from", "2026-06-21T00:00+02:00", "--until", "2026-06-22T00:00+02:00")


def test_command_writes_page_and_table(house: Path, tmp_path: Path) -> None:
    page = tmp_path / "hours.html"
    weather = pandas.DataFrame(
        {"dni": 500.0, "dhi": 50.0}, index=pandas.date_range("2026-06-20T22:00Z", periods=24, freq="h")
    )
    weather.to_csv(tmp_path / "weather.csv")
    given = [
        "sun", str(house), *SHORT, "--step", "120", "-o", str(page), "--ground", "--cell", "2",
        "--weather", str(tmp_path / "weather.csv"), "--json",
    ]  # fmt: skip
    done = CliRunner().invoke(main, given)
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert report["steps"] == 12
    text = page.read_text(encoding="utf-8")
    assert len(images_of(text)) == 5
    assert "house" in text
    assert "kWh" in text
    table = pandas.read_csv(page.with_suffix(".csv"))
    assert len(table) == report["faces"] > 12
    top = table[(table.node == "house") & np.isclose(table.y, 2.0)]
    assert top.hours.mean() == pytest.approx(16.0, abs=1.0)
    assert (top.direct_kwh_m2 > 4.0).all()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["hours.csv", "hours.html", "house.obj", "weather.csv"]


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        (
            ("--place", "48.1,11.6", "--year", "2026", "-o", "a.html"),
            2,
            "--year needs --zone, the time zone of the place",
        ),
        ((*YEAR, "--from", "2026-01-01T00:00Z", "-o", "a.html"), 2, "leave out --from and --until"),
        (("--place", "48.1,11.6", "-o", "a.html"), 2, "give --year and --zone, or --from and --until"),
        (("--place", "91,11.6", "--year", "2026", "--zone", "UTC", "-o", "a.html"), 2, "is not LATITUDE,LONGITUDE"),
        ((*YEAR[:-1], "Berlin", "-o", "a.html"), 1, "zone must be a time zone such as"),
        ((*YEAR, "--step", "0", "-o", "a.html"), 1, "step must be a timedelta or a number of minutes, above 0"),
        ((*SHORT[:3], "2026-06-21T00:00", *SHORT[4:], "-o", "a.html"), 1, "start must have a time zone"),
        ((*SHORT[:3], "2026-06-23T00:00Z", *SHORT[4:], "-o", "a.html"), 1, "end must be after start"),
        ((*YEAR, "-o", "a.pdf"), 1, "must be a file that ends in .html"),
        ((*YEAR, "-o", "missing/a.html"), 1, "there is no folder missing"),
        ((*YEAR, "--cell", "-1", "-o", "a.html"), 2, "--cell must be a length"),
        ((*YEAR, "--north", "0,1,0", "-o", "a.html"), 1, "north must not be along up"),
        ((*YEAR, "--weather", "none.csv", "-o", "a.html"), 1, "none.csv"),
    ],
)
def test_command_names_what_is_wrong(
    house: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: tuple[str, ...], code: int, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["sun", str(house), *given])
    assert done.exit_code == code, done.output
    assert words in " ".join(done.stderr.split())
    assert "Traceback" not in done.output
    assert sorted(each.name for each in tmp_path.iterdir()) == ["house.obj"]


def test_missing_model_is_named(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["sun", str(tmp_path / "none.glb"), *YEAR, "-o", str(tmp_path / "a.html")])
    assert done.exit_code == 1
    assert "file not found" in done.stderr
