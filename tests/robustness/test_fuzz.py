"""A few mutated files and random settings, always the same, through the whole renderer; scripts/fuzz runs 10,000."""

import time

import numpy as np
import pytest

import glshadow as gs

from ..pace import pace
from . import mutated_files, random_settings, verdict

FILES = 100
SETTINGS = 40  # ten seconds if the driver has cached no shader: nearly every case has some of its own
SEED = 20260101
SLOWEST_S = 10.0  # of processor time of an idle core: a hang


@pytest.fixture(scope="module")
def renderer():
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture(scope="module")
def files(models):
    stock = mutated_files.sources(models)
    return stock, mutated_files.refused(stock)


def failures(run, cases):
    """`number: cause` of all failed cases, and the number of cases by result."""
    wrong, kinds = [], dict.fromkeys((verdict.OK, verdict.WARNED, verdict.REFUSED, verdict.FAIL), 0)
    slowness = pace()
    for number in range(cases):
        start = time.process_time()
        result = run(np.random.default_rng([SEED, number]))
        kinds[result.kind] += 1
        if result.kind == verdict.FAIL:
            wrong.append(f"{number}: {result.cause}: {result.detail[-400:]}")
        taken = time.process_time() - start
        if taken > SLOWEST_S and taken > SLOWEST_S * max(slowness, pace()):
            wrong.append(f"{number}: hang")
    return wrong, kinds


def test_mutated_files(renderer, files, tmp_path, capfd):
    def run(rng):
        mutant = mutated_files.mutant(rng, *files)
        path = tmp_path / f"fuzz{mutant.suffix}"
        path.write_bytes(mutant.data)

        def work():
            scene = gs.load(path)
            verdict.checked_render(renderer, scene, None, verdict.small_maps(scene.lights), (64, 64))

        return verdict.judged(work)

    wrong, kinds = failures(run, FILES)
    assert wrong == []
    # the mutations are neither harmless nor all fatal
    assert kinds[verdict.OK] + kinds[verdict.WARNED] > FILES // 10, kinds
    assert kinds[verdict.REFUSED] > FILES // 10, kinds


def test_random_settings(renderer):
    def run(rng):
        case = random_settings.case(rng)
        return verdict.judged(lambda: verdict.checked_case(renderer, case))

    wrong, kinds = failures(run, SETTINGS)
    assert wrong == []
    assert kinds[verdict.OK] > SETTINGS // 4, kinds  # most cameras see something


def test_checks_detect_broken_frames(renderer, monkeypatch):
    scene = gs.scenes.courtyard()
    render = gs.Renderer.render

    def judge(change):
        def broken(self, *arguments, **options):
            frame = render(self, *arguments, **options)
            change(frame)
            return frame

        monkeypatch.setattr(gs.Renderer, "render", broken)
        result = verdict.judged(lambda: verdict.checked_render(renderer, scene, None, None, (32, 32)))
        return result.kind, result.cause

    assert judge(lambda frame: None)[0] == verdict.OK
    assert judge(lambda frame: frame.linear.__setitem__((3, 4, 0), np.nan))[1] == "linear not finite"
    assert judge(lambda frame: frame.visibility.__setitem__((0, 0, 0), 1.5))[0] == verdict.FAIL
    assert (
        judge(lambda frame: (frame.depth.fill(np.inf), frame.visibility.fill(np.nan)))[1] == "blank without a warning"
    )
    noise = iter(range(1, 99))
    assert judge(lambda frame: frame.image.fill(next(noise)))[1] == "two pictures differ in image"
    assert judge(lambda frame: {}["no such key"])[1].startswith("KeyError at ")
