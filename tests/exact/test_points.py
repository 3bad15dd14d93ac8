"""Visibility of lights from given points: closed forms, float64 rays, the pixels of images, and independence of order and parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.derive import coherence
from glshadow.gl import points as points_module
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.faces import face_corners, faces_of, fronts, sample_faces
from glshadow.scenes import shapes

from ..tracer import Tracer, scene_triangles
from .test_casters import LIGHTS, ground, leaf, leaves, placed
from .test_soft_closed_forms import CASES, HALF, HEIGHT
from .test_soft_closed_forms import scene_of as sheets_over_floor

Array = NDArray[np.float64]

BAND = 3e-6
"""Rounding of a shadow's border on a receiver, in the largest coordinates: 2^-24 times 10 for the point (its upload 1.7, its rotation 4,
its translation 1.7, its projection 2.6), and as much for the border's vertices, seen from as far as three times their distance."""

SUN = gs.DirectionalLight(direction=(1.0, -1.0, 0.0))
FLAT = np.array([0.0, 1.0, 0.0])


def sheet(x: tuple[float, float], height: float, z: tuple[float, float] = (-40.0, 40.0)) -> gs.Mesh:
    return gs.Mesh(*shapes.rectangle((x[0], height, z[1]), (x[1] - x[0], 0, 0), (0, 0, z[0] - z[1])))


FLOOR = sheet((-5.0, 5.0), 0.0, (-5.0, 5.0))
WALL = gs.Mesh([(0, 0, -5), (0, 0, 5), (0, 2, 5), (0, 2, -5)], [(0, 1, 2), (0, 2, 3)])


def assert_lit(seen: Any, expected: Any, distance: Any, band: float = 5.0 * BAND) -> None:
    """Equal, except within a band of the shadow's border, given by the distances from it."""
    wrong = (seen != expected) & (np.abs(distance) > band)
    assert not wrong.any(), f"{wrong.sum()} of {len(wrong)} points"
    assert 0.1 < np.mean(seen) < 0.9


@pytest.fixture(scope="module")
def older() -> Iterator[Renderer]:
    """A driver of OpenGL 3.3."""
    with Renderer("egl") as older:
        older._context.caps = replace(
            older._context.caps, compute=False, max_storage_block=0, texture_gather=False, version_code=330
        )
        yield older


# -- closed forms


@pytest.mark.parametrize("scale", [1.0, 1e-6, 3e4])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (1e7, -1e7, 1e7)])
@pytest.mark.parametrize("named", [True, False])
def test_wall_in_the_sun(renderer: Renderer, scale: float, offset: tuple[float, float, float], named: bool) -> None:
    """Its shadow is two wide; scaled and moved as far as float64 resolves the points to a thousandth of the band."""
    if scale < 1.0 and any(offset):
        offset = (10.0, -10.0, 10.0)
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = offset
    scene = gs.Scene([gs.Node(FLOOR, matrix), gs.Node(WALL, matrix)])
    samples = sample_faces(scene, 2000)
    seen = renderer.visibility(scene, samples.points, [SUN], triangles=samples.triangles if named else None)[0]
    x, y, _ = ((samples.points - offset) / scale).T
    on = samples.triangles < 2
    gap = np.minimum(np.abs(x), np.abs(x - 2.0))
    assert_lit(
        seen[on], ~((x > 0.0) & (x < 2.0))[on], gap[on], 5.0 * BAND + 1e-16 * float(np.abs(offset).max()) / scale
    )
    assert (seen[~on] == 1.0).all()
    assert (y[~on] >= 0.0).all()


def test_square_and_two_layers(renderer: Renderer, rng: np.random.Generator) -> None:
    """Free points at several heights under two squares: dark below either."""
    scene = gs.Scene([FLOOR, sheet((0.0, 1.0), 2.0, (-1.0, 1.0)), sheet((0.5, 2.0), 3.0, (0.0, 1.0))])
    points = rng.uniform((-1.0, 0.1, -2.0), (3.0, 4.0, 2.0), (20000, 3))
    x, y, z = points.T
    seen = renderer.visibility(
        scene, points, [gs.DirectionalLight(direction=(0.0, -1.0, 0.0))], triangles=-np.ones(20000, int)
    )
    gap, dark = np.full(len(x), np.inf), np.zeros(len(x), dtype=bool)
    for low, high, near, far, height in ((0.0, 1.0, -1.0, 1.0, 2.0), (0.5, 2.0, 0.0, 1.0, 3.0)):
        dark |= (x > low) & (x < high) & (z > near) & (z < far) & (y < height)
        gap = np.minimum(gap, np.min(np.abs([x - low, x - high, z - near, z - far, y - height]), axis=0))
    assert_lit(seen[0], ~dark, gap)


