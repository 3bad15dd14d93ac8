"""Renderers created and released in turn, at once, in threads and processes, out of memory and interrupted; images stay right."""

import gc
import itertools
import multiprocessing as mp
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from pathlib import Path

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

from ..tolerances import PATIENCE_S
from .gl_objects import counted, resident_mib
from .interrupted import interrupt

SIZE = (48, 32)


def box(height=1.0):
    floor = shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4))
    solids = (floor, shapes.box((1, height, 1), (0, height / 2, 0)))
    return gs.Scene(tuple(gs.Node(gs.Mesh(*solid), np.eye(4), str(i)) for i, solid in enumerate(solids)))


def picture(renderer, scene=None):
    return renderer.render(scene or box(), size=SIZE, samples=1).image


def alone(queue=None):
    with gs.Renderer() as renderer:
        image = picture(renderer)
    if queue is not None:
        queue.put(image)
    return image


@pytest.fixture(scope="module")
def expected():
    return alone()


def test_renderer_works_after_another_was_released(expected):
    first = gs.Renderer()
    kept = picture(first)
    first.release()
    first.release()
    np.testing.assert_array_equal(alone(), expected)
    np.testing.assert_array_equal(kept, expected)
    with pytest.raises(gs.GlshadowError, match="released"):
        picture(first)


def test_two_renderers_may_be_released_in_any_order(expected):
    first, second = gs.Renderer(), gs.Renderer()
    scene = box()
    for renderer in (first, second, first, second):
        np.testing.assert_array_equal(picture(renderer, scene), expected)
    first.release()
    np.testing.assert_array_equal(picture(second, scene), expected)
    second.release()


def test_one_renderer_per_thread(expected):
    results, errors = {}, []

    def work(number):
        try:
            with gs.Renderer() as renderer:
                results[number] = [picture(renderer) for _ in range(3)]
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(i,), daemon=True) for i in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
        assert not thread.is_alive(), "a thread hangs"
    assert errors == []
    assert sorted(results) == [0, 1, 2]
    for images in results.values():
        for image in images:
            np.testing.assert_array_equal(image, expected)


def test_renderer_used_in_another_thread(expected):
    outcome = []
    with gs.Renderer() as renderer:
        picture(renderer)

        def work():
            try:
                outcome.append(picture(renderer))
            except gs.GlshadowError as error:
                outcome.append(error)

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        thread.join(PATIENCE_S)
        assert not thread.is_alive()
        assert isinstance(outcome[0], gs.GlshadowError) or np.array_equal(outcome[0], expected)
        np.testing.assert_array_equal(picture(renderer), expected)


def test_spawned_processes(expected):
    context = mp.get_context("spawn")
    queue = context.Queue()
    workers = [context.Process(target=_spawned, args=(queue, os.fspath(__file__))) for _ in range(2)]
    for worker in workers:
        worker.start()
    for _ in workers:
        np.testing.assert_array_equal(queue.get(timeout=PATIENCE_S), expected)
    for worker in workers:
        worker.join(PATIENCE_S)
        assert worker.exitcode == 0


def _spawned(queue, _):
    alone(queue)


FORK = """
import os, signal, sys
import glshadow as gs
from glshadow.scenes import shapes
import numpy as np
scene = gs.Scene((gs.Node(gs.Mesh(*shapes.box((1, 1, 1)))),))
when = sys.argv[1]
used = gs.Renderer() if when != "before" else None
if used:
    used.render(scene, size=(8, 8))
if when == "released":
    used.release()
child = os.fork()
if child == 0:
    signal.alarm(20)
    try:
        renderer = used if when == "shared" else gs.Renderer()
        renderer.render(scene, size=(8, 8))
        renderer.release()
        os._exit(0)
    except gs.GlshadowError as error:
        print(error, flush=True)
        if used:
            used.release()
        os._exit(7)
_, status = os.waitpid(child, 0)
if when in ("shared", "other"):
    used.render(scene, size=(8, 8))
    used.release()
sys.exit(os.waitstatus_to_exitcode(status))
"""


