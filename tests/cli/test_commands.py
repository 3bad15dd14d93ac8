"""The commands run in this process: every option, every exit code, and what is printed to which stream."""

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow import image
from glshadow.cli import main
from glshadow.errors import warn

SMALL = ("--size", "96x54", "--resolution", "256")


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str, code: int = 0):
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result


def facts(*arguments: str, code: int = 0) -> dict:
    """The one JSON object."""
    result = run(*arguments, "--json", code=code)
    assert result.stdout.count("\n") == 1
    return json.loads(result.stdout)


def pixels(path: str | Path) -> np.ndarray:
    return image.read(path)[..., :3]


# -- what is written and printed


def test_courtyard_by_default(folder):
    result = run("render", *SMALL)
    assert [path.name for path in folder.iterdir()] == ["courtyard.png"]
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    assert "courtyard.png: 96x54, 91656 triangles, 1 light" in result.stderr
    assert pixels("courtyard.png").shape == (54, 96, 3)


def test_name_comes_from_the_model(folder, models):
    run("render", str(models / "milk_truck.glb"), *SMALL)
    assert [path.name for path in folder.iterdir()] == ["milk_truck.png"]


def test_two_runs_same_bytes(folder):
    for name in ("a.png", "b.png"):
        run("render", *SMALL, "-o", name, "--light", "spot:6,6,6:-1,-1,-1", "--overlay", "map,lights,axes,grid")
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()


def test_json(folder):
    report = facts("render", *SMALL, "--light", "sun:-1,-2,-1", "--light", "point:0,3,0:shadow=off", "-o", "x.png")
    assert report["path"] == "x.png"
    assert report["size"] == [96, 54]
    assert report["scene"]["name"] == "courtyard"
    assert report["scene"]["triangles"] == 91656
    assert len(report["scene"]["bounds"]) == 2
    assert [light["kind"] for light in report["lights"]] == ["sun", "point"]
    assert report["lights"][0]["used"]["views"][0]["resolution"] == 256
    assert report["lights"][1]["used"]["views"] == []
    assert 0.0 < report["covered"] < 1.0
    assert {"load", "render", "write", "passes"} <= set(report["timings"])
    assert report["driver"]["backend"] == "egl"
    assert report["warnings"] == []


def test_exr_holds_the_floats(folder):
    import OpenImageIO as oiio

    run("render", *SMALL, "-o", "x.exr")
    names = oiio.ImageInput.open("x.exr").spec().channelnames
    assert {"R", "G", "B", "A", "Z", "N.X", "P.Y", "node", "visibility.0"} == {
        n for n in names if n[:2] not in ("N.", "P.")
    } | {"N.X", "P.Y"}


# -- every option reaches the image or the report


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--filter", "hard", {"filter": "Hard()"}),
        ("--filter", "pcf:3", {"filter": "Pcf(radius=3)"}),
        ("--bias", "constant:0.01", {"bias": "ConstantBias(world=0.01)"}),
        ("--bias", "none", {"bias": "NoBias()"}),
        ("--target-format", "depth16", {"target": "depth16"}),
        ("--target-format", "r32f", {"target": "r32f"}),
        ("--target-format", "rgba8", {"target": "rgba8"}),
        ("--clip", "-1..1", {"clip": "-1..1"}),
        ("--clip", "-1..1,reversed", {"clip": "-1..1,reversed"}),
        ("--clip", "0..1,reversed", {"clip": "0..1,reversed"}),
        ("--faces", "back", {"faces": "back"}),
        ("--faces", "auto", {"faces": "auto"}),
    ],
)
def test_shadow_option(folder, option, value, expected):
    used = facts("render", *SMALL, option, value)["lights"][0]["used"]
    assert {name: used[name] for name in expected} == expected


def test_resolution_and_fit(folder):
    view, scene = (facts("render", "--size", "96x54", "--resolution", "64", "--eye", "0,3,1", "--target", "0,0,0",
                         "--fit", fit)["lights"][0]["used"]["views"][0] for fit in ("view", "scene"))  # fmt: skip
    assert view["resolution"] == 64
    assert view["texel"][0] < scene["texel"][0]


def test_shadow_options_apply_to_given_and_default_lights_but_not_to_shadow_none(folder):
    report = facts("render", *SMALL, "--filter", "hard", "--light", "sun:-1,-1,0", "--light", "sun:0,-1,0:shadow=off")
    assert [light["used"]["filter"] for light in report["lights"]] == ["Hard()", "None"]
    assert [light["casts"] for light in report["lights"]] == [True, False]


