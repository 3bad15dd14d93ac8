"""N1 to N6 and N9 to N11: plain solids on a plane, in contact, near contact and far from it."""

from __future__ import annotations

import numpy as np

from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import analytic, shapes
from glshadow.scenes.analytic import AnalyticScene

from .registry import Case, Known, Picture, overhead, picture_of, sun_direction

FACETS = 2e-3  # share of pixels: facets of icosphere 6 lie up to 2e-4 of the radius inside the sphere


def local_light_towards(
    elevation: float, distance: float, target: tuple[float, float, float], *, spot: float = 0.0
) -> Light:
    """A point light, or a spot of that outer angle aimed at the target, where a directional light of that elevation would come from."""
    aim = np.asarray(sun_direction(elevation))
    position = tuple(np.asarray(target) - aim * distance)
    if spot == 0.0:
        return PointLight(position=position)  # type: ignore[arg-type]
    return SpotLight(position=position, direction=tuple(aim), inner_angle=0.9 * spot, outer_angle=spot)  # type: ignore[arg-type]


def walls() -> list[Picture]:
    pictures = [
        picture_of(f"wall, sun {elevation:g} degrees high", analytic.wall(elevation)) for elevation in (30.0, 60.0, 5.0)
    ]
    for elevation in (1.0, 0.1):
        reach = 2.0 / np.tan(np.radians(elevation))
        camera = overhead((-1.2 * reach, 0.1 * reach), (-3.0, 3.0), reach)
        pictures.append(
            picture_of(f"wall, sun {elevation:g} degrees high", analytic.wall(elevation, half=2.0), camera=camera)
        )
    near = analytic.wall(30.0)
    for name, spot in (("point light", 0.0), ("spot", 40.0)):
        light = local_light_towards(30.0, 12.0, (-1.0, 0.0, 0.0), spot=spot)
        pictures.append(picture_of(f"wall, {name}", near, light))
    low = local_light_towards(5.0, 30.0, (-10.0, 0.0, 0.0), spot=50.0)
    pictures.append(picture_of("wall, spot 5 degrees high", analytic.wall(5.0), low, resolution=2048))
    return pictures


def spheres() -> list[Picture]:
    return [
        picture_of(f"sphere, sun {e:g} degrees high", analytic.sphere(e), closed_form_share=FACETS)
        for e in (45.0, 90.0, 10.0)
    ]


def local_light_discs() -> list[Picture]:
    built = analytic.sphere(height=6.0, lamp_height=10.0)
    spot = SpotLight(position=(0.0, 10.0, 0.0), direction=(0.0, -1.0, 0.0), inner_angle=35.0, outer_angle=40.0)
    # The top of the sphere is above the light: the shadow is bounded by a hyperbola.
    low = PointLight(position=(3.0, 6.5, 0.0))
    beside = overhead((-60.0, 0.0), (-10.0, 10.0), 60.0)
    wide = Scene(
        (Node(Mesh(*shapes.rectangle((-100.0, 0.0, 50.0), (120.0, 0.0, 0.0), (0.0, 0.0, -100.0))), np.eye(4), "ground"),
         built.scene.nodes[1]), beside, (low,),
    )  # fmt: skip
    return [
        picture_of("disc, point light", built, closed_form_share=FACETS),
        picture_of("disc, spot", built, spot, closed_form_share=FACETS),
        picture_of(
            "hyperbola, point light beside the sphere",
            AnalyticScene(wide, built.blocked),
            closed_form_share=FACETS,
        ),
    ]


def local_light_squares() -> list[Picture]:
    built = analytic.plates(gap=4.0, lamp_height=10.0)
    spot = SpotLight(position=(0.0, 10.0, 0.0), direction=(0.0, -1.0, 0.0), inner_angle=25.0, outer_angle=30.0)
    tilted = SpotLight(position=(0.0, 10.0, 0.0), direction=(0.2, -1.0, 0.1), inner_angle=35.0, outer_angle=40.0)
    return [
        picture_of("square, point light", built),
        picture_of("square, spot", built, spot),
        picture_of("square, tilted spot", built, tilted),
        picture_of("square, eight texels", built, spot, resolution=8),
    ]


def balls() -> list[Picture]:
    pictures = [picture_of(f"ball, sun {e:g} degrees high", analytic.ball(e), dark=False) for e in (30.0, 90.0, 5.0)]
    for level in (3, 4):
        coarse = analytic.ball(30.0, subdivisions=level)
        pictures.append(picture_of(f"ball of {20 * 4**level} facets", coarse, dark=False))
    ball = analytic.ball(30.0)
    pictures.append(picture_of("ball, point light", ball, local_light_towards(30.0, 6.0, (0.0, 0.0, 0.0)), dark=False))
    pictures.append(
        picture_of("ball, spot", ball, local_light_towards(30.0, 6.0, (0.0, 0.0, 0.0), spot=15.0), dark=False)
    )
    return pictures


THETAS = (45.0, 0.0, 80.0, 89.0, 89.9, 89.99)


