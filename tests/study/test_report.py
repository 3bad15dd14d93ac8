"""The page: complete, in one file, and deterministic."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner
from PIL import Image
from py_mini_racer import MiniRacer

import glshadow as gs
from glshadow.cli.study import command
from glshadow.study import Study, write_report
from glshadow.study.cases import read_cases
from glshadow.study.report import NONE

VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Counts tags and collects the page's references."""

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
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(study, tmp_path_factory.mktemp("report")).parent


def test_page_is_self_contained(folder: Path) -> None:
    page = Page((folder / "study.html").read_text())
    assert page.open == []
    assert page.references
    assert all(reference.startswith(("data:image/", "#")) for reference in page.references)
    assert page.tags.keys() & {"link", "iframe", "object"} == set()
    assert "@import" not in (folder / "study.html").read_text()


def test_page_has_plot_table_and_images(folder: Path, study: Study) -> None:
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


def test_page_shows_the_hard_cases(folder: Path) -> None:
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


def test_images_show_their_flip(folder: Path, study: Study) -> None:
    numbers = json.loads((folder / "study.json").read_text())
    flips = {row["key"]: row["flip"] for row in numbers["results"]}
    for key, panel in study.panels.items():
        assert flips[key] == gs.flip(panel.ours, panel.truth).mean
        assert (flips[key] > 0.0) == (panel.ours != panel.truth).any()
        assert f"FLIP {flips[key]:.5f}" in (folder / "study.html").read_text()
    assert all(flips[result.key] is None for result in study.results if result.key not in study.panels)


def test_report_works_without_flip(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glshadow.study.report.find_spec", lambda name: None)
    page = write_report(study, tmp_path)
    assert "FLIP" not in page.read_text()


def test_plot_and_numbers_are_written_next_to_the_page(folder: Path, study: Study) -> None:
    with Image.open(folder / "plot.png") as plot:
        assert plot.width > 1500
        assert len(plot.convert("RGB").getcolors(1 << 20) or []) > 50
    numbers = json.loads((folder / "study.json").read_text())
    assert [row["setting"] for row in numbers["results"]] == [result.name for result in study.results]
    assert {row["setting"] for row in numbers["results"] if row["front"]} == {result.name for result in study.front()}


def test_page_is_deterministic(folder: Path, study: Study, tmp_path: Path) -> None:
    assert write_report(study, tmp_path).read_bytes() == (folder / "study.html").read_bytes()


# The part of a document that the page's script uses, around a table of `types` of columns and `cells` of [text, value].
DOCUMENT = """
const element = (textContent, dataset) => {
  const attributes = new Map(), listeners = [];
  return {
    textContent, dataset, button: { addEventListener: (_, listener) => listeners.push(listener) },
    querySelector() { return this.button; }, click: () => listeners.forEach(listener => listener()),
    getAttribute: name => attributes.get(name) ?? null, setAttribute: (name, value) => attributes.set(name, value),
    removeAttribute: name => attributes.delete(name),
  };
};
const heads = types.map(type => element("", { type }));
const body = {
  rows: cells.map(row => ({ cells: row.map(([text, value]) => element(text, { value })) })),
  append(row) { this.rows = [...this.rows.filter(other => other !== row), row]; },
};
const document = { querySelectorAll: () => [{ tHead: { rows: [{ cells: heads }] }, tBodies: [body] }] };
const marks = () => JSON.stringify(heads.map(head => head.getAttribute("aria-sort")));
const texts = column => JSON.stringify(body.rows.map(row => row.cells[column].textContent));
"""


def natural(text: str) -> list[str | float]:
    """Sort key of a cell: numbers by their size, not by their digits."""
    text = text.replace(NONE, "")  # a dash comes first, as in a browser
    return [float(part) if part[:1].isdigit() else part.lower() for part in re.split(r"(\d[\d.]*)", text)]


def test_table_sorts_by_click(folder: Path) -> None:
    """The page's own script, in a browser's engine: each heading ascending, then descending, and only that one marked."""
    page = (folder / "study.html").read_text()
    start = page.index('<table class="wide" id="settings">')
    table = ElementTree.fromstring(page[start : page.index("</table>", start) + len("</table>")])
    types = [head.get("data-type") for head in table.iter("th")]
    cells = [[("".join(cell.itertext()), cell.get("data-value")) for cell in row] for row in table[1]]
    engine = MiniRacer()
    engine.eval(f"const types = {json.dumps(types)}, cells = {json.dumps(cells)};{DOCUMENT}")
    engine.eval(page[page.index("<script>") + len("<script>") : page.index("</script>")])
    for column, kind in enumerate(types):
        key = (lambda cell: float(cell[1])) if kind == "n" else (lambda cell: natural(cell[0]))
        for direction in ("ascending", "descending"):
            engine.eval(f"heads[{column}].click()")
            marks = [direction if other == column else None for other in range(len(types))]
            assert json.loads(str(engine.eval("marks()"))) == marks
            cells.sort(key=lambda row: key(row[column]), reverse=direction == "descending")
            assert json.loads(str(engine.eval(f"texts({column})"))) == [row[column][0] for row in cells]


def test_command_writes_all_files_and_prints_one_object(tmp_path: Path) -> None:
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


def test_command_refuses_bad_options(tmp_path: Path) -> None:
    assert CliRunner().invoke(command, []).exit_code == 2
    assert CliRunner().invoke(command, ["-o", str(tmp_path), "--size", "big"]).exit_code == 2
    missing = CliRunner().invoke(command, ["nothing.glb", "-o", str(tmp_path / "out")])
    assert missing.exit_code == 1
    assert missing.stderr.startswith("error: ")
    assert not (tmp_path / "out").exists()


def test_names_are_escaped_in_the_page(study: Study, tmp_path: Path) -> None:
    hostile = replace(study, scene="\x1b]0;x\x07\u202egnp<script>alert(1)</script>")
    page = write_report(hostile, tmp_path).read_text()
    for text in (page, str(hostile), hostile._repr_html_()):
        assert not {"\x1b", "\x07", "\u202e"} & set(text)
        assert r"\x1b]0;x\x07\u202egnp" in text
    assert "<script>alert" not in page + hostile._repr_html_()
    assert json.loads((tmp_path / "study.json").read_text())["scene"]["name"] == hostile.scene
