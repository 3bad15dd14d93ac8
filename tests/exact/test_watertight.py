"""No ray slips between two triangles, and no pixel under a closed sheet is lit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.view import Kind
from glshadow.gl.context import GLContext
from glshadow.gl.program import Programs
from glshadow.scene import shapes
from glshadow.scene.shapes import Solid

from .fans import KINDS, MOST, fans_of, rays_at, slipped

RAYS = 200_000  # per mesh and light; scripts/bench watertight asks ten millions of each light


@pytest.fixture(scope="module")
def programs(session_glcontext: GLContext) -> Iterator[Programs]:
    programs = Programs(session_glcontext)
    yield programs
    with session_glcontext:
        programs.release()


MESHES: dict[str, Callable[[], Solid]] = {
    "sphere": lambda: shapes.icosphere(5, 1.0),
    "torus": lambda: shapes.torus(1.0, 0.3, 192, 96),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", [*MESHES, "brain"])
def test_no_ray_slips_between_triangles(
    glcontext: GLContext, programs: Programs, request: pytest.FixtureRequest, rng: np.random.Generator, name: str, kind: Kind
) -> None:
    solid = MESHES[name]() if name in MESHES else brain(request.getfixturevalue("models"))
    fans = fans_of(solid, kind, rng)
    assert len(fans.edges) > 1000
    assert ((fans.around >= 0).sum(axis=1) <= MOST).all()
    ours, control = slipped(glcontext, programs, fans, rays_at(fans, RAYS, rng))
    assert ours == 0
    # Rounded triple products let a few in a thousand slip: the rays are aimed well.
    assert control > RAYS // 2000


def brain(models: Path) -> Solid:
    mesh = gs.load(models / "brain_cortex.ply").nodes[0].mesh
    return mesh.positions, mesh.triangles
