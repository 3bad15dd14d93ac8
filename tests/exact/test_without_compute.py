"""Exact() on OpenGL 3.3 to 4.2: triangle lists built on the CPU give the image of those built on the GPU."""

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
from glshadow.core.spaces import Array, translation
from glshadow.derive.lists import RATIO, ListGrid
from glshadow.gl.techniques import Listed, Technique, Uploaded, uploaded
from glshadow.lights import Light
from glshadow.reference.points import count_points
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.view import FACES

from ..cell_lists import Walked, held, walked
from ..unit.test_cells import scattered
from .compare import WRONG, compared, shone, with_exact
from .sheets import PLANE_TRIANGLES, lit_and_asked, under_a_sheet
from .test_casters import LIGHTS, ground, leaf, leaves, placed, scene_of
from .test_exactness import COURTYARD
from .test_soft_closed_forms import CASES, HALF, HEIGHT, camera_of
from .test_soft_closed_forms import SIZE as DISC_SIZE
from .test_soft_closed_forms import scene_of as floor_under
from .test_without_double import NORMALS

SIZE = (320, 180)


@pytest.fixture(scope="module")
def older() -> Iterator[Renderer]:
    """A driver of OpenGL 3.3 without extensions: its GLSL has no `precise`."""
    with Renderer("egl") as renderer:
        renderer._context.caps = replace(
            renderer._context.caps, compute=False, max_storage_block=0, texture_gather=False, version_code=330
        )
        yield renderer


def technique_of(renderer: Renderer, kind: type[Technique]) -> Any:
    """How the last frame's first light was computed."""
    assert renderer._cache is not None
    return renderer._cache.techniques[0, kind.__name__]


# -- images


def casters() -> Scene:
    """Cut-out leaves, a mirrored closed mesh, and one triangle larger than everything else."""
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    vast = Mesh(np.array([[-900.0, -2.0, -900.0], [900.0, -2.0, -900.0], [0.0, -2.0, 900.0]]), np.array([[0, 2, 1]]))
    return scene_of(
        Node(leaf(leaves(), 3.7), placed(-1.0, 1.0, 0.0, 1), "leaf"),
        Node(Mesh(*shapes.torus(0.6, 0.2, 48, 24)), placed(0.8, 0.9, 0.1, 2) @ mirror, "torus"),
        Node(vast, np.eye(4), "vast"),
    )


def moved(scene: Scene, scale: float, offset: tuple[float, float, float]) -> Scene:
    matrix = translation(offset) @ np.diag([scale, scale, scale, 1.0])
    nodes = tuple(replace(node, world_from_mesh=matrix @ node.world_from_mesh) for node in scene.nodes)
    camera = scene.camera
    assert isinstance(camera, gs.PerspectiveCamera)
    places = {
        name: tuple((scale * np.array(getattr(camera, name)) + offset).tolist()) for name in ("position", "target")
    }
    return replace(scene, nodes=nodes, camera=replace(camera, **places))


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("which", ["courtyard", "casters"])
def test_image_equals_that_of_lists_built_on_the_gpu(renderer: Renderer, older: Renderer, which: str) -> None:
    names = ("sun", "low sun", "wide spot", "point light near a column")  # slow scene: not all
    courtyard = {name: COURTYARD[name] for name in names}
    scene, lights = (gs.scenes.courtyard(), courtyard) if which == "courtyard" else (casters(), LIGHTS)
    for name, light in lights.items():
        frames = [
            each.render(scene, None, [light], SIZE, outputs=("visibility",), samples=1) for each in (renderer, older)
        ]  # everything that no setting changes is exact in both
        np.testing.assert_array_equal(*(frame.visibility for frame in frames), err_msg=name)
        theirs, ours = (frame.used[0] for frame in frames)
        assert ours.filter == gs.Exact()
        assert ours.fallbacks == ()
        assert "built on the CPU: building them on the GPU needs OpenGL 4.3" in ours.why
        assert ours.why.endswith("has 3.3")
        # both use their own rule for large triangles, and their counts differ little
        assert abs(ours.links / theirs.links - 1.0) < 0.1, name


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize(("scale", "offset"), [(1e-6, (0.0, 0.0, 0.0)), (1.0, (1e7, -3e6, 2e7))])
def test_image_is_invariant_to_scale_and_translation(
    renderer: Renderer, older: Renderer, scale: float, offset: tuple[float, float, float]
) -> None:
    scene = moved(casters(), scale, offset)
    position = tuple((scale * np.array([0.3, 2.6, 0.2]) + offset).tolist())
    for light in (LIGHTS["sun"], gs.PointLight(position=position)):
        theirs, ours = (
            each.render(scene, None, [light], SIZE, outputs=("visibility",), samples=1).visibility
            for each in (renderer, older)
        )
        np.testing.assert_array_equal(ours, theirs)
        assert (ours == 0.0).sum() > 1000


