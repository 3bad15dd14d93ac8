"""The command with failing streams, full disks and odd names: one sentence and an exit code, never a traceback."""

import os
import resource
import subprocess
import sys

import pytest

from glshadow import image

from ..tolerances import PATIENCE_S

SMALL = ("--size", "32x24", "--resolution", "32")
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "tri.obj").write_text(TRIANGLE)
    return tmp_path


def start(folder, *arguments, **options):
    command = [sys.executable, "-m", "glshadow", "render", *arguments]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, **options)


def ended(process):
    """Exit code and standard error, which must be neither a traceback nor a request to report a bug."""
    said = process.stderr.read().decode()
    process.stderr.close()
    code = process.wait(timeout=PATIENCE_S)
    assert "Traceback" not in said
    assert "Exception ignored" not in said
    assert "unexpected" not in said
    return code, said


def test_closed_pipe_ends_the_report(folder):
    process = start(folder, "tri.obj", *SMALL, "--json", stdout=subprocess.PIPE)
    process.stdout.close()
    code, said = ended(process)
    assert code == 1
    assert "error" not in said
    assert (folder / "tri.png").exists()


def test_full_disk_fails_the_report(folder):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        code, said = ended(start(folder, "tri.obj", *SMALL, "--json", stdout=full))
    assert code == 1
    assert said.endswith("error: cannot read or write the output: No space left on device\n")


def test_closed_streams_are_no_error(folder):
    def close():
        os.close(1)
        os.close(2)

    command = [sys.executable, "-m", "glshadow", "render", "tri.obj", *SMALL, "--json"]
    assert subprocess.run(command, cwd=folder, preexec_fn=close, timeout=PATIENCE_S, check=False).returncode == 0
    assert (folder / "tri.png").exists()


@pytest.mark.parametrize("limit_bytes", [4096, 5, 0])
@pytest.mark.parametrize("ending", [".png", ".jpg", ".tif", ".exr"])
def test_full_disk_leaves_no_partial_image(tmp_path, ending, limit_bytes):
    """A child process with a limit on the size of files: its writes fail as on a full disk."""
    code = f"import numpy as np, sys; sys.path[:] = {sys.path!r}\nfrom glshadow import image, GlshadowError\n" + (
        "pixels = np.random.default_rng(0).integers(0, 256, (200, 200, 3)).astype(np.uint8)\n"
        f"try: image.write('x{ending}', pixels)\n"
        "except GlshadowError as error: print(error)\n"
    )

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))

    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        cwd=tmp_path,
        preexec_fn=limit,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"x{ending} cannot be written: File too large\n", (
        "the system's own word, and no temporary name"
    )
    assert list(tmp_path.iterdir()) == []


def test_page_of_a_model_with_a_non_utf8_name(folder):
    model = os.fsencode(folder) + b"/b\xfc<\x1b[1m.obj"
    os.rename(folder / "tri.obj", model)  # noqa: PTH104
    command = [sys.executable, "-m", "glshadow", "export", model, "-o", "page"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert r"<title>b\udcfc&lt;\x1b[1m</title>" in (folder / "page/index.html").read_text(encoding="utf-8")


def test_non_utf8_names_are_supported(folder):
    model, picture = os.fsencode(folder) + b"/b\xfcste.obj", os.fsencode(folder) + b"/b\xfcste.png"
    os.rename(folder / "tri.obj", model)  # noqa: PTH104
    code, _ = ended(start(folder, model, *SMALL, "-o", picture))
    assert code == 0
    assert image.read(os.fsdecode(picture)).shape == (24, 32, 4)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("-o", "x" * 300 + ".png"), "its names from 1 to 255 bytes long"),
        (("--eye", "1e300,0,0"), "position must be 3 finite numbers, each in [-1e+20, 1e+20]"),
        (("--fov", "1e-300"), "fov_y must be a finite number in [1e-06, 180) degrees"),
        (("--far", "1e300"), "far must be a finite number in [1e-20, 1e+20]"),
        (("--light", "point:1e300,0,0"), "position must be 3 finite numbers, each in [-1e+20, 1e+20]"),
        (("--light", "point:0,0,1:far=1e300"), "far must be a finite number in [1e-20, 1e+20]"),
    ],
)
def test_values_beyond_the_limits_are_refused(folder, arguments, words):
    code, said = ended(start(folder, "tri.obj", *SMALL, *arguments))
    assert code == 2
    assert words in said
    assert "Warning:" not in said
