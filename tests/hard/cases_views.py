"""N14 to N24: the directions of light and camera, and places that the map does not cover."""

from __future__ import annotations

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.lights import DirectionalLight, PointLight, SpotLight
from glshadow.scene.mesh import Mesh
from glshadow.scenes import analytic, shapes
from glshadow.scenes.analytic import AnalyticScene

from .registry import AS_DEFAULT, MOMENTS, Case, Picture, crease, overhead, picture_of, sun_direction
from .solids import checker, level, posts, scene_of


def masks() -> list[Picture]:
    """2 m of 8 x 8 cells over the ground: once with texels of 3.1 cm as in the table, once finer than the map's texel."""
    camera = overhead((-2.4, 0.6), (-1.5, 1.5), 0.9)
    ground, sun = level((-4.0, 2.0), (-3.0, 3.0)), DirectionalLight(direction=sun_direction(45.0))
    pictures = []
    for texels, cutoff, resolution in ((64, 0.5, 1024), (64, 0.25, 1024), (64, 0.75, 1024), (1024, 0.5, 256)):
        mesh = checker(texels, 8, 1.0, 1.0, cutoff)
        scene = scene_of({"ground": ground, "leaves": mesh}, camera, sun, "checker")
        pictures.append(
            Picture(f"checker of {texels} texels, cutoff {cutoff:g}", scene, sun, camera, resolution=resolution)
        )
    local_light = PointLight(position=(1.0, 4.0, 0.5))
    wide = overhead((-2.0, 2.0), (-2.0, 2.0), 0.9)
    scene = scene_of({"ground": ground, "leaves": checker(64, 8, 1.0, 1.0, 0.5)}, wide, local_light, "checker")
    pictures.append(Picture("checker, point light", scene, local_light, wide))
    return pictures


def duels() -> list[Picture]:
    """The light shines into the camera; posts over 100 m of ground."""
    places = [(x + 0.3 * (z % 7), z) for z in np.arange(-2.0, -60.0, -6.0).tolist() for x in (-3.0, 0.4, 3.5)]
    parts = {"ground": level((-50.0, 50.0), (-90.0, 10.0)), "posts": posts(places, 0.25, 1.5)}
    camera = PerspectiveCamera((0.0, 1.7, 4.0), (0.0, 1.0, -6.0), fov_y=60.0)
    pictures = []
    for elevation in (3.0, 1.0, 5.0):
        e = np.radians(elevation)
        sun = DirectionalLight(direction=(0.0, -float(np.sin(e)), float(np.cos(e))))
        scene = scene_of(parts, camera, sun, "duel")
        pictures.append(Picture(f"duel, sun {elevation:g} degrees high", scene, sun, camera, resolution=2048))
    local_light = SpotLight(position=(0.0, 6.0, -75.0), direction=(0.0, -0.08, 1.0), inner_angle=30.0, outer_angle=40.0)
    scene = scene_of(parts, camera, local_light, "duel")
    pictures.append(Picture("duel, spot", scene, local_light, camera, resolution=2048))
    return pictures


