"""Casters and receivers: cut-out and blended materials, nodes that do not cast or receive, instances, mirrored nodes, single triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, translation
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

from ..tolerances import WEIGHT
from .compare import WRONG, Compared, compared, shone
from .orientations import rotation

CAMERA = gs.PerspectiveCamera((3.0, 5.0, 6.0), (0.0, 0.6, 0.0), fov_y=50.0)
LIGHTS: dict[str, Light] = {
    "sun": gs.DirectionalLight(direction=(-0.4, -1.0, 0.3)),
    "spot": gs.SpotLight(position=(1.2, 5.0, -0.8), direction=(-1.2, -5.0, 0.8), inner_angle=40.0, outer_angle=45.0),
    "point light": gs.PointLight(position=(0.3, 2.6, 0.2)),
    "point light among them": gs.PointLight(position=(0.3, 1.3, 0.2)),
}
every_light = pytest.mark.parametrize("light", LIGHTS.values(), ids=list(LIGHTS))


def ground() -> Node:
    return Node(Mesh(*shapes.rectangle((-4.0, 0.0, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -8.0))), np.eye(4), "ground")


def leaf(
    texture: np.ndarray, repeats: float = 1.0, alpha: float = 1.0, cutoff: float = 0.5, mode: AlphaMode = AlphaMode.MASK
) -> Mesh:
    """A horizontal square of side 2 whose texture repeats, starting at a negative coordinate."""
    positions, triangles = shapes.rectangle((-1.0, 0.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0))
    uv = (np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) - 0.3) * repeats
    material = Material((1.0, 1.0, 1.0, alpha), texture, mode, cutoff)
    return Mesh(positions, triangles, uv=uv.astype(np.float32), material=material)


def leaves(width: int = 32, height: int = 24) -> np.ndarray:
    """A texture with holes of all alpha values, wider than high."""
    texture = np.full((height, width, 4), 200, dtype=np.uint8)
    texture[..., 3] = np.random.default_rng(3).integers(0, 256, (height, width))
    return texture


def scene_of(*nodes: Node, name: str = "casters") -> Scene:
    return Scene((ground(), *nodes), CAMERA, name=name)


def placed(x: float, y: float, z: float, turn: int = 0) -> Array:
    matrix = translation((x, y, z))
    matrix[:3, :3] = 0.6 * rotation(np.random.default_rng(turn))
    return matrix


def assert_right(result: Compared) -> None:
    assert result.wrong.sum() <= WRONG, str(result)
    facing = result.truth.cosine[0] > 0.0
    assert (facing & (result.truth.visibility[0] == 0.0)).sum() > 500, str(result)
    assert (facing & (result.truth.visibility[0] == 1.0)).sum() > 500, str(result)


# -- alpha


@every_light
@pytest.mark.parametrize("repeats", [1.0, 3.7])
def test_cut_out_casters_have_traced_shadows(renderer: Renderer, light: Light, repeats: float) -> None:
    """One image used by two materials, instances of one mesh, and opaque casters among them."""
    image = leaves()
    one, other = leaf(image, repeats), leaf(image, 0.5, alpha=0.8, cutoff=0.3)
    solid = Mesh(*shapes.box((0.4, 0.4, 0.4)))
    nodes = [
        Node(one, placed(-1.0, 1.0, 0.0, 1), "a"),
        Node(solid, placed(0.2, 0.7, 0.9, 2), "solid"),
        Node(one, placed(1.0, 1.4, -0.5, 3), "b"),
        Node(other, placed(0.0, 1.8, 0.3, 4), "c"),
        Node(leaf(leaves(7, 13), 2.0), placed(-0.6, 0.5, 1.2, 5), "d"),
    ]
    assert_right(compared(renderer, scene_of(*nodes), light))


@every_light
def test_alpha_masks_change_the_shadow(renderer: Renderer, light: Light) -> None:
    """The control of the test above: opaque leaves give another image."""
    mesh = leaf(leaves())
    cut = compared(renderer, scene_of(Node(mesh, placed(-0.5, 1.0, 0.0, 1), "leaf")), light)
    whole = replace(mesh, material=replace(mesh.material, alpha_mode=AlphaMode.OPAQUE))
    solid = compared(renderer, scene_of(Node(whole, placed(-0.5, 1.0, 0.0, 1), "leaf")), light)
    assert solid.wrong.sum() <= WRONG
    assert cut.lit > solid.lit + 0.005


@pytest.mark.parametrize("before", [1, 2, 3])
def test_alpha_mask_is_independent_of_preceding_triangles(renderer: Renderer, before: int) -> None:
    corners = np.array([[[-9.0, -0.1 * k, 9.0], [9.0, -0.1 * k, 9.0], [0.0, -0.1 * k, -9.0]] for k in range(before)])
    below = Node(Mesh(corners.reshape(-1, 3), np.arange(3 * before).reshape(-1, 3)), np.eye(4), "ground")
    scene = Scene((below, Node(leaf(leaves()), placed(-0.5, 1.0, 0.0, 1), "leaf")), CAMERA)
    assert_right(compared(renderer, scene, LIGHTS["sun"]))


@pytest.mark.parametrize("cutoff", [0.0, 1.0, 1.5, -1.0])
def test_extreme_alpha_cutoffs(renderer: Renderer, cutoff: float) -> None:
    """At 0 every texel is solid, at 1 only fully opaque ones, above 1 none."""
    image = leaves()
    image[:12, :, 3] = 255
    scene = scene_of(Node(leaf(image, cutoff=cutoff), placed(-0.5, 1.0, 0.0, 1), "leaf"))
    result = compared(renderer, scene, LIGHTS["sun"])
    assert result.wrong.sum() <= WRONG, str(result)


@every_light
@pytest.mark.parametrize("filter_", [gs.Exact(), gs.Pcf(1)], ids=["exact", "pcf"])
def test_blended_materials_cast_nothing(renderer: Renderer, light: Light, filter_: gs.Exact | gs.Pcf) -> None:
    for texture in (None, leaves()):
        mesh = leaf(leaves())
        material = Material((1.0, 1.0, 1.0, 0.9), texture=texture, alpha_mode=AlphaMode.BLEND)
        translucent = replace(mesh, material=material)
        scene = scene_of(Node(translucent, placed(-0.5, 1.0, 0.0, 1), "glass"))
        lit = replace(light, shadow=gs.Shadow(filter=filter_))
        frame = renderer.render(
            scene, lights=[lit], size=(160, 90), outputs=("visibility", "triangle", "position"), samples=1
        )
        floor = (frame.triangle >= 0) & (frame.triangle < 2)
        assert floor.any()
        assert (frame.triangle < 2).all(), "outputs are those of opaque surfaces"
        np.testing.assert_allclose(frame.visibility[0][floor & shone(frame)], 1.0, atol=WEIGHT)


# -- nodes that do not cast, or do not receive


@every_light
@pytest.mark.parametrize("casts", [True, False])
@pytest.mark.parametrize("receives", [True, False])
def test_casts_and_receives(renderer: Renderer, light: Light, casts: bool, receives: bool) -> None:
    box, ball = Mesh(*shapes.box((1.0, 1.0, 1.0))), Mesh(*shapes.icosphere(3, 0.5))
    nodes = [
        Node(box, placed(-0.8, 0.9, 0.0, 1), "a", casts=casts, receives=receives),
        Node(ball, placed(0.8, 1.6, -0.2, 2), "b", receives=not receives),
        Node(box, placed(0.4, 0.6, 1.0, 3), "c", casts=not casts),
    ]
    scene = scene_of(*nodes)
    result = compared(renderer, scene, light)
    assert_right(result)
    # the same with a shadow map, outside a band of two texels, which no edge exceeds here
    frame = renderer.render(
        scene, lights=[light], size=result.frame.size, outputs=("visibility", "triangle"), samples=1
    )
    share = (np.abs(frame.visibility[0] - result.truth.visibility[0]) > 0.5)[result.truth.triangle >= 0].mean()
    assert share < 2e-3


def test_a_floor_that_does_not_receive_stays_lit(renderer: Renderer) -> None:
    floor = replace(ground(), receives=False)
    scene = Scene((floor, Node(Mesh(*shapes.box((1.0, 1.0, 1.0))), placed(0.0, 1.0, 0.0), "box")), CAMERA)
    for light in LIGHTS.values():
        result = compared(renderer, scene, light)
        assert result.wrong.sum() == 0, str(result)
        seen = (result.truth.triangle >= 0) & (result.truth.triangle < 2)
        np.testing.assert_array_equal(result.frame.visibility[0][seen & result.truth.reached[0]], 1.0)


# -- instances and mirrors


@every_light
def test_instances_that_share_edges(renderer: Renderer, light: Light) -> None:
    """A closed ceiling of tiles: one mesh, each tile placed and rotated by its own matrix, its vertices rounded after the transform.

    Where the matrices are exact, neighbours share vertices and no light may leak; where they round, leaks are as thin as
    the rounding.
    """
    tile = Mesh(*shapes.rectangle((-0.5, 0.0, 0.5), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    quarter = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    nodes = []
    for i in range(-16, 16):
        for j in range(-16, 16):
            matrix = translation((i + 0.5, 2.0, j + 0.5))
            matrix[:3, :3] = np.linalg.matrix_power(quarter, (i + 3 * j) % 4)
            nodes.append(Node(tile, matrix, f"{i} {j}"))
    above = replace(light, position=(0.3, 3.6, 0.2)) if isinstance(light, gs.PointLight) else light
    camera = gs.PerspectiveCamera((0.0, 1.5, 4.0), (0.0, 0.0, 0.0), fov_y=60.0)
    result = compared(renderer, Scene((ground(), *nodes), camera, name="tiles"), above)
    assert result.wrong.sum() == 0, str(result)
    floor = (result.frame.triangle >= 0) & (result.frame.triangle < 2) & result.truth.reached[0]
    assert floor.sum() > 10_000
    assert (result.frame.visibility[0][floor] == 0.0).all()


@every_light
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("faces", [None, gs.Faces.BOTH])
def test_mirrored_nodes(renderer: Renderer, light: Light, axis: int, faces: gs.Faces | None) -> None:
    """A mirror reverses the winding: closed meshes must keep the side that faces the light."""
    flip = np.eye(4)
    flip[axis, axis] = -1.0
    ball, torus = Mesh(*shapes.icosphere(3, 0.6)), Mesh(*shapes.torus(0.6, 0.2, 48, 24))
    nodes = [
        Node(ball, placed(-0.8, 1.0, 0.2, 1) @ flip, "ball"),
        Node(torus, placed(0.8, 0.9, 0.1, 2) @ flip, "torus"),
    ]
    assert_right(compared(renderer, scene_of(*nodes), light, faces=faces))


@pytest.mark.parametrize("filter_", [gs.Exact(), gs.Hard()], ids=["exact", "hard"])
@pytest.mark.parametrize("axis", [None, 0, 1, 2])
def test_a_mirrored_sheet_keeps_its_front(renderer: Renderer, axis: int | None, filter_: gs.Exact | gs.Hard) -> None:
    """Only one side of an open sheet casts. Mirroring reverses the vertex order, and must not change which side that is."""
    flip = np.eye(4)
    if axis is not None:
        flip[axis, axis] = -1.0
    # faces up; down where y is mirrored
    sheet = Mesh(*shapes.rectangle((-1.0, 0.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0)))
    scene = scene_of(Node(sheet, translation((0.0, 1.0, 0.0)) @ flip, "sheet"))
    below = gs.PerspectiveCamera((0.0, 0.8, 4.0), (0.0, 0.0, 0.0))
    darkened = {}
    for faces in (gs.Faces.FRONT, gs.Faces.BACK, gs.Faces.BOTH):
        light = gs.DirectionalLight(
            direction=(0.1, -1.0, 0.05), shadow=gs.Shadow(filter=filter_, faces=faces, resolution=512)
        )
        frame = renderer.render(scene, below, [light], (160, 90), outputs=("visibility", "triangle"), samples=1)
        darkened[faces] = bool((frame.visibility[0][(frame.triangle >= 0) & (frame.triangle < 2)] == 0.0).any())
    up = axis != 1
    assert darkened == {gs.Faces.FRONT: up, gs.Faces.BACK: not up, gs.Faces.BOTH: True}


@pytest.mark.parametrize("filter_", [gs.Exact(), gs.Hard()], ids=["exact", "hard"])
def test_a_large_sheet_without_area_casts_nothing(renderer: Renderer, filter_: gs.Exact | gs.Hard) -> None:
    """A node scaled to a line, as long as the scene."""
    line = np.diag([1.0, 0.0, 0.0, 1.0])
    line[1, 3] = 1.0
    scene = scene_of(Node(Mesh(*shapes.rectangle((-9.0, 0.0, 9.0), (18.0, 0.0, 0.0), (0.0, 0.0, -18.0))), line, "line"))
    light = gs.DirectionalLight(direction=(0.0, -1.0, 0.0), shadow=gs.Shadow(filter=filter_, resolution=128))
    frame = renderer.render(scene, CAMERA, [light], (80, 45), outputs=("visibility",), samples=1)
    assert np.nanmin(frame.visibility) == 1.0


# -- degenerate


@pytest.mark.parametrize("kind", list(LIGHTS))
def test_one_triangle(renderer: Renderer, kind: str) -> None:
    corners = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 0.3, -1.0]])
    scene = Scene((Node(Mesh(corners, np.array([[0, 1, 2]], dtype=np.int32)), np.eye(4), "triangle"),), CAMERA)
    result = compared(renderer, scene, LIGHTS[kind])
    assert result.wrong.sum() == 0
    seen = result.truth.triangle >= 0
    np.testing.assert_array_equal(result.frame.visibility[0][seen], (result.truth.cosine[0] > 0.0)[seen])


@pytest.mark.parametrize("casters", [1, 2])
def test_light_in_the_plane_of_a_triangle(renderer: Renderer, casters: int) -> None:
    """An edge-on triangle casts nothing; a caster in between must still cast."""
    wall = Mesh(*shapes.rectangle((0.5, 0.0, 1.0), (0.0, 2.0, 0.0), (0.0, 0.0, -2.0)))
    plate = Mesh(*shapes.rectangle((-0.5, 1.0, 0.5), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    nodes = [Node(wall, np.eye(4), "wall"), Node(plate, np.eye(4), "plate")][:casters]
    lights: list[Light] = [
        gs.PointLight(position=(0.5, 4.0, 0.0)),  # in the plane of the wall, x = 0.5
        gs.PointLight(position=(0.5, 1.0, 0.0)),  # on the wall, and in the plate's plane
        gs.SpotLight(position=(0.5, 4.0, 0.0), direction=(0.0, -1.0, 0.0), outer_angle=60.0),
        gs.DirectionalLight(direction=(0.0, -1.0, 0.0)),
        gs.DirectionalLight(direction=(-1.0, 0.0, 0.0)),  # in the planes of ground and plate
    ]
    for light in lights:
        result = compared(renderer, scene_of(*nodes), light)
        assert result.wrong.sum() <= WRONG, str(result)


@pytest.mark.parametrize("corner", [(-1.0, 1.0, 1.0), (0.0, 1.0, 0.0), (0.3, 1.0, 0.3)])
def test_a_light_on_a_vertex_or_inside_a_triangle(renderer: Renderer, corner: tuple[float, float, float]) -> None:
    plate = Mesh(*shapes.rectangle((-1.0, 1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0)))
    result = compared(renderer, scene_of(Node(plate, np.eye(4), "plate")), gs.PointLight(position=corner))
    assert result.wrong.sum() <= WRONG, str(result)


@pytest.mark.parametrize(
    "light",
    [gs.SkyLight(), gs.DirectionalLight(angle=5.0), gs.PointLight(position=(1.0, 4.0, 1.0), radius=0.3,
     shadow=gs.Shadow(filter=gs.LightSamples(16, of=gs.Pcf(1))))],
    ids=["sky", "sun", "lamp of maps"],
)  # fmt: skip
def test_non_receivers_see_the_whole_area_light(renderer: Renderer, light: Light) -> None:
    ground = Mesh(*shapes.rectangle((-4.0, 0.0, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -8.0)))
    body = Mesh(*shapes.box((2.0, 1.0, 2.0), (0.0, 1.0, 0.0)))
    camera = gs.PerspectiveCamera(position=(3.0, 4.0, 6.0), target=(0.0, 0.5, 0.0))
    for receives in (True, False):
        nodes = (Node(ground, np.eye(4), "ground", receives=receives), Node(body, np.eye(4), "body"))
        frame = renderer.render(
            gs.Scene(nodes, camera=camera), None, [light], (80, 45), outputs=("visibility", "node"), samples=1
        )
        seen = frame.visibility[0][frame.node == 0]
        assert (seen < 0.99).any() == receives
        assert receives or (seen > 0.999).all()
