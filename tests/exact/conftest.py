"""One renderer for the whole folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from glshadow.renderer import Renderer


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    with Renderer("egl") as renderer:
        yield renderer


@pytest.fixture
def built_on_the_gpu(renderer: Renderer) -> None:
    """For tests of what only compute passes do; `MESA_GL_VERSION_OVERRIDE=3.3` or 4.1 runs the others without them."""
    if not renderer.info["compute"]:
        pytest.skip("is about lists that a compute pass builds: OpenGL 4.3")