@pytest.mark.parametrize("name", list(CASES))
def test_disc_behind_edges(renderer: Renderer, name: str) -> None:
    """A directional light that has a size: the visible part of the disc, to the steps of 1,024 sample points."""
    casters, exact = CASES[name]
    scene = sheets_over_floor(casters)
    x, z = np.linspace(-1.4, 1.4, 57), 0.37
    points = np.stack([x * HEIGHT * HALF, np.zeros_like(x), np.full_like(x, z * HEIGHT * HALF)], axis=1)
    light = gs.DirectionalLight(direction=(0.0, -1.0, 0.0), angle=float(np.degrees(2.0 * np.arctan(HALF))))
    seen = renderer.visibility(scene, points, [light], normals=np.tile(FLAT, (len(x), 1)), light_samples=1024)[0]
    # as tests/exact/test_soft_closed_forms.py: equal solid angles are not quite equal areas of the disc
    assert np.abs(seen - exact(x, np.full_like(x, z))).max() < 0.01
    assert np.ptp(seen) > 0.2


@pytest.mark.parametrize("alpha", [15.0, 45.0, 80.0])
def test_sky_beside_a_long_wall(renderer: Renderer, alpha: float) -> None:
    """A wall that rises to an elevation alpha and is long on both sides hides (1 - cos(alpha)) / 2 of the light: the integral of Lambert's
    cosine over the dome beyond the plane through the receiver and the wall's top. At its foot that is 1/2."""
    away, high = np.cos(np.radians(alpha)), np.sin(np.radians(alpha))
    wall = gs.Mesh(*shapes.rectangle((0.0, 0.0, -2e3), (0.0, 0.0, 4e3), (0.0, high, 0.0)))
    scene = gs.Scene([sheet((-5.0, 5.0), 0.0), wall])
    seen = renderer.visibility(scene, [(away, 0.0, 0.3)], [gs.SkyLight()], [FLAT], light_samples=1024)
    assert abs(seen[0, 0] - 0.5 * (1.0 + away)) < 2e-3  # 1,024 directions


def test_sky_in_the_corner_of_two_planes(renderer: Renderer) -> None:
    """On a floor at the foot of a high, long wall half of the light arrives, in a corner of two such walls a quarter."""
    high = 1e3
    walls = [
        gs.Mesh(*shapes.rectangle((0.0, 0.0, -high), (0.0, 0.0, 2.0 * high), (0.0, high, 0.0))),
        gs.Mesh(*shapes.rectangle((-high, 0.0, 0.0), (2.0 * high, 0.0, 0.0), (0.0, high, 0.0))),
    ]
    points = [(1e-2, 0.0, 1e-2)]
    for count, expected in ((1, 0.5), (2, 0.25)):
        scene = gs.Scene([sheet((-5.0, 5.0), 0.0, (-5.0, 5.0)), *walls[:count]])
        seen = renderer.visibility(scene, points, [gs.SkyLight()], [FLAT], light_samples=1024)
        assert abs(seen[0, 0] - expected) < 5e-3


def test_free_point_in_a_dome_sees_by_solid_angle(renderer: Renderer) -> None:
    """Without a normal all directions count alike: under a half plane over x < 0 half of them."""
    scene = gs.Scene([sheet((-1e4, 0.0), 1.0, (-1e4, 1e4))])
    seen = renderer.visibility(scene, [(0.0, 0.0, 0.0)], [gs.SkyLight()], light_samples=1024)
    assert abs(seen[0, 0] - 0.5) < 2e-3


