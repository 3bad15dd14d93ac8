"""Batches: all lines are checked before rendering starts, failures are isolated, finished images are kept, dead processes are replaced."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
import tracemalloc
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow import image
from glshadow.batch import Failed, read_jobs, run_batch
from glshadow.batch.draw import Drawer
from glshadow.batch.job import parse_job
from glshadow.batch.run import JOURNAL
from glshadow.cli import main
from glshadow.errors import listening

from ..scene.glb import Glb

FLAT = {"kind": "orthographic", "position": [0, 9, 1], "height": 8}
SMALL = {"size": [48, 32], "samples": 1}


def written(path: Path, *jobs: dict[str, Any]) -> Path:
    path.write_text("".join(json.dumps({"scene": "courtyard", **SMALL, **job}) + "\n" for job in jobs))
    return path


def test_images_equal_those_of_render(tmp_path: Path) -> None:
    sun = {"kind": "sun", "direction": [-1, -2, -1]}
    jobs = read_jobs(
        written(
            tmp_path / "jobs.jsonl",
            {"output": "a.png", "lights": [sun], "shadow": {"filter": "pcf:1", "resolution": 512}},
            {
                "output": "view_{:02d}.png",
                "cameras": [{"position": [9, 6, 11]}, FLAT],
            },
            {"output": "sub/round_{}.png", "orbit": 3, "scene": "landscape:1"},
        )
    )
    done = run_batch(jobs, tmp_path / "out", processes=2)
    assert (done.drawn, done.kept, done.pictures, done.failed) == (3, 0, 6, ())
    light = gs.DirectionalLight(direction=(-1, -2, -1), shadow=gs.Shadow(filter=gs.Pcf(1), resolution=512))
    expected = gs.render(gs.scenes.courtyard(), lights=[light], size=(48, 32), samples=1)
    np.testing.assert_array_equal(image.read(tmp_path / "out" / "a.png")[..., :3], expected.image)
    names = sorted(path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.png"))
    assert names == ["a.png", "sub/round_0.png", "sub/round_1.png", "sub/round_2.png", "view_00.png", "view_01.png"]
    again = run_batch(jobs, tmp_path / "out", processes=1)
    assert (again.drawn, again.kept) == (0, 3)
    (tmp_path / "out" / "a.png").unlink()
    assert run_batch(jobs, tmp_path / "out", processes=1).drawn == 1, "the missing image is rendered"
    changed = read_jobs(written(tmp_path / "jobs.jsonl", {"output": "a.png", "lights": [sun]}))
    assert run_batch(changed, tmp_path / "out", processes=1).drawn == 1, "another job of the same name"
    assert run_batch(changed, tmp_path / "out", processes=1, fresh=True).drawn == 1


def test_cameras_smoothness_and_times_of_files(tmp_path: Path) -> None:
    """As `load` takes them; a scene is loaded again where they differ."""
    glb = Glb(
        nodes=[{"mesh": 0}, {"camera": 0, "name": "far"}, {"camera": 0, "name": "near", "translation": [0, 0, 4]}]
    )
    glb.json["nodes"][1]["translation"] = [0, 0, 9]
    glb.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.8}}]
    glb.mesh({"attributes": {"POSITION": glb.add([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])}})
    glb.json["animations"] = []
    for name, x in (("left", -1.5), ("right", 1.5)):
        sampler = {"input": glb.add([0, 2]), "output": glb.add([[0, 0, 0], [x, 0, 0]])}
        channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
        glb.json["animations"].append({"name": name, "samplers": [sampler], "channels": [channel]})
    glb.save(tmp_path / "moving.glb")
    (tmp_path / "tent.obj").write_text(
        "v 0 0 0\nv 2 0 0\nv 2 1 -1\nv 0 1 -1\nv 2 3 -1\nv 0 3 -1\nf 1 2 3 4\nf 4 3 5 6\n"
    )
    wanted: list[tuple[str, dict[str, Any]]] = [
        ("moving.glb", {}),
        ("moving.glb", {"camera": "near"}),
        ("moving.glb", {"camera": 1, "time": 1.0}),
        ("moving.glb", {"time": 2.0, "animation": "right"}),
        ("tent.obj", {}),
        ("tent.obj", {"smooth": 60.0}),
    ]
    lines = [{"scene": name, "output": f"{k}.png", **given} for k, (name, given) in enumerate(wanted)]
    assert run_batch(read_jobs(written(tmp_path / "jobs.jsonl", *lines)), tmp_path / "out", processes=1).failed == ()
    seen = []
    for k, (name, given) in enumerate(wanted):
        expected = gs.render(gs.load(tmp_path / name, **given), size=(48, 32), samples=1).image
        np.testing.assert_array_equal(image.read(tmp_path / "out" / f"{k}.png")[..., :3], expected)
        seen.append(expected.tobytes())
    assert len(set(seen)) == len(wanted)


def test_truncated_journal_keeps_its_complete_lines(tmp_path: Path) -> None:
    jobs = read_jobs(written(tmp_path / "jobs.jsonl", {"output": "a.png"}, {"output": "b.png"}))
    run_batch(jobs, tmp_path / "out", processes=1)
    journal = tmp_path / "out" / JOURNAL
    text = journal.read_text()
    journal.write_text(text[:-20])  # the machine went down while it wrote the second line
    again = run_batch(jobs, tmp_path / "out", processes=1)
    assert (again.drawn, again.kept, again.failed) == (1, 1, ())


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_jobs_with_a_byte_order_mark(tmp_path: Path, mark: str) -> None:
    path = written(tmp_path / "jobs.jsonl", {"output": "a.png"}, {"output": "b.png"})
    path.write_text(mark + path.read_text(), encoding="utf-8")
    assert [job.output for job in read_jobs(path)] == ["a.png", "b.png"]


WRONG: list[tuple[dict[str, Any] | str, str]] = [
    ("{", "not JSON"), ('{"a": 1, "a": 2}', "the key 'a' more than once"), ('{"a": ' + "9" * 5000 + "}", "an integer of 5000 digits$"),
    ("[1]", "must be an object"), ({"scene": "courtyard"}, "output is missing"),
    ({"output": "a.png"}, "scene is missing"),
    ({"colour": 1}, "'colour': unknown; the keys are animation, background"), ({"scene": "nowhere.glb"}, "file not found"),
    ({"output": "a.bmp"}, "must end in one of"), ({"output": "../a.png"}, "must stay in"), ({"output": "/a.png"}, "must stay in"),
    ({"output": "a_{}.png"}, "there is only one image"), ({"orbit": 3}, "one field for the image's number"),
    *(({"orbit": 3, "output": each}, "one field for the image's number") for each in (
        "{x}.png", "{0.foo}.png",
        "{0[a]}.png", "{0!s:{0:c}>{0}.0}tmp/evil.png", "{:c}.png", "{:.0e}.png", "{}{}.png", "{:999}.png", "{.png")),
    ({"output": "a{{}}.png"}, "there is only one image"), ({"orbit": 3, "output": "../{}.png"}, "must stay in"),
    ({"orbit": 3, "output": "/{}.png"}, "must stay in"), ({"output": "x" * 300 + ".png"}, "bytes long"),
    ({"output": "a\0.png"}, "without NUL"), ({"scene": "a\0.glb"}, "file not found"),
    ({"orbit": 100_001, "output": "{}.png"}, "orbit must be"),
    ({"size": [0, 3]}, "size must be"), ({"size": "big"}, "size must be"), ({"samples": 3}, "samples must be"),
    ({"lights": [{"kind": "lamp"}]}, r"lights\[0\].kind must be one of"), ({"lights": [{"kind": "point"}]}, r"lights\[0\]: .*position"),
    ({"lights": [{"kind": "environment", "image": "nowhere.hdr"}]}, r"lights\[0\]: .*nowhere.hdr: image file not found"),
    ({"lights": [{"kind": "environment", "image": [[[-1, 0, 0]]]}]}, r"lights\[0\]: .*negative"),
    ({"lights": [{"kind": "sun", "colour": 3}]}, r"lights\[0\]: .*colour"), ({"lights": {}}, "lights must be a list"),
    ({"cameras": [{"fov_y": 300}]}, "fov_y must be"), ({"cameras": 1}, "cameras must be a list"), ({"cameras": [3]}, "must be an object"),
    ({"shadow": {"filter": "pfc"}}, "is not a filter"), ({"shadow": {"colour": 1}}, "'colour' unknown"),
    ({"shadow": {"target": "r9"}}, "target"),
    ({"background": [2, 0, 0]}, "background must be"),
    ({"exposure": "bright"}, "exposure must be"), ({"tone": 1}, "tone must be"),
    ({"ground": 1}, "ground must be"), ({"up_axis": "w"}, "up_axis must be"),
    ({"orbit": 2, "cameras": [{}, {}], "output": "{}.png"}, "cannot be combined"),
    ({"camera": "a", "cameras": [{}]}, "cameras and camera cannot be combined"), ({"camera": -1}, "camera must be"),
    ({"time": "x"}, "time must be"), ({"time": 1}, "time needs a model's file"), ({"animation": "a"}, "animation needs time"),
    ({"smooth": 200}, "smooth must be"), ({"smooth": 30, "camera": 0}, "camera, smooth needs a model's file"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "said"), WRONG, ids=range(len(WRONG)))
def test_invalid_job_lines_are_refused(tmp_path: Path, line: dict[str, Any] | str, said: str) -> None:
    if isinstance(line, dict):
        whole = {"scene": "courtyard", "output": "a.png"} | line
        if said.endswith("is missing"):
            whole = line
        line = json.dumps(whole)
    with pytest.raises(gs.GlshadowError, match=said):
        parse_job(line, tmp_path)


ODD = [None, True, 0, -1, 3, 1e308, float("nan"), 10**400, "x", "", "a.png", "{}.png", "\ud800", "\0", [], [1], [None], {}, [[[]]],
       {"kind": "sun"}, {"kind": [1]}, {"filter": [1]}, {"target": [1]}, {"target": {}}, [{"shadow": {"target": [1]}}]]  # fmt: skip
INNER = [
    "kind",
    "position",
    "fov_y",
    "direction",
    "shadow",
    "filter",
    "target",
    "bias",
    "fit",
    "strength",
    "color",
    "self",
    "",
]


def test_random_json_is_a_job_or_a_named_error(tmp_path: Path) -> None:
    rng = random.Random(1)

    def value(depth: int) -> Any:
        if depth < 3 and rng.random() < 0.5:
            inner = [value(depth + 1) for _ in range(rng.randint(0, 3))]
            return inner if rng.random() < 0.5 else dict(zip(rng.choices(INNER, k=len(inner)), inner, strict=True))
        return rng.choice(ODD)

    keys = [each.name for each in fields(gs.batch.Job)]
    jobs = 0
    for _ in range(5000):
        job = {"scene": "courtyard", "output": "a.png"} | {rng.choice(keys): value(0) for _ in range(rng.randint(1, 3))}
        with suppress(gs.GlshadowError):
            parse_job(json.dumps(job), tmp_path)
            jobs += 1
    assert jobs > 50, "otherwise all were refused"


def test_all_lines_are_checked_before_any_work(tmp_path: Path) -> None:
    path = tmp_path / "jobs.jsonl"
    good = json.dumps({"scene": "courtyard", "output": "a.png"})
    path.write_text(f"# a comment\n{good}\n\n{good}\nnothing\n" + "nothing\n" * 30)
    done = CliRunner().invoke(main, ["batch", str(path), "-o", str(tmp_path / "out")])
    assert done.exit_code in (1, 2)
    assert "jobs.jsonl has 32 lines that are not jobs" in done.stderr
    assert "line 4: output 'a.png' is already used by line 2" in done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 22, "one line of output for each bad line"
    assert lines[0] == "error: jobs.jsonl has 32 lines that are not jobs"
    assert lines[2].startswith("  line 5: the line is not JSON")
    assert lines[-1] == "  and 12 more"
    as_json = CliRunner().invoke(main, ["batch", str(path), "--json"])
    assert len(json.loads(as_json.stdout)["notes"]) == 21
    assert not (tmp_path / "out").exists()
    path.write_text("\n")
    assert "has no job" in CliRunner().invoke(main, ["batch", str(path)]).stderr
    assert "No such file" in CliRunner().invoke(main, ["batch", str(tmp_path / "none.jsonl")]).stderr


def test_jobs_file_must_be_a_regular_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.jsonl")  # a pipe without a writer: opening it would block for ever
    for place in (tmp_path / "pipe.jsonl", Path("/dev/zero"), tmp_path):
        with pytest.raises(gs.SettingsError, match="a folder, a device or a pipe"):
            read_jobs(place)


def test_expanded_names_are_generated_lazily_and_limited(tmp_path: Path) -> None:
    """A line of a million characters would expand to a hundred thousand names; eleven lines, to more images than the limit."""
    path = tmp_path / "jobs.jsonl"
    long = "x/" * 400_000 + "{}.png"
    path.write_text(
        json.dumps({"scene": "courtyard", "output": long, "orbit": 100_000}) + "\n" + "y" * (3 << 20) + "\n"
    )
    tracemalloc.start()
    with pytest.raises(gs.SettingsError, match="has 2 lines that are not jobs") as raised:
        read_jobs(path)
    assert tracemalloc.get_traced_memory()[1] < 64 << 20
    tracemalloc.stop()
    assert "4095 in all" in raised.value.__notes__[0]
    assert "line 2: the line is longer than 1048576 characters" in raised.value.__notes__[1]
    written(path, *({"output": f"{k}_{{}}.png", "orbit": 100_000} for k in range(11)))
    with pytest.raises(gs.SettingsError, match="has 1 line that is not a job") as raised:
        read_jobs(path)
    assert "line 11: 1100000 images up to this line" in raised.value.__notes__[0]


def test_output_names_are_compared_as_paths(tmp_path: Path) -> None:
    path = written(
        tmp_path / "jobs.jsonl", {"output": "a//b.png"}, {"output": "./a/b.png"}, {"output": "{:x}.png", "orbit": 11}
    )
    with pytest.raises(gs.SettingsError, match="has 1 line that is not a job") as raised:
        read_jobs(path)
    assert "line 2: output 'a/b.png' is already used by line 1" in raised.value.__notes__[0]
    assert list(gs.batch.Job("courtyard", "{:x}.png", orbit=11).names())[-2:] == ["9.png", "a.png"]


def test_symlink_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (out / "link").symlink_to(elsewhere)
    jobs = read_jobs(written(tmp_path / "jobs.jsonl", {"output": "link/sub/a.png"}, {"output": "b.png"}))
    done = run_batch(jobs, out, processes=1)
    assert (done.drawn, len(done.failed)) == (1, 1)
    assert "by a link" in done.failed[0].reason
    assert list(elsewhere.iterdir()) == []


def outcomes(jobs: Path, out: Path) -> tuple[int, int]:
    done = run_batch(read_jobs(jobs), out, processes=1)
    assert done.failed == ()
    return done.drawn, done.kept


def test_image_matches_the_job_of_the_last_run(tmp_path: Path) -> None:
    """Edit a job, run, undo the edit, run: the image is the first job's again. The same after another file has replaced it."""
    out, path = tmp_path / "out", tmp_path / "jobs.jsonl"
    first, second = ({"output": "a.png", "lights": [{"direction": [x, -2, -1]}]} for x in (-1, 1))
    pictures = []
    for job in (first, second, first):
        assert outcomes(written(path, job), out) == (1, 0)
        pictures.append((out / "a.png").read_bytes())
    assert pictures[0] == pictures[2] != pictures[1]
    assert outcomes(path, out) == (0, 1)
    (out / "a.png").write_bytes(b"garbage")
    assert outcomes(path, out) == (1, 0)
    assert (out / "a.png").read_bytes() == pictures[0]


