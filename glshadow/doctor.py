"""Checks this machine: every backend in a process of its own, driver, limits, formats, versions."""

import importlib.metadata
import json
import os
import platform
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from glshadow import __version__
from glshadow.errors import ContextError
from glshadow.gl.driver.backends import LOADERS, BackendUnavailable
from glshadow.gl.driver.context import GLContext, open_context
from glshadow.gl.driver.entry_points import DEPTH_COMPONENT16, DEPTH_COMPONENT24, DEPTH_COMPONENT32F

DEPTH_FORMATS = {"DEPTH16": DEPTH_COMPONENT16, "DEPTH24": DEPTH_COMPONENT24, "DEPTH32F": DEPTH_COMPONENT32F}
COLOR_FORMATS = {"R32F": (1, "f4"), "R16F": (1, "f2"), "R8": (1, "f1"), "RGBA8": (4, "f1")}
PACKAGES = {  # package -> the extra that installs it, None if glshadow requires it
    "numpy": None,
    "scipy": None,
    "pillow": None,
    "moderngl": None,
    "glcontext": None,
    "trimesh": None,
    "OpenImageIO": None,
    "click": None,
    "rich": None,
    "embreex": "reference",
    "matplotlib": "study",
    "jinja2": "study",
    "glfw": "view",
    "pyrender": "pyrender",
    "ipywidgets": "notebook",
    "distributed": "dask",
    "shapely": "outline",
}

# A probe takes half a second; a broken display connection may never answer.
_TIMEOUT_S = 30.0

# 8 bits store a quarter as 64/255: half a step of the coarsest format tried.
_TOLERANCE = 0.5 / 255


def examine() -> dict[str, Any]:
    """Check everything that rendering on this machine needs.

    Returns
    -------
    dict
        Can be written as JSON. `backends[name]` has `works`; if true also `caps`, `depth_formats` and `color_formats`: format name ->
        whether a target of that format could be cleared and read back; if false `reason` and `remedy`. `devices` are EGL's: `number`,
        `name`, `works`, `driver`. `auto` is the backend that `backend="auto"` would take, or None. `packages[name]` is a version, or
        None; `missing[name]` is then the command that installs it.
    """
    backends = {name: _in_own_process(name) for name in LOADERS}
    packages = {name: _version(name) for name in PACKAGES}
    return {
        "glshadow": __version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": packages,
        "missing": {name: _pip_command(name) for name, version in packages.items() if version is None},
        "backends": backends,
        "devices": _devices() if backends["egl"]["works"] else [],
        "auto": next((name for name, report in backends.items() if report["works"]), None),
    }


def _devices() -> list[dict[str, Any]]:
    """EGL's devices in its order: the name that EGL reports, and the driver that draws on each."""
    code = "from glshadow.gl.driver import backends, egl; names = egl.load_egl(backends.EGL_LIBRARY).devices"
    names = _answer(f"import json; {code}; print(json.dumps({{'names': names}}))")
    found = []
    for number, name in enumerate(names.get("names", [])):
        report = _in_own_process(f"egl:{number}")
        driver = report["caps"]["renderer"] if report["works"] else None
        found.append({"number": number, "name": name, "works": report["works"], "driver": driver})
    return found


def examine_backend(name: str) -> dict[str, Any]:
    """Open one backend in this process and try its formats; `examine` calls this in a fresh one."""
    try:
        glcontext = open_context(name)  # type: ignore[arg-type]
    except ContextError as error:
        cause = error.__cause__
        if isinstance(cause, BackendUnavailable):
            return _failure(cause.reason, cause.remedy)
        return _failure(str(error), "")
    with glcontext:
        report = {
            "works": True,
            "caps": asdict(glcontext.caps),
            "depth_formats": {name: _works(_try_depth, glcontext, form) for name, form in DEPTH_FORMATS.items()},
            "color_formats": {name: _works(_try_color, glcontext, *form) for name, form in COLOR_FORMATS.items()},
        }
    glcontext.release()
    return report


def _in_own_process(name: str) -> dict[str, Any]:
    return _answer(
        "import json, sys; from glshadow.doctor import examine_backend as e; print(json.dumps(e(sys.argv[1])))", name
    )


def _answer(code: str, *arguments: str) -> dict[str, Any]:
    """The last line that a script prints, as JSON; or a report of why there is none."""
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)  # noqa: PTH109
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            env=os.environ | {"PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return _failure(f"the driver did not answer within {_TIMEOUT_S:.0f} s", "check DISPLAY and the OpenGL driver")
    if done.returncode < 0:
        crash = signal.Signals(-done.returncode).name
        return _failure(f"the driver crashed ({crash})", "reinstall or update the OpenGL driver")
    lines = done.stdout.splitlines()
    if done.returncode or not lines:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return _failure(last, "reinstall glshadow and its dependencies")
    # The driver may print warnings first.
    report: dict[str, Any] = json.loads(lines[-1])
    return report


def _failure(reason: str, remedy: str) -> dict[str, Any]:
    return {"works": False, "reason": reason, "remedy": remedy}


def _works(attempt: Callable[..., float], glcontext: GLContext, *form: Any) -> bool:
    """Whether a target of the format returns the value that it was cleared to, a quarter."""
    try:
        value = attempt(glcontext, *form)
    except Exception:  # moderngl.Error for an incomplete framebuffer; any error means that the format does not work
        glcontext.gl.errors()
        return False
    return not glcontext.gl.errors() and abs(value - 0.25) <= _TOLERANCE


def _try_depth(glcontext: GLContext, internal_format: int) -> float:
    texture = glcontext.ctx.depth_texture((4, 4))
    glcontext.gl.specify_depth(texture.glo, (4, 4), internal_format)
    if glcontext.gl.texture_format(texture.glo)[2] != internal_format:
        return -1.0
    glcontext.ctx.framebuffer(depth_attachment=texture).clear(depth=0.25)
    return float(memoryview(texture.read()).cast("f")[0])


def _try_color(glcontext: GLContext, components: int, dtype: str) -> float:
    texture = glcontext.ctx.texture((4, 4), components, dtype=dtype)
    framebuffer = glcontext.ctx.framebuffer([texture])
    framebuffer.clear(0.25, 0.25, 0.25, 0.25)
    return float(memoryview(framebuffer.read(components=1, dtype="f4")).cast("f")[0])


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _pip_command(package: str) -> str:
    extra = PACKAGES[package]
    return f"pip install 'glshadow[{extra}]'" if extra else f"pip install {package}"