def test_side_follows_normal_and_front(renderer: Renderer) -> None:
    """The front of a mirrored node is that of its mesh."""
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    lights = [gs.DirectionalLight(direction=(0.1, d, 0.0)) for d in (-1.0, 1.0)]
    for matrix in (np.eye(4), mirrored):
        scene = gs.Scene([gs.Node(FLOOR, matrix)])
        for triangles in ([1], None):
            for normal, expected in ((None, [1, 0]), (FLAT, [1, 0]), (-FLAT, [0, 1]), (0.0 * FLAT, [1, 0])):
                normals = None if normal is None else [normal]
                seen = renderer.visibility(scene, [(0.3, 0.0, 0.2)], lights, normals, triangles)
                assert seen[:, 0].tolist() == expected
    free = renderer.visibility(scene, [(0.3, 1.0, 0.2)], lights, [-FLAT], [-1])
    assert free[:, 0].tolist() == [0, 0]  # away from the light above; the floor is in front of the other


def test_own_triangle_of_points_beside_its_plane(renderer: Renderer) -> None:
    """A named point is moved into its triangle's plane; as a free point below the floor it is in the dark."""
    scene = gs.Scene([FLOOR])
    points = [(0.3, -1e-3, 0.2)]
    assert renderer.visibility(scene, points, [SUN], triangles=[1]).tolist() == [[1.0]]
    assert renderer.visibility(scene, points, [SUN], triangles=[-1]).tolist() == [[0.0]]


# -- float64 rays


def faceted(scene: gs.Scene) -> gs.Scene:
    """The scene without vertex normals: receivers on smooth meshes are moved."""
    return gs.Scene([replace(node, mesh=replace(node.mesh, normals=None)) for node in scene.nodes])


def random_points(scene: gs.Scene, count: int, rng: np.random.Generator) -> tuple[Array, NDArray[np.int64]]:
    """Points on faces, chosen by area."""
    faces = faces_of(scene)
    corners = face_corners(scene, faces)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = corners[chosen].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), faces[chosen]