TRIANGLES = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 3/3 2/2\n"


def test_changed_model_file_renders_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Model, material library, texture, a file that was missing, glshadow's version. Rewriting the same bytes renders nothing."""
    out, path = tmp_path / "out", tmp_path / "jobs.jsonl"
    model, materials, texture = (tmp_path / f"models/a.{ending}" for ending in ("obj", "mtl", "png"))
    model.parent.mkdir()
    model.write_text(TRIANGLES)
    materials.write_text("newmtl m\nmap_Kd a.png\n")
    written(
        path, {"scene": "models/a.obj", "output": "a.png"}, {"scene": "models/a.obj", "output": "b.png", "ground": True}
    )
    assert outcomes(path, out) == (2, 0), "without its texture"
    assert outcomes(path, out) == (0, 2)
    image.write(texture, np.full((2, 2, 3), 200, np.uint8))
    assert outcomes(path, out) == (2, 0), "the texture exists now"
    reds = (out / "a.png").read_bytes()
    facts = texture.stat()
    image.write(texture, np.full((2, 2, 3), (90, 10, 10), np.uint8))
    os.utime(texture, ns=(facts.st_atime_ns, facts.st_mtime_ns))
    assert outcomes(path, out) == (2, 0), "another texture, of the same size and time"
    assert (out / "a.png").read_bytes() != reds
    materials.write_text("newmtl m\nKd 1 0 0\n")
    assert outcomes(path, out) == (2, 0)
    model.write_text(TRIANGLES + "# another file\n")
    assert outcomes(path, out) == (2, 0)
    model.write_bytes(model.read_bytes())
    assert outcomes(path, out) == (0, 2)
    model.parent.rename(tmp_path / "moved")
    written(path, {"scene": "moved/a.obj", "output": "a.png"})
    assert outcomes(path, out) == (0, 1), "the model's location does not matter"
    monkeypatch.setattr("glshadow.batch.inputs.__version__", "another")
    assert outcomes(path, out) == (1, 0)