def test_camera(folder):
    given = ("--eye", "-9,-0.05,11", "--target", "0,1,-1", "--up", "0.1,1,-0.1", "--fov", "35", "--near", "2")
    camera = facts("render", *SMALL, *given, "--far", "30")["camera"]
    assert camera["position"] == [-9.0, -0.05, 11.0]
    assert camera["target"] == [0.0, 1.0, -1.0]
    assert camera["up"] == [0.1, 1.0, -0.1]
    assert (camera["fov_y"], camera["near"], camera["far"]) == (35.0, 2.0, 30.0)


def test_orthographic_camera(folder):
    camera = facts("render", *SMALL, "--eye", "9,6,11", "--ortho", "4.5")["camera"]
    assert camera["height"] == 4.5
    assert "fov_y" not in camera
    assert 0.0 <= camera["near"] < camera["far"]


def test_fov_and_ortho_together_are_refused(folder):
    result = run("render", *SMALL, "--ortho", "4.5", "--fov", "30", code=2)
    assert "--fov and --ortho cannot be combined" in result.output
    assert "height must be a finite number in" in run("render", *SMALL, "--ortho", "-1", code=2).output


def test_eye_without_target_looks_at_the_scene_centre(folder):
    report = facts("render", *SMALL, "--eye", "-20,10,5")
    np.testing.assert_allclose(report["camera"]["target"], np.mean(report["scene"]["bounds"], axis=0))


def test_default_camera_is_the_scenes(folder):
    scene = gs.scenes.courtyard()
    assert facts("render", *SMALL)["camera"]["position"] == list(scene.camera.position)


def test_model_options(folder, models):
    path = str(models / "athlete_robot.stl")
    flat, turned = (facts("render", path, *SMALL, "--up-axis", axis) for axis in "yz")
    assert np.ptp(flat["scene"]["bounds"], axis=0)[2] == pytest.approx(np.ptp(turned["scene"]["bounds"], axis=0)[1])
    assert facts("render", path, *SMALL, "--no-ground")["scene"]["nodes"] == flat["scene"]["nodes"] - 1


def test_strength_ambient_background(folder):
    dark, pale = (_rendered("--strength", strength) for strength in ("1", "0"))
    assert dark.mean() < pale.mean() - 1.0
    assert _rendered("--ambient", "0.5").mean() > dark.mean() + 1.0
    # from below: the ground receives ambient light only
    red = _rendered("--ambient", "1,0,0", "--light", "sun:0,1,0", "--tone", "none")
    assert (red[-1, 48] == (255, 0, 0)).all()
    assert (_rendered("--background", "1,0.5,0")[0, 0] == (255, 128, 0)).all()


def test_exposure_and_tone(folder):
    """Of the lights: two stops more are four times the light, and lights in lux are metered."""
    dim, strong = (("--ambient", "0", "--light", f"sun:0,-1,0:intensity={i}") for i in (0.1, 1e5))
    white = ("--light", "sun:0,-1,0:intensity=0.8", "--ambient", "0")
    np.testing.assert_array_equal(
        _rendered(*dim, "--exposure", "2"), _rendered(*dim[:3], f"{dim[3]}".replace("0.1", "0.4"))
    )
    np.testing.assert_array_equal(_rendered(*strong, "--exposure", "auto"), _rendered(*white))
    np.testing.assert_array_equal(_rendered(*strong[:3], f"{strong[3]}:photometric=on"), _rendered(*white))
    assert (_rendered(*strong)[-1, 48] > 253).all()
    report = facts("render", *SMALL, *strong, "--exposure", "auto", "--tone", "none")
    assert (report["exposure"], report["tone"]) == (pytest.approx(np.log2(0.8e-5)), "none")
    assert "a number of stops" in run("render", *SMALL, "--exposure", "99", code=2).output


def _rendered(*arguments: str) -> np.ndarray:
    run("render", *SMALL, "-o", "x.png", *arguments)
    return pixels("x.png")


def test_overlay(folder):
    plain = _rendered()
    for name in ("map", "lights", "axes", "grid"):
        assert (_rendered("--overlay", name) != plain).any(axis=-1).sum() > 20, name


