"""Every hostile file by `load`, through the renderer, and through the command: an image, or one sentence that names the file."""

import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow import image
from glshadow.cli import main

from ..pace import at_most
from ..tolerances import PATIENCE_S
from . import mutated_files, verdict

MODELS = Path(os.environ.get("GLSHADOW_MODELS", Path(__file__).resolve().parents[3] / "shared" / "models"))
COMPANIONS = {".bin", ".mtl", ".md"}
FILES = sorted(p.name for p in (MODELS / "hostile").glob("*") if p.suffix not in COMPANIONS)
SMALL = ("--size", "48x48", "--resolution", "128")


@pytest.fixture(scope="module")
def renderer():
    with gs.Renderer() as renderer:
        yield renderer


def test_every_hostile_file_exists(models):
    assert len(FILES) > 100


@pytest.mark.parametrize("name", FILES)
def test_library_and_command_agree(models, renderer, name, tmp_path):
    path = models / "hostile" / name

    def work():
        scene = gs.load(path, look="plain")
        verdict.checked_render(renderer, scene, None, verdict.small_maps(scene.lights), (48, 48))

    out = tmp_path / "out.png"
    with at_most(10.0), np.errstate(all="warn", under="ignore"), warnings.catch_warnings():
        result = verdict.judged(work)
        done = CliRunner().invoke(main, ["render", str(path), "-o", str(out), *SMALL, "--look", "plain", "--json"])
    assert result.kind != verdict.FAIL, f"{result.cause}\n{result.detail}"
    assert "Traceback" not in done.stderr
    assert done.exception is None or isinstance(done.exception, SystemExit)
    report = json.loads(done.stdout)
    blank = result.cause.startswith("blank")
    if result.kind == verdict.REFUSED or blank:
        assert done.exit_code == 1
        assert not out.exists()
        assert done.stderr.splitlines()[-1].startswith(f"error: {name if not blank else ''}")
        assert "unexpected" not in report["error"]
    else:
        assert done.exit_code == 0, done.stderr
        assert report["covered"] > 0.0
        assert image.read(out).shape[:2] == (48, 48)
        # what to type to see more of a model is said by the command alone
        told = [each for each in report["warnings"] if "more is seen with --eye" not in each]
        assert bool(told) == (result.kind == verdict.WARNED)
        assert all(line.startswith("warning: ") for line in done.stderr.splitlines()[:-1])


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "%2e%2e/secret.bin", "/etc/hostname", "file:///etc/hostname", "http://example.org/a.bin"]
)
def test_references_that_leave_the_folder_are_refused(uri, tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    document, binary = mutated_files.box_document(plane=True)
    (tmp_path / "secret.bin").write_bytes(binary)
    document["buffers"][0]["uri"] = uri
    (folder / "out.gltf").write_text(json.dumps(document))
    done = CliRunner().invoke(main, ["render", str(folder / "out.gltf"), "-o", str(tmp_path / "x.png"), *SMALL])
    assert done.exit_code == 1
    assert "leaves the model's folder" in done.stderr
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("name", ["RecursiveNodes.gltf", "made_nan.stl"])
def test_command_survives_hostile_files(models, name, tmp_path):
    command = [sys.executable, "-m", "glshadow", "render", models / "hostile" / name, "-o", tmp_path / "x.png", *SMALL]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    refused = name == "RecursiveNodes.gltf"
    assert done.returncode == int(refused)
    assert done.stdout == ""
    assert done.stderr.startswith(f"{'error' if refused else 'warning'}: {name}")
    assert (tmp_path / "x.png").exists() != refused
