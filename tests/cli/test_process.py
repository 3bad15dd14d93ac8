"""The command in a process of its own: streams, Ctrl-C, the terminal, and which modules it does not import."""

import json
import os
import signal
import subprocess
import sys

from ..tolerances import PATIENCE_S

SMALL = ("--size", "96x54", "--resolution", "256")
STALLED = """
import sys, time
import glshadow.renderer as renderer
from glshadow.cli import main
whole = renderer.Renderer.render
def render(*arguments, **options):
    print("ready", flush=True)
    time.sleep({seconds})
    return whole(*arguments, **options)
renderer.Renderer.render = render
main(sys.argv[1:])
"""


def run(*arguments, cwd, **options):
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        **options,
    )


def test_streams(tmp_path):
    done = run("-m", "glshadow", "render", *SMALL, "--json", cwd=tmp_path)
    assert done.returncode == 0
    assert json.loads(done.stdout)["path"] == "courtyard.png"
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["courtyard.png"]


def test_failure(tmp_path):
    done = run("-m", "glshadow", "render", "nothing.glb", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "error: nothing.glb: file not found: nothing.glb\n"
    assert run("-m", "glshadow", "render", "--size", "0x0", cwd=tmp_path).returncode == 2


def test_ctrl_c(tmp_path):
    code = STALLED.format(seconds=60)
    with subprocess.Popen(
        [sys.executable, "-c", code, "render", *SMALL],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert errors == "error: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def _on_a_terminal(cwd, seconds):
    """Standard error of a render that lasts so long, connected to a terminal."""
    mine, theirs = os.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", STALLED.format(seconds=seconds), "render", *SMALL],
        cwd=cwd, stdout=subprocess.DEVNULL, stderr=theirs, env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
    ) as process:  # fmt: skip
        os.close(theirs)
        shown = b""
        try:
            while chunk := os.read(mine, 4096):
                shown += chunk
        except OSError:  # how a terminal reports that its other end was closed
            pass
        os.close(mine)
    assert process.returncode == 0
    return shown.decode()


def test_progress_is_shown_only_for_long_renders(tmp_path):
    shown = _on_a_terminal(tmp_path, seconds=2.5)
    assert "rendering courtyard" in shown
    assert "courtyard.png: 96x54" in shown


HEAVY = {"rich", "trimesh", "scipy", "PIL", "embreex", "matplotlib", "glfw", "pyrender"}
SAY_MODULES = """
import sys
from glshadow.cli import main
try:
    main(sys.argv[1:])
finally:
    print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


def test_help_imports_no_graphics(tmp_path):
    done = run("-c", SAY_MODULES, "render", "--help", cwd=tmp_path)
    assert not (HEAVY | {"moderngl", "OpenImageIO"}) & set(done.stdout.splitlines()[-1].split())


def test_render_imports_only_what_it_needs(tmp_path, models):
    done = run("-c", SAY_MODULES, "render", str(models / "chess_board.glb"), *SMALL, cwd=tmp_path)
    assert done.returncode == 0
    # scipy computes whether each part of a mesh is closed: 0.1 s, and back faces need not be drawn
    assert not (HEAVY - {"scipy"}) & set(done.stdout.splitlines()[-1].split())
