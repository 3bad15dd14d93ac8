"""The ground that images of models without cameras and lights stand on, and the error and the warning of images without the model."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

import glshadow as gs
from glshadow.scene.stray import speck_cause
from glshadow.scenes import shapes

from .test_commands import facts, folder, pixels, run  # noqa: F401

SMALL = ("--size", "64x36", "--samples", "1")


def box(path: str, *more: trimesh.Trimesh) -> str:
    scene = trimesh.Scene([trimesh.creation.box((1, 1, 1)), *more])
    scene.export(path)
    return path


def nodes(*arguments: str) -> int:
    return int(facts("render", *arguments, *SMALL)["scene"]["nodes"])


@pytest.mark.usefixtures("folder")
def test_images_of_a_model_alone_have_a_ground() -> None:
    box("box.glb")
    assert nodes("box.glb") == nodes("box.glb", "--look", "outdoor") == nodes("box.glb", "--background", "1,0,0") == 2
    assert nodes("box.glb", "--light", "sun:0,-1,0") == nodes("box.glb", "--eye=3,2,3") == 2
    others = (
        ["--no-ground"],
        ["--look", "plain"],
        ["--background", "none"],
        ["--eye=3,-2,3"],
        ["-o", "a.npz"],
        ["-o", "a.exr"],
    )
    assert [nodes("box.glb", *each) for each in others] == [1] * 6
    assert nodes("box.glb", "--ground", "--eye=3,-2,3") == nodes("box.glb", "--ground", "-o", "a.npz") == 2
    run("render", "box.glb", "--catcher", "--no-ground", code=2)


@pytest.mark.usefixtures("folder")
def test_it_is_the_ground_that_was_asked_for_before() -> None:
    box("box.glb")
    for name, more in (("a.png", []), ("b.png", ["--ground"]), ("c.png", ["--no-ground"])):
        run("render", "box.glb", *SMALL, "-o", name, *more)
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    changed = pixels("a.png") != pixels("c.png")
    assert 0.02 < changed.any(axis=-1).mean() < 0.5  # the shadow; the model is where it was
    frames = [gs.render("box.glb", size=(64, 36), samples=1, path=path) for path in ("d.png", None)]
    assert Path("d.png").stat().st_size > 0
    for frame in frames:
        assert [node.ground for node in frame.scene.nodes] == [False, True]
        np.testing.assert_array_equal(frame.scene.bounds, gs.load("box.glb").bounds)
        assert frame.camera == gs.load("box.glb").camera


@pytest.mark.usefixtures("folder")
def test_python_gives_data_without_a_ground() -> None:
    box("box.glb")
    assert len(gs.load("box.glb").nodes) == 1
    assert len(gs.load("box.glb", ground=None).nodes) == 2
    assert len(gs.load("box.glb", ground=None, look="plain").nodes) == 1
    assert len(gs.load(gs.load("box.glb"), ground=None).nodes) == 1
    options = (
        {"outputs": ("depth", "node")},
        {"background": None},
        {"path": "a.npz", "outputs": "all"},
        {"ground": False},
    )
    for given in options:
        assert len(gs.render("box.glb", size=(8, 8), samples=1, **given).scene.nodes) == 1


@pytest.mark.usefixtures("folder")
def test_files_with_a_camera_or_lights_get_no_ground(models: Path) -> None:
    """A scene, not a model: whoever made it has put under it what he wanted."""
    scene = trimesh.Scene([trimesh.creation.box((1, 1, 1))], camera=trimesh.scene.Camera(fov=(40, 40)))
    scene.camera_transform = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1.0]])
    scene.export("seen.glb")
    expected = 1 if gs.load("seen.glb").cameras else 2
    assert nodes("seen.glb") == expected


def test_a_floor_of_the_model_is_before_the_ground(renderer: gs.Renderer) -> None:
    floor = gs.Mesh(*shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4)), material=gs.Material(color=(1, 0, 0, 1)))
    for side, look in ((1.0, "studio"), (1e-6, "studio"), (1e6, "studio"), (1.0, "outdoor")):
        scene = gs.load([gs.Node(floor, np.diag([side, side, side, 1.0]))], ground=True, look=look)
        frame = renderer.render(scene, size=(160, 90), samples=1, outputs=("node", "position"))
        inside = (np.abs(frame.position[..., [0, 2]]) < 1.98 * side).all(axis=-1)
        assert inside.sum() > 1000
        assert (frame.node[inside] == 0).all()


@pytest.mark.usefixtures("folder")
def test_a_model_out_of_view_is_refused_although_its_ground_is_seen() -> None:
    box("box.glb")
    result = run("render", "box.glb", *SMALL, "--eye=0,3,4", "--target=1.5,-0.5,0", "--fov", "5", code=1)
    assert "nothing is in view" in result.stderr


@pytest.mark.usefixtures("folder")
def test_a_transparent_model_is_seen() -> None:
    mesh = trimesh.creation.box((1, 1, 1))
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 0, 0, 80], alphaMode="BLEND")
    )
    trimesh.Scene([mesh]).export("clear.glb")
    assert gs.load("clear.glb").nodes[0].mesh.material.alpha_mode is gs.AlphaMode.BLEND
    report = facts("render", "clear.glb", *SMALL)
    assert report["covered"] > 0.1
    assert report["warnings"] == [], "of the fill that the look adds nobody asked"
    asked = facts("render", "clear.glb", *SMALL, "--light", "sky")
    assert any("untinted" in each for each in asked["warnings"])


def far(kind: str) -> str:
    ball = trimesh.creation.icosphere(subdivisions=2)
    if kind == "needle":
        trimesh.creation.box((1000, 1e-3, 1e-3)).export("needle.ply")
        return "needle.ply"
    if kind == "node":
        other = ball.copy()
        other.apply_translation([4000, 0, 0])
        trimesh.Scene([ball, other]).export("node.glb")
        return "node.glb"
    vertices = np.vstack([ball.vertices, [[5000, 20, 0]]])
    faces = np.vstack([ball.faces, [0, 1, len(ball.vertices)]])
    trimesh.Trimesh(vertices, faces, process=False).export("vertex.ply")
    return "vertex.ply"


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("vertex", r"1 of its \d+ vertices is far from the others: node 'mesh' reaches \(5000, 20, 0\), 5e\+03 from"),
        ("node", r"node 'geometry_1' reaches \(4001, 0, 0\), 4e\+03 from the middle of the rest, which is 3.46 across"),
        ("needle", r"1e\+06 times as long as it is thick"),
    ],
)
def test_a_speck_is_explained_with_a_camera_that_shows_more(kind: str, says: str) -> None:
    path = far(kind)
    result = run("render", path, *SMALL, code=1)
    assert re.search(says, result.stderr)
    options = re.search(r"(--eye=\S+) (--target=\S+) (--fov) (\S+)$", result.stderr.strip())
    assert options is not None
    assert facts("render", path, *SMALL, *options.groups())["covered"] > 0.02
    large = run("render", path)
    assert "of the image: " in large.stderr
    assert re.search(says, large.stderr)


def test_models_that_are_whole_have_no_cause(models: Path) -> None:
    for name in ("milk_truck.glb", "chess_board.glb", "dungeon_instances.glb"):
        assert speck_cause(gs.load(models / name)) is None
