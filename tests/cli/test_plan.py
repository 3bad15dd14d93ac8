"""glshadow plan: what it prints, and the command line that it suggests."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from glshadow import image
from glshadow.cli import main
from glshadow.cli.values import share
from glshadow.errors import SettingsError

SMALL = ("--size", "96x54", "--backend", "egl")
SUNS = ("--light", "sun:-1,-2,-1:intensity=0.5", "--light", "sun:1,-2,0")
PICTURE = (*SMALL, "--ground", *SUNS, "--eye=9,6,11")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["plan", *arguments])


@pytest.mark.parametrize(("text", "value"), [("0.1%", 0.001), ("0.001", 0.001), ("0", 0.0), ("25%", 0.25)])
def test_share(text: str, value: float) -> None:
    assert share(text) == value


@pytest.mark.parametrize("text", ["1", "100%", "-1%", "some", "%", "nan", "0.1 %%"])
def test_share_refuses(text: str) -> None:
    with pytest.raises(SettingsError, match=r"such as 0\.1% or 0\.001"):
        share(text)


@pytest.fixture(scope="module")
def journal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The journal: the settings of PICTURE are measured once for this file."""
    return tmp_path_factory.mktemp("plan") / "plan.jsonl"


@pytest.fixture(scope="module")
def planned(journal: Path) -> Result:
    return run("--wrong=20%", "--json", "--journal", str(journal), *PICTURE)


def test_json_is_one_object(planned: Result, journal: Path) -> None:
    assert planned.exit_code == 0, planned.output
    assert planned.stdout.count("\n") == 1
    report = json.loads(planned.stdout)
    assert report["met"] is True
    assert report["best"] == report["choices"][0]["setting"] in report["tried"]
    assert report["choices"][0]["error"] <= report["budget"] == 0.2
    assert "--wrong" not in report["command"]
    assert str(journal) not in report["command"]
    assert journal.is_file()


def test_printed_command_renders(
    planned: Result, journal: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    measured = journal.read_bytes()
    done = run("--wrong", "20%", "--journal", str(journal), *PICTURE)
    assert done.exit_code == 0, done.output
    assert journal.read_bytes() == measured
    facts, line = done.stdout.splitlines()
    assert line == json.loads(planned.stdout)["command"]
    name, _, numbers = facts.partition(": wrong ")
    assert "x floor" in numbers
    words = shlex.split(line)
    assert words[:2] == ["glshadow", "render"]
    kept = {"--ground", "--eye=9,6,11", "--size=96x54", "--light=sun:-1,-2,-1:intensity=0.5", "--light=sun:1,-2,0"}
    assert kept <= set(words)
    assert words[-4:] == ["--resolution", name.split()[0], "--filter", name.split()[1]]
    rendered = CliRunner().invoke(main, words[1:])
    assert rendered.exit_code == 0, rendered.output
    assert image.read("courtyard.png").shape == (54, 96, 4)


def test_unreachable_budget_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glshadow.study.plan.run_plan.__defaults__", _coarse())
    done = run("--wrong=0", *SMALL, "--json")
    assert done.exit_code == 1
    assert done.stderr.startswith("error: none of 3 settings keeps the wrong pixels within 0%; the best is 128 ")
    report = json.loads(done.stdout)
    assert report["met"] is False
    assert report["command"] is None
    assert report["choices"][0]["error"] > 0.0


def _coarse() -> tuple[object, ...]:
    """run_plan with one low resolution by default, so that trying all settings is quick."""
    from glshadow.study import plan

    # without Exact, which meets every budget
    coarse = {
        id(plan.RESOLUTIONS): (128,),
        id(plan.RUNGS): plan.RUNGS[:3],
    }
    return tuple(coarse.get(id(value), value) for value in plan.run_plan.__defaults__ or ())


def test_usage() -> None:
    assert run().exit_code == 2
    refused = run("--wrong", "200%")
    assert refused.exit_code == 2
    assert "such as 0.1% or 0.001" in refused.stderr


def test_a_budget_of_time(journal: Path) -> None:
    """No frame takes a picosecond: one line says so and names the fastest. Without any budget nothing is measured."""
    quick = run("--wrong=20%", "--ms", "1e-9", "--journal", str(journal), *PICTURE)
    assert quick.exit_code == 1
    assert "draws a frame within 1e-09 ms; the fastest is" in quick.output
    none = run(*PICTURE)
    assert none.exit_code == 2
    assert "--wrong 0.1%, --ms 20, or both" in none.output
