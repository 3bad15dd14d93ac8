"""Killed processes leave no partial file, and the next process removes what SIGKILL leaves."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from glshadow import files, image

from ..tolerances import PATIENCE_S

PIXELS = np.zeros((32, 32, 3), dtype=np.uint8)
SMALL = ("--size", "96x54", "--resolution", "256")

# The command, stopped at the worst moment: half of the image is written.
HALF_WRITTEN = """
import sys, time
from glshadow import image
whole = image._write_file
def half(path, *rest):
    path.write_bytes(b"half")
    print("ready", flush=True)
    time.sleep(900)
    whole(path, *rest)
image._write_file = half
from glshadow.cli import main
main(sys.argv[1:])
"""
HALF_READ = """
import time
from contextlib import contextmanager
from glshadow import image
whole = image.temporary
@contextmanager
def half(suffix):
    with whole(suffix) as path:
        path.write_bytes(b"half")
        print("ready", flush=True)
        time.sleep(900)
        yield path
image.temporary = half
image.read(open("picture.png", "rb").read())
"""


def hidden(folder):
    return sorted(path.name for path in folder.iterdir() if path.name.startswith("."))


def killed(tmp_path, code, number, *arguments):
    """Standard error of a child that is killed once it is ready, and its exit status."""
    command = [sys.executable, "-c", code, *arguments]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        _, errors = process.communicate(timeout=PATIENCE_S)
    return process.returncode, errors


def test_terminated_command_cleans_up(tmp_path):
    code, errors = killed(tmp_path, HALF_WRITTEN, signal.SIGTERM, "render", *SMALL)
    assert (code, errors) == (143, "error: terminated\n")
    assert list(tmp_path.iterdir()) == []


def test_next_command_cleans_up_after_a_killed_one(tmp_path):
    (tmp_path / "courtyard.png").write_bytes(b"the one before")
    code, _ = killed(tmp_path, HALF_WRITTEN, signal.SIGKILL, "render", *SMALL)
    assert code == -signal.SIGKILL
    assert len(hidden(tmp_path)) == 1  # otherwise nothing would be tested
    assert (tmp_path / "courtyard.png").read_bytes() == b"the one before"
    image.write(tmp_path / "another.png", PIXELS)
    assert hidden(tmp_path) == []


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_next_load_cleans_up_after_a_killed_one(tmp_path, monkeypatch, number):
    image.write(tmp_path / "picture.png", PIXELS)
    code, _ = killed(tmp_path, HALF_READ, number)
    assert code == -number
    assert len(hidden(tmp_path)) == 1
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    files._swept.discard(tmp_path)
    assert image.read((tmp_path / "picture.png").read_bytes()).shape == (32, 32, 4)
    assert hidden(tmp_path) == []


def test_files_of_running_processes_and_of_others_stay(tmp_path):
    machine = files._MACHINE
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(900)"]) as other:
        stay = [f".glshadow-{machine}-{other.pid}-0.png", ".glshadow-0badcafe-1-0.png", ".glshadow.png", ".other"]
        for name in stay:
            (tmp_path / name).touch()
        image.write(tmp_path / "picture.png", PIXELS)
        assert hidden(tmp_path) == sorted(stay)
        other.kill()
    files._swept.discard(tmp_path)
    image.write(tmp_path / "picture.png", PIXELS)
    assert hidden(tmp_path) == sorted(stay[1:])


def test_error_leaves_no_temporary_file(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("before")

    def fail():
        with files.replacing(target) as part:
            part.write_text("half")
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert target.read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.slow
@pytest.mark.exhaustive
def test_commands_killed_at_any_time_leave_no_partial_image(tmp_path):
    """SIGTERM and SIGKILL in turn, at times spread over the command's run: the image is complete or absent."""
    command = [sys.executable, "-m", "glshadow", "render", *SMALL, "-o", "a.png"]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    start = time.monotonic()
    subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=True)
    seconds = time.monotonic() - start
    whole = (tmp_path / "a.png").read_bytes()
    for turn in range(8):
        (tmp_path / "a.png").unlink(missing_ok=True)
        with subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE) as process:
            time.sleep(seconds * (0.3 + 0.7 * turn / 7))
            process.send_signal(signal.SIGKILL if turn % 2 else signal.SIGTERM)
            process.communicate(timeout=PATIENCE_S)
        assert process.returncode in (0, 143, -signal.SIGTERM, -signal.SIGKILL)
        if (tmp_path / "a.png").exists():
            assert (tmp_path / "a.png").read_bytes() == whole
        if not turn % 2:
            assert hidden(tmp_path) == []
        files._swept.discard(tmp_path)
        image.write(tmp_path / "b.png", PIXELS)
        assert hidden(tmp_path) == []