def test_long_lived_worker_reloads_a_changed_model(tmp_path: Path) -> None:
    """Workers of a cluster outlive a batch."""
    model = tmp_path / "a.obj"
    model.write_text(TRIANGLES)
    job = gs.batch.Job(str(model), "a.png", size=(48, 32), samples=1)
    drawer = Drawer("egl")
    first = drawer.draw(job, tmp_path, "one")
    model.write_text(TRIANGLES.replace("v 1 0 0", "v 3 0 0"))
    assert drawer.draw(job, tmp_path, "one").images == first.images, "within a batch it is loaded once"
    assert drawer.draw(job, tmp_path, "two").images != first.images
    drawer.release()


def test_python_jobs_are_checked_and_told_apart(tmp_path: Path) -> None:
    for wrong in ({"size": (0, 3)}, {"cameras": [3]}, {"lights": gs.DirectionalLight}, {"shadow": 1}, {"samples": 3}, {"orbit": 0},
                  {"ground": 1}, {"up_axis": "w"}, {"background": "red"}, {"output": "/a.png"}, {"scene": 3}):  # fmt: skip
        with pytest.raises(gs.SettingsError, match=next(iter(wrong))):
            gs.batch.Job(**{"scene": "courtyard", "output": "a.png", **wrong})
    image_of = [np.full((4, 4, 3), each, np.uint8) for each in (50, 200)]
    for cookie in map(gs.Cookie, image_of):  # whose values print the same
        light = gs.DirectionalLight(direction=(-1, -2, -1), cookie=cookie)
        job = gs.batch.Job("courtyard", "a.png", lights=(light,), size=(48, 32), samples=1)
        assert run_batch([job], tmp_path, processes=1).drawn == 1
    assert run_batch([job], tmp_path, processes=1).kept == 1


