"""Vertex colours: the meaning of the files' numbers, and their rendering."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.spaces import Array, translation
from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load
from glshadow.lights import DirectionalLight
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.filters import Exact, Hard
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow

from .glb import Glb

SIZE = (96, 64)
FRONT = PerspectiveCamera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_y=50.0)
SLANTED = DirectionalLight(direction=(0.0, -0.6, -0.8), color=(1.0, 0.5, 0.25), intensity=2.0, shadow=None)
BITS = np.array([2.0 / 2047, 2.0 / 2047, 2.0 / 1023])
"""Colours are stored as 11, 11 and 10 bits of their square root: half a step of the root is a whole one of a colour near 1; doubled for
the float32 roundings of interpolation and shading."""

TRIANGLE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
RAINBOW = np.array([[1.0, 0.0, 0.25, 1.0], [0.0, 1.0, 0.5, 1.0], [0.125, 0.0, 1.0, 1.0]])
SRGB = np.array([[255, 0, 137, 255], [0, 255, 188, 128], [99, 0, 255, 0]], dtype=np.uint8)  # 137, 188, 99: see LINEAR
# IEC 61966-2-1: ((byte / 255 + 0.055) / 1.055) ** 2.4; alpha is linear
LINEAR = np.array([[1, 0, 0.2501583, 1], [0, 1, 0.5028865, 128 / 255], [0.1247718, 0, 1, 0]])


def drawn(renderer: Renderer, *meshes: Mesh) -> Array:
    """Linear image (H, W, 3) of meshes at their places, lit by SLANTED and some ambient light."""
    nodes = tuple(Node(mesh, np.eye(4), f"part {k}") for k, mesh in enumerate(meshes))
    frame = renderer.render(
        Scene(nodes, FRONT), lights=[SLANTED], size=SIZE, ambient=0.25, outputs=("linear",), samples=1
    )
    return frame.linear.astype(np.float64)


def weights() -> tuple[Array, Any]:
    """Barycentric weights (N, 3) of TRIANGLE at the pixels inside it, a quarter of a pixel from its edges, and which those are."""
    rays = pixel_rays(FRONT, SIZE)
    x, y = (3.0 * rays[..., k] / -rays[..., 2] for k in (0, 1))
    c = 0.5 * (y + 1.0)
    b = 0.5 * (x + 1.0 - c)
    found = np.stack([1.0 - b - c, b, c], axis=-1)
    inside = (found > 0.01).all(axis=-1)
    return found[inside], inside


@pytest.mark.parametrize("picture", [False, True], ids=["plain", "textured"])
def test_linear_is_base_times_vertex_times_light(renderer: Renderer, picture: bool) -> None:
    base = np.array([1.0, 0.5, 0.75])
    material, uv = Material((*base, 1.0)), None
    if picture:
        material, uv = Material((*base, 1.0), np.full((2, 2, 4), (188, 255, 188, 255), np.uint8)), np.zeros((3, 2))
        base = base * LINEAR[1, [2, 1, 2]]
    mesh = Mesh(TRIANGLE, np.array([[0, 1, 2]]), uv=uv, colors=RAINBOW, material=material)
    share, inside = weights()
    assert inside.sum() > 500
    light = 0.25 + 2.0 * 0.8 * np.array([1.0, 0.5, 0.25])  # N.L = 0.8
    wanted = base * (share @ RAINBOW[:, :3]) * light
    error = np.abs(drawn(renderer, mesh)[inside] - wanted)
    assert (error <= BITS * light).all(), error.max(axis=0)


def test_meshes_with_and_without_colours_in_one_scene(renderer: Renderer) -> None:
    """Each keeps its own colours; uniform vertex colours equal that colour of the material."""
    plain = Mesh(TRIANGLE - (0.0, 0.0, 1.0), np.array([[0, 1, 2]]), material=Material((0.2, 0.4, 0.8, 1.0)))
    colored = Mesh(0.3 * TRIANGLE, np.array([[0, 1, 2]]), colors=np.tile((0.5, 0.25, 1.0, 1.0), (3, 1)))
    same = Mesh(0.3 * TRIANGLE, np.array([[0, 1, 2]]), material=Material((0.5, 0.25, 1.0, 1.0)))
    np.testing.assert_allclose(drawn(renderer, plain, colored), drawn(renderer, plain, same), atol=2.0 * BITS.max())


@pytest.mark.parametrize(
    ("colors", "said"),
    [
        (np.ones((3, 3)), r"colors must have shape \(3, 4\)"),
        (np.ones((2, 4)), r"colors must have shape \(3, 4\)"),
        (np.full((3, 4), 1.5), "colors must be numbers from 0 to 1 .* 3 of 3 are not"),
        (np.array([[0, 0, 0, 1], [0, 0, np.nan, 1], [0, 0, 0, 1]]), "1 of 3 colors are not finite"),
        (np.array([[0, 0, 0, 1], [0, 2, 0, 1], [0, -1, 0, 1]]), "2 of 3 are not"),
    ],
)
def test_invalid_colours_are_refused(colors: Array, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        Mesh(TRIANGLE, np.array([[0, 1, 2]]), colors=colors)


# -- alpha: the solid part of a sheet, half of which is transparent


def sheet(texture: bool, mode: AlphaMode = AlphaMode.MASK) -> Mesh:
    """Horizontal, 2 x 2 at y = 1; alpha rises from 0 at x = -1 to 1 at x = 1: with cutoff .4 and factor .8 it is solid for x > 0."""
    positions, triangles = shapes.rectangle((-1.0, 1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0))
    colors = np.array([[1, 1, 1, alpha] for alpha in (0.0, 1.0, 1.0, 0.0)])
    factor = 0.8
    picture, uv = None, None
    if texture:  # alpha of one half in the texture, so that the factor has to be doubled
        picture, uv, factor = np.full((2, 2, 4), (255, 255, 255, 204), np.uint8), np.zeros((4, 2)), 1.0
    return Mesh(positions, triangles, uv=uv, colors=colors, material=Material((1, 1, 1, factor), picture, mode, 0.4))


SHADOWS = {
    "exact": Shadow(filter=Exact()),
    "depth": Shadow(filter=Hard()),
    "metric": Shadow(filter=Hard(), target=Target.R32F),
}


@pytest.mark.parametrize("texture", [False, True], ids=["vertices", "vertices and texture"])
@pytest.mark.parametrize("shadow", SHADOWS.values(), ids=list(SHADOWS))
def test_vertex_alpha_cuts_out(renderer: Renderer, shadow: Shadow, texture: bool) -> None:
    """Camera and light agree with the float64 reference: the sheet is solid only for x > 0."""
    ground = Mesh(*shapes.rectangle((-3.0, 0.0, 3.0), (6.0, 0.0, 0.0), (0.0, 0.0, -6.0)))
    scene = Scene((Node(ground, np.eye(4), "ground"), Node(sheet(texture), np.eye(4), "sheet")))
    camera = PerspectiveCamera((0.5, 4.0, 5.0), (0.0, 0.5, 0.0), fov_y=50.0)
    light = DirectionalLight(direction=(-0.3, -1.0, 0.2), shadow=shadow)
    frame = renderer.render(scene, camera, [light], (320, 180), outputs=("visibility", "triangle"), samples=1)
    truth = trace(scene, camera, [light], (320, 180), samples=1)
    seen = truth.node == 1
    assert seen.sum() > 500
    assert (truth.position[seen][:, 0] > -1e-6).all()
    # one in a thousand: a pixel's centre on a silhouette
    assert (frame.triangle != truth.triangle).mean() < 1e-3
    floor = (frame.triangle == truth.triangle) & (truth.node == 0)
    x, z = (truth.position[..., 0] + 0.3, truth.position[..., 2] - 0.2)  # where the light's ray crosses y = 1
    texel = 0.02  # the map's texel, of 2048 over 6 units, is a seventh of that
    edge = (np.minimum(np.abs(x), np.abs(x - 1.0)) < texel) | (np.abs(np.abs(z) - 1.0) < texel)
    dark = (x > 0.0) & (x < 1.0) & (np.abs(z) < 1.0)
    assert (floor & dark & ~edge).sum() > 500
    np.testing.assert_array_equal(frame.visibility[0][floor & ~edge], np.where(dark, 0.0, 1.0)[floor & ~edge])
    np.testing.assert_array_equal(truth.visibility[0][floor & ~edge], np.where(dark, 0.0, 1.0)[floor & ~edge])


def test_alpha_factor_below_the_cutoff_hides_the_mesh(renderer: Renderer) -> None:
    """No texture, no vertex colours: the alpha test still applies."""
    ghost = Mesh(TRIANGLE, np.array([[0, 1, 2]]), material=Material((1, 1, 1, 0.3), alpha_mode=AlphaMode.MASK))
    back = Mesh(3.0 * TRIANGLE - (0, 0, 1), np.array([[0, 1, 2]]))
    scene = Scene((Node(ghost, np.eye(4), "ghost"), Node(back, np.eye(4), "back")), FRONT)
    light = DirectionalLight(direction=(0.0, 0.0, -1.0), shadow=Shadow(filter=Exact()))
    frame = renderer.render(scene, lights=[light], size=SIZE, outputs=("triangle", "visibility"), samples=1)
    truth = trace(scene, lights=[light], size=SIZE, samples=1)
    assert set(np.unique(frame.triangle)) == set(np.unique(truth.triangle)) == {-1, 1}
    np.testing.assert_array_equal(frame.visibility, truth.visibility)


def test_interpolation_costs_no_pixel_where_alpha_equals_the_cutoff(renderer: Renderer) -> None:
    # each corner at a depth of its own
    turned = TRIANGLE * (1.0, 1.0, 0.0) + np.array([[0, 0, -5.0], [0, 0, 0.7], [0, 0, 0.3]])
    opaque = np.concatenate([RAINBOW[:, :3], np.ones((3, 1))], axis=1)
    masked = Material(alpha_mode=AlphaMode.MASK, cutoff=1.0)
    pictures = [
        drawn(renderer, Mesh(turned, np.array([[0, 1, 2]]), colors=opaque, material=m)) for m in (masked, Material())
    ]
    np.testing.assert_array_equal(*pictures)


# -- files and objects


def glb(path: Path, colors: Any, dtype: str, mode: str | None = None, **extra: Any) -> Path:
    file = Glb(nodes=[{"mesh": 0}], materials=[{"alphaMode": mode} if mode else {}])
    attributes = {"POSITION": file.add(TRIANGLE), "COLOR_0": file.add(colors, dtype, **extra)}
    file.mesh({"attributes": attributes, "material": 0})
    return file.save(path / "made.glb")


@pytest.mark.parametrize("columns", [3, 4])
@pytest.mark.parametrize(("dtype", "most"), [("float32", 1), ("uint8", 255), ("uint16", 65535)])
def test_gltf_colors_are_linear(tmp_path: Path, dtype: str, most: int, columns: int) -> None:
    given = np.round(np.array([[1, 0, 0.2, 0.4], [0, 1, 0.6, 1], [0.8, 0.2, 1, 0]]) * most, 0 if most > 1 else 6)
    mesh = load(glb(tmp_path, given[:, :columns], dtype, normalized=most > 1)).nodes[0].mesh
    assert mesh.colors is not None
    assert mesh.colors.dtype == np.float32
    wanted = given.astype(dtype).astype(np.float64) / most
    wanted[:, columns:] = 1.0
    np.testing.assert_array_equal(mesh.colors, wanted.astype(np.float32))


def test_gltf_integers_are_normalised_whatever_the_file_says(tmp_path: Path) -> None:
    mesh = load(glb(tmp_path, np.array([[255, 0, 51], [0, 0, 0], [0, 0, 0]]), "uint8")).nodes[0].mesh
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors[0], (1.0, 0.0, 0.2, 1.0), rtol=1e-6)  # float32


def test_colors_out_of_range_and_not_finite_warn(tmp_path: Path) -> None:
    path = glb(tmp_path, np.array([[2, 0, 0], [np.nan, 0, 0], [0, -1, 0]]), "float32")
    with pytest.warns(GlshadowWarning) as caught:
        mesh = load(path).nodes[0].mesh
    said = " ".join(str(each.message) for each in caught)
    assert "COLOR_0: 1 of 3 colours are not finite (NaN or infinite): white there" in said
    assert "COLOR_0: 2 of 3 colours are clipped to 0..1" in said
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1, 0, 0, 1], [1, 1, 1, 1], [0, 0, 0, 1]]


def test_vertex_alpha_joins_the_alpha_mode(tmp_path: Path) -> None:
    clear = RAINBOW * (1, 1, 1, 0.5)
    half = [[1, 1, 1, 0.5]] * 3
    for colors, mode, kept in (
        (RAINBOW, "BLEND", AlphaMode.OPAQUE),  # nothing is transparent
        (clear, "BLEND", AlphaMode.BLEND),
        (half, "BLEND", AlphaMode.BLEND),
        (clear, "MASK", AlphaMode.MASK),
        (clear, None, AlphaMode.OPAQUE),
    ):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            material = load(glb(tmp_path, colors, "float32", mode)).nodes[0].mesh.material
        assert material.alpha_mode is kept, (mode, colors)
        assert [str(each.message) for each in caught] == []


def test_trimesh_vertex_colors_are_srgb() -> None:
    made = trimesh.Trimesh(TRIANGLE, [[0, 1, 2]], vertex_colors=SRGB, process=False)
    mesh = load(made).nodes[0].mesh
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, LINEAR, atol=1e-6)
    assert mesh.material.alpha_mode is AlphaMode.OPAQUE
    assert len(mesh.positions) == 3


def test_trimesh_face_colors_split_vertices() -> None:
    """A tetrahedron: as many faces as vertices, so that the count does not show which of them the colours belong to."""
    solid = trimesh.Trimesh(
        np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]], process=False
    )
    solid.visual.face_colors = np.vstack([SRGB, [[10, 20, 30, 255]]])
    mesh = load(solid).nodes[0].mesh
    assert mesh.colors is not None
    assert mesh.positions.shape == (12, 3)
    np.testing.assert_allclose(mesh.colors[mesh.triangles][:3], np.repeat(LINEAR[:, None], 3, axis=1), atol=1e-6)
    np.testing.assert_array_equal(mesh.positions[mesh.triangles], solid.vertices[solid.faces])
    assert mesh.closed  # the split does not open it


def test_trimesh_beside_a_material_colors_are_linear() -> None:
    visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 0, 255, 255])
    )
    visual.vertex_attributes["color"] = SRGB
    mesh = load(trimesh.Trimesh(TRIANGLE, [[0, 1, 2]], visual=visual, process=False)).nodes[0].mesh
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, SRGB / 255.0, atol=1e-6)
    assert mesh.material.color == (1.0, 0.0, 1.0, 1.0)


def test_pyrender_vertex_colors_are_linear() -> None:
    pyrender = pytest.importorskip("pyrender")
    primitive = pyrender.Primitive(
        positions=TRIANGLE,
        color_0=RAINBOW,
        indices=np.array([[0, 1, 2]]),
        material=pyrender.MetallicRoughnessMaterial(baseColorFactor=(0.5, 1.0, 1.0, 1.0), alphaMode="BLEND"),
    )
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh([primitive]))
    mesh = load(scene).nodes[0].mesh
    assert mesh.colors is not None
    np.testing.assert_array_equal(mesh.colors, RAINBOW.astype(np.float32))
    assert mesh.material.color == (0.5, 1.0, 1.0, 1.0)
    assert mesh.material.alpha_mode is AlphaMode.OPAQUE  # no vertex is transparent
    primitive.color_0 = RAINBOW * (1, 1, 1, 0.5)
    assert load(scene).nodes[0].mesh.material.alpha_mode is AlphaMode.BLEND


def test_moved_copy_keeps_its_colours(renderer: Renderer) -> None:
    """Instances share the buffers; a mesh far from its origin is stored relative to its centre."""
    far = np.array([1e5, 0.0, 0.0])
    mesh = Mesh(TRIANGLE + far, np.array([[0, 1, 2]]), colors=RAINBOW)
    scene = Scene((Node(mesh, translation(-far), "far"),), FRONT)
    frame = renderer.render(scene, lights=[SLANTED], size=SIZE, ambient=0.25, outputs=("linear",), samples=1)
    near = drawn(renderer, Mesh(TRIANGLE, np.array([[0, 1, 2]]), colors=RAINBOW))
    np.testing.assert_allclose(frame.linear, near, atol=2.0 * BITS.max())
