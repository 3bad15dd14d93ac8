"""One renderer for the whole folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from glshadow.renderer import Renderer


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    with Renderer("egl") as renderer:
        yield renderer