def test_arguments_of_a_batch_are_checked(tmp_path: Path) -> None:
    jobs = [gs.batch.Job("courtyard", "a.png")]
    for wrong in ({"jobs": 3}, {"jobs": ["a.png"]}, {"processes": 0}, {"processes": "2"}, {"backend": "vulkan"}, {"fresh": 1},
                  {"progress": 3},
                  {"dask": 3}, {"folder": 3}):  # fmt: skip
        with pytest.raises(gs.SettingsError, match=next(iter(wrong))):
            run_batch(**{"jobs": jobs, "folder": tmp_path / "out", **wrong})
    assert not (tmp_path / "out").exists()


def test_unwritable_journal_is_refused_before_any_work(tmp_path: Path) -> None:
    jobs = [gs.batch.Job("courtyard", "a.png", size=(48, 32))]
    (tmp_path / "a" / JOURNAL).mkdir(parents=True)
    with pytest.raises(gs.GlshadowError, match=rf"{JOURNAL} is a folder"):
        run_batch(jobs, tmp_path / "a", processes=1)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / JOURNAL).symlink_to(tmp_path / "nowhere" / "journal")
    with pytest.raises(gs.GlshadowError, match=rf"{JOURNAL} is a link"):
        run_batch(jobs, tmp_path / "b", processes=1)
    assert not list(tmp_path.rglob("*.png"))


