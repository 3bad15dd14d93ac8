"""The choice of outputs, and the spelling of a setting, must not change the image."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.outputs import NAMES as OUTPUTS

SIZE = (640, 360)
READ = tuple(name for name in OUTPUTS if name != "timings")
LIGHTS = {
    "sun": gs.DirectionalLight(),
    "spot": gs.SpotLight(position=(6.0, 7.0, 5.0), direction=(-6.0, -7.0, -5.0), inner_angle=30, outer_angle=35),
    "point": gs.PointLight(position=(0.5, 2.2, 0.8)),
}


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.courtyard()


def bits(values: np.ndarray | tuple[np.ndarray, ...]) -> bytes:
    """The bytes of an output; shadow maps one after another."""
    return b"".join(each.tobytes() for each in (values if isinstance(values, tuple) else (values,)))


@pytest.mark.parametrize("light", LIGHTS.values(), ids=list(LIGHTS))
def test_every_subset_of_outputs_gives_the_same_image(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light) -> None:
    light = replace(light, shadow=gs.Shadow(resolution=128))  # a map is read back in every second frame
    whole = renderer.render(scene, None, [light], SIZE, outputs=READ, samples=1)
    expected = {name: bits(getattr(whole, name)) for name in READ}
    for count in (1, 2, len(READ) - 1):
        for chosen in itertools.combinations(READ, count):
            frame = renderer.render(scene, None, [light], SIZE, outputs=chosen, samples=1)
            for name in chosen:
                assert bits(getattr(frame, name)) == expected[name], (chosen, name)
            assert frame.used[0].views[0].near == whole.used[0].views[0].near


@pytest.mark.parametrize("light", LIGHTS.values(), ids=list(LIGHTS))
def test_explicit_default_gives_the_same_image(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light) -> None:
    plain = gs.Shadow(filter=gs.Pcf())
    derived = renderer.render(scene, None, [replace(light, shadow=plain)], SIZE, samples=1)
    used = derived.used[0]
    written = replace(
        plain, resolution=2048, bias=gs.ReceiverPlaneBias(), target=used.target, clip=used.clip, fit=gs.ViewFit()
    )
    frame = renderer.render(scene, None, [replace(light, shadow=written)], SIZE, samples=1)
    np.testing.assert_array_equal(frame.image, derived.image)
    np.testing.assert_array_equal(frame.visibility, derived.visibility)
    assert frame.used[0].as_dict() | {"draws": 0} == used.as_dict() | {"draws": 0}


@pytest.mark.parametrize("compute", [True, False], ids=["built on the GPU", "built on the CPU"])
def test_exact_obeys_faces(compute: bool) -> None:
    """A single sheet over a ground, lit on its front: BACK casts nothing, FRONT and BOTH the whole shadow."""
    ground = gs.Mesh(np.array([[-2, 0, 2], [2, 0, 2], [2, 0, -2], [-2, 0, -2.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    sheet = gs.Mesh(0.4 * ground.positions + (0, 1, 0), ground.triangles)  # faces up
    scene = gs.Scene((gs.Node(ground, np.eye(4), "ground"), gs.Node(sheet, np.eye(4), "sheet")))
    dark = {}
    with gs.Renderer() as renderer:
        caps = renderer._context.caps
        if not compute:
            renderer._context.caps = replace(caps, compute=False, max_storage_block=0, version_code=330)
        for faces in gs.Faces:
            light = gs.DirectionalLight(direction=(0.3, -1, 0), shadow=gs.Shadow(filter=gs.Exact(), faces=faces))
            frame = renderer.render(scene, None, [light], (96, 64), samples=1)
            dark[faces] = int((frame.visibility[0] == 0.0).sum())
    assert dark[gs.Faces.BACK] == 0
    assert dark[gs.Faces.FRONT] == dark[gs.Faces.BOTH] > 100


def test_floor_is_culled_only_under_a_sufficient_bias(renderer: gs.Renderer, scene: gs.Scene) -> None:
    """The courtyard's floor shadows nothing: it is one draw less. A bias that may fail must still show its effect on the floor."""

    def drawn(**settings: object) -> gs.Frame:
        shadow = gs.Shadow(resolution=256, filter=gs.Hard(), fit=gs.SceneFit(), **settings)  # type: ignore[arg-type]
        return renderer.render(scene, None, [gs.DirectionalLight(shadow=shadow)], SIZE, samples=1)

    derived, constant, none = drawn(), drawn(bias=gs.ConstantBias(0.5)), drawn(bias=gs.NoBias())
    assert derived.used[0].draws == constant.used[0].draws - 1 == none.used[0].draws - 1
    dark = [(frame.visibility[0] == 0.0).mean() for frame in (derived, none)]
    assert dark[1] > 3.0 * dark[0], "no stripes on the floor"
