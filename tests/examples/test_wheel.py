"""The wheel, built from the sdist of this checkout and installed elsewhere, renders with its own copy of glsl/."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import glshadow as gs

from ..tolerances import PATIENCE_S

CHECKOUT = Path(__file__).resolve().parents[2]


def run(*command: str | Path, cwd: Path, **environment: str) -> str:
    done = subprocess.run(
        command, cwd=cwd, env=os.environ | environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    # Through the sdist, so that a file missing there is noticed; without isolation, so that no network is needed.
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, cwd=CHECKOUT)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def site(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    install = ("-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", folder, wheel)
    run(sys.executable, *install, cwd=folder)
    return folder


@pytest.mark.slow
@pytest.mark.exhaustive
def test_wheel_carries_every_shader_and_module(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    shaders = {f"glshadow/{path.relative_to(CHECKOUT)}" for path in (CHECKOUT / "glsl").rglob("*.*") if path.is_file()}
    modules = {str(path.relative_to(CHECKOUT)) for path in (CHECKOUT / "glshadow").rglob("*.py")}
    assert shaders
    assert shaders | modules | {"glshadow/py.typed"} <= names
    assert wheel.name.startswith(f"glshadow-{gs.__version__}-")
    assert not {name for name in names if name.startswith(("tests/", "scripts/", "examples/"))}


@pytest.mark.slow
@pytest.mark.exhaustive
def test_long_description_has_no_relative_links(wheel: Path) -> None:
    """The long description is the README without relative addresses: an index has none of our files."""
    archive = zipfile.ZipFile(wheel)
    (name,) = (each for each in archive.namelist() if each.endswith(".dist-info/METADATA"))
    _, _, text = archive.read(name).decode().partition("\n\n")
    readme = (CHECKOUT / "README.md").read_text()
    relative = re.findall(r"\]\((?!https?:)[^)]*\)|(?:src|href)=[\"'](?!https?:)|<!--", readme)
    assert relative
    assert re.findall(r"\]\((?!https?:)[^)]*\)|(?:src|href)=[\"'](?!https?:)|<!--", text) == []
    assert re.findall(r"^#.*|^```.*", text, re.MULTILINE) == re.findall(r"^#.*|^```.*", readme, re.MULTILINE)
    for caption in re.findall(r"!\[([^\]]*)\]", readme):
        assert f"*{caption}*" in text


@pytest.mark.slow
@pytest.mark.exhaustive
def test_installed_wheel_renders(site: Path, tmp_path: Path) -> None:
    # Before the editable checkout on the path; the working directory holds no glshadow either.
    where = run(sys.executable, "-c", "import glshadow; print(glshadow.__file__)", cwd=tmp_path, PYTHONPATH=str(site))
    assert Path(where.strip()).is_relative_to(site)
    picture = tmp_path / "out.png"
    run(
        *(sys.executable, "-m", "glshadow", "render", "-o", picture, "--size", "64x64"),
        cwd=tmp_path,
        PYTHONPATH=str(site),
    )
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("L"), dtype=float)
    assert pixels.shape == (64, 64)
    assert pixels.std() > 10  # an image with light and shadow, not one colour
