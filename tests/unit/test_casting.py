"""Bodies that a light's passes may cull: only those that certainly shadow nothing."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.derive.casting import convex, darkens
from glshadow.scene.box import box_corners

FACES = [
    (0, 1, 3),
    (0, 3, 2),
    (4, 6, 7),
    (4, 7, 5),
    (0, 4, 5),
    (0, 5, 1),
    (2, 3, 7),
    (2, 7, 6),
    (0, 2, 6),
    (0, 6, 4),
    (1, 5, 7),
    (1, 7, 3),
]
SUN = gs.DirectionalLight(direction=(-0.5, -0.8, 0.3))


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """Corners (1, 8, 3)."""
    return box_corners(np.array([[low, high]]), np.eye(4)[None])


def slab() -> np.ndarray:
    """Triangles (12, 3, 3) of a floor, 24 wide, its top at y = 0."""
    corners = box((-12.0, -0.2, -12.0), (12.0, 0.0, 12.0))[0]
    return corners[np.array(FACES)]


@pytest.mark.parametrize(
    "light",
    [SUN, gs.PointLight(position=(3.0, 4.0, 1.0)), gs.SpotLight(position=(0.0, 5.0, 0.0), direction=(0.0, -1.0, 0.0))],
)
def test_floor_under_everything_shadows_nothing(light: gs.DirectionalLight) -> None:
    assert not darkens(slab(), box((-1.0, 0.0, -1.0), (1.0, 2.0, 1.0)), light.extremes())


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((-1.0, -3.0, -1.0), (1.0, -1.0, 1.0)),
        ((-1.0, -0.1, -1.0), (1.0, 2.0, 1.0)),
        ((-17.0, -9.0, -1.0), (-15.0, -7.0, 1.0)),
    ],
    ids=["below", "sunk into it", "beside it, in its shadow"],
)
def test_floor_shadows_bodies_behind_it(low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
    assert darkens(slab(), box(low, high), SUN.extremes())


def test_floor_casts_under_a_light_from_below() -> None:
    assert darkens(slab(), box((-1.0, 0.0, -1.0), (1.0, 2.0, 1.0)), gs.PointLight(position=(0.0, -3.0, 0.0)).extremes())


def test_valleys_and_open_boxes_may_shadow_themselves() -> None:
    a, b, c, d = (np.array(p) for p in ((-3.0, 2.0, 3.0), (0.0, 0.0, 3.0), (0.0, 0.0, -3.0), (-3.0, 2.0, -3.0)))
    left = np.array([[a, b, c], [a, c, d]])
    right = left * (-1.0, 0.15, 1.0)
    low = gs.DirectionalLight(direction=(1.0, -0.3, 0.1))
    valley, tent = np.concatenate([left, right]), np.concatenate([left, right]) * (1.0, -1.0, 1.0)
    assert darkens(valley, valley, low.extremes())
    assert not darkens(tent, tent, gs.DirectionalLight(direction=(0.1, -1.0, 0.1)).extremes())
    open_box = slab()[[1, 2, 4, 5, 6, 7, 8, 9]]
    assert darkens(open_box, open_box, SUN.extremes())


def test_camera_outside_a_convex_body_sees_no_back_face() -> None:
    body = convex(slab())
    assert body is not None
    above, inside, across = ([(0.0, y, 0.0), (0.1, top, 0.0)] for y, top in ((0.1, 0.2), (-0.15, -0.1), (-0.1, 0.1)))
    assert body.excludes(np.array(above))
    assert not body.excludes(np.array(inside))
    assert not body.excludes(np.array(across))
    mirrored = convex(slab()[:, ::-1])
    assert mirrored is not None
    assert mirrored.excludes(np.array(above))
    wall = np.array([[[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 3.0, 0.0]]])
    assert convex(np.concatenate([slab(), wall])) is None


def test_plank_between_the_extreme_points_of_a_light_casts() -> None:
    """The shadows of the light's rim pass a small body on either side, that of its centre hits it."""
    plank = np.array([[[-9.0, 0.0, 0.05], [9.0, 0.0, 0.05], [9.0, 0.0, -0.05]]])
    target = box((-0.1, -5.1, -0.1), (0.1, -5.0, 0.1))
    sun = gs.DirectionalLight(direction=(0.0, -1.0, 0.0), angle=20.0)
    assert darkens(plank, target, sun.extremes())
    assert any(darkens(plank, target, point.extremes()) for point in sun.hard_lights(256))


def test_against_rays(rng: np.random.Generator) -> None:
    """For a triangle that is culled as shadowing nothing, no ray from the receivers to the light hits it."""
    from glshadow.core.spaces import view_axes

    axes = view_axes(np.asarray(SUN.direction))[:2]
    culled = 0
    for _ in range(300):
        triangle = rng.normal(size=(1, 3, 3)) * 3.0
        middle = rng.normal(size=3) * 6.0
        target = box(tuple(middle - 0.5), tuple(middle + 0.5))
        if darkens(triangle, target, SUN.extremes()):
            continue
        culled += 1
        points = middle + rng.uniform(-0.5, 0.5, size=(200, 3))
        a, b, c = np.moveaxis((triangle[0][None] - points[:, None]) @ axes.T, 1, 0)
        area = [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a))]
        met = (np.min(area, axis=0) > 0.0) | (np.max(area, axis=0) < 0.0)
        normal = np.cross(triangle[0, 1] - triangle[0, 0], triangle[0, 2] - triangle[0, 0])
        behind = ((points - triangle[0, 0]) @ normal) * np.sign(normal @ np.asarray(SUN.direction)) > 0.0
        assert not (met & behind).any()
    assert culled > 100
