"""The tables of docs/ and the README equal those of the stored numbers, completely, and contain no number that was not measured."""

from __future__ import annotations

import importlib
import json
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from click.testing import CliRunner

from glshadow.shadows.filters import FILTERS

CHECKOUT = Path(__file__).resolve().parents[1]


@pytest.fixture
def pages(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT)
    return importlib.import_module("scripts.pages")


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch, pages: ModuleType) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT / "scripts" / "benchmarks")
    return importlib.import_module("tables")


@pytest.fixture
def copy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, pages: ModuleType, tables: ModuleType) -> Path:
    """A checkout of the pages alone, which may be written."""
    shutil.copytree(CHECKOUT / "docs", tmp_path / "docs")
    shutil.copy(CHECKOUT / "README.md", tmp_path)
    for module in (pages, tables):
        monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(pages, "DOCS", tmp_path / "docs")
    return tmp_path


def test_pages_match_the_stored_numbers(pages: ModuleType) -> None:
    stale = [path.name for path, text in pages.rendered().items() if path.read_text(encoding="utf-8") != text]
    assert stale == [], "scripts/bench tables --from-stored writes them"


def test_every_filter_has_a_row() -> None:
    """One in each of the three tables: in short, where it lives, what it costs."""
    lines = (CHECKOUT / "docs" / "techniques.md").read_text().splitlines()
    for kind in FILTERS:
        (short,) = (line for line in lines if line.startswith(f"| `{kind.__name__}()` |"))
        (long,) = (line for line in lines if line.startswith(f"| `{kind.usage()}` | {kind.summary}"))
        for line in (short, long):
            assert kind.source in line
            assert kind.fails in line


def test_captions_are_those_of_the_script_that_makes_the_images(pages: ModuleType) -> None:
    captions = importlib.import_module("scripts.pictures").captions()
    readme = (CHECKOUT / "README.md").read_text()
    for name in ("caption courtyard", "caption twelve", "caption soft"):
        assert f"<!-- table: {name} -->\n{captions[name]}\n<!-- end -->" in readme
    turned = [model for model in importlib.import_module("scripts.pictures").TWELVE if model.up != "y"]
    assert all(model.shows in captions["caption twelve"] for model in turned)


def test_the_number_of_techniques_is_that_of_the_readme() -> None:
    assert f"{len(FILTERS)} filters from Williams 1978" in (CHECKOUT / "README.md").read_text()


def test_changed_number_changes_only_its_pages(copy: Path, tables: ModuleType) -> None:
    numbers = copy / "docs" / "numbers" / "techniques.json"
    content = json.loads(numbers.read_text())
    content["results"]["pcf:1"]["cost"] = 1.2345
    numbers.write_text(json.dumps(content))
    done = CliRunner().invoke(tables.main, ["--from-stored"], catch_exceptions=False)
    assert done.stderr.splitlines() == ["written: docs/techniques.md"]
    assert "| `pcf:1` | 1.23 |" in (copy / "docs" / "techniques.md").read_text()
    assert CliRunner().invoke(tables.main, ["--from-stored"]).stderr == ""


def test_measurements_are_stored_with_their_conditions(
    copy: Path, pages: ModuleType, tables: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = {
        str(kind): {"cost": 2.0, "wrong": 1 / 3, "acne": 0.0, "leak": 0.0, "grain": 0.0, "edge": 0.0}
        for kind in settings()
    }
    monkeypatch.setattr(tables, "measured", lambda part, more: results)
    done = CliRunner().invoke(tables.main, ["--only", "techniques", "--models", str(copy)], catch_exceptions=False)
    assert done.stderr.startswith("[1/1] scripts/bench techniques\n")
    stored = json.loads((copy / "docs" / "numbers" / "techniques.json").read_text())
    assert set(stored["measured"]) == {"on", "commit", "machine"}
    assert stored["results"]["hard"] == {"cost": 2.0, "wrong": 0.3333, "acne": 0.0, "leak": 0.0, "grain": 0.0}


def settings() -> list[Any]:
    from scripts.pages.techniques import measured

    return [each for kind in FILTERS for each in measured(kind)]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("<!-- table: speed -->", "<!-- table: sped -->", "no table sped"),
        ("<!-- table: speed -->", "", "on no page: speed"),
    ],
)
def test_tables_and_their_markers_must_match(copy: Path, pages: ModuleType, old: str, new: str, says: str) -> None:
    page = copy / "docs" / "speed.md"
    page.write_text(page.read_text().replace(old, new))
    with pytest.raises(ValueError, match=says):
        pages.rendered()