@pytest.mark.parametrize("when", ["before", "released", "other", "shared"])
def test_fork(when):
    code = FORK
    done = subprocess.run(
        [sys.executable, "-c", code, when], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == (0 if when == "before" else 7), f"{done.returncode} (-14: it hung)\n{done.stderr}"
    if when != "before":
        assert "fork" in done.stdout or "released" in done.stdout


MEMORY = """
import resource, sys
from pathlib import Path
sys.path.insert(0, {folder!r})
from gl_objects import counted
import numpy as np
import glshadow as gs
from glshadow.scenes import shapes
scene = gs.Scene((gs.Node(gs.Mesh(*shapes.box((1, 1, 1)))),))
with gs.Renderer() as renderer:
    before = renderer.render(scene, size=(64, 64), samples=1).image
    held = counted(renderer)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + (256 << 20), resource.RLIM_INFINITY))
    sun = [gs.DirectionalLight(shadow=gs.Shadow(resolution=12000, target=target)) for target in (None, gs.Target.RGBA8)]
    for options in (dict(lights=sun[:1]), dict(size=(9000, 9000)), dict(size=(3000, 3000)), dict(lights=sun[1:])) * 2:
        try:
            renderer.render(scene, **(dict(size=(64, 64), samples=1) | options))
            if options != dict(size=(3000, 3000)):  # on the edge of what is left: moderngl's own allocations fail there
                sys.exit("rendered")
        except gs.ResourceError as error:
            assert "memory" in str(error), error
        again = renderer.render(scene, size=(64, 64), samples=1).image
        assert np.array_equal(before, again), "the picture after it is wrong"
        assert counted(renderer) == held, f"left behind after {{options}}: {{held}} -> {{counted(renderer)}}"
"""


@pytest.mark.skipif(sys.platform != "linux", reason="optional: RLIMIT_AS limits what it says on Linux only")
def test_out_of_memory_is_a_named_error_and_leaves_a_working_renderer():
    done = subprocess.run(
        [sys.executable, "-c", MEMORY.format(folder=os.fspath(Path(__file__).parent))],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_refused_frames_leak_no_gl_objects():
    with gs.Renderer() as renderer:
        scene = box()
        picture(renderer, scene)
        before = counted(renderer)
        for size in ((20_000, 4), (4, 20_000), (4, 1 << 20)):
            with pytest.raises(gs.GlshadowError, match=r"16384|pixels"):
                renderer.render(scene, size=size, samples=1)
        lights = [gs.PointLight(position=(0, 2, 0), shadow=gs.Shadow(resolution=16384))]
        with pytest.raises(gs.SettingsError):
            renderer.render(scene, lights=lights, size=SIZE, samples=1)
        picture(renderer, scene)
        assert counted(renderer) == before


def test_changing_scenes_do_not_leak():
    with gs.Renderer() as renderer:
        counts = []
        for turn in range(30):
            picture(renderer, box(1.0 + 0.01 * turn))
            if turn % 10 == 9:
                counts.append(counted(renderer))
        assert counts[0] == counts[1] == counts[2]


def test_renderers_leave_no_objects_in_a_foreign_context():
    context = moderngl.create_standalone_context(backend="egl")
    first = gs.Renderer(context=context)
    empty = {}
    for _ in range(3):
        with gs.Renderer(context=context) as renderer:
            picture(renderer)
        empty = empty or counted(first)
        assert counted(first) == empty
    first.release()
    context.release()


def test_ctrl_c_during_a_frame_leaves_a_working_renderer(expected):
    scene = gs.scenes.courtyard()
    lights = [gs.PointLight(position=(0, 3, 0), shadow=gs.Shadow(resolution=1024))] * 4
    interrupted = 0
    with gs.Renderer() as renderer:
        for delay in (0.02, 0.1, 0.3):
            timer = threading.Timer(delay, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            try:
                start = time.monotonic()
                while time.monotonic() - start < PATIENCE_S:
                    renderer.render(scene, lights=lights, size=(320, 180), samples=1)
            except KeyboardInterrupt:
                interrupted += 1
            timer.join()
            np.testing.assert_array_equal(picture(renderer), expected)
    assert interrupted == 3


# an object that moderngl was creating at the interrupt may lack attributes that its __del__ reads
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("warm", "stride"),
    [
        (True, 4999),
        *(pytest.param(*each, marks=pytest.mark.exhaustive) for each in ((False, 1999), (True, 701))),
    ],
)
def test_ctrl_c_at_any_step_leaves_a_working_renderer(warm, stride):
    """A first frame has some 27,000 steps, a warm one 7,000."""
    scene = box()
    lights = [gs.DirectionalLight(shadow=gs.Shadow(filter=filter_)) for filter_ in (gs.Pcf(), gs.Exact())]

    def draw():
        return renderer.render(scene, lights=lights, size=SIZE, samples=1).image

    with gs.Renderer() as renderer:
        expected = draw()
    step, interrupted = 11, True
    while interrupted:
        with gs.Renderer() as renderer:
            if warm:
                picture(renderer, box(2.0))
            interrupted = interrupt(step, draw)
            np.testing.assert_array_equal(draw(), expected)
            assert renderer._context.ctx.error == "GL_NO_ERROR"
        step += stride


def test_released_renderers_free_their_memory():
    for _ in range(3):
        alone()
    before = resident_mib()
    for _ in range(8):
        alone()
    # one 2048 x 2048 float map is 16 MiB: eight renderers that kept theirs would keep 128
    assert resident_mib() - before < 32.0


def test_dropped_renderers_give_their_memory_back():
    """Without release; the scene, which outlives them, must not hold them."""
    scene, count = box(), 8
    for _ in range(3):
        alone()
    before = resident_mib()
    held = [gs.Renderer() for _ in range(count)]
    for renderer in held:
        picture(renderer, scene)
    size = resident_mib() - before
    contexts = [weakref.ref(renderer._context) for renderer in held]
    del held, renderer
    gc.collect()
    assert [ref() for ref in contexts] == [None] * count
    before = resident_mib()
    for _ in range(2 * count):
        picture(gs.Renderer(), scene)
        gc.collect()
    assert resident_mib() - before < size / 4, f"{count} renderers at once take {size:.0f} MiB"


@pytest.mark.parametrize(
    ("name", "at_least"),
    [
        *((name, 3) for name in ("program", "buffer", "texture", "framebuffer", "vertex_array")),
        *((name, 1) for name in ("compute_shader", "depth_texture")),
    ],
)
def test_interrupted_when_a_gpu_object_is_made_and_not_yet_noted(monkeypatch, expected, name, at_least):
    """What nobody has noted goes with its context."""
    make = getattr(moderngl.Context, name)
    with gs.Renderer() as renderer:
        picture(renderer)
        held = counted(renderer)

    for number in range(at_least):
        calls = itertools.count()

        def made(*arguments, calls=calls, number=number, **options):
            thing = make(*arguments, **options)
            if next(calls) == number:
                raise KeyboardInterrupt
            return thing

        with gs.Renderer() as renderer:
            monkeypatch.setattr(moderngl.Context, name, made)
            with pytest.raises(KeyboardInterrupt):
                picture(renderer)
            monkeypatch.undo()
            np.testing.assert_array_equal(picture(renderer), expected)
            assert counted(renderer) == held


def test_released_renderer_leaves_no_data_on_meshes():
    """A scene outlives many renderers: the data that each of them computed of its meshes must be freed with it."""
    scene = gs.scenes.courtyard()
    renderer = gs.Renderer()
    renderer.render(scene, size=(32, 32), samples=1)
    kept = [weakref.ref(gpu) for gpu in renderer._cache.scene.thing.meshes]
    renderer.release()
    del renderer
    gc.collect()
    assert [ref() for ref in kept] == [None] * len(kept)