def test_failed_job_is_listed_and_the_others_succeed(tmp_path: Path) -> None:
    (tmp_path / "broken.glb").write_bytes(b"glTF nothing")
    jobs = written(
        tmp_path / "jobs.jsonl", {"output": "a.png"}, {"scene": "broken.glb", "output": "b.png"}, {"output": "c.png"}
    )
    out = tmp_path / "out"
    done = CliRunner().invoke(main, ["batch", str(jobs), "-o", str(out), "--processes", "1", "--json"])
    assert done.exit_code == 1
    report = json.loads(done.stdout)
    assert (report["drawn"], report["pictures"]) == (2, 2)
    (failed,) = report["failed"]
    assert failed["output"] == "b.png"
    assert "broken.glb" in failed["reason"]
    assert (out / "a.png").is_file()
    assert (out / "c.png").is_file()
    again = CliRunner().invoke(main, ["batch", str(jobs), "-o", str(out), "--processes", "1"])
    assert "2 kept, 1 failed" in again.stderr, "a failed job is tried again"
    checked = CliRunner().invoke(main, ["batch", str(jobs), "--check", "--json"])
    assert json.loads(checked.stdout)["pictures"] == 3


def test_dead_process_fails_one_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from glshadow.batch import run

    jobs = read_jobs(written(tmp_path / "jobs.jsonl", *({"output": f"{k}.png"} for k in range(4))))
    begun = run._Worker.begin

    def begin(worker: Any, job: Any) -> None:
        if job.output == "1.png":
            os.kill(worker._process.pid, signal.SIGSTOP)  # so that it cannot be done before it is killed
        begun(worker, job)
        if job.output == "1.png":
            os.kill(worker._process.pid, signal.SIGKILL)

    monkeypatch.setattr(run._Worker, "begin", begin)
    done = run_batch(jobs, tmp_path / "out", processes=1)
    assert done.drawn == 3
    (failed,) = done.failed
    assert isinstance(failed, Failed)
    assert (failed.job.output, "signal 9" in failed.reason) == ("1.png", True)
    monkeypatch.undo()
    assert run_batch(jobs, tmp_path / "out", processes=1).kept == 3