def planes() -> list[Picture]:
    """1024 texels over 10.24 m: t = 1 cm."""
    camera = overhead((-5.0, 5.0), (-5.0, 5.0), 10.0)
    pictures = [
        picture_of(
            f"plane, theta {theta:g}", analytic.plane(90.0 - theta, half=5.12), camera=camera, dark=False, size=(96, 96)
        )
        for theta in THETAS
    ]
    diagonal = DirectionalLight(direction=sun_direction(1.0, 45.0))
    pictures.append(picture_of("plane, theta 89, diagonal", analytic.plane(1.0), diagonal, dark=False))
    for name, spot in (("point light", 0.0), ("spot", 60.0)):
        light = local_light_towards(2.0, 20.0, (0.0, 0.0, 0.0), spot=spot)
        pictures.append(picture_of(f"plane, {name} 2 degrees high", analytic.plane(2.0), light, camera, dark=False))
    return pictures


def feet() -> list[Picture]:
    """The wall's foot from above: 40 cm of ground, texels of a millimetre."""
    camera = overhead((-0.2, 0.2), (-0.2, 0.2), 3.0)
    built = analytic.wall(30.0)
    pictures = [picture_of("foot of the wall", built, camera=camera)]
    for name, spot in (("point light", 0.0), ("spot", 30.0)):
        light = local_light_towards(30.0, 6.0, (0.0, 0.0, 0.0), spot=spot)
        pictures.append(picture_of(f"foot, {name}", built, light, camera))
    # The lit side, so close that a texel is many pixels: the wall is steep to the light, the ground is flat to it.
    near = overhead((0.45, 0.65), (-0.1, 0.1), 3.0)
    for resolution in (1024, 40):
        pictures.append(
            picture_of(
                f"lit foot, {resolution} texels",
                analytic.box(80.0, 0.0),
                camera=near,
                resolution=resolution,
                dark=False,
            )
        )
    return pictures


def boxes() -> list[Picture]:
    pictures = [
        picture_of(f"box, elevation {e:g}, azimuth {a:g}", analytic.box(e, a))
        for e, a in ((30.0, 30.0), (60.0, 0.0), (10.0, 75.0), (2.0, 45.0))
    ]
    built = analytic.box(30.0, 30.0)
    for name, spot in (("point light", 0.0), ("spot", 40.0)):
        pictures.append(picture_of(f"box, {name}", built, local_light_towards(30.0, 8.0, (0.0, 0.0, 0.0), spot=spot)))
    return pictures


GAPS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


def gaps() -> list[Picture]:
    pictures = [picture_of(f"plate, gap {gap:g}", analytic.plates(gap, 45.0), dark=gap > 5e-6) for gap in GAPS]
    pictures.append(picture_of("plate, coplanar", analytic.plates(0.0, 45.0), dark=False))
    pictures += [picture_of(f"plate, gap {gap:g}, from below", *_below(gap)) for gap in (1e-1, 1e-2)]
    ground = shapes.rectangle((-2.0, 0.0, 2.0), (4.0, 0.0, 0.0), (0.0, 0.0, -4.0))
    built = analytic.plane(30.0, half=2.0)
    twice = Scene((*built.scene.nodes, Node(Mesh(*ground), np.eye(4), "copy")), built.scene.camera, built.scene.lights)
    pictures.append(picture_of("plane drawn twice", AnalyticScene(twice, built.blocked), dark=False))
    return pictures


def _below(gap: float) -> tuple[AnalyticScene, None, object]:
    """The plate's shadow seen through the gap, from inside it."""
    from glshadow.core.cameras import PerspectiveCamera

    camera = PerspectiveCamera((-1.5 - gap, 0.5 * gap, 0.1), (0.0, 0.0, 0.0), fov_y=20.0)
    return analytic.plates(gap, 45.0), None, camera


STRIP = "lit strip of b cos e where the shadow begins"
CLIPPED = (
    "a triangle that the map's window cuts: pixels on the seam read a sliver of the driver's clipper, whose depth "
    "is off by ten texels' rise"
)

CASES = (
    Case(1, "wall under a low sun", "shadow on -H cot e < x < 0", walls,
         fails={"constant": STRIP, "clip": STRIP, "r8": "one and a half quanta of 1/255 of the range",
                "normal offset": "the far edge moves in by n cot e"},
         passes=("slope", "depth16", "r16f")),
    Case(2, "sphere over a plane", "ellipse r / sin e by r at -h cot e", spheres),
    Case(3, "sphere under a point light", "disc of radius H r / sqrt((H - h)^2 - r^2) = 2.582; beside it a hyperbola", local_light_discs),
    Case(4, "square under a point light", "square of half-side H / (H - h) = 1.667", local_light_squares),
    Case(5, "convex sphere alone", "lit iff N.L > 0", balls,
         fails={"clip": "acne where the slope exceeds the bias"}),
    Case(6, "empty plane to 89.99 degrees", "all lit", planes, fails={"none": "half the plane"},
         passes=("constant", "slope", "normal offset", "clip", "depth16", "r16f", "r8"),
         findings=(Known(("plane, theta 89.99",), ("default", "hard"), CLIPPED),)),
    Case(9, "wall in contact", "shadow starts at x = 0", feet,
         fails={"constant": STRIP, "clip": STRIP}, passes=("normal offset", "slope")),
    Case(10, "box on the plane", "hull of the footprint and of it moved by H cot e", boxes),
    Case(11, "plate at a gap, and coplanar", "moved by g cot e; all lit at g = 0", gaps,
         passes=("slope", "depth16")),
)  # fmt: skip
