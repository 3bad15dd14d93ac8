"""Frame in numpy, matplotlib, pickle and files, and its outputs against their table."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from PIL import ImageShow

import glshadow as gs
from glshadow.core.outputs import CENTRES, DRAWN, NAMES, OUTPUTS, TRACED, Of

SIZE = (48, 32)
FAR_FROM_ORIGIN = np.array([1e6, -3e5, 2e6])


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


@pytest.fixture(scope="module")
def frame(renderer: gs.Renderer, scene: gs.Scene) -> gs.Frame:
    return renderer.render(
        scene, lights=[gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Pcf(1)))], size=SIZE, outputs=("all", *TRACED)
    )


def test_all_renders_every_output_of_the_table(frame: gs.Frame) -> None:
    assert set(frame.outputs) == set(NAMES)


@pytest.mark.parametrize("output", [each for each in OUTPUTS if each.of is not Of.FRAME], ids=lambda each: each.name)
def test_type_shape_and_background_are_those_of_the_table(frame: gs.Frame, output: object) -> None:
    assert isinstance(output, type(OUTPUTS[0]))
    value = getattr(frame, output.name)
    sizes = {"H": SIZE[1], "W": SIZE[0], "lights": 1, "3": 3}
    assert value.dtype == output.dtype
    assert value.shape == tuple(sizes[part.strip()] for part in output.shape.strip("()").split(","))
    empty = frame.alpha == 0.0
    assert empty.any()
    assert not empty.all()
    held = (value[0] if output.shape.startswith("(lights") else value)[empty]
    expected = {
        "NaN": np.isnan,
        "infinity": np.isposinf,
        "-1": lambda v: v == -1,
        "0": lambda v: v == 0,
        "1": lambda v: v == 1,
    }
    if output.nothing in expected:
        assert expected[output.nothing](held).all()
    else:
        assert "background" in output.nothing
        assert (held == held[0]).all()


def test_default_is_four_samples(renderer: gs.Renderer, scene: gs.Scene, frame: gs.Frame) -> None:
    assert frame.samples == 4
    assert next(renderer.sequence(scene, [scene.camera], size=SIZE)).samples == 4
    assert gs.trace(scene, size=SIZE).samples == 4
    assert (
        gs.measure(
            renderer.render(scene, size=SIZE, outputs=("visibility", "triangle")), gs.trace(scene, size=SIZE)
        ).wrong
        == 0.0
    )


def test_single_output_name_is_accepted(renderer: gs.Renderer, scene: gs.Scene) -> None:
    frame = renderer.render(scene, size=SIZE, outputs="depth")
    assert set(frame.outputs) == {"depth"}
    assert len(renderer.render(scene, size=SIZE, outputs=["all"]).outputs) == len(DRAWN)
    with pytest.raises(gs.SettingsError, match=r"or .all., got 'deep'"):
        renderer.render(scene, size=SIZE, outputs="deep")


def test_positions_are_world_coordinates_far_from_the_origin(renderer: gs.Renderer, scene: gs.Scene) -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = FAR_FROM_ORIGIN
    nodes = [gs.Node(node.mesh, matrix @ node.world_from_mesh, node.name) for node in scene.nodes]
    camera = gs.PerspectiveCamera(
        tuple(np.asarray(scene.camera.position) + FAR_FROM_ORIGIN),
        tuple(np.asarray(scene.camera.target) + FAR_FROM_ORIGIN),
    )
    frame = renderer.render(gs.Scene(nodes, camera), size=SIZE, outputs=("position", "depth"))
    seen = np.isfinite(frame.depth)
    starts, rays = camera.rays(SIZE)
    expected = starts + np.where(seen, frame.depth, 0.0)[..., None] * rays
    # depth is float32 of some 10 units: 1e-6; a float32 position would be off by 2^-4
    np.testing.assert_allclose(frame.position[seen], expected[seen], atol=2e-5, rtol=0.0)
    assert np.isnan(frame.position[~seen]).all()


def test_numpy_and_matplotlib_take_a_frame_as_its_image(frame: gs.Frame) -> None:
    from matplotlib.figure import Figure

    np.testing.assert_array_equal(np.asarray(frame), frame.image)
    assert np.asarray(frame, dtype=np.float32).dtype == np.float32
    shown = Figure().subplots().imshow(frame)  # type: ignore[arg-type]
    np.testing.assert_array_equal(shown.get_array(), frame.image)


def test_pickled_frame_omits_its_scene(renderer: gs.Renderer) -> None:
    scene = gs.scenes.courtyard()
    frame = renderer.render(scene, size=SIZE)
    data = pickle.dumps(frame)
    arrays = sum(np.asarray(value).nbytes for value in frame.outputs.values())
    assert len(data) < 2 * arrays + 10_000  # the scene has 4 MB
    again = pickle.loads(data)
    np.testing.assert_array_equal(again.image, frame.image)
    assert repr(again) == repr(frame)
    assert again.lights == frame.lights
    with pytest.raises(gs.GlshadowError, match=r"keep scene .* separately"):
        _ = again.scene.nodes
    assert pickle.loads(pickle.dumps(again)).scene.name == scene.name


def test_show_opens_a_viewer_or_reports_that_none_exists(frame: gs.Frame, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = []
    monkeypatch.setattr(ImageShow, "show", lambda picture: shown.append(np.asarray(picture)) or True)
    frame.show()
    np.testing.assert_array_equal(shown[0], frame.image)
    monkeypatch.setattr(ImageShow, "show", lambda picture: False)
    with pytest.raises(gs.GlshadowError, match="save the frame"):
        frame.show()


@pytest.mark.parametrize("path", ["nowhere/picture.png", "picture.gif"])
def test_bad_output_path_is_refused_before_rendering(tmp_path: Path, path: str) -> None:
    with pytest.raises(gs.SettingsError, match=r"folder not found|must end in one of"):
        gs.render(object(), path=tmp_path / path)  # which load would refuse with a SceneError


def test_exr_channels_are_those_of_the_table(frame: gs.Frame, tmp_path: Path) -> None:
    import OpenImageIO as oiio

    frame.save(tmp_path / "all.exr")
    reader = oiio.ImageInput.open(str(tmp_path / "all.exr"))
    assert reader is not None
    names = set(reader.spec().channelnames)
    reader.close()
    named = {name for output in OUTPUTS for name in output.channels if not output.shape.startswith("(lights")}
    assert names == named | {
        "visibility.0",
        "blocker.0",
        "blocker_distance.0",
        *(f"transmittance.0.{color}" for color in "RGB"),
    }


def test_exr_header_has_exposure_and_tone(renderer: gs.Renderer, scene: gs.Scene, tmp_path: Path) -> None:
    import OpenImageIO as oiio

    frame = renderer.render(scene, size=(8, 8), samples=1, outputs="linear", exposure=-1.25)
    frame.save(tmp_path / "dark.exr")
    spec = oiio.ImageInput.open(str(tmp_path / "dark.exr")).spec()
    assert (spec.get_float_attribute("exposure"), spec.get_string_attribute("tone")) == (-1.25, "neutral")


def test_outputs_at_the_pixel_centre_have_no_samples(renderer: gs.Renderer, scene: gs.Scene) -> None:
    one, four = (renderer.render(scene, size=SIZE, outputs=CENTRES, samples=samples) for samples in (1, 4))
    for name in CENTRES:
        np.testing.assert_array_equal(one.outputs[name], four.outputs[name])