@pytest.mark.slow
def test_killed_batch_resumes(tmp_path: Path) -> None:
    """The whole command, killed by SIGKILL: no image is truncated, and the next run renders only the missing ones."""
    jobs = written(tmp_path / "jobs.jsonl", *({"output": f"{k}.png"} for k in range(60)))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "glshadow", "batch", str(jobs), "-o", str(out), "--processes", "1"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True) as process:
        until = time.monotonic() + 30.0
        while len(list(out.glob("[0-9]*.png"))) < 5 and time.monotonic() < until:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
    there = {path.name for path in out.glob("[0-9]*.png")}
    for name in there:
        assert image.read(out / name).shape[:2] == (32, 48)
    done = run_batch(read_jobs(jobs), out, processes=1)
    assert done.kept >= len(there) - 1, "an image may exist before its line in the journal"
    assert done.kept + done.drawn == 60
    assert len(list(out.glob("[0-9]*.png"))) == 60
    assert len((out / JOURNAL).read_text().splitlines()) == 60


@pytest.mark.slow
def test_cluster_survives_a_lost_worker(tmp_path: Path) -> None:
    """Two worker processes, one killed midway: every image is rendered, none twice."""
    distributed = pytest.importorskip("distributed")
    lines = ({"output": f"{k:02d}.png", "lights": [{"direction": [-1, -2 - k, -1]}]} for k in range(40))
    jobs = read_jobs(written(tmp_path / "jobs.jsonl", *lines))
    killed: list[int] = []
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        pids = [worker.pid for worker in cluster.workers.values()]

        def progress(done: int, total: int, name: str) -> None:
            if done == 10 and not killed:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        done = run_batch(jobs, tmp_path / "out", dask=cluster.scheduler_address, progress=progress)
    assert killed
    assert done.failed == ()
    assert done.drawn == 40
    keys = [json.loads(line)["key"] for line in (tmp_path / "out" / JOURNAL).read_text().splitlines()]
    assert len(keys) == len(set(keys)) == 40
    assert len(list((tmp_path / "out").glob("[0-9]*.png"))) == 40
    assert not [path for path in (tmp_path / "out").iterdir() if path.suffix not in (".png", ".jsonl")]