@pytest.mark.parametrize("name", ["sun", "wide spot", "point light near a column"])
def test_images_match_rays(older: Renderer, name: str) -> None:
    result = compared(older, gs.scenes.courtyard(), COURTYARD[name], size=SIZE)
    assert result.wrong.sum() <= WRONG, str(result)
    assert 0.2 < result.lit < 0.99


@pytest.mark.parametrize("cells", [40, 200])
def test_nothing_is_lit_under_a_sheet(older: Renderer, rng: np.random.Generator, cells: int) -> None:
    scene, lights = under_a_sheet(cells, rng)
    for name, light in lights.items():
        lit, asked = lit_and_asked(older, scene, with_exact(light), PLANE_TRIANGLES)
        assert asked > 100_000
        assert lit == 0, f"{name}: {lit} leaks of {asked}"


@pytest.mark.parametrize("version", ["3.3", "4.1"])
def test_driver_of_an_older_version(renderer: Renderer, tmp_path: Path, version: str) -> None:
    """Mesa is configured to offer no more than that version; in a process of its own, because it reads the variable once."""
    code = (
        "import glshadow as gs, numpy as np, sys\n"
        "with gs.Renderer('egl') as renderer:\n"
        "    print(renderer.info['version'])\n"
        f"    frame = renderer.render(gs.scenes.courtyard(), size={SIZE}, samples=1)\n"
        "    print(frame.used[0].filter, frame.used[0].why)\n"
        "np.save(sys.argv[1], frame.visibility)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "seen.npy")],
        env=os.environ | {"MESA_GL_VERSION_OVERRIDE": version}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    said = done.stdout.splitlines()
    assert said[0].startswith(version)
    assert "exact" in said[1].lower()
    assert said[1].endswith(f"has {version}")
    expected = renderer.render(gs.scenes.courtyard(), size=SIZE, samples=1).visibility
    np.testing.assert_array_equal(np.load(tmp_path / "seen.npy"), expected)


@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_half_planes_before_a_disc(older: Renderer, kind: str) -> None:
    """An area light is evaluated point by point; a spot's cone is not applied to each of its sample points."""
    count, far = 64, 2000.0
    casters, exact = CASES["half plane"]
    shadow = gs.Shadow(filter=gs.Exact(light_samples=count))
    light: Light = gs.DirectionalLight(
        direction=(0, -1, 0), angle=2.0 * float(np.degrees(np.arctan(HALF))), shadow=shadow
    )
    if kind == "spot":
        light = gs.SpotLight(
            position=(0, far, 0),
            direction=(0, -1, 0),
            inner_angle=5.0,
            outer_angle=5.0,
            radius=far * HALF,
            shadow=shadow,
        )
    elif kind == "point":
        light = gs.PointLight(position=(0, far, 0), radius=far * HALF, shadow=shadow)
    frame = older.render(
        floor_under(casters), camera_of(0.7), [light], DISC_SIZE, outputs=("visibility", "position"), samples=1
    )
    assert "built on the CPU" in frame.used[0].why
    assert frame.used[0].why.endswith("64 points of the light, one after another")
    place = frame.position / (HEIGHT * HALF)
    expected = exact(place[..., 0], place[..., 2])
    assert ((expected > 0.05) & (expected < 0.95)).mean() > 0.2
    # points of a disc; those of a spherical light are distributed less evenly: docs/soft.md
    most = 2.0 * count**-0.75 if kind == "sun" else 0.65 * count**-0.5
    assert np.abs(frame.visibility[0] - expected).max() < most


def test_directional_light_samples_match_rays(older: Renderer) -> None:
    scene = gs.scenes.box().scene
    light = gs.DirectionalLight(angle=20.0, shadow=gs.Shadow(filter=gs.Exact(light_samples=16)))
    frame = older.render(scene, None, [light], SIZE, outputs=("visibility", "triangle"), samples=1)
    expected = count_points(gs.trace(scene, None, [light], SIZE, surface=frame.triangle, samples=1), light, 16)
    gap = np.abs(frame.visibility[0] * 16.0 - expected)[~np.isnan(expected)]
    assert (gap > 0.5).sum() <= WRONG
    assert ((frame.visibility[0] > 0.1) & (frame.visibility[0] < 0.9)).sum() > 100


# -- triangle lists


def lists_of(renderer: Renderer) -> tuple[ListGrid, NDArray[np.float32], Walked]:
    """Grid, facets and lists of the last frame's first light, built on either processor."""
    on_gpu = renderer._context.caps.compute
    source = technique_of(renderer, Listed if on_gpu else Uploaded)
    textures = source._textures if on_gpu else source.lists.textures
    heads, links, grid = textures["u_heads"], textures["u_links"], (source if on_gpu else source.lists).grid
    with renderer._context:
        facets = np.frombuffer(textures["u_facets"].buffer.read(), np.float32).reshape(-1, 3, 4)
        read = np.frombuffer(heads.read(), np.uint32).reshape(heads.size[::-1])
        entries = np.frombuffer(links.buffer.read(), np.uint32).reshape(-1, 4)
    return grid, facets, walked(grid, read, entries)


def touches(grid: ListGrid, corners: Array, x: NDArray[np.int64], y: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether triangles (N, 3, 3) in front of the light overlap a face's fine cells (x, y): no axis separates them."""
    depth = np.ones(corners.shape[:2]) if grid.projection == "orthographic" else -corners[..., 2]
    scale = np.array(grid.cells_from_window)
    place = corners[..., :2] / depth[..., None] * scale[:2] + scale[2:] - np.stack([x, y], axis=1)[:, None]
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    overlap = np.ones(len(corners), dtype=bool)
    edges = np.roll(place, -1, axis=1) - place
    normals = [np.tile(axis, (len(corners), 1)) for axis in np.eye(2)]
    for normal in (*normals, *(np.stack([-edges[:, i, 1], edges[:, i, 0]], axis=1) for i in range(3))):
        ours, theirs = np.einsum("nki,ni->nk", place, normal), normal @ square.T
        overlap &= (ours.max(axis=1) > theirs.min(axis=1)) & (theirs.max(axis=1) > ours.min(axis=1))
    return overlap


@pytest.mark.usefixtures("built_on_the_gpu")
@pytest.mark.parametrize("name", [*LIGHTS, "wide spot"])
def test_cpu_lists_contain_those_of_the_gpu(
    renderer: Renderer, older: Renderer, rng: np.random.Generator, name: str
) -> None:
    """Facets are equal to the bit. If the GPU lists a triangle in a cell, and float64 agrees, so does the CPU."""
    light = LIGHTS.get(name, gs.SpotLight(position=(0.1, 0.5, 0.2), direction=(0.3, -1.0, 0.2), outer_angle=80.0))
    triangles = scattered(rng, 2000, 1.5)
    numbers = np.arange(6000).reshape(-1, 3)
    mirror = translation((0.3, 0.2, 0.1)) @ np.diag([1.0, -0.7, 1.0, 1.0])
    mesh = Mesh(triangles.reshape(-1, 3), numbers)
    scene = Scene(
        (ground(), Node(mesh, np.eye(4), "a"), Node(mesh, mirror, "b")),
        gs.PerspectiveCamera((3.0, 5.0, 6.0), (0.0, 0.0, 0.0)),
    )
    for each in (renderer, older):
        each.render(scene, None, [with_exact(light)], (64, 36), samples=1)
    (grid, facets, theirs), (our_grid, our_facets, ours) = lists_of(renderer), lists_of(older)
    assert our_grid.cells_from_window == grid.cells_from_window
    assert len(facets) == 4002
    our_facets = our_facets[:4002]  # its buffer may be larger
    np.testing.assert_array_equal(our_facets[..., :3], facets[..., :3])
    # sums in another order: where they cancel, normals differ in float64's last digits
    np.testing.assert_allclose(our_facets[..., 3], facets[..., 3], rtol=0.0, atol=NORMALS)
    assert (our_facets[..., 3] == facets[..., 3]).mean() > 0.999
    assert theirs.masks == ours.masks
    for found, side, scale in ((theirs.fine, grid.cells, 1), (theirs.coarse, grid.cells // RATIO, RATIO)):
        cell, triangle = (found >> np.uint64(32)).astype(np.int64), (found & np.uint64(0xFFFFFFFF)).astype(np.int64)
        face, y, x = cell // side**2, cell // side % side, cell % side
        # some fine cell of a coarse one
        x, y = (scale * at + rng.integers(0, scale, len(at)) for at in (x, y))
        corners = facets[triangle, :, :3].astype(np.float64)
        if grid.projection == "cube":
            corners = np.einsum("nij,nkj->nki", FACES[face], corners)
        before = (
            (corners[..., 2] < 0.0).all(axis=1)
            if grid.projection != "orthographic"
            else np.ones(len(corners), dtype=bool)
        )
        rows = np.flatnonzero(before)
        needed = rows[touches(grid, corners[rows], x[rows], y[rows])]
        assert len(needed) > 300
        assert held(ours, grid, face[needed], x[needed], y[needed], triangle[needed]).all()


# -- limits


def test_lists_that_do_not_fit_use_a_coarser_grid() -> None:
    scene, light = casters(), LIGHTS["point light"]
    with Renderer("egl") as small:
        small._context.caps = replace(small._context.caps, compute=False, max_storage_block=0, version_code=410)
        usual = small.render(scene, None, [light], SIZE, outputs=("visibility",), samples=1)
        cells, links = technique_of(small, Uploaded).lists.grid.cells, usual.used[0].links
        small._context.caps = replace(small._context.caps, max_texture_buffer_size=links - 1)
        other = small.render(
            scene,
            None,
            [replace(light, shadow=gs.Shadow(faces=gs.Faces.BOTH))],
            SIZE,
            outputs=("visibility",),
            samples=1,
        )
        lists = technique_of(small, Uploaded).lists
        assert lists.grid.cells < cells
        assert lists.count <= links - 1
    np.testing.assert_array_equal(other.visibility, usual.visibility)


def test_scene_beyond_the_buffers_falls_back_to_a_map() -> None:
    scene = gs.scenes.courtyard()
    with Renderer("egl") as small:
        small._context.caps = replace(
            small._context.caps, compute=False, max_storage_block=0, version_code=330, max_texture_buffer_size=1 << 17
        )
        frame = small.render(scene, None, [gs.DirectionalLight()], SIZE, samples=1)
        assert frame.used[0].filter == gs.Pcf(1)
        assert "Exact() needs 3 texels for each of the scene's" in frame.used[0].why
        with pytest.raises(gs.ResourceError, match=r"Exact\(\) needs 3 texels .* holds 131072"):
            small.render(scene, None, [with_exact(gs.DirectionalLight())], SIZE, samples=1)


@pytest.mark.parametrize("name", list(LIGHTS))
def test_scene_without_casters_is_lit(older: Renderer, name: str) -> None:
    quiet = casters()
    quiet = replace(quiet, nodes=tuple(replace(node, casts=False) for node in quiet.nodes))
    frame = older.render(quiet, None, [LIGHTS[name]], SIZE, outputs=("visibility", "triangle", "position"), samples=1)
    floor = (frame.triangle >= 0) & (frame.triangle < 2) & shone(frame)
    assert (frame.visibility[0][floor] == 1.0).all()


def test_lists_are_reused_while_light_and_scene_stay(older: Renderer) -> None:
    scene, light = casters(), LIGHTS["spot"]

    def drawn(light: Light, fov_y: float = 50.0) -> int:
        camera = gs.PerspectiveCamera((3.0, 5.0, 6.0), (0.0, 0.6, 0.0), fov_y=fov_y)
        return older.render(scene, camera, [light], (64, 36), samples=1).used[0].draws

    assert drawn(light) == 1
    assert drawn(light, 40.0) == 0
    assert drawn(replace(light, intensity=2.0)) == 0
    assert drawn(replace(light, position=(1.3, 5.0, -0.8))) == 1


@pytest.mark.parametrize(("room", "again"), [(1 << 29, 0), (1, 16)])
def test_lists_of_light_samples_are_reused_within_the_memory_limit(
    monkeypatch: pytest.MonkeyPatch, room: int, again: int
) -> None:
    monkeypatch.setattr(uploaded, "_KEPT", room)
    scene, shadow = casters(), gs.Shadow(filter=gs.Exact(light_samples=16))
    sun = gs.DirectionalLight(direction=(-0.4, -1.0, 0.3), angle=6.0, shadow=shadow)
    turned = gs.PerspectiveCamera((3.5, 5.0, 5.5), (0.0, 0.6, 0.0), fov_y=50.0)
    # another camera, another light, another scene
    quiet = replace(scene, nodes=scene.nodes[:2])
    frames = [(scene, None, sun), (scene, turned, sun), (scene, None, replace(sun, angle=5.0)), (quiet, None, sun)]
    pictures, builds = [], []

    def older() -> Renderer:
        renderer = Renderer("egl")
        renderer._context.caps = replace(renderer._context.caps, compute=False, max_storage_block=0, version_code=410)
        return renderer

    with older() as kept:
        for which, camera, light in frames:
            frame = kept.render(which, camera, [light], (64, 36), outputs=("visibility",), samples=1)
            pictures.append(frame.visibility)
            assert kept._cache is not None
            builds.append(kept._cache.techniques[0, "Uploaded many times"]._one.builds)  # type: ignore[attr-defined]
    assert np.diff(builds, prepend=0).tolist() == [16, again, 16, 16]
    with older() as fresh:
        expected = fresh.render(scene, turned, [sun], (64, 36), outputs=("visibility",), samples=1).visibility
    np.testing.assert_array_equal(pictures[1], expected)