# -- what is refused


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--size", "big"), ("--size", "1280x720")),
        (("--eye", "1,2"), ("--eye", "3 finite numbers")),
        (("--fov", "180"), ("--fov", "[1e-06, 180)")),
        (("--near", "-1"), ("--near", "greater than 0")),
        (("--up-axis", "w"), ("--up-axis", "'x', 'y', 'z'")),
        (("--up-axis", "z"), ("--up-axis", "MODEL")),
        (("--light", "moon:1,2,3"), ("--light", "spot:px,py,pz:dx,dy,dz")),
        (("--light", "environment:nowhere.hdr"), ("--light", "nowhere.hdr: image file not found")),
        (("--light", "sun:1,-2,3:cookie=nowhere.png"), ("--light", "nowhere.png: image file not found")),
        (("--resolution", "0"), ("--resolution", "[1, 16384]")),
        (("--filter", "pcf:9"), ("--filter", "Pcf radius")),
        (("--bias", "constant"), ("--bias", "constant:WORLD")),
        (("--target-format", "d16"), ("--target-format", "depth32f")),
        (("--clip", "0..2"), ("--clip", "-1..1,reversed")),
        (("--fit", "tight"), ("--fit", "view, scene, cascades")),
        (("--faces", "none"), ("--faces", "'both'")),
        (("--strength", "2"), ("--strength", "[0, 1]")),
        (("--ambient", "-1"), ("--ambient", "0 or more")),
        (("--background", "0,0,256"), ("--background", "0 to 1")),
        (("--backend", "metal"), ("--backend", "'osmesa'")),
        (("--overlay", "map,sun"), ("--overlay", "map,lights,axes,grid")),
        (("-o", "x.bmp"), ("--output", ".png")),
        (("-o", "nowhere/x.png"), ("--output", "'nowhere'")),
        (("-o", "x.exr", "--overlay", "map"), ("--overlay", ".png")),
        (("--eye", "1,1,1", "--target", "1,1,1"), ("--eye", "zero vector")),
        (("--near", "5", "--far", "2"), ("--near", "less than far")),
        (("--bias", "slope", "--target-format", "r32f"), ("shadow options", "r32f")),
        (("--colour", "1"), ("--colour",)),
    ],
)
def test_usage_error(folder, arguments, words):
    result = run("render", *SMALL, *arguments, code=2)
    assert result.stdout == ""
    assert all(word in result.stderr for word in words), result.stderr
    assert list(folder.iterdir()) == []


def test_missing_file(folder):
    result = run("render", "nothing.glb", code=1)
    assert result.stderr == "error: nothing.glb: file not found: nothing.glb\n"
    assert facts("render", "nothing.glb", code=1) == {
        "error": "nothing.glb: file not found: nothing.glb", "kind": "SceneError", "warnings": [],
    }  # fmt: skip
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    "name",
    ["made_cube_all_nan.glb", "glb_truncated_chunk_data.glb", "RecursiveNodes.gltf", "empty.stl", "OutOfMemory.off"],
)
def test_hostile_file_prints_one_line(folder, models, name):
    result = run("render", str(models / "hostile" / name), code=1)
    errors = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
    assert len(errors) == 1
    assert errors[0].startswith("error: ")
    assert name.partition(".")[0] in errors[0]
    assert list(folder.iterdir()) == []


def test_warnings_are_printed_and_listed(folder, models):
    path = str(models / "hostile" / "nancolor.obj")
    result = run("render", path, *SMALL)
    assert "warning: nancolor.obj: " in result.stderr
    report = facts("render", path, *SMALL)
    assert any("colours are not finite" in line for line in report["warnings"])


def test_repeated_warning_is_printed_once(folder, monkeypatch):
    def noisy(*_, **__):
        for message in ("two\n lines", "two lines", "another"):
            warn(message)
        raise gs.SceneError("and\nthen it failed")

    monkeypatch.setattr("glshadow.io.load.read_scene", noisy)
    result = run("render", "x.glb", code=1)
    assert result.stderr == "warning: two lines\nwarning: another\nerror: and then it failed\n"


@pytest.mark.parametrize("camera", [("--eye", "30,30,30", "--target", "60,60,60"), ("--near", "50", "--far", "60")])
@pytest.mark.parametrize("command", ["render", "measure"])
def test_empty_view_is_refused(folder, command, camera):
    result = run(command, *SMALL, *camera, "-o", "x.png", code=1)
    last = result.stderr.splitlines()[-1]
    assert last.startswith("error: nothing is in view: courtyard is between (-12, ")
    assert "looks at" in last
    assert list(folder.iterdir()) == []