@pytest.mark.slow
def test_cluster_without_workers_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The batch waits and reports that it waits; so it does again when the last worker has gone."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("glshadow.batch.cluster.ANSWERS_S", 0.5)
    jobs = read_jobs(written(tmp_path / "jobs.jsonl", {"output": "a.png"}, {"output": "b.png"}))
    said: list[str] = []
    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:

        def listen(text: str) -> None:
            said.append(text)
            cluster.scale(1)

        def progress(done: int, total: int, name: str) -> None:
            if done == 1:
                cluster.scale(0)

        with listening(listen):
            done = run_batch(jobs, tmp_path / "out", dask=cluster.scheduler_address, progress=progress)
    assert done.drawn == 2
    assert "has no worker: waiting for one" in said[0]


def test_result_that_was_lost_with_its_worker_is_waited_for_aloud(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between a job's end and the fetching of its result the last worker may go."""
    from glshadow.batch import cluster

    library = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "ANSWERS_S", 0.0)

    class Fake:
        left = 2

        def result(self, timeout: float) -> str:
            self.left -= 1
            if self.left >= 0:
                raise TimeoutError
            return "drawn"

        def nthreads(self) -> dict[str, int]:
            return {"worker": 1} if self.left == 0 else {}

    with pytest.warns(gs.GlshadowWarning, match="has no worker left") as said:
        assert cluster._result(Fake(), library, Fake(), "tcp://there") == "drawn"
    assert len(said) == 2


def test_missing_scheduler_and_missing_opengl_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    jobs = read_jobs(written(tmp_path / "jobs.jsonl", {"output": "a.png"}))
    monkeypatch.setattr("glshadow.batch.cluster.ANSWERS_S", 0.5)
    with pytest.raises(gs.SettingsError, match="no Dask scheduler answers at"):
        run_batch(jobs, tmp_path / "out", dask="tcp://127.0.0.1:1")
    with pytest.raises(gs.ResourceError, match="a process of the batch has no OpenGL"):
        run_batch(jobs, tmp_path / "out", processes=1, backend="window")
