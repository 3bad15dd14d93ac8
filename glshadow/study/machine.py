"""The machine of a study, as far as it affects times."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import Any

import numpy as np

from glshadow import __version__


def machine(info: dict[str, Any]) -> dict[str, str]:
    """Processor, driver and versions, by their names in a report.

    Parameters
    ----------
    info : dict
        As of Renderer.info.
    """
    return {
        "processor": f"{_processor()}, {os.cpu_count()} threads",
        "driver": str(info["renderer"]),
        "OpenGL": f"{info['version']}, by {info['backend']}",
        "system": f"{platform.system()} {platform.machine()}",
        "Python": f"{platform.python_version()}, numpy {np.__version__}",
        "glshadow": __version__,
    }


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
