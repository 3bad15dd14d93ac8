"""Where a driver has no double, pairs of floats give the same triangles: equal to the bit, normals of slivers nearly."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.gl.driver.program import Programs
from glshadow.gl.techniques.listed import Listed

SIZE = (160, 90)
NORMALS = 2.0**-24
"""Half a unit in the last place of 1: both round a number that they represent to 2^-45, and may round to either side."""


@pytest.fixture
def without() -> Iterator[gs.Renderer]:
    with gs.Renderer("egl") as renderer:
        renderer._context.caps = replace(renderer._context.caps, doubles=False)
        yield renderer


def facets(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light) -> NDArray[np.float32]:
    """The pass's output (T, 3, 4), as the renderer reads it."""
    renderer.render(scene, lights=[light], size=SIZE, outputs=("visibility",), samples=1)
    assert renderer._cache is not None
    (source,) = (each for each in renderer._cache.techniques.values() if isinstance(each, Listed))
    assert source._facets is not None
    with renderer._context:
        return np.frombuffer(source._facets.buffer.read(), np.float32).reshape(-1, 3, 4)


@pytest.mark.usefixtures("built_on_the_gpu")
def test_double_is_not_used(without: gs.Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = []
    compute = Programs.compute

    def seen(self: Programs, name: str, **options: Any) -> Any:
        compiled.append((name, options.get("defines", {}).get("GLS_DOUBLE")))
        return compute(self, name, **options)

    monkeypatch.setattr(Programs, "compute", seen)
    facets(without, gs.scenes.courtyard(), gs.DirectionalLight())
    assert ("pass/lists.comp", 0) in compiled


def scaled(scene: gs.Scene, scale: float, offset: tuple[float, float, float]) -> gs.Scene:
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = offset
    moved = tuple(replace(node, world_from_mesh=matrix @ node.world_from_mesh) for node in scene.nodes)
    return gs.Scene(moved, name=scene.name)


SCENES = {
    "as it is": (1.0, (0.0, 0.0, 0.0)),
    "a millionth": (1e-6, (0.0, 0.0, 0.0)),
    "far away": (1.0, (1e6, -3e5, 2e6)),
    "1e-12": (1e-12, (0.0, 0.0, 0.0)),
}


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("kind", ["sun", "point"])
def test_triangles_are_the_same(without: gs.Renderer, name: str, kind: str) -> None:
    scale, offset = SCENES[name]
    scene = scaled(gs.scenes.courtyard(), scale, offset)
    place = scale * np.array([1.0, 7.0, 2.0]) + offset
    lights: dict[str, gs.Light] = {
        "sun": gs.DirectionalLight(direction=(-0.5, -0.8, 0.3)),
        "point": gs.PointLight(position=tuple(place)),
    }
    with gs.Renderer("egl") as renderer:
        theirs = facets(renderer, scene, lights[kind])
    ours = facets(without, scene, lights[kind])
    assert len(ours) == sum(len(node.mesh.triangles) for node in scene.nodes)
    np.testing.assert_array_equal(ours[..., :3], theirs[..., :3])
    np.testing.assert_allclose(ours[..., 3], theirs[..., 3], rtol=0.0, atol=NORMALS)
    assert (ours[..., 3] == theirs[..., 3]).mean() > 0.999, (
        "2^-45 against half of 2^-24: one in a million rounds otherwise"
    )


@pytest.mark.usefixtures("built_on_the_gpu")
def test_slivers_and_degenerate_triangles(without: gs.Renderer, rng: np.random.Generator) -> None:
    """Slivers down to a millionth as wide as long; points and lines have no normal."""
    ends = rng.uniform(-1.0, 1.0, (200, 2, 3))
    along = rng.uniform(0.0, 1.0, (200, 1))
    third = (
        ends[:, 0] * (1 - along) + ends[:, 1] * along + rng.normal(size=(200, 3)) * 10.0 ** rng.uniform(-6, 0, (200, 1))
    )
    corners = np.concatenate([ends, third[:, None]], axis=1)
    corners[0, 1:] = corners[0, 0]
    corners[1] = np.array([[0.0, 0.0, 0.0], [0.25, 0.5, 1.0], [0.5, 1.0, 2.0]])
    mesh = gs.Mesh(corners.reshape(-1, 3), np.arange(600).reshape(-1, 3))
    scene = gs.Scene((gs.Node(mesh, np.eye(4), "slivers"),))
    light = gs.DirectionalLight(direction=(0.1, -1.0, 0.2))
    with gs.Renderer("egl") as renderer:
        theirs = facets(renderer, scene, light)
    ours = facets(without, scene, light)
    np.testing.assert_array_equal(ours[..., :3], theirs[..., :3])
    np.testing.assert_array_equal((ours[..., 3] == 0.0).all(axis=1), (theirs[..., 3] == 0.0).all(axis=1))
    # e x f of a sliver 1e-6 wide is 1e-6 of |e| |f|, of which pairs keep 2^-44 and double 2^-52
    np.testing.assert_allclose(ours[..., 3], theirs[..., 3], rtol=0.0, atol=NORMALS + 2.0**-44 / 1e-6)


@pytest.mark.usefixtures("built_on_the_gpu")
def test_driver_without_double_is_supported(tmp_path: Path) -> None:
    """Mesa is configured to omit the extension, and to keep its OpenGL version, which it would otherwise lower to 3.3."""
    code = (
        "import glshadow as gs, numpy as np, sys\n"
        "with gs.Renderer('egl') as renderer:\n"
        "    print(renderer.info['doubles'])\n"
        f"    frame = renderer.render(gs.scenes.courtyard(), size={SIZE})\n"
        "    print(frame.used[0].filter)\n"
        "np.save(sys.argv[1], frame.visibility)\n"
    )
    seen = {}
    for name, extra in (
        ("with", {}),
        ("without", {"MESA_EXTENSION_OVERRIDE": "-GL_ARB_gpu_shader_fp64", "MESA_GL_VERSION_OVERRIDE": "4.5"}),
    ):
        path = tmp_path / f"{name}.npy"
        done = subprocess.run(
            [sys.executable, "-c", code, str(path)], env=os.environ | extra, capture_output=True, text=True, check=True
        )
        assert done.stdout.splitlines()[0] == str(name == "with")
        assert "exact" in done.stdout
        seen[name] = np.load(path)
    np.testing.assert_array_equal(seen["without"], seen["with"])
