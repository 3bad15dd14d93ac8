"""Outlines of shadows: closed forms, areas, scales, places, and every pixel of a plane against `Exact()` and against the tracer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

import glshadow as gs
from glshadow.outlines.casters import casters_of
from glshadow.outlines.planes import plane_of
from glshadow.outlines.projected import Projection

from ..tolerances import RTOL_FLOAT64
from .solids import box, disc, moved, sheet, torus

SUN = gs.DirectionalLight(direction=(-1.0, -1.0, 0.0))
CUBE = gs.Scene([gs.Node(box((-0.5, 0.0, -0.5), (0.5, 1.0, 0.5)), name="cube")]).with_ground()
GROUND = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
UNDER = gs.DirectionalLight(direction=(0.0, 1.0, 0.0))


def corners(outline: gs.ShadowOutline) -> set[tuple[float, float]]:
    """The corners of a single polygon without collinear points."""
    ((exterior, holes),) = outline.polygons
    assert holes == ()
    return {
        (round(x, 12), round(y, 12))
        for x, y in shapely.get_coordinates(shapely.Polygon(exterior).simplify(0.0)).tolist()
    }


def test_box_under_a_sun_is_its_sweep() -> None:
    outline = gs.shadow_outline(CUBE, SUN)
    assert outline.area == pytest.approx(2.0, rel=RTOL_FLOAT64)
    assert corners(outline) == {(0.5, 0.5), (-1.5, 0.5), (-1.5, -0.5), (0.5, -0.5)}
    assert outline.nodes == ("cube",)


@pytest.mark.parametrize("sides", [3, 64, 1000])
def test_disc_under_a_sun_keeps_its_area(sides: int) -> None:
    scene = gs.Scene([gs.Node(disc(sides, 2.0), name="disc")])
    outline = gs.shadow_outline(scene, gs.DirectionalLight(direction=(0.3, -1.0, 0.2)), GROUND)
    assert outline.area == pytest.approx(0.5 * sides * np.sin(2.0 * np.pi / sides), rel=RTOL_FLOAT64)
    middle = np.asarray(outline.geometry.centroid.coords[0])
    np.testing.assert_allclose(middle, (0.6, -0.4), rtol=RTOL_FLOAT64)  # v is -z


def test_square_under_a_point_light_is_scaled_from_its_foot() -> None:
    square = sheet([(-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)])
    light = gs.PointLight(position=(0.5, 3.0, 0.25))
    outline = gs.shadow_outline(gs.Scene([square]), light, GROUND)
    assert outline.area == pytest.approx(4.0 * 1.5**2, rel=RTOL_FLOAT64)
    x, v = 0.5 * (1.0 - 1.5), -0.25 * (1.0 - 1.5)
    assert corners(outline) == {(x + a, v + b) for a in (-1.5, 1.5) for b in (-1.5, 1.5)}


def test_area_light_gives_the_outline_of_its_centre() -> None:
    rect = gs.RectLight(position=(0.0, 4.0, 0.0), width=1.0, height=2.0)
    point = gs.PointLight(position=(0.0, 4.0, 0.0))
    assert gs.shadow_outline(CUBE, rect).area == gs.shadow_outline(CUBE, point).area


def test_ring_has_a_hole() -> None:
    scene = gs.Scene([torus(2.0, 0.5, 3.0)])
    outline = gs.shadow_outline(scene, gs.DirectionalLight(direction=(0.0, -1.0, 0.0)), GROUND)
    ((exterior, holes),) = outline.polygons
    assert len(holes) == 1
    polygon_area = 12.0 * np.sin(2.0 * np.pi / 24)  # of a regular 24-gon with radius 1
    assert outline.area == pytest.approx(polygon_area * (2.5**2 - 1.5**2), rel=RTOL_FLOAT64)
    assert shapely.Polygon(exterior).exterior.is_ccw
    assert not shapely.LinearRing(holes[0]).is_ccw


def test_union_counts_common_ground_once() -> None:
    left, right = box((0, 1, 0), (2, 2, 2)), box((1, 3, 0), (3, 4, 2))
    scene = gs.Scene([gs.Node(left, name="left"), gs.Node(right, name="right")])
    down = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
    areas = [gs.shadow_outline(scene, down, GROUND, of).area for of in ("left", "right", None, [0, 1])]
    np.testing.assert_allclose(areas, [4.0, 4.0, 6.0, 6.0], rtol=RTOL_FLOAT64)


def test_casters_below_the_plane_cast_nothing_and_others_are_clipped() -> None:
    scene = gs.Scene([box((-1, -1, -1), (1, 1, 1))])
    down = gs.DirectionalLight(direction=(-1.0, -1.0, 0.0))
    at = lambda height: gs.shadow_outline(scene, down, ((0, height, 0), (0, 1, 0))).area  # noqa: E731
    np.testing.assert_allclose([at(0.0), at(0.5), at(-1.0)], [4 + 2, 4 + 1, 4 + 4], rtol=RTOL_FLOAT64)
    assert at(1.0) == at(2.0) == 0.0


def test_a_plane_has_two_sides() -> None:
    scene = gs.Scene([box((-1, -3, -1), (1, -2, 1))])
    up = gs.DirectionalLight(direction=(0.0, 1.0, 0.0))
    for normal in ((0, 1, 0), (0, -2, 0)):
        assert gs.shadow_outline(scene, up, ((0, 0, 0), normal)).area == pytest.approx(4.0, rel=RTOL_FLOAT64)
    assert gs.shadow_outline(scene, SUN, GROUND).geometry.is_empty


def test_light_under_the_ground_casts_nothing_of_what_stands_on_it() -> None:
    outline = gs.shadow_outline(CUBE, UNDER)
    assert (outline.area, outline.polygons, outline.nodes) == (0.0, (), ())


def test_what_is_beyond_the_light_casts_nothing() -> None:
    scene = gs.Scene([box((-1, 5, -1), (1, 6, 1))])
    assert gs.shadow_outline(scene, gs.PointLight(position=(0, 4, 0)), GROUND).area == 0.0


def test_shadow_without_end_needs_bounds() -> None:
    wall = gs.Scene([sheet([(1, 0, -1), (1, 4, -1), (1, 4, 1), (1, 0, 1)])])
    light = gs.PointLight(position=(0.0, 2.0, 0.0))
    with pytest.raises(gs.SettingsError, match=r"'node' has no end, as it reaches the light's height.*bounds"):
        gs.shadow_outline(wall, light, GROUND)
    outline = gs.shadow_outline(wall, light, GROUND, bounds=((-3, -9), (3, 9)))
    assert outline.area == pytest.approx(
        0.5 * (2 + 6) * 2, rel=RTOL_FLOAT64
    )  # a trapezoid: x from 1 to 3, as wide as 2 x


def test_light_inside_a_box_is_dark_all_around() -> None:
    scene = gs.Scene([box((-1, 0.5, -1), (1, 2, 1))])
    outline = gs.shadow_outline(scene, gs.PointLight(position=(0, 1, 0)), GROUND, bounds=((-8, -8), (8, 8)))
    assert outline.area == pytest.approx(256.0, rel=RTOL_FLOAT64)


@pytest.mark.parametrize("light", [SUN, gs.PointLight(position=(3.0, 4.0, 1.0))], ids=lambda each: each.spelling)
@pytest.mark.parametrize(("scale", "shift"), [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e7)])
def test_scale_and_place_do_not_matter(light: gs.Light, scale: float, shift: float) -> None:
    scene = gs.Scene([torus(1.0, 0.4, 1.0), box((0.2, 0, 0.1), (0.6, 3, 0.4))]).with_ground()
    place = shift * np.array([1.0, 0.0, -1.0])
    there = light if light.at_infinity else gs.PointLight(position=tuple(scale * np.asarray(light.place[:3]) + place))
    here, far = gs.shadow_outline(scene, light), gs.shadow_outline(moved(scene, scale, place), there)
    rounding = RTOL_FLOAT64 + 64 * np.spacing(shift)  # of vertices moved to 1e7
    assert far.area == pytest.approx(here.area * scale**2, rel=rounding)
    back = shapely.transform(far.geometry, lambda each: (each - place[[0, 2]] * (1, -1)) / scale)
    assert shapely.symmetric_difference(here.geometry, back).area < 10 * rounding * here.area


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 0, 1), (0.3, 0.5, -0.8)])
def test_tilted_plane_is_a_rotated_scene(normal: tuple[float, float, float]) -> None:
    """A sphere under a light along the normal: a disc, whose place in the world is the sphere's foot."""
    unit = np.asarray(normal) / np.linalg.norm(normal)
    rng = np.random.default_rng(5)
    points = rng.normal(size=(200, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    hull = shapely.MultiPoint(points @ np.linalg.svd(unit[None])[2][1:].T).convex_hull
    import scipy.spatial

    scene = gs.Scene([gs.Mesh(points + 3.0 * unit, scipy.spatial.ConvexHull(points).simplices)])
    outline = gs.shadow_outline(scene, gs.DirectionalLight(direction=tuple(-unit)), ((0, 0, 0), normal))
    assert outline.area == pytest.approx(hull.area, rel=1e-11)
    ((ring, _),) = outline.world
    assert np.abs(ring @ unit).max() < 1e-14
    np.testing.assert_allclose(np.cross(*outline.axes), outline.normal, atol=1e-15)
    assert outline.contains(points + 3.0 * unit - 1e-6 * (points - unit * (points @ unit)[:, None])).all()


def test_projected_triangles_and_their_union_agree() -> None:
    """The winding of unshared edges against the union of every triangle."""
    rng = np.random.default_rng(3)
    soup = gs.Mesh(rng.normal((0.0, 6.0, 0.0), size=(60, 3)), rng.integers(0, 60, size=(150, 3)))
    scene = gs.Scene([gs.Node(soup), gs.Node(torus(1.5, 0.3, 5.0))])
    light = gs.PointLight(position=(1.0, 20.0, 2.0))
    outline = gs.shadow_outline(scene, light, GROUND)
    projection = Projection.of(plane_of(scene, GROUND), light, scene.extent)
    parts = []
    for caster in casters_of(scene, [0, 1], projection.middle):
        rows, triangles = projection.projected(caster, None)
        parts += list(shapely.polygons((rows[:, :2] / rows[:, 2:3])[triangles]))
    whole = shapely.union_all(np.array([each for each in parts if each.area > 0.0]))
    assert outline.area * projection.scale**2 == pytest.approx(whole.area, rel=1e-11)


@pytest.mark.parametrize(
    "light",
    [gs.DirectionalLight(direction=(-1.0, -1.3, 0.4)), gs.PointLight(position=(2.5, 5.0, 2.0)),
     gs.SpotLight(position=(-2.0, 6.0, 1.0), direction=(0.3, -1.0, 0.0), outer_angle=60.0)],
    ids=lambda each: each.spelling,
)  # fmt: skip
def test_every_pixel_of_the_plane_is_that_of_exact_and_of_the_tracer(renderer: gs.Renderer, light: gs.Light) -> None:
    scene = gs.Scene(
        [
            torus(1.2, 0.3, 1.5),
            box((-0.3, -0.2, -0.3), (0.3, 0.7, 0.3)),
            sheet([(-2, 0, 1), (-1, 1, 1), (-1, 1, 2), (-2, 0, 2)]),
        ]
    ).with_ground()
    scene = gs.Scene(
        [*scene.nodes[:-1], gs.Node(sheet([(-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6)]), name="floor")]
    )
    camera = gs.OrthographicCamera((0.0, 30.0, 0.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), height=10.0)
    size = (160, 160)
    outline = gs.shadow_outline(scene, light, "floor")
    frame = renderer.render(scene, camera, light, size, outputs=("visibility", "node", "position"), samples=1)
    traced = gs.trace(scene, camera, light, size, samples=1)
    seen = frame.node == 3
    assert 0.5 < seen.mean() < 1.0
    inside = outline.contains(frame.position[seen])
    pixel = camera.height / size[1]
    places = shapely.points(frame.position[seen][:, 0], -frame.position[seen][:, 2])
    border = shapely.distance(places, outline.geometry.boundary) < 1e-4 * pixel
    assert border.mean() < 0.01
    shone = light.shines_on(frame.position[seen])
    assert (~inside & ~border).any()
    assert (inside & ~border).sum() > 500
    for visibility, counted in ((frame.visibility, ~border), (traced.visibility, ~border & shone)):
        np.testing.assert_array_equal((visibility[0][seen] == 0.0)[counted], inside[counted])


def test_model_equals_its_traced_shadow(models: Path) -> None:
    scene = gs.load(models / "cesium_man.glb", ground=True)
    light = gs.DirectionalLight(direction=(-1.0, -1.0, 0.4))
    outline = gs.shadow_outline(scene, light)
    rng = np.random.default_rng(1)
    low, high = np.array(outline.geometry.bounds).reshape(2, 2)
    points = rng.uniform(low, high, size=(4000, 2))
    apart = shapely.distance(shapely.points(points), outline.geometry.boundary) > 1e-6 * (high - low).max()
    rays = gs.trace(scene, size=(8, 8)).rays
    start = np.stack([points[:, 0], np.full(4000, scene.lowest()), -points[:, 1]], axis=1) - rays.origin
    own = np.full(4000, len(rays.node) - 1, dtype=np.int32)
    aim = np.broadcast_to(-np.asarray(light.direction), start.shape)
    blocked = rays.blocked(own, start, aim, np.full(4000, np.inf))[0]
    np.testing.assert_array_equal(outline.contains(points)[apart], blocked[apart])


def test_cut_out_casters_count_whole_and_are_named() -> None:
    leaf = sheet([(-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)])
    cut = gs.Material(color=(1, 1, 1, 0.2), alpha_mode=gs.AlphaMode.MASK)
    mesh = gs.Mesh(leaf.positions, leaf.triangles, material=cut)
    scene = gs.Scene([gs.Node(mesh, name="leaf"), gs.Node(leaf, name="other")])
    with pytest.warns(gs.GlshadowWarning, match=r"\(MASK\) count with their whole triangles in an outline: 'leaf'$"):
        assert gs.shadow_outline(scene, SUN, GROUND, "leaf").area == pytest.approx(4.0)


def test_what_blends_or_does_not_cast_leaves_no_outline() -> None:
    leaf = sheet([(-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)])
    window = gs.Mesh(
        leaf.positions, leaf.triangles, material=gs.Material((1, 1, 1, 0.5), alpha_mode=gs.AlphaMode.BLEND)
    )
    scene = gs.Scene([gs.Node(window), gs.Node(leaf, casts=False)])
    assert gs.shadow_outline(scene, SUN, GROUND).area == 0.0


def test_geojson_has_the_coordinates_and_the_named_crs(tmp_path: Path) -> None:
    outline = gs.shadow_outline(CUBE, SUN)
    written = outline.to_geojson(tmp_path / "a.geojson", crs="EPSG:25832", offset=(400000.0, 5700000.0))
    assert json.loads((tmp_path / "a.geojson").read_text()) == written
    (feature,) = written["features"]
    assert written["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::25832"
    assert feature["geometry"]["type"] == "MultiPolygon"
    ring = np.array(feature["geometry"]["coordinates"][0][0])
    assert (ring.min(axis=0) == (399998.5, 5699999.5)).all()
    assert shapely.LinearRing(ring).is_ccw
    assert feature["properties"] == {"area": pytest.approx(2.0), "nodes": ["cube"], "light": "sun"}
    assert "crs" not in outline.to_geojson()
    assert shapely.from_geojson(json.dumps(feature["geometry"])).is_valid


def test_svg_draws_v_up(tmp_path: Path) -> None:
    triangle = gs.Mesh(np.array([[0.0, 1, 0], [4, 1, 0], [0, 1, -2]]), np.array([[0, 1, 2]]))
    outline = gs.shadow_outline(gs.Scene([triangle]), gs.DirectionalLight(direction=(0, -1, 0)), GROUND)
    drawing = outline.to_svg(tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_text() == drawing
    assert 'viewBox="-2.08 -1.08 4.16 2.16"' in drawing
    path = drawing.split('d="')[1].split('"')[0]
    points = {tuple(map(float, each.split())) for each in path.strip("MZ").split("L")}
    assert points == {(-2.0, 1.0), (2.0, 1.0), (-2.0, -1.0)}  # the corner with the largest v is at the top
    empty = gs.shadow_outline(CUBE, UNDER).to_svg()
    assert 'd=""' in empty


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"light": gs.DirectionalLight(direction=(1, 0, 0))}, "parallel to the plane"),
        ({"light": gs.PointLight(position=(5, 0, 0))}, "parallel to the plane"),
        ({"light": gs.SkyLight()}, "needs a light from one direction or place, got SkyLight"),
        ({"light": "sun"}, "light must be"),
        ({"plane": "roof"}, r"plane must be nodes of the scene.*'cube', 'ground'.*got 'roof'"),
        ({"plane": "cube"}, "plane must be flat, and Node 'cube' leaves its plane by 0.5 "),
        ({"plane": ((0, 0, 0), (0, 0, 0))}, "plane's normal must not be the zero vector"),
        ({"plane": ((0, 0, 0), (0, 1, 0), 3)}, "plane must be a point and a normal, a node or None"),
        ({"plane": ((0, 0, np.nan), (0, 1, 0))}, "plane's point must be 3 finite numbers"),
        ({"of": ["cube", 7]}, "of must be nodes of the scene.*indices from 0 to 1.*got 7"),
        ({"bounds": ((0, 0), (0, 1))}, r"bounds must be \(\(u, v\), \(u, v\)\)"),
    ],
    ids=[
        "directional", "point", "dome", "type", "name", "solid", "zero", "three", "nan", "index", "order",
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(gs.SettingsError, match=message):
        gs.shadow_outline(CUBE, **{"light": SUN, **arguments})  # type: ignore[arg-type]


def test_points_and_lines_are_refused() -> None:
    scene = gs.Scene([gs.Node(gs.Points(np.array([[0.0, 1.0, 0.0]]), radius=0.1), name="dots"), CUBE.nodes[0]])
    with pytest.raises(gs.SceneError, match=r"'dots' has points or lines.*leave it out with of="):
        gs.shadow_outline(scene, SUN, GROUND)
    assert gs.shadow_outline(scene, SUN, GROUND, of="cube").area == pytest.approx(2.0)


def test_files_and_points_that_are_wrong_are_named(tmp_path: Path) -> None:
    outline = gs.shadow_outline(CUBE, SUN)
    for call, message in (
        (lambda: outline.to_geojson(tmp_path / "a.txt"), r"path must end in .geojson or .json, got a.txt"),
        (lambda: outline.to_geojson(offset=(1.0,)), "offset must be 2 finite numbers"),
        (lambda: outline.to_svg(tmp_path / "a.png"), "path must end in .svg"),
        (lambda: outline.to_svg(fill='"/>'), "fill must be a colour"),
        (lambda: outline.contains([1.0]), r"points must be an array \(..., 2\) or \(..., 3\)"),
    ):
        with pytest.raises(gs.SettingsError, match=message):
            call()  # type: ignore[no-untyped-call]
    with pytest.raises(gs.GlshadowError, match="cannot be written"):
        outline.to_svg(tmp_path / "missing" / "a.svg")
    with pytest.raises(gs.SceneError, match=r"glshadow\.Scene is needed"):
        gs.shadow_outline(3)  # type: ignore[arg-type]


def test_without_shapely_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "shapely", None)
    with pytest.raises(gs.GlshadowError, match=r"pip install 'glshadow\[outline\]'"):
        gs.shadow_outline(CUBE, SUN)


def test_a_failure_of_shapely_is_a_named_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise shapely.errors.GEOSException("TopologyException")

    monkeypatch.setattr(shapely, "union_all", failing)
    with pytest.raises(gs.GlshadowError, match="shapely could not unite the shadows: TopologyException"):
        gs.shadow_outline(CUBE, SUN)
