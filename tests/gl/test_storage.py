"""What a shadow map stores: light x clip convention x format against the float64 formula."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import CLIP_SPACES, Array, ClipSpace
from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.shadows.bias import NoBias
from glshadow.shadows.fits import SceneFit
from glshadow.shadows.metric import Target, metric_range, projected_metric, radial_metric, unpack
from glshadow.shadows.shadow import Faces, Shadow

from .. import model
from ..pairwise import every_pair
from ..tolerances import depth_tolerance, precision

RESOLUTION = 48
CAMERA = PerspectiveCamera(position=(4.0, 6.0, 7.0), target=(0.0, 0.5, 0.0))
KINDS = ("directional", "spot", "point")

CELLS = {"kind": KINDS, "clip": CLIP_SPACES, "target": list(Target)}


def scene_of(*solids: shapes.Solid) -> tuple[Scene, Array]:
    """A scene of solids, and its triangles (T, 3, 3)."""
    nodes = tuple(Node(Mesh(*solid), np.eye(4), f"part {i}") for i, solid in enumerate(solids))
    return Scene(nodes, CAMERA), np.concatenate([positions[faces] for positions, faces in solids])


def plane_and_box() -> tuple[Scene, Array]:
    ground = shapes.rectangle((-3.0, 0.0, 3.0), (6.0, 0.0, 0.0), (0.0, 0.0, -6.0))
    return scene_of(ground, shapes.box((1.0, 1.5, 1.2), (0.4, 0.75, -0.3)))


def light_of(kind: str, near: float | None = None, far: float | None = None, **shadow: object) -> Light:
    settings = Shadow(**{"resolution": RESOLUTION, "fit": SceneFit(), "faces": Faces.BOTH, "bias": NoBias()} | shadow)  # type: ignore[arg-type]
    if kind == "directional":
        return DirectionalLight(direction=(-0.5, -0.8, -0.3), near=near, far=far, shadow=settings)
    position = (1.5, 4.0, 1.0)
    if kind == "spot":
        direction = (-0.4, -1.0, -0.3)
        return SpotLight(position=position, direction=direction, outer_angle=55, near=near, far=far, shadow=settings)
    return PointLight(position=position, near=near, far=far, shadow=settings)


def stored_bounds(renderer: Renderer, light: Light, clip: ClipSpace, target: Target) -> tuple[Array, Array, Array]:
    """Contents of the map of `plane_and_box`, and the minimum and maximum value allowed; (V, R, R) each."""
    scene, triangles = plane_and_box()
    frame = renderer.render(scene, lights=[light], size=(16, 9), outputs=("shadow_maps", "visibility"), samples=1)
    used = frame.used[0]
    assert used.clip == clip
    assert used.target is target
    assert used.fallbacks == ()
    assert frame.shadow_maps is not None
    kind = used.views[0].projection
    allowed = precision(RESOLUTION, kind != "directional", 10.0)
    twin = model.cast(used.views, triangles, target, precision=allowed)
    low, high = (np.stack(side) for side in zip(*(twin.tile(i) for i in range(len(used.views))), strict=True))
    return frame.shadow_maps[0].astype(np.float64), low, high


@every_pair(**CELLS)
def test_every_texel_matches_the_formula(renderer: Renderer, kind: str, clip: ClipSpace, target: Target) -> None:
    """Near and far cut through the scene: the map also holds what is nearer, what is beyond, and empty texels."""
    near, far = (-1.0, 0.3) if kind == "directional" else (2.8, 4.4)
    light = light_of(kind, near, far, clip=clip, target=target)
    stored, low, high = stored_bounds(renderer, light, clip, target)
    assert (stored >= low).all(), f"{(stored < low).sum()} texels too low, worst {(low - stored).max():.3g}"
    assert (stored <= high).all(), f"{(stored > high).sum()} texels too high, worst {(stored - high).max():.3g}"
    # The bounds are tight: except at edges all texels are known to the format's step and the effect of a moved vertex.
    width = 2.0 * (target.quantum + depth_tolerance(RESOLUTION, kind != "directional")) + 5e-3
    assert (high - low <= width).mean() > 0.9
    nearest, farthest = (1.0, 0.0) if target.is_depth and clip.reversed else (0.0, 1.0)
    assert (np.abs(stored - farthest) <= target.quantum).any(), "nothing lies beyond far"
    between = (low > 0.02) & (high < 0.98)
    assert between.mean() > 0.02, "nothing lies between near and far"
    if target.is_depth or kind == "directional":
        assert (stored == nearest).any(), "nothing is clamped to near"


@every_pair(**CELLS)
def test_derived_range_holds_the_whole_scene(renderer: Renderer, kind: str, clip: ClipSpace, target: Target) -> None:
    stored, low, high = stored_bounds(renderer, light_of(kind, clip=clip, target=target), clip, target)
    assert ((stored >= low) & (stored <= high)).all()
    nothing = clip.clear_depth if target.is_depth else 1.0
    drawn = stored[np.abs(stored - nothing) > 1.5 * target.quantum]
    assert drawn.size > 0.05 * stored.size
    assert 0.0 < drawn.min() < drawn.max() < 1.0  # visible surfaces lie between near and far: nothing is clamped


def facing_square(distance: float, half: float = 40.0) -> shapes.Solid:
    """A square below the origin that faces up."""
    return shapes.rectangle((-half, -distance, half), (2.0 * half, 0.0, 0.0), (0.0, 0.0, -2.0 * half))


@every_pair(**CELLS, share=(-0.5, 0.0, 0.25, 1.0, 1.5))
def test_near_far_and_beyond(renderer: Renderer, kind: str, clip: ClipSpace, target: Target, share: float) -> None:
    """A plane across the light's axis before near, at near, between, at far and beyond: one known number at the centre."""
    near, far = 2.0, 6.0
    distance = near + share * (far - near) if share >= 0.0 else 0.5 * near
    settings = Shadow(RESOLUTION + 1, bias=NoBias(), clip=clip, target=target, fit=SceneFit(), faces=Faces.BOTH)
    common = {"near": near, "far": far, "shadow": settings}
    light: Light = {
        "directional": lambda: DirectionalLight(direction=(0.0, -1.0, 0.0), **common),
        "spot": lambda: SpotLight(position=(0, 0, 0), direction=(0.0, -1.0, 0.0), outer_angle=40, **common),
        "point": lambda: PointLight(position=(0, 0, 0), **common),
    }[kind]()
    # the upper square keeps a node inside the range, so that the map is drawn wherever the other is
    scene, _ = scene_of(facing_square(distance), shapes.box((0.1, 0.1, 0.1), (0.9, -4.0, 0.9)))
    frame = renderer.render(scene, lights=[light], size=(8, 8), outputs=("shadow_maps",), samples=1)
    assert frame.shadow_maps is not None
    number = next(i for i, view in enumerate(frame.used[0].views) if kind != "point" or view.face == 3)
    view = frame.used[0].views[number]
    assert view.far - view.near == pytest.approx(far - near)
    middle = frame.shadow_maps[0][number][RESOLUTION // 2, RESOLUTION // 2]
    expected = float(np.clip(closed_form(kind, clip, target, distance, near, far), 0.0, 1.0))
    assert middle == pytest.approx(expected, abs=target.quantum + depth_tolerance(RESOLUTION, kind != "directional"))


def closed_form(kind: str, clip: ClipSpace, target: Target, d: float, n: float, f: float) -> float:
    """Stored value at distance d on the axis, written out for each convention."""
    if target.is_depth:
        share = (d - n) / (f - n) if kind == "directional" else f * (d - n) / (d * (f - n))
        return 1.0 - share if clip.reversed else share
    if kind == "point":
        return (d + n) / (n + f)
    return (d - n) / (f - n)  # clip z is linear in d: the metric is the same line in every convention


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=str)
def test_camera_depth_and_metric(renderer: Renderer, clip: ClipSpace) -> None:
    """The camera's own depth against rays, and its metric against the formula of a spot light in its convention."""
    scene, triangles = plane_and_box()
    camera = PerspectiveCamera(CAMERA.position, CAMERA.target, near=2.0, far=20.0)
    # the light's convention does not affect the camera's
    lights_ = [DirectionalLight(shadow=Shadow(resolution=16, clip=clip))]
    frame = renderer.render(scene, camera, lights_, size=(64, 48), outputs=("depth", "depth_metric"), samples=1)
    assert frame.depth is not None
    assert frame.depth_metric is not None
    expected, _, border = model.first_hits(camera, (64, 48), triangles)
    inner = ~border
    assert inner.mean() > 0.8
    hit = np.isfinite(expected)
    np.testing.assert_array_equal(np.isfinite(frame.depth)[inner], hit[inner])
    # a moved vertex tilts the depth by 1/512 pixel: the ground's steepest slope is 0.2 units a pixel
    np.testing.assert_allclose(frame.depth[hit & inner], expected[hit & inner], atol=1e-3)
    own = ClipSpace(True, reversed=True)
    clip_z = 2.0 * (20.0 - frame.depth[hit]) / (20.0 - 2.0)  # of 0..1 reversed: n (f - d) / (f - n)
    metric = projected_metric(clip_z, own, *metric_range("perspective", own, 2.0, 20.0))
    np.testing.assert_allclose(frame.depth_metric[hit], metric, atol=1e-6)
    assert (frame.depth_metric[~hit] == 1.0).all()
    np.testing.assert_allclose(metric, (frame.depth[hit] - 2.0) / 18.0, atol=1e-6)


