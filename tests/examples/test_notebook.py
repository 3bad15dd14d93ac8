"""The notebook runs from top to bottom in a fresh kernel, and its text agrees with its numbers."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from ..tolerances import PATIENCE_S

CHECKOUT = Path(__file__).resolve().parents[2]
NOTEBOOK = CHECKOUT / "examples" / "visual_check.ipynb"

# In a process of its own: the Jupyter machinery emits warnings of its own, and pytest here turns warnings into errors.
RUN = """
import json, sys
from pathlib import Path
from scripts.manual.notebooks import run
Path(sys.argv[3]).write_text(json.dumps(run(Path(sys.argv[1]), Path(sys.argv[2]))))
"""


def executed_notebook(path: Path, folder: Path) -> dict[str, Any]:
    """A notebook with its outputs, run in a folder by a fresh kernel."""
    pytest.importorskip("nbclient", reason="notebooks need nbclient and ipykernel: pip install 'glshadow[dev]'")
    result = folder / "executed.ipynb"
    command = [sys.executable, "-c", RUN, str(path), str(folder), str(result)]
    done = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return dict(json.loads(result.read_text()))


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return executed_notebook(NOTEBOOK, tmp_path_factory.mktemp("notebook"))


def _outputs(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    return [output for cell in notebook["cells"] for output in cell.get("outputs", [])]


def _printed(notebook: dict[str, Any]) -> str:
    streams = (output["text"] for output in _outputs(notebook) if output["output_type"] == "stream")
    return "".join("".join(text) for text in streams)


def test_every_image_is_shown_and_stderr_is_empty(executed: dict[str, Any]) -> None:
    outputs = _outputs(executed)
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 6
    assert [output for output in outputs if output.get("name") == "stderr"] == []


def test_the_shadows_are_right(executed: dict[str, Any]) -> None:
    score = re.search(r"wrong ([\d.]+)%", _printed(executed))
    assert score is not None
    assert float(score[1]) < 0.2  # no shadow at all: 6 %; the README's image, larger: 0.05 %


def test_blurring_the_map_is_hard_and_fringed_and_pcf_is_not(executed: dict[str, Any]) -> None:
    found = re.findall(r"(\d+) grey levels; lit ground drawn dark: ([\d.]+)%", _printed(executed))
    (hard, fringe), (soft, edge) = [(int(levels), float(share)) for levels, share in found]
    assert hard == 2
    assert soft > 10  # of 26 that 5 x 5 comparisons can give
    assert fringe > 4.0 * max(edge, 0.01)


def test_handwritten_pcf_matches_glshadow(executed: dict[str, Any]) -> None:
    difference = re.search(r"on average ([\d.]+) from", _printed(executed))
    assert difference is not None
    # nearest against bilinear taps differ in the ramp only, which is a few percent of the ground
    assert float(difference[1]) < 0.02


def test_soft_light_is_right(executed: dict[str, Any]) -> None:
    found = re.search(r"penumbra off by ([\d.]+): .*64 points of the light$", _printed(executed), re.MULTILINE)
    assert found is not None
    assert float(found[1]) < 0.02  # 64 points and 256 rays: 64^-3/4 + 256^-3/4 = 0.06 at the worst places
