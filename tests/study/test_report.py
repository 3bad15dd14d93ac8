"""The page: complete, in one piece, and the same every time."""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest
from click.testing import CliRunner
from PIL import Image

import glshadow as gs
from glshadow.cli.study import command
from glshadow.study import Grid, Study, run_study, write_report
from glshadow.study.cases import read_cases

SIZE = (160, 90)
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Counts tags and collects what the page refers to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: dict[str, int] = {}
        self.references: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] = self.tags.get(tag, 0) + 1
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag


@pytest.fixture(scope="module")
def study() -> Study:
    grid = Grid((256, 512), (gs.Hard(), gs.Pcf(1)), more=(gs.Shadow(),))
    return run_study(gs.scenes.box().scene, size=SIZE, grid=grid, repeats=1, backend="egl")


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(study, tmp_path_factory.mktemp("report")).parent


def test_the_page_needs_nothing_else(folder: Path) -> None:
    page = Page((folder / "study.html").read_text())
    assert page.open == []
    assert page.references
    assert all(reference.startswith(("data:image/", "#")) for reference in page.references)
    assert page.tags.keys() & {"link", "iframe", "object"} == set()
    assert "@import" not in (folder / "study.html").read_text()


def test_the_page_has_plot_table_and_pictures(folder: Path, study: Study) -> None:
    text = (folder / "study.html").read_text()
    page = Page(text)
    assert page.tags["svg"] == len(study.lights) == 1
    table = text[text.index('<table class="wide"') :]
    rows = table[table.index("<tbody>") : table.index("</tbody>")]
    assert rows.count("<tr") == len(study.results)
    assert rows.count('<tr class="front"') == len(study.front())
    assert page.tags["section"] == len(study.panels)
    regions = sum(len(panel.regions) for panel in study.panels.values())
    assert page.tags["img"] == 3 * (len(study.panels) + regions)
    for value in study.machine.values():
        assert value in text


def test_the_page_shows_the_hard_cases(folder: Path) -> None:
    text = (folder / "study.html").read_text()
    cases = read_cases()
    table = text[text.index('<table id="cases"') :]
    table = table[: table.index("</table>")]
    assert table.count('class="up"') == len(cases.techniques)
    body = table[table.index("<tbody>") :]
    assert body.count("<tr>") == len(cases.rows)
    failing = [cell for row in cases.rows for cell in row.cells if cell is not None and cell.note]
    assert failing
    assert body.count("<sup>") == len(failing)
    notes = text[text.index('<ol class="notes">') :]
    assert notes[: notes.index("</ol>")].count("<li>") == len(cases.notes)


def test_pictures_carry_their_flip(folder: Path, study: Study) -> None:
    numbers = json.loads((folder / "study.json").read_text())
    flips = {row["key"]: row["flip"] for row in numbers["results"]}
    for key, panel in study.panels.items():
        assert flips[key] == gs.flip(panel.ours, panel.truth).mean > 0.0
        assert f"FLIP {flips[key]:.5f}" in (folder / "study.html").read_text()
    assert all(flips[result.key] is None for result in study.results if result.key not in study.panels)


def test_a_report_does_without_flip(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glshadow.study.report.find_spec", lambda name: None)
    page = write_report(study, tmp_path)
    assert "FLIP" not in page.read_text()


def test_plot_and_numbers_stand_beside_it(folder: Path, study: Study) -> None:
    with Image.open(folder / "plot.png") as plot:
        assert plot.width > 1500
        assert len(plot.convert("RGB").getcolors(1 << 20) or []) > 50
    numbers = json.loads((folder / "study.json").read_text())
    assert [row["setting"] for row in numbers["results"]] == [result.name for result in study.results]
    assert {row["setting"] for row in numbers["results"] if row["front"]} == {result.name for result in study.front()}


def test_the_same_study_gives_the_same_page(study: Study, tmp_path: Path) -> None:
    first, second = (write_report(study, tmp_path / name) for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()


def test_the_table_sorts_by_click(folder: Path, tmp_path: Path) -> None:
    node = shutil.which("chromium")
    if node is None:
        pytest.skip("optional: chromium is missing (apt-get install chromium)")
    click = "<script>document.querySelectorAll('#settings button')[7].click()</script></body>"
    page = tmp_path / "clicked.html"
    page.write_text((folder / "study.html").read_text().replace("</body>", click))
    command = [
        node,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--dump-dom",
        f"--user-data-dir={tmp_path}",
        page.as_uri(),
    ]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    table = dom[dom.index('id="settings"') :]
    body = table[table.index("<tbody>") : table.index("</tbody>")]
    wrong = [float(re.findall(r'data-value="([^"]*)"', row)[4]) for row in body.split("<tr")[1:]]
    assert wrong == sorted(wrong)


def test_the_command_writes_everything_and_prints_one_object(tmp_path: Path) -> None:
    arguments = ["-o", str(tmp_path / "out"), "--size", "64x36", "--quick", "--json", "--backend", "egl"]
    done = CliRunner().invoke(command, arguments)
    assert done.exit_code == 0, done.stderr
    report = json.loads(done.stdout)
    assert len(report["results"]) == 4
    assert Path(report["path"]).is_file()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "plot.png",
        "study.html",
        "study.json",
        "study.jsonl",
    ]
    times = [row["times_ms"] for row in report["results"]]
    again = json.loads(CliRunner().invoke(command, arguments).stdout)
    assert [row["times_ms"] for row in again["results"]] == times
    fresh = json.loads(CliRunner().invoke(command, [*arguments, "--fresh"]).stdout)
    assert [row["times_ms"] for row in fresh["results"]] != times


def test_the_command_refuses_what_it_cannot_do(tmp_path: Path) -> None:
    assert CliRunner().invoke(command, []).exit_code == 2
    assert CliRunner().invoke(command, ["-o", str(tmp_path), "--size", "big"]).exit_code == 2
    missing = CliRunner().invoke(command, ["nothing.glb", "-o", str(tmp_path / "out")])
    assert missing.exit_code == 1
    assert missing.stderr.startswith("error: ")
    assert not (tmp_path / "out").exists()