def test_interrupt(folder, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    Path("x.png").write_bytes(b"before")
    monkeypatch.setattr("glshadow.renderer.Renderer.render", interrupted)
    result = run("render", *SMALL, "-o", "x.png", code=130)
    assert result.stderr == "error: interrupted\n"
    assert [path.name for path in folder.iterdir()] == ["x.png"]
    assert Path("x.png").read_bytes() == b"before"


def test_bug_prints_one_line_and_a_traceback_on_demand(folder, monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("of something")

    monkeypatch.setattr("glshadow.renderer.Renderer.render", broken)
    result = run("render", *SMALL, code=1)
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("error: unexpected ZeroDivisionError: of something; please report this")
    shown = CliRunner().invoke(main, ["render", *SMALL, "--debug"])
    assert shown.exit_code == 1
    assert "Traceback" in shown.stderr
    assert "in broken" in shown.stderr


def test_fallbacks_are_warnings(folder):
    report = facts("render", *SMALL, "--light", "sun:-1,-1,-1:angle=1", "--filter", "pcf:1")
    assert any(line.startswith("light 0: ") and "size" in line for line in report["warnings"])


# -- measure and doctor


def test_measure(folder):
    pytest.importorskip("embreex")
    result = run("measure", *SMALL, "-o", "error.png")
    assert result.stdout.startswith("light 0: wrong ")
    assert pixels("error.png").shape == (54, 3 * 96 + 8, 3)
    run("render", *SMALL, "-o", "ours.png", "--samples", "1", "--tone", "none")
    ours = pixels("error.png")[:, 96 + 4 : 2 * 96 + 4].astype(int)
    # The same shading: float32 light composed again, and rounded once more
    assert np.abs(ours - pixels("ours.png")).max() <= 1


def test_measure_two_lights_as_json(folder):
    pytest.importorskip("embreex")
    report = facts("measure", *SMALL, "--light", "sun:-1,-2,-1", "--light", "point:0,3,0", "-o", "e.png")
    assert len(report["error"]["lights"]) == 2
    assert 0.0 <= report["error"]["wrong"] < 0.5
    assert {"trace", "measure", "write"} <= set(report["timings"])
    assert pixels("e.png").shape == (2 * 54 + 4, 3 * 96 + 8, 3)


def test_measure_without_embree(folder, monkeypatch):
    def missing(*_, **__):
        raise gs.ReferenceUnavailable("embreex is not installed: pip install 'glshadow[reference]'")

    monkeypatch.setattr(import_module("glshadow.reference.trace"), "trace", missing)
    assert "pip install" in run("measure", *SMALL, code=1).stderr


def test_measure_refuses_exr(folder):
    assert "-o of measure" in run("measure", *SMALL, "-o", "x.exr", code=2).stderr


WORKS = {"works": True,
         "caps": {"renderer": "R", "vendor": "V", "version": "4.5", "max_texture_size": 16384, "clip_control": True},
         "depth_formats": {"DEPTH16": True}, "color_formats": {"R8": False}}  # fmt: skip
BROKEN = {"works": False, "reason": "libEGL is missing", "remedy": "apt-get install libegl1"}


@pytest.mark.parametrize(("backends", "code"), [({"egl": WORKS, "osmesa": BROKEN}, 0), ({"egl": BROKEN}, 1)])
def test_doctor(monkeypatch, backends, code):
    found = {"glshadow": "0", "python": "3", "platform": "P", "packages": {"numpy": "2", "glfw": None},
             "missing": {"glfw": "pip install 'glshadow[view]'"}, "backends": backends,
             "devices": [{"number": 0, "name": "card", "works": True, "driver": "D"}],
             "auto": next((name for name, report in backends.items() if report["works"]), None)}  # fmt: skip
    monkeypatch.setattr("glshadow.doctor.examine", lambda: found)
    result = run("doctor", code=code)
    for words in ("libEGL is missing", "apt-get install libegl1", "pip install 'glshadow[view]'"):
        assert words in result.stdout
    assert ("not working: R8" in result.stdout) == (code == 0)
    assert ("error: no OpenGL backend works" in result.stderr) == (code == 1)
    report = facts("doctor", code=code)
    assert report["backends"] == backends


# -- help


def test_version():
    assert run("--version").stdout == f"glshadow {gs.__version__}\n"


@pytest.mark.parametrize("command", ["render", "measure", "doctor"])
def test_help(command):
    page = run(command, "--help").stdout
    assert "Examples:" in page or command == "doctor"
    assert "--json" in page
    assert all(len(line) <= 110 for line in page.splitlines())


def test_help_states_every_default():
    page = " ".join(run("render", "--help").stdout.split())
    for words in (
        "Default: exact",
        "Default: receiver-plane",
        "Default: depth32f",
        "Default: 2048",
        "default: 1280x720",
    ):
        assert words in page
