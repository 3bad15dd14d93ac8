"""Fixtures of the exact filter's tests."""

from __future__ import annotations

import pytest

from glshadow.renderer import Renderer


@pytest.fixture
def built_on_the_gpu(renderer: Renderer) -> None:
    """For tests of what only compute passes do; `MESA_GL_VERSION_OVERRIDE=3.3` or 4.1 runs the others without them."""
    if not renderer.info["compute"]:
        pytest.skip("is about lists that a compute pass builds: OpenGL 4.3")
