"""No ray slips between two triangles, and no pixel under a closed sheet is lit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Programs
from glshadow.renderer import Renderer
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid

from ..pairwise import mostly
from .compare import with_exact
from .fans import KINDS, MOST, closed_box, fans_of, rays_at, rays_on_seams, slipped
from .sheets import ELEVATIONS, PLANE_TRIANGLES, lit_and_asked, tessellations, under_a_sheet

RAYS = 200_000  # per mesh and light; scripts/bench watertight tests ten million per light


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


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", [*MESHES, "brain"])
def test_no_ray_slips_between_triangles(
    glcontext: GLContext,
    programs: Programs,
    request: pytest.FixtureRequest,
    rng: np.random.Generator,
    name: str,
    kind: str,
) -> None:
    solid = MESHES[name]() if name in MESHES else brain(request.getfixturevalue("models"))
    fans = fans_of(solid, kind, rng)
    assert len(fans.edges) > 1000
    assert ((fans.around >= 0).sum(axis=1) <= MOST).all()
    ours, control = slipped(glcontext, programs, fans, rays_at(fans, RAYS, rng))
    assert ours == 0
    # Rounded triple products let a few in a thousand slip: the rays are aimed well.
    assert control > RAYS // 2000


@pytest.mark.usefixtures("built_on_the_gpu")
def test_no_ray_slips_between_a_point_lights_faces(
    glcontext: GLContext, programs: Programs, rng: np.random.Generator
) -> None:
    """At a face's border rounding gives the cell after its last one."""
    for _ in range(5):
        ours, _ = slipped(glcontext, programs, closed_box(rng), rays_on_seams(RAYS, rng))
        assert ours == 0


def brain(models: Path) -> Solid:
    mesh = gs.load(models / "brain_cortex.ply").nodes[0].mesh
    return mesh.positions, mesh.triangles


@pytest.mark.parametrize("cells", [40, 300])
def test_nothing_is_lit_under_a_sheet(renderer: Renderer, rng: np.random.Generator, cells: int) -> None:
    scene, lights = under_a_sheet(cells, rng)
    for name, light in lights.items():
        lit, tested = lit_and_asked(renderer, scene, with_exact(light), PLANE_TRIANGLES)
        assert tested > 100_000
        assert lit == 0, f"{name}: {lit} leaks of {tested}"
        control, _ = lit_and_asked(renderer, scene, replace(light, shadow=None), PLANE_TRIANGLES)
        assert control == tested, f"{name}: without a shadow all of the plane is lit"


@pytest.mark.parametrize("offset", mostly([0.0, 1000.0], 0.0))
@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_tessellations_of_one_plane_do_not_shadow_each_other(
    renderer: Renderer, rng: np.random.Generator, elevation: float, offset: float
) -> None:
    scene, lights = tessellations(elevation, offset, rng)
    for name, light in lights.items():
        lit, tested = lit_and_asked(renderer, scene, with_exact(light), 1 << 30)
        assert tested > 100_000
        assert lit == tested, f"{name}: acne in {tested - lit} of {tested} pixels"
