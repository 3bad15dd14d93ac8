"""Notebooks are stored with the outputs of their present cells, which a viewer without a kernel can show."""

from __future__ import annotations

import base64
import copy
import importlib
import io
import json
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from PIL import Image

CHECKOUT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((CHECKOUT / "examples").glob("*.ipynb"))
ALL_TOGETHER, WIDEST = 2_000_000, 2000  # bytes; pixels
STATIC = {"text/plain", "text/html", "image/png", "image/jpeg", "image/svg+xml"}
IMAGE = re.compile(r"data:image/(?:png|jpeg|svg\+xml);base64,([\w+/=]+)")
MACHINE = re.compile(r"(?<![\w.:/])/(?:home|root|tmp|usr|var|opt|work|Users|mnt|private)/|[A-Z]:\\\\|\bfile://")


@pytest.fixture
def notebooks(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT)
    return importlib.import_module("scripts.manual.notebooks")


def faults(notebook: dict[str, Any], of: str) -> list[str]:
    """What is wrong with the outputs of a stored notebook; `of`: hash of its code."""
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    outputs = [output for cell in code for output in cell["outputs"]]
    words = [json.dumps(cell.get("metadata", {})) + "".join(cell["source"]) for cell in notebook["cells"]]
    found, images = [], 0
    if notebook["metadata"].get("glshadow", {}).get("outputs_of") != of:
        found.append("the code has changed since")
    if [cell["execution_count"] for cell in code] != list(range(1, len(code) + 1)):
        found.append("cells were not run in order")
    for output in outputs:
        data = output.get("data", {})
        if output["output_type"] == "error" or output.get("name") == "stderr":
            found.append("an error or a warning")
        if not set(data) <= STATIC:
            found.append(f"needs a kernel: {sorted(set(data) - STATIC)}")
        html = "".join(data.get("text/html", ""))
        embedded = [
            *IMAGE.findall(html),
            *("".join(data[kind]) for kind in data if kind in ("image/png", "image/jpeg")),
        ]
        images += len(embedded)
        found += [f"an image of {size}" for size in map(size_of, embedded) if max(size) > WIDEST]
        words += ["".join(output.get("text", "")), IMAGE.sub("", html), "".join(data.get("text/plain", ""))]
    if images == 0:
        found.append("no image")
    return found + [f"a path of one machine: {word[:80]}" for word in words if MACHINE.search(word)]


def size_of(data: str) -> tuple[int, int]:
    return Image.open(io.BytesIO(base64.b64decode(data))).size


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_there_and_of_the_present_cells(path: Path, notebooks: ModuleType) -> None:
    notebook = json.loads(path.read_text(encoding="utf-8"))
    assert faults(notebook, notebooks.sources(notebook)) == [], f"scripts/notebooks {path.stem} runs it anew"


def test_they_are_small() -> None:
    assert len(NOTEBOOKS) >= 5
    assert sum(path.stat().st_size for path in NOTEBOOKS) < ALL_TOGETHER


def break_code(notebook: dict[str, Any]) -> None:
    next(cell for cell in notebook["cells"] if cell["cell_type"] == "code")["source"].append("# another line")


def break_order(notebook: dict[str, Any]) -> None:
    [cell for cell in notebook["cells"] if cell["cell_type"] == "code"][1]["execution_count"] = 7


def break_outputs(notebook: dict[str, Any]) -> None:
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            cell["outputs"] = []


def add(output: dict[str, Any]) -> Callable[[dict[str, Any]], None]:
    def added(notebook: dict[str, Any]) -> None:
        next(cell for cell in notebook["cells"] if cell["cell_type"] == "code")["outputs"].append(output)

    return added


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (break_code, "the code has changed since"),
        (break_order, "cells were not run in order"),
        (break_outputs, "no image"),
        (add({"output_type": "error", "ename": "E", "evalue": "", "traceback": []}), "an error or a warning"),
        (add({"output_type": "stream", "name": "stderr", "text": ["x"]}), "an error or a warning"),
        (
            add({"output_type": "stream", "name": "stdout", "text": ["in /tmp/x.py"]}),
            "a path of one machine: in /tmp/x.py",
        ),
        (
            add({"output_type": "display_data", "data": {"application/vnd.jupyter.widget-view+json": {}}}),
            "needs a kernel: ['application/vnd.jupyter.widget-view+json']",
        ),
    ],
    ids=["code", "order", "no outputs", "error", "stderr", "path", "widget"],
)
def test_a_notebook_that_is_not_so_is_found(
    change: Callable[[dict[str, Any]], None], says: str, notebooks: ModuleType
) -> None:
    notebook = copy.deepcopy(json.loads(NOTEBOOKS[0].read_text(encoding="utf-8")))
    change(notebook)
    assert says in faults(notebook, notebooks.sources(notebook))


def test_a_widget_becomes_the_image_that_it_holds_and_a_bar_goes(notebooks: ModuleType) -> None:
    file = io.BytesIO()
    Image.new("RGB", (8, 4), (200, 10, 10)).save(file, format="png")
    state = {
        "box": {"model_name": "VBoxModel", "state": {"children": ["IPY_MODEL_bar", "IPY_MODEL_image"]}},
        "bar": {"model_name": "IntProgressModel", "state": {}},
        "image": {
            "model_name": "ImageModel",
            "state": {"format": "png"},
            "buffers": [{"data": base64.b64encode(file.getvalue()).decode(), "encoding": "base64", "path": ["value"]}],
        },
    }
    views = [
        {"output_type": "display_data", "data": {notebooks.WIDGET: {"model_id": name}, "text/plain": [name]}}
        for name in ("box", "bar")
    ]
    notebook = {
        "cells": [{"cell_type": "code", "source": ["x"], "metadata": {"execution": {}}, "outputs": views}],
        "metadata": {"widgets": {"application/vnd.jupyter.widget-state+json": {"state": state}}},
    }
    kept = notebooks.static(notebook)
    (output,) = kept["cells"][0]["outputs"]
    assert size_of(output["data"]["image/png"]) == (8, 4)
    assert set(output["data"]) == {"image/png", "text/plain"}
    assert set(kept["metadata"]) == {"glshadow", "kernelspec", "language_info"}