def backs() -> list[Picture]:
    """Sheets lit from behind, thinner than any bias: their visible side and the inside of a hut of them are dark."""
    sun = DirectionalLight(direction=(0.3, -0.4, 1.0))  # towards the camera
    camera = PerspectiveCamera((0.0, 1.2, 6.0), (0.0, 0.7, 0.0))
    ground = level((-3.0, 3.0), (-3.0, 4.0))
    sheet = shapes.rectangle((-1.0, 0.2, 0.0), (2.0, 0.0, 0.0), (0.0, 1.5, 0.0))
    thin = shapes.box((2.0, 1.5, 1e-4), (0.0, 0.95, 0.0))
    pictures = [
        Picture(f"{name} lit from behind", scene_of({"ground": ground, name: solid}, camera, sun, name), sun, camera)
        for name, solid in (("sheet", sheet), ("slab of 0.1 mm", thin))
    ]
    # From inside a hut of sheets without thickness only light through the door is visible.
    walls = [
        shapes.rectangle((-2.0, 0.0, -2.0), (4.0, 0.0, 0.0), (0.0, 2.0, 0.0)),
        shapes.rectangle((-2.0, 0.0, -2.0), (0.0, 0.0, 4.0), (0.0, 2.0, 0.0)),
        shapes.rectangle((2.0, 0.0, -2.0), (0.0, 0.0, 4.0), (0.0, 2.0, 0.0)),
        level((-2.0, 2.0), (-2.0, 2.0), 2.0),
    ]
    hut = {"ground": level((-6.0, 6.0), (-6.0, 6.0)), "hut": shapes.joined(walls)}
    outside = DirectionalLight(direction=(-0.5, -0.9, -0.7))
    eye = PerspectiveCamera((1.5, 1.6, 1.7), (-1.0, 0.2, -1.5), fov_y=80.0)
    pictures.append(Picture("hut", scene_of(hut, eye, outside, "hut"), outside, eye))
    local_light = PointLight(position=(3.0, 4.0, 3.0))
    pictures.append(Picture("hut, point light", scene_of(hut, eye, local_light, "hut"), local_light, eye))
    return pictures


def ranges() -> list[Picture]:
    """Depth 0 to 10 from the world's origin, a plane at light depth 12: beyond far. Nothing casts on it."""
    camera = PerspectiveCamera((3.0, -8.0, 6.0), (0.0, -12.0, 0.0))
    parts = {"ground": level((-4.0, 4.0), (-4.0, 4.0), -12.0)}
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0), near=0.0, far=10.0)
    spot = SpotLight(position=(0.0, 0.0, 0.0), near=0.1, far=10.0, inner_angle=40.0, outer_angle=45.0)
    local_light = PointLight(position=(0.0, 0.0, 0.0), near=0.1, far=10.0)
    tilted = DirectionalLight(direction=(0.5, -1.0, 0.2), near=0.0, far=9.0)
    return [
        Picture(f"beyond far, {name}", scene_of(parts, camera, light, "beyond far"), light, camera, dark=False)
        for name, light in (("sun", sun), ("spot", spot), ("point light", local_light), ("low sun", tilted))
    ]


def borders() -> list[Picture]:
    """A spot of half-width 5 on a receiver of 40 x 40; and a directional light whose map covers the visible 10 x 10."""
    camera = overhead((-20.0, 20.0), (-20.0, 20.0), 30.0)
    half = float(np.degrees(np.arctan(0.5)))
    built = analytic.plates(gap=4.0, lamp_height=10.0)
    parts = {"ground": level((-20.0, 20.0), (-20.0, 20.0)), "plate": level((-1.0, 1.0), (-1.0, 1.0), 4.0)}
    spot = SpotLight(position=(0.0, 10.0, 0.0), inner_angle=half, outer_angle=half)
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0))
    inner = overhead((-5.0, 5.0), (-5.0, 5.0), 30.0)
    low = camera_below((-14.0, 2.0, 0.0), (0.0, 0.0, 0.0))
    flat = analytic.plates(gap=4.0, elevation=90.0)
    return [
        picture_of(
            "spot, its map ends on the receiver", AnalyticScene(scene_of(parts, low, spot, "border"), built.blocked)
        ),
        picture_of(
            "sun, the plane goes on", AnalyticScene(scene_of(parts, inner, sun, "border"), flat.blocked), dark=False
        ),
        picture_of("sun, seen from the side", AnalyticScene(scene_of(parts, low, sun, "border"), flat.blocked)),
        picture_of("spot from above", AnalyticScene(scene_of(parts, camera, spot, "border"), built.blocked)),
    ]


def camera_below(position: tuple[float, float, float], target: tuple[float, float, float]) -> PerspectiveCamera:
    return PerspectiveCamera(position, target, fov_y=40.0)


