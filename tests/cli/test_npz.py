"""glshadow render -o frame.npz and batches: the chosen outputs as plain arrays."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import glshadow as gs
from glshadow.cli import main
from glshadow.core.outputs import STORED
from glshadow.errors import GlshadowError, SettingsError

SMALL = ("--size", "64x48", "--samples", "1", "--backend", "egl")
CAMERA = {"K", "R", "t", "near", "far", "nodes"}
SHOWN = {"exposure", "tone"}  # with the image


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str, code: int = 0) -> Result:
    done = CliRunner().invoke(main, [*arguments])
    assert done.exit_code == code, done.output
    return done


def test_default_outputs_equal_the_frame() -> None:
    run("render", *SMALL, "-o", "frame.npz")
    scene = gs.scenes.courtyard()
    frame = gs.render(scene, size=(64, 48), samples=1, outputs=STORED)
    with np.load("frame.npz", allow_pickle=False) as file:
        assert set(file) == {*STORED, *CAMERA, *SHOWN}
        assert (float(file["exposure"]), str(file["tone"])) == (0.0, "neutral")
        for name in STORED:
            np.testing.assert_array_equal(file[name], frame.outputs[name])
            assert file[name].dtype == frame.outputs[name].dtype
        np.testing.assert_array_equal(file["K"], scene.camera.K((64, 48)))
        np.testing.assert_array_equal(file["R"], scene.camera.opencv()[0])
        np.testing.assert_array_equal(file["t"], scene.camera.opencv()[1])
        assert file["nodes"].tolist() == [node.name for node in scene.nodes]
        assert (float(file["near"]), float(file["far"])) == (frame.near, frame.far)


def test_chosen_outputs() -> None:
    run("render", *SMALL, "-o", "frame.npz", "--outputs", "depth, node")
    with np.load("frame.npz", allow_pickle=False) as file:
        assert set(file) == {"depth", "node", *CAMERA}
        # the camera in the file and the depth give back points of the ground
        v, u = np.nonzero(np.isfinite(file["depth"]))
        seen = np.linalg.solve(file["K"], np.stack([u, v, np.ones_like(u)])) * file["depth"][v, u]
        points = file["R"].T @ (seen - file["t"][:, None])
    assert (np.abs(points[1]) < 1e-4).mean() > 0.2


def test_outputs_of_exr() -> None:
    import OpenImageIO as oiio

    run("render", *SMALL, "-o", "a.exr", "--outputs", "depth,normal")
    assert sorted(oiio.ImageInput.open("a.exr").spec().channelnames) == ["N.X", "N.Y", "N.Z", "Z"]


def test_equal_frames_give_equal_bytes() -> None:
    for name in ("a.npz", "b.npz"):
        run("render", *SMALL, "-o", name)
    assert Path("a.npz").read_bytes() == Path("b.npz").read_bytes()


def test_shadow_maps_and_an_orthographic_camera() -> None:
    shadow = gs.Shadow(filter=gs.Pcf(1), resolution=64)
    lights = [
        gs.DirectionalLight(direction=(-1.0, -2.0, -1.0), shadow=shadow),
        gs.PointLight(position=(2.0, 3.0, 1.0), shadow=shadow),
    ]
    camera = gs.OrthographicCamera((5.0, 5.0, 5.0), (0.0, 0.0, 0.0), height=6.0)
    frame = gs.render(
        gs.scenes.box().scene, camera, lights, size=(32, 24), outputs=("shadow_maps", "timings"), path="all.npz"
    )
    with np.load("all.npz", allow_pickle=False) as file:
        assert set(file) == {"shadow_maps_0", "shadow_maps_1", *CAMERA} - {"K"}
        for number in (0, 1):
            np.testing.assert_array_equal(file[f"shadow_maps_{number}"], frame.shadow_maps[number])


def test_orbit_and_resuming() -> None:
    arguments = ("render", *SMALL, "--orbit", "2", "-o", "view_{:d}.npz", "--json", "--outputs")
    assert [row["made"] for row in json.loads(run(*arguments, "depth").stdout)["pictures"]] == [True, True]
    assert [row["made"] for row in json.loads(run(*arguments, "depth").stdout)["pictures"]] == [False, False]
    assert [row["made"] for row in json.loads(run(*arguments, "node").stdout)["pictures"]] == [True, True]
    with np.load("view_1.npz", allow_pickle=False) as file:
        assert set(file) == {"node", *CAMERA}


def test_batch() -> None:
    job = {"scene": "courtyard", "size": [32, 24], "samples": 1}
    jobs = [
        {**job, "output": "a.npz"},
        {**job, "output": "b.npz", "outputs": ["depth"]},
        {**job, "output": "c.npz", "outputs": "all"},
    ]
    Path("jobs.jsonl").write_text("\n".join(map(json.dumps, jobs)))
    run("batch", "jobs.jsonl", "-o", "out", "--processes", "1")
    names = [set(np.load(f"out/{name}.npz", allow_pickle=False)) - CAMERA - SHOWN for name in "abc"]
    assert names[:2] == [set(STORED), {"depth"}]
    assert names[2] > {*STORED, "depth_metric"}


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("-o", "a.png", "--outputs", "depth"), "--outputs needs -o with .npz or .exr"),
        (("-o", "a.npz", "--outputs", "colour"), "outputs must be some of"),
        (("-o", "missing/a.npz"), "folder not found"),
    ],
)
def test_refusals(arguments: tuple[str, ...], named: str) -> None:
    assert named in run("render", *SMALL, *arguments, code=2).stderr


def test_refusals_of_a_job_of_measure_and_of_save(folder: Path) -> None:
    Path("jobs.jsonl").write_text('{"scene": "courtyard", "output": "a.png", "outputs": ["depth"]}')
    assert ".npz or .exr" in run("batch", "jobs.jsonl", code=1).stderr
    assert "-o of measure" in run("measure", *SMALL[:2], "-o", "x.npz", code=2).stderr
    frame = gs.render(gs.scenes.box().scene, size=(8, 8), samples=1)
    with pytest.raises(SettingsError, match="existing folder"):
        frame.save(folder / "missing" / "a.npz")
    (folder / "folder.npz").mkdir()
    with pytest.raises(GlshadowError, match="cannot be written"):
        frame.save(folder / "folder.npz")
    with pytest.raises(SettingsError, match="must end in one of"):
        gs.image.write(folder / "a.npz", frame.image)
    assert sorted(path.name for path in folder.iterdir()) == ["folder.npz", "jobs.jsonl"]