def test_failed_benchmark_stores_nothing(copy: Path, tables: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (copy / "docs" / "numbers" / "speed.json").read_text()
    monkeypatch.setattr(tables.sys, "executable", "/bin/false")
    done = CliRunner().invoke(tables.main, ["--only", "speed", "--models", str(copy)])
    assert done.exit_code == 1
    assert "scripts/bench frame failed; nothing of it is stored" in done.stderr
    assert (copy / "docs" / "numbers" / "speed.json").read_text() == before


# -- the benchmarks' output, and the part of it that is stored


def condensed(pages: ModuleType, name: str, results: Any) -> Any:
    (part,) = (part for part in pages.PARTS if part.name == name)
    return part.condensed(results)


def test_finer_maps_are_listed_in_their_row(pages: ModuleType) -> None:
    row = {"counted": 0.9, "none": 0.06, "wrong": 5e-4, "acne": 0.0, "leak": 0.0, "grain": 0.0, "mean": 1.0}
    results = {
        "lines": {"a, spot": row, "a, spot, 4096": row | {"wrong": 2e-4}},
        "truth": {"trace_s": 1.0},
        "formats": [],
    }
    found = condensed(pages, "accuracy", results)["lines"]
    assert list(found) == ["a, spot"]
    assert found["a, spot"]["maps"] == {"4096": {"wrong": 2e-4, "grain": 0.0}}
    assert "mean" not in found["a, spot"]


def test_median_of_the_models_excludes_the_courtyard(pages: ModuleType) -> None:
    ratios = {"courtyard": 9.0, "x/a_b.glb": 1.0, "c.ply": 2.0, "d.obj": 4.0}
    results = {
        name: {"triangles": 3, "nodes": 1, "floor": {"median_ms": 1.0}}
        | {kind: {"ratio": value} for kind in ("default", "hard", "pcf 1", "pcf 3")}
        for name, value in ratios.items()
    }
    found = condensed(pages, "speed", results | {"dungeon, nodes against one draw": {"ratio": 1.0}})
    assert (found["models"], found["median"]) == (3, 2.0)
    assert list(found["scenes"]) == ["courtyard", "a b", "c", "d"]


def test_exact_keeps_the_worst_of_three_lights(pages: ModuleType) -> None:
    lights = ("sun", "spot", "point")
    results = {
        "wrong": {f"a.glb {light}": {"pixels": 100 - k, "ours": k, "counted_wrong": 0.1 * k} for k, light in enumerate(lights)},
        "moving": {f"a.glb {light}": {"ratio": 1.0 + k} for k, light in enumerate(lights)},
        "embree": {name: {"frame_trimesh": 2 * x, "frame_trimesh_with_tree": x} for name, x in (("a", 0.125), ("b", 0.1))},
        "build": {"a sun": {"ratio": 0.8}, "a spot": {"ratio": 0.7}},
        "still": {"exact": 1.2, "hard": 1.0},
        "samples": {count: {"mean": 0.1, "ratio": 1.0} for count in ("1", "4", "8", "16")},
        "growth": {
            "9980 triangles": {"floor_ms": 1.0, "map": 1.5, "exact": 1.1, "exact_ms": 9.0},
            "courtyard, map 512": {"floor_ms": 1.0, "map": 1.5, "exact": 1.1, "exact_ms": 5.0},
        },
    }  # fmt: skip
    found = condensed(pages, "exact", results)
    assert found["scenes"] == {"a": {"time": [1.0, 2.0, 3.0], "wrong": [0, 1, 2], "pixels": 100, "counted_wrong": 0.2}}
    assert (found["embree_over_frame"], found["embree_with_tree_over_frame"]) == ([4.0, 5.0], [8.0, 10.0])
    assert (found["build_over_depth_pass"], found["exact_ms_beside_maps"]) == ([0.7, 0.8], [5.0, 5.0])


def test_watertight_counts_use_the_least_tested_light(pages: ModuleType) -> None:
    def row(what: str, light: str, asked: int, wrong: int, control: int | None, every: bool = False) -> dict[str, Any]:
        return {"what": what, "light": light, "asked": asked, "wrong": wrong, "control": control, "every": every}

    found = condensed(
        pages,
        "watertight",
        [
            row("rays slipped, torus", "sun", 100, 1, 1),
            row("rays slipped, brain", "sun", 100, 0, 2),
            row("rays slipped, torus", "point", 50, 2, 1),
            row("leaks, sheet", "sun", 10, 0, 10, every=True),
            row("acne, light 60 degrees high", "sun", 10, 0, None),
        ],
    )
    assert found["rays slipped"] == {"asked": 50, "wrong": 3, "control_per_million": [1e4, 2e4]}
    assert found["leaks"] == found["acne"] == {"asked": 10, "wrong": 0}


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0.000"),
        (5.4e-4, "0.054"),
        (2e-6, "0.0002"),
        (4.9e-6, "0.0005"),
        (9.99e-7, "0.00010"),
        (None, "not measured"),
    ],
)
def test_nonzero_percentage_is_not_printed_as_zero(pages: ModuleType, value: float | None, shown: str) -> None:
    assert pages.markdown.percent(value, 3) == shown