def projections() -> list[Picture]:
    """A spot at the origin along -z; planes in front of it and behind it."""
    spot = SpotLight(position=(0.0, 0.0, 0.0), direction=(0.0, 0.0, -1.0), inner_angle=30.0, outer_angle=30.0)
    caster = shapes.rectangle((-0.5, -0.5, -2.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    front = shapes.rectangle((-3.0, -3.0, -4.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0))
    behind = shapes.rectangle((3.0, -3.0, 4.0), (-6.0, 0.0, 0.0), (0.0, 6.0, 0.0))
    parts = {"front": front, "behind": behind, "caster": caster}

    def exact(points: Array, normals: Array) -> Array:
        t = np.where(points[:, 2] < -2.0, 2.0 / np.maximum(-points[:, 2], 1e-9), 0.0)
        dark = (t > 0.0) & (np.abs(points[:, :2] * t[:, None]) <= 0.5).all(axis=1)
        facing = (normals * -points).sum(axis=1) > 0.0
        return np.where(facing & ~dark, 1.0, 0.0)

    ahead = PerspectiveCamera((2.0, 1.0, 0.5), (0.0, 0.0, -4.0), fov_y=70.0)
    back = PerspectiveCamera((0.5, 0.2, -1.5), (0.0, 0.0, 4.0), fov_y=70.0)
    return [
        Picture("plane in front of the spot", scene_of(parts, ahead, spot, "spot"), spot, ahead, exact),
        Picture("plane behind the spot", scene_of(parts, back, spot, "spot"), spot, back, exact, lit=False, dark=False),
    ]


def openings() -> list[Picture]:
    built = analytic.plates(gap=4.0, lamp_height=10.0)
    pictures = []
    for across in (160.0, 175.0, 179.8):
        spot = SpotLight(position=(0.0, 10.0, 0.0), inner_angle=0.49 * across, outer_angle=0.5 * across)
        pictures.append(picture_of(f"spot of {across:g} degrees", built, spot))
    return pictures


def rooms() -> list[Picture]:
    return [
        picture_of("room with rods", analytic.room(rods=True)),
        picture_of("room", analytic.room(), dark=False),
    ]


def shells() -> list[Picture]:
    room = analytic.room()
    shell = shapes.icosphere(3, 0.05)
    parts = {"room": shapes.box((2.0, 2.0, 2.0)), "shell": shell}
    lights = {"near 0.1": PointLight(position=(0.0, 0.0, 0.0), near=0.1), "near derived": PointLight(position=(0.0, 0.0, 0.0)),
              "off centre": PointLight(position=(0.02, -0.01, 0.015), near=0.1)}  # fmt: skip
    pictures = [
        Picture(
            f"shell, {name}", scene_of(parts, room.scene.camera, light, "shell"), light, room.scene.camera, lit=False
        )
        for name, light in lights.items()
    ]
    spot = SpotLight(
        position=(0.0, 0.0, 0.0), direction=(-0.5, -0.4, -1.0), inner_angle=60.0, outer_angle=60.0, near=0.1
    )
    pictures.append(Picture("shell, spot", scene_of(parts, room.scene.camera, spot, "shell"), spot, room.scene.camera,
                            lit=False))  # fmt: skip
    return pictures


def towers() -> list[Picture]:
    """A caster 500 m above a view of 20 m."""
    parts = {"ground": level((-10.0, 10.0), (-10.0, 10.0)), "cloud": level((-3.0, 2.0), (-1.0, 4.0), 500.0)}
    camera = PerspectiveCamera((0.0, 14.0, 18.0), (0.0, 0.0, 0.0))
    pictures = []
    for name, direction in (("overhead", (0.0, -1.0, 0.0)), ("a little off", (0.004, -1.0, -0.003))):
        sun = DirectionalLight(direction=direction)
        pictures.append(Picture(f"caster 500 m up, sun {name}", scene_of(parts, camera, sun, "tower"), sun, camera))
    spot = SpotLight(position=(0.0, 1000.0, 0.0), inner_angle=1.0, outer_angle=1.0)
    pictures.append(Picture("caster 500 m up, spot", scene_of(parts, camera, spot, "tower"), spot, camera))
    return pictures


def beams() -> list[Picture]:
    """A beam from the ground to y = 1000, one degree off the light, through the light's near plane."""
    e = np.radians(89.0)
    top = np.array([1000.0 / np.tan(e), 1000.0, 0.0])
    ring = np.array([(-0.2, 0.0, -0.2), (0.2, 0.0, -0.2), (0.2, 0.0, 0.2), (-0.2, 0.0, 0.2)])
    positions = np.concatenate([ring, ring + top])
    sides = [(i, (i + 1) % 4) for i in range(4)]
    triangles = [(a, b, b + 4) for a, b in sides] + [(a, b + 4, a + 4) for a, b in sides]
    beam = (positions, np.array(triangles, dtype=np.int32))
    parts = {"ground": level((-10.0, 10.0), (-10.0, 10.0)), "beam": beam}
    camera = PerspectiveCamera((-6.0, 9.0, 14.0), (-3.0, 0.0, 0.0))
    pictures = []
    for name, light in (
        ("sun", DirectionalLight(direction=(0.0, -1.0, 0.0))),
        ("sun with its near plane across", DirectionalLight(direction=(0.0, -1.0, 0.0), near=-5.0)),
        ("spot", SpotLight(position=(-1.0, 400.0, 0.5), inner_angle=3.0, outer_angle=3.0)),
    ):
        pictures.append(Picture(f"beam, {name}", scene_of(parts, camera, light, "beam"), light, camera))
    return pictures


def smooth_back() -> Mesh:
    """A horizontal square whose shading normals lean towards a light that its geometric normal faces away from."""
    positions, triangles = level((-1.0, 1.0), (-1.0, 1.0))
    normals = np.tile(np.array([[-0.8, 0.6, 0.0]], dtype=np.float32), (len(positions), 1))
    return Mesh(positions, triangles, normals=normals)


def insides() -> list[Picture]:
    """N40: the camera inside a shadow and inside a caster; its near plane across one: see test_settings.py."""
    built = analytic.box(30.0, 30.0, (2.0, 2.0, 2.0))
    direction = np.asarray(built.scene.lights[0].direction)  # type: ignore[union-attr]
    dark = np.array([0.0, 1.0, 0.0]) + 1.5 * direction
    places = {
        "in the shadow": PerspectiveCamera(tuple(dark), (-3.0, 0.0, 2.5), fov_y=100.0),  # type: ignore[arg-type]
        "in the caster": PerspectiveCamera((0.3, 1.2, 0.2), (-4.0, 0.0, 3.0), fov_y=90.0),
    }
    lit = {"in the caster": False}
    return [
        picture_of(f"camera {name}", built, camera=camera, lit=lit.get(name, True)) for name, camera in places.items()
    ]


CASES = (
    Case(14, "alpha mask", "half the area; edges at 0.25 m", masks),
    Case(15, "duelling frusta", "as N1", duels),
    Case(16, "back sides and thin sheets", "dark", backs),
    Case(17, "receiver beyond far", "all lit", ranges),
    Case(18, "receiver beyond the map's border", "the caster's shadow only", borders),
    Case(19, "planes before and behind a spot", "square of half-side 1; no light behind", projections),
    Case(20, "spots of 160 to 180 degrees", "square of half-side 1.667; 180 is an error", openings),
    Case(21, "point light in a room", "all lit; rods unbroken", rooms, skips=AS_DEFAULT,
         findings=(crease("room", "room with rods"),)),
    Case(22, "light in a closed shell", "all dark", shells),
    Case(23, "caster far above the view", "its shadow", towers),
    Case(24, "beam across the near plane", "its projection", beams,
         skips={each.name: "creases and leaks together" for each in MOMENTS},
         findings=(crease("beam, spot"),
                   crease("beam, sun", techniques=("pcf 4", "gaussian 3", "disc 2,16", "disc 4,64", "poisson 1", "edgepcf 4")))),
    Case(40, "camera in a shadow, in a caster", "as traced", insides),
)  # fmt: skip
