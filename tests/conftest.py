"""Fixtures for all tests: one OpenGL context per process, a seeded generator, the models, and no silent skip."""

import itertools
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from shutil import which
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.driver.context import GLContext, open_context

CHECKOUT = Path(__file__).resolve().parents[1]
IN_CI = os.environ.get("CI") == "true"
REQUIRE_GL = os.environ.get("GLSHADOW_REQUIRE_GL") == "1"

# Skips whose message starts with this stay skips outside CI: the program is not available on every system.
OPTIONAL = "optional: "

_displays = itertools.count()


def pytest_configure() -> None:
    # A shell starts a job in the background with SIGINT ignored, and whatever that starts inherits it: Ctrl-C tests would hang.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run slow modules first, so that the last one to start is a short one."""
    long = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in long)


_left_out: set[str] = set()


def pytest_deselected(items: list[pytest.Item]) -> None:
    _left_out.update(item.nodeid for item in items if item.get_closest_marker("exhaustive"))


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):  # of pytest-xdist
        session.config.workeroutput["left_out"] = sorted(_left_out)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    _left_out.update(getattr(node, "workeroutput", {}).get("left_out", ()))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    if _left_out:
        terminalreporter.write_line(f"{len(_left_out)} exhaustive tests were left out: scripts/test --all runs them")


def _skip_is_failure(report: Any) -> bool:
    if not (REQUIRE_GL and report.skipped) or hasattr(report, "wasxfail"):
        return False
    return OPTIONAL not in str(report.longrepr)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    report = yield
    if _skip_is_failure(report):
        report.outcome = "failed"
        report.longrepr = f"skipped, and GLSHADOW_REQUIRE_GL=1 makes that a failure: {report.longrepr}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Iterator[None]:
    report = yield
    if _skip_is_failure(report):
        report.outcome = "failed"
        report.longrepr = f"skipped, and GLSHADOW_REQUIRE_GL=1 makes that a failure: {report.longrepr}"
    return report


@pytest.fixture(autouse=True)
def numpy_errors_raise() -> Iterator[None]:
    # Underflow to zero is correct everywhere here: a tiny weight, a tiny cosine.
    with np.errstate(all="raise", under="ignore"):
        yield


@pytest.fixture(scope="session")
def renderer() -> Iterator[gs.Renderer]:
    """One for all tests of a process: programs are compiled once, and each test sees what the ones before have left."""
    with gs.Renderer("egl") as renderer:
        yield renderer


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260101)


@pytest.fixture(scope="session")
def optional() -> Callable[[str, str], None]:
    """Call `optional("OSMesa", "libosmesa6")` where a program is missing: fails in CI, otherwise skips and names the package."""

    def missing(what: str, package: str) -> None:
        message = f"{what} is missing (apt-get install {package})"
        if IN_CI:
            pytest.fail(message)
        pytest.skip(OPTIONAL + message)

    return missing


@pytest.fixture(scope="session")
def models() -> Path:
    """Folder of the shared models; without it the test fails in CI and is skipped elsewhere."""
    folder = Path(os.environ.get("GLSHADOW_MODELS", CHECKOUT.parent / "shared" / "models"))
    if not folder.is_dir():
        message = f"no models in {folder}; set GLSHADOW_MODELS to their folder"
        if IN_CI:
            pytest.fail(message)
        pytest.skip(OPTIONAL + message)
    return folder


@pytest.fixture(scope="session")
def session_glcontext() -> Iterator[GLContext]:
    """The one context of this process; tests use `glcontext`, which checks it for errors."""
    context = open_context("egl")
    yield context
    context.release()


@pytest.fixture
def glcontext(session_glcontext: GLContext) -> Iterator[GLContext]:
    """The shared context, current, without an OpenGL error before and after the test."""
    with session_glcontext as context:
        assert context.gl.errors() == [], "an earlier test left OpenGL errors behind"
        yield context
        assert context.gl.errors() == [], "the test left OpenGL errors behind"


@pytest.fixture(scope="session")
def headless() -> dict[str, str]:
    """This process's environment without a screen."""
    return {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}


@pytest.fixture
def screen(optional: Callable[[str, str], None]) -> Iterator[str]:
    """A display of its own, 1280 x 800, with programs that press its keys."""
    for program, package in (("Xvfb", "xvfb"), ("xdotool", "xdotool")):
        if not which(program):
            optional(program, package)
    read_end, write_end = os.pipe()
    # A new number for each server: a server that ends deletes the socket of the next one with its number.
    number = 100 + 100 * (os.getpid() % 500) + next(_displays)
    command = ["Xvfb", f":{number}", "-displayfd", str(write_end), "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=[write_end], stderr=subprocess.DEVNULL) as server:
        os.close(write_end)
        with os.fdopen(read_end) as told:
            display = f":{told.readline().strip()}"
        yield display
        server.terminate()
