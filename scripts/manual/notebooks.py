"""The notebooks of examples/, run anew and kept with their outputs, so that a viewer without a kernel shows them."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import click

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
WIDGET = "application/vnd.jupyter.widget-view+json"
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}
SECONDS = 300  # for one cell


def sources(notebook: dict[str, Any]) -> str:
    """Hash of the code: outputs that are stored with another one are not of these cells."""
    code = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    return hashlib.sha256("\0".join(code).encode()).hexdigest()[:16]


def run(path: Path, folder: Path) -> dict[str, Any]:
    """Run a notebook in a folder, by a fresh kernel; returns it with its outputs.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell fails.
    """
    # A grammar of addresses that jsonschema would compile for 5 s wherever jupyter_server brought it.
    sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=SECONDS, kernel_name="python3", record_timing=False).execute(cwd=str(folder))
    return dict(json.loads(nbformat.writes(notebook)))


def static(notebook: dict[str, Any]) -> dict[str, Any]:
    """What a viewer without a kernel can show: widgets become the image that they hold, or go; one format for each image."""
    widgets = notebook["metadata"].pop("widgets", {})
    state = next(iter(widgets.values()), {}).get("state", {})
    for cell in notebook["cells"]:
        cell["metadata"] = {}
        if cell["cell_type"] == "code":
            cell["outputs"] = _merged([_static(each, state) for each in cell["outputs"] if _stays(each, state)])
    notebook["metadata"] = {
        "glshadow": {"outputs_of": sources(notebook)},
        "kernelspec": KERNEL,
        "language_info": {"name": "python"},
    }
    return notebook


def _stays(output: dict[str, Any], state: dict[str, Any]) -> bool:
    """Progress bars do not, which hold no image."""
    view = output.get("data", {}).get(WIDGET)
    return view is None or _image(view["model_id"], state) is not None


def _static(output: dict[str, Any], state: dict[str, Any]) -> dict[str, Any]:
    data = output.get("data")
    if data is None:
        return output
    if view := data.pop(WIDGET, None):
        data["image/png"] = _image(view["model_id"], state)
    if "image/png" in data:
        data.pop("image/jpeg", None)
        data["image/png"] = _small(data["image/png"])
    return output


def _image(name: str, state: dict[str, Any]) -> str | None:
    """Base64 of the first PNG in a widget or what it holds."""
    model = state.get(name, {})
    if model.get("model_name") == "ImageModel":
        return str(model["buffers"][0]["data"])
    for child in model.get("state", {}).get("children", ()):
        if found := _image(child.removeprefix("IPY_MODEL_"), state):
            return found
    return None


def _small(data: str) -> str:
    """The same pixels, compressed as far as PNG goes."""
    from PIL import Image

    file = io.BytesIO()
    Image.open(io.BytesIO(base64.b64decode(data))).save(file, format="png", optimize=True)
    return base64.b64encode(file.getvalue()).decode() + "\n"


def _merged(outputs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Printed lines that follow each other in one output: where a stream is cut is chance."""
    merged: list[dict[str, Any]] = []
    for each in outputs:
        if merged and each.get("name") is not None and each.get("name") == merged[-1].get("name"):
            merged[-1]["text"] = [*merged[-1]["text"], *each["text"]]
        else:
            merged.append(each)
    return merged


@click.command()
@click.argument("names", nargs=-1)
def main(names: tuple[str, ...]) -> None:
    """Run the notebooks NAMES of examples/, or all, and keep them with what they show."""
    known = {path.stem: path for path in sorted(EXAMPLES.glob("*.ipynb"))}
    if unknown := set(names) - set(known):
        raise click.UsageError(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    for name in names or known:
        click.echo(f"glshadow: {name}", err=True)
        with tempfile.TemporaryDirectory() as folder:
            notebook = static(run(known[name], Path(folder)))
        known[name].write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