def traced(
    scene: gs.Scene, light: Light, points: Array, triangles: NDArray[np.int64], normals: Array, tracer: Tracer
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether points are lit, by rays in float64, and whether that is certain: the same for points moved by the band."""
    _, _, casts = scene_triangles(scene)
    reach = float(np.abs(tracer.corners - tracer.corners.reshape(-1, 3).mean(axis=0)).max())

    def lit(places: Array, own: Any) -> NDArray[np.bool_]:
        towards, distance = light.to_light(places)
        least = 1e-12 * reach
        most = np.where(np.isinf(distance), 1e3 * reach, distance)
        found, _ = tracer.trace(places, np.ascontiguousarray(towards), least, most, own, casts, any_hit=True)
        return (found < 0) & (np.einsum("ij,ij->i", normals, towards) > 0.0) & light.shines_on(places)

    answer = lit(points, triangles)
    certain = np.ones(len(points), dtype=bool)
    for axis in np.concatenate([np.eye(3), -np.eye(3), np.ones((1, 3)), -np.ones((1, 3))]):
        certain &= lit(points + BAND * reach * axis, triangles) == answer
    return answer, certain


MODELS = {"chess_board.glb": "y", "terrain_jacksboro.ply": "z"}


def lights_around(scene: gs.Scene) -> list[Light]:
    low, high = scene.bounds
    size, middle = float((high - low).max()), 0.5 * (low + high)
    above = middle + size * np.array([0.13, 0.9, 0.21])
    return [
        gs.DirectionalLight(direction=(-0.41, -0.83, 0.29)),
        gs.DirectionalLight(direction=(0.9, -0.13, 0.21)),
        gs.PointLight(position=tuple(above)),
        gs.SpotLight(position=tuple(above), direction=(-0.1, -1.0, -0.2), inner_angle=20.0, outer_angle=30.0),
    ]


@pytest.mark.parametrize("name", ["courtyard", *MODELS])
def test_random_points_against_float64_rays(
    renderer: Renderer, models: Path, rng: np.random.Generator, name: str
) -> None:
    """No point is wrong outside of rounding, also where its triangle has to be found."""
    scene = gs.scenes.courtyard() if name == "courtyard" else gs.load(models / name, up_axis=MODELS[name], ground=True)
    scene = faceted(scene)
    points, triangles = random_points(scene, 4000, rng)
    normals, lights = fronts(scene, triangles), lights_around(scene)
    seen = renderer.visibility(scene, points, lights, triangles=triangles)
    found = renderer.visibility(scene, points, lights, normals)
    tracer = Tracer(scene_triangles(scene)[0])
    for row, also, light in zip(seen, found, lights, strict=True):
        answer, certain = traced(scene, light, points, triangles, normals, tracer)
        assert certain.mean() > 0.97
        assert ((row > 0.5) != answer)[certain].sum() == 0, light
        assert ((also > 0.5) != answer)[certain].sum() == 0, light


def test_soft_points_against_float64_rays(renderer: Renderer, rng: np.random.Generator) -> None:
    """Of each sample point of the light a ray: the counts are equal but for those within rounding."""
    scene = faceted(gs.scenes.courtyard())
    points, triangles = random_points(scene, 400, rng)
    normals = fronts(scene, triangles)
    tracer, (_, _, casts) = Tracer(scene_triangles(scene)[0]), scene_triangles(scene)
    above = (0.0, 5.35, 0.0)
    lights: list[Light] = [
        gs.DirectionalLight(direction=(-0.41, -0.83, 0.29), angle=4.0),
        gs.PointLight(position=above, radius=0.4),
        gs.RectLight(position=above, direction=(0.1, -1.0, 0.2), width=1.0, height=0.5),
    ]
    seen = renderer.visibility(scene, points, lights, triangles=triangles)
    for row, light in zip(seen, lights, strict=True):
        aims = light.to_points(points, 64)
        counts = np.zeros(len(points))
        for aim in aims.transpose(1, 0, 2):
            far = 1e3 if light.at_infinity else 1.0
            hit, _ = tracer.trace(points, np.ascontiguousarray(aim), 1e-9, far, triangles, casts, any_hit=True)
            counts += (hit < 0) & (np.einsum("ij,ij->i", normals, aim) > 0.0)
        counts *= light.shines_on(points)
        off = np.abs(np.rint(64.0 * row) - counts)
        assert off.max() <= 1.0  # a sample point within rounding of an edge
        assert (off > 0.0).mean() < 0.02
        assert ((row > 0.0) & (row < 1.0)).sum() > 5


# -- as pixels have them


def scenes() -> dict[str, Callable[[], gs.Scene]]:
    solid = gs.Mesh(*shapes.box((0.4, 0.4, 0.4)))
    mirrored = placed(1.0, 0.8, -1.0, 7) @ np.diag([1.0, -1.0, 1.0, 1.0])
    camera = gs.PerspectiveCamera((3.0, 5.0, 6.0), (0.0, 0.6, 0.0), fov_y=50.0)
    turned = [
        gs.Node(solid, placed(-1.0, 1.0, 0.0, 1)),
        gs.Node(solid, mirrored),
        gs.Node(solid, placed(0.2, 0.7, 0.9, 2)),
    ]
    return {
        "instances, one mirrored": lambda: gs.Scene([ground(), *turned], camera),
        "cut-out": lambda: gs.Scene([ground(), gs.Node(leaf(leaves()), placed(-0.5, 1.0, 0.0, 1)), turned[0]], camera),
        "neither casts nor receives": lambda: gs.Scene(
            [ground(), replace(turned[0], casts=False), replace(turned[1], receives=False), turned[2]], camera
        ),
        "blended": lambda: gs.Scene(
            [ground(), gs.Node(replace(solid, material=gs.Material((1, 1, 1, 0.5), alpha_mode=gs.AlphaMode.BLEND)), placed(0.5, 1.5, 0.0)),
             *turned], camera),
        "smooth": lambda: gs.Scene([ground(), *smooth_balls()], camera),
        "balls and tubes": lambda: gs.Scene(
            [ground(), gs.Points([(0.2, 1.0, 0.3)], radius=0.4), gs.Lines([(-1, 1, 0), (1, 2, 0)], [(0, 1)], radius=0.1), turned[0]], camera
        ),
    }  # fmt: skip


def smooth_balls() -> list[gs.Node]:
    positions, triangles = shapes.icosphere(2, 1.0)
    mesh = gs.Mesh(positions, triangles, normals=positions / np.linalg.norm(positions, axis=1, keepdims=True))
    matrix = np.diag([0.7, 0.7, 0.7, 1.0])
    matrix[:3, 3] = 0.3, 1.2, 0.2
    return [gs.Node(mesh, matrix)]


SOFT: dict[str, Light] = {
    "wide sun": gs.DirectionalLight(direction=(-0.4, -1.0, 0.3), angle=8.0),
    "ball": gs.PointLight(position=(0.3, 3.6, 0.2), radius=0.5),
    "wide spot": gs.SpotLight(position=(0.3, 3.6, 0.2), direction=(0, -1, 0), outer_angle=40.0, radius=0.4),
    "rectangle": gs.RectLight(position=(0.3, 3.6, 0.2), direction=(0.1, -1, 0), width=1.5, height=0.7),
    "sky": gs.SkyLight(),
    "no shadow": gs.DirectionalLight(direction=(-0.4, -1.0, 0.3), shadow=None),
}


@pytest.mark.parametrize("name", list(scenes()))
def test_pixels_as_points(renderer: Renderer, name: str) -> None:
    """The points, triangles and normals that an image shows give the image's visibility."""
    scene = scenes()[name]()
    lights = [LIGHTS["sun"], LIGHTS["point light among them"], *SOFT.values()]
    exact = [replace(each, shadow=each.shadow and gs.Shadow(filter=gs.Exact(light_samples=16))) for each in lights]
    frame = renderer.render(scene, lights=exact, size=(64, 40), samples=1,
                            outputs=("visibility", "triangle", "position", "normal", "node"))  # fmt: skip
    shown = frame.triangle >= 0
    round_ = np.array([node.mesh.count != len(node.mesh.triangles) for node in scene.nodes])
    shown &= ~round_[frame.node]
    points, normals, triangles = frame.position[shown], frame.normal[shown], frame.triangle[shown]
    seen = renderer.visibility(scene, points, lights, normals, triangles, light_samples=16)
    expected = frame.visibility[:, shown]
    off = np.abs(seen - expected)
    # float32 of a pixel's ray and of its point differ: at silhouettes a hard shadow, or one of 16 sample points
    assert (off > 1.5 / 16.0).sum(axis=1).max() <= 3, [int(n) for n in (off > 1.5 / 16.0).sum(axis=1)]
    assert off.mean() < 2e-3
    assert (seen[:-1].min(axis=1) < 0.95).all()


def test_points_on_what_is_not_drawn(renderer: Renderer) -> None:
    """A triangle that blends does not block light; its points receive it on their side."""
    blended = replace(FLOOR, material=gs.Material((1, 1, 1, 0.5), alpha_mode=gs.AlphaMode.BLEND))
    scene = gs.Scene([gs.Node(WALL), gs.Node(blended)])
    points = [(1.0, 0.0, 0.0), (3.0, 0.0, 0.0), (3.0, 0.0, 0.0)]
    seen = renderer.visibility(scene, points, [SUN], [FLAT, FLAT, -FLAT], [2, 3, 2])
    assert seen.tolist() == [[0.0, 1.0, 0.0]]


# -- order and parts


def test_answers_do_not_depend_on_order_and_parts(
    renderer: Renderer, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = gs.scenes.courtyard()
    points, triangles = random_points(scene, 3000, rng)
    points = np.concatenate([points, rng.uniform(-30.0, 30.0, (200, 3))])
    triangles = np.append(triangles, np.full(200, -1))
    lights = [gs.DirectionalLight(), SOFT["wide sun"], SOFT["ball"], SOFT["sky"]]
    whole = renderer.visibility(scene, points, lights, triangles=triangles, light_samples=16)
    order = rng.permutation(len(points))
    assert (renderer.visibility(scene, points[order], lights, None, triangles[order], 16) == whole[:, order]).all()
    monkeypatch.setattr(points_module, "PART", 1801)
    monkeypatch.setattr(coherence, "_FEW", 100)  # these are sorted along a curve
    told: list[tuple[int, int, str]] = []
    parts = renderer.visibility(scene, points, lights, None, triangles, 16, lambda *each: told.append(each))
    assert (parts == whole).all()
    assert [each[0] for each in told] == sorted(each[0] for each in told)
    assert told[-1][:2] == (len(lights) * len(points),) * 2
    with Renderer("egl") as fresh:
        assert (fresh.visibility(scene, points[7:8], lights[0], None, triangles[7:8]) == whole[:1, 7:8]).all()


def test_lists_are_kept(renderer: Renderer) -> None:
    """A second call with the same scene and light builds no lists."""
    scene = gs.Scene([FLOOR, WALL])
    made = renderer._cache.point_techniques._made  # type: ignore[union-attr]
    renderer.visibility(scene, [(1.0, 0.0, 0.0)], [SUN])
    builds = {key: each.builds for key, each in made.items() if hasattr(each, "builds")}
    renderer.visibility(scene, [(1.0, 0.0, 0.0), (3.0, 0.0, 0.0)], [SUN])
    assert builds == {key: each.builds for key, each in made.items() if hasattr(each, "builds")}
    assert builds


# -- without OpenGL 4.3


def test_without_compute(older: Renderer, renderer: Renderer, rng: np.random.Generator) -> None:
    scene = gs.Scene([FLOOR, WALL])
    points, triangles = random_points(scene, 3000, rng)
    lights = [
        SUN,
        gs.PointLight(position=(1.0, 3.0, 0.0)),
        gs.SkyLight(),
        gs.DirectionalLight(direction=(1, -1, 0), angle=6.0),
    ]
    for numbers in (triangles, None):
        seen = older.visibility(scene, points, lights, triangles=numbers, light_samples=16)
        expected = renderer.visibility(scene, points, lights, triangles=numbers, light_samples=16)
        assert ((seen - expected) != 0.0).sum() <= 2


# -- arguments


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"points": [(0.0, 0.0)]}, r"points must be an array \(N, 3\)"),
        ({"points": "many"}, r"points must be an array \(N, 3\)"),
        ({"points": [(0.0, 0.0, 0.0), (np.nan, 0.0, 0.0)]}, "points must be finite: 1 of 2"),
        ({"points": [(0.0, 0.0, 0.0), (0.0, 1e30, 0.0)]}, "points must be within 1e[+]20"),
        ({"normals": [(0.0, 1.0, 0.0)]}, r"normals must be an array \(2, 3\)"),
        ({"normals": [(0.0, 1.0, 0.0), (np.inf, 0.0, 0.0)]}, "normals must be finite"),
        ({"triangles": [0]}, r"triangles must be an array \(2,\)"),
        ({"triangles": [0.0, 1.0]}, r"triangles must be an array \(2,\) of integers"),
        ({"triangles": [0, 5]}, "triangles must be numbers of the scene's 5 triangles, from 0, or -1 for none: got 5"),
        ({"triangles": [0, -2]}, "got -2"),
        ({"triangles": [0, 4]}, "triangles has 1 numbers of balls or tubes"),
        ({"light_samples": 3}, "light_samples must be"),
        ({"progress": 1}, "progress must be"),
        ({"lights": "sun"}, "lights"),
    ],
)  # fmt: skip
def test_bad_arguments(renderer: Renderer, changed: dict[str, Any], message: str) -> None:
    scene = gs.Scene([FLOOR, WALL, gs.Points([(0.0, 3.0, 0.0)], radius=0.1)])
    given: dict[str, Any] = {"points": [(1.0, 0.0, 0.0), (3.0, 0.0, 0.0)], "lights": SUN}
    with pytest.raises(gs.SettingsError, match=message):
        renderer.visibility(scene, **(given | changed))