def test_radial_metric_is_the_distance(renderer: Renderer) -> None:
    """At a face's corner a point light's metric is the distance, sqrt(3) times the depth."""
    scene, _ = scene_of(shapes.box((4.0, 4.0, 4.0)))
    settings = Shadow(resolution=64, bias=NoBias(), target=Target.R32F, faces=Faces.BOTH, fit=SceneFit())
    light = PointLight(position=(0, 0, 0), near=0.1, far=4.0, shadow=settings)
    frame = renderer.render(scene, lights=[light], size=(8, 8), outputs=("shadow_maps",), samples=1)
    assert frame.shadow_maps is not None
    view = frame.used[0].views[0]
    centres = view.window[0] + (np.arange(64) + 0.5) * view.texel[0]
    distance = 2.0 * np.sqrt(1.0 + centres[:, None] ** 2 + centres**2)
    inner = (np.abs(centres) < 0.99)[:, None] & (np.abs(centres) < 0.99)
    for face in frame.shadow_maps[0]:
        np.testing.assert_allclose(
            face[inner], radial_metric(distance, 0.1, 4.0)[inner], atol=depth_tolerance(64, True)
        )
    assert distance[inner].max() / distance[inner].min() == pytest.approx(np.sqrt(3.0), rel=0.03)


def test_packed_and_float_hold_the_same(renderer: Renderer) -> None:
    scene, _ = plane_and_box()
    maps = []
    for target in (Target.R32F, Target.RGBA8):
        light = light_of("spot", target=target)
        frame = renderer.render(scene, lights=[light], size=(8, 8), outputs=("shadow_maps",), samples=1)
        assert frame.shadow_maps is not None
        maps.append(frame.shadow_maps[0])
    np.testing.assert_allclose(maps[1], maps[0], atol=2.0 * Target.RGBA8.quantum)
    assert unpack([0.0, 0.0, 0.0, 1.0]) == 1.0


def test_spot_at_zero_near_is_refused() -> None:
    with pytest.raises(SettingsError, match="near must be a finite number in"):
        light_of("spot", near=0.0, clip=ClipSpace(True, True), target=Target.R32F)
