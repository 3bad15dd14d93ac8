"""Every notebook runs from top to bottom in a fresh kernel, writes nothing to stderr, and shows what it promises."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from ..pairwise import mostly
from .test_notebook import executed_notebook

NOTEBOOKS = Path(__file__).parents[2] / "examples"
OTHERS = ("bias_exercise", "depth_metrics", "soft_light", "speed_against_error", "sun_hours")


@pytest.fixture(scope="module", params=mostly(OTHERS, *OTHERS[:1], *OTHERS[2:]))
def executed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, executed_notebook(NOTEBOOKS / f"{request.param}.ipynb", folder)


def outputs_of(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    return [output for cell in notebook["cells"] for output in cell.get("outputs", [])]


def printed(notebook: dict[str, Any]) -> str:
    streams = (output["text"] for output in outputs_of(notebook) if output["output_type"] == "stream")
    return "".join("".join(text) for text in streams)


def shown(notebook: dict[str, Any], kind: str) -> list[str]:
    return ["".join(output["data"][kind]) for output in outputs_of(notebook) if kind in output.get("data", {})]


def test_notebook_shows_its_outputs(executed: tuple[str, dict[str, Any]]) -> None:
    name, notebook = executed
    assert [output for output in outputs_of(notebook) if output.get("name") == "stderr"] == []
    said, html = printed(notebook), shown(notebook, "text/html")
    if name == "bias_exercise":
        smallest = [float(each) for each in re.findall(r"landscape \d: ([\d.]+) of the depth range", said)]
        assert len(set(smallest)) == 3, "another for each landscape"
        derived = re.findall(r"derived ([\d.]+)%, ([\d.]+)%", said)
        assert len(derived) == 3
        assert all(float(acne) <= 0.05 for acne, _ in derived)
        assert sum(page.count("<figure") for page in html) >= 5
    elif name == "depth_metrics":
        wrong = dict(re.findall(r"(\w+) +\d+ different depths, wrong ([\d.]+)%", said))
        assert len(wrong) == 7
        assert float(wrong["r8"]) > float(wrong["depth32f"])
        assert sum("view 0: 512 x 512" in page for page in html) == 3
    elif name == "sun_hours":
        assert len(shown(notebook, "image/png")) == 5
        hours, possible = map(float, re.findall(r"([\d.]+) h in the mean of ([\d.]+) h", said)[0])
        share = re.search(r"whole month: (\d+)%", said)
        assert share is not None
        assert float(share[1]) == pytest.approx(100.0 * (1.0 - hours / possible), abs=0.6)
    elif name == "soft_light":
        lines = re.findall(r"^(\S[\w ]*?)  +[\d.]+ ms, off by ([\d.]+)", said, re.MULTILINE)
        found = {way: float(off) for way, off in lines}
        assert len(found) == 4
        assert found["Exact"] == min(found.values())
        assert shown(notebook, "application/vnd.jupyter.widget-view+json"), "the controls"
        assert shown(notebook, "image/png")
    else:
        assert "met: True" in said
        assert any("setting" in page for page in html)
        assert shown(notebook, "image/png")