def test_scene_that_is_none(renderer: Renderer) -> None:
    with pytest.raises(gs.SceneError, match=r"a glshadow\.Scene is needed"):
        renderer.visibility(FLOOR, [(0.0, 0.0, 0.0)])  # type: ignore[arg-type]


def test_no_points_and_no_lights(renderer: Renderer) -> None:
    scene = gs.Scene([FLOOR])
    assert renderer.visibility(scene, np.zeros((0, 3)), [SUN]).shape == (1, 0)
    assert renderer.visibility(scene, np.zeros((2, 3)), []).shape == (0, 2)


def test_function_with_its_own_renderer() -> None:
    seen = gs.visibility(gs.Scene([FLOOR, WALL]), [(1.0, 0.0, 0.0), (3.0, 0.0, 0.0)], SUN)
    assert seen.dtype == np.float32
    assert seen.tolist() == [[0.0, 1.0]]


@pytest.mark.parametrize("length", [1e-300, 1e-60, 1.0, 1e300])
def test_normals_may_have_any_length(renderer: gs.Renderer, length: float) -> None:
    floor = gs.Scene([gs.Mesh(np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1.0]]), [[0, 2, 1], [0, 3, 2]])])
    down = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
    normals = [[0.0, length, 0.0], [0.0, -length, 0.0]]
    seen = renderer.visibility(floor, [[0.0, 0.5, 0.1]] * 2, [down], normals)
    np.testing.assert_array_equal(seen, [[1.0, 0.0]])
