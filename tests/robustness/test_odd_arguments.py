"""Every public callable with every odd value for each argument: it works, or it names the fault; no foreign error, no foreign
warning, and no negative or non-finite number in an image."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow import batch, image, overlay, study

from .odd_arguments import ODD, SCENE, SIZE, Call, built, given


def verdict(call: Callable[[], Any]) -> str | None:
    """How a call fails the test; None: it does not."""
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="warn", under="ignore"):
        warnings.simplefilter("always")
        try:
            result = call()
        except gs.GlshadowError as error:
            result = None
            if not str(error).isprintable() or len(str(error)) > 2100:
                return f"unprintable or endless: {str(error)[:200]!r}"
        except Exception as error:
            return f"{type(error).__name__}: {str(error)[:200]}"
    foreign = [each for each in caught if not issubclass(each.category, gs.GlshadowWarning)]
    if foreign:
        return f"{foreign[0].category.__name__}: {foreign[0].message} ({foreign[0].filename}:{foreign[0].lineno})"
    return frame_fault(result) if isinstance(result, gs.Frame) else None


def frame_fault(frame: gs.Frame) -> str | None:
    """An invalid value in a frame; None if there is none."""
    linear = frame.outputs.get("linear", np.zeros(1))
    if not np.isfinite(linear).all() or (linear < 0.0).any():
        return f"linear from {linear.min()} to {linear.max()}"
    return None


def faults(function: Callable[..., Any], arguments: dict[str, Callable[[], Any]], name: str) -> list[str]:
    found = []
    for odd, make in ODD.items():
        values = {key: value() for key, value in arguments.items()} | {name: make()}
        fault = verdict(lambda values=values: function(**values))  # type: ignore[misc]
        if fault:
            found.append(f"{name}={odd}: {fault}")
    return found


TRACE: dict[str, Call] = {
    "trace": (
        gs.trace,
        {
            "scene": given(SCENE), "camera": given(None), "lights": given(None), "size": given(SIZE), "samples": given(1),
            "light_samples": given(1), "surface": given(None),
        },
    ),
    "render_distorted": (
        gs.render_distorted,
        {
            "scene": given(SCENE), "camera": given(None), "distortion": given(gs.BrownDistortion(0.1)), "size": given(SIZE),
            "oversampling": given(1), "renderer": given(None), "outputs": given("linear"),
        },
    ),
    "read_colmap": (gs.read_colmap, {"folder": given(Path(__file__).parents[1] / "colmap")}),
}  # fmt: skip


def cases(calls: dict[str, Call]) -> list[Any]:
    return [pytest.param(*call, name, id=f"{key}-{name}") for key, call in calls.items() for name in call[1]]


@pytest.mark.parametrize(("function", "arguments", "name"), cases(built() | TRACE))
def test_settings(function: Callable[..., Any], arguments: dict[str, Callable[[], Any]], name: str) -> None:
    if function not in (image.read, gs.read_colmap):  # which have nothing to read
        function(**{key: value() for key, value in arguments.items()})
    assert faults(function, arguments, name) == []


@pytest.fixture(scope="module")
def results(renderer: gs.Renderer) -> tuple[gs.Frame, gs.Truth]:
    outputs = ("image", "visibility", "depth", "shadow_maps")
    return renderer.render(SCENE, size=SIZE, outputs=outputs, samples=1), gs.trace(SCENE, size=SIZE, samples=1)


RENDER = {
    "scene": given(SCENE), "camera": given(None), "lights": given(None), "size": given(SIZE), "ambient": given(0.1),
    "background": given((0.0, 0.0, 0.0)), "outputs": given(("image", "linear")),
}  # fmt: skip


@pytest.mark.parametrize("name", RENDER)
def test_render(renderer: gs.Renderer, name: str) -> None:
    assert faults(renderer.render, RENDER, name) == []


def test_odd_but_valid_arguments_render(renderer: gs.Renderer) -> None:
    """Otherwise the tests above would pass if everything were refused."""
    for name, odd in [("lights", "lights"), ("lights", "sun"), ("lights", "()"), ("ambient", "0-d"), ("ambient", "[.5] * 3"),
                      ("background", "read-only"), ("background", "0"), ("outputs", "names"), ("size", "one")]:  # fmt: skip
        values = {key: value() for key, value in RENDER.items()} | {name: ODD[odd]()}
        if name == "size":
            values["size"] = iter((np.int64(8), 6))
        assert isinstance(renderer.render(**values), gs.Frame), (name, odd)


def test_light_is_neither_negative_nor_infinite(renderer: gs.Renderer) -> None:
    for refused in (
        {"ambient": -0.1},
        {"ambient": (0.1, -0.1, 0.1)},
        {"background": (0.0, 0.0, 1e308)},
        {"background": (-0.1, 0.0, 0.0)},
    ):
        with pytest.raises(gs.SettingsError, match=next(iter(refused))):
            renderer.render(SCENE, size=SIZE, **refused)  # type: ignore[arg-type]
    for strong in ({"ambient": 1e38}, {"lights": gs.DirectionalLight(color=(1e38,) * 3, intensity=1e38)}):
        frame = renderer.render(SCENE, size=SIZE, outputs=("linear",), **strong)  # type: ignore[arg-type]
        assert frame_fault(frame) is None


RESULTS: dict[str, dict[str, Any]] = {
    "gs.render": {"scene": SCENE, "camera": None, "lights": None, "size": SIZE, "path": None, "ambient": 0.1, "outputs": ("image",)},
    "Renderer": {"backend": "auto", "context": None},
    "gs.measure": {"frame": 0, "truth": 1},
    "gs.flip": {"ours": 0, "reference": 0, "pixels_per_degree": 67.0},
    "overlay.overlay": {"frame": 0, "names": ("map",)},
    "overlay.light_color": {"number": 0},
    "Frame.save": {"path": "a.png"},
    "Frame.save exr": {"path": "a.exr"},
    "image.write": {"path": "a.png", "image": np.zeros((2, 2, 3), dtype=np.uint8)},
    "image.write exr": {"path": "a.exr", "image": {"x": np.zeros((2, 2))}},
    "image.write channel": {"value": np.zeros((2, 2))},
    "Truth.near_edge": {"light": 0, "radius": 0.1, "where": None},
    "Truth.near_foot": {"radius": 0.1, "where": np.ones(SIZE[::-1], dtype=bool)},
    "Measurement.picture": {"light": 0},
}  # fmt: skip


@pytest.mark.parametrize(("key", "name"), [(key, name) for key, arguments in RESULTS.items() for name in arguments])
def test_results(
    results: tuple[gs.Frame, gs.Truth], key: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    frame, truth = results

    def opened(**arguments: Any) -> None:
        gs.Renderer(**arguments).release()

    functions: dict[str, Callable[..., Any]] = {
        "gs.render": gs.render, "Renderer": opened, "gs.measure": gs.measure, "gs.flip": gs.flip, "overlay.overlay": overlay.overlay,
        "overlay.light_color": overlay.light_color,
        "Frame.save": frame.save, "Frame.save exr": frame.save, "image.write": image.write, "image.write exr": image.write,
        "image.write channel": lambda value: image.write("a.exr", {"x": value}), "Truth.near_edge": truth.near_edge,
        "Truth.near_foot": truth.near_foot, "Measurement.picture": gs.measure(frame, truth).picture,
    }  # fmt: skip
    made = {"frame": frame, "truth": truth, "ours": frame, "reference": frame}
    arguments = {other: given(made.get(other, value)) for other, value in RESULTS[key].items()}
    assert faults(functions[key], arguments, name) == []
    assert not list(tmp_path.glob(".*"))


STUDY: dict[str, Any] = {
    "scene": SCENE, "camera": None, "lights": None, "size": SIZE, "repeats": 1, "resume": None, "progress": None, "backend": "auto",
}  # fmt: skip
PLAN = STUDY | {"wrong": 0.9, "filters": (gs.Hard(),), "resolutions": (64,)}


@pytest.mark.parametrize(
    ("function", "given_arguments", "name"),
    [(study.run_study, STUDY | {"grid": [gs.Shadow(resolution=64)]}, name) for name in (*STUDY, "grid")]
    + [(study.run_plan, PLAN, name) for name in PLAN],
)
def test_studies(
    function: Callable[..., Any],
    given_arguments: dict[str, Any],
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The run is stubbed: only the checks of its arguments are tested."""
    monkeypatch.chdir(tmp_path)

    def stop(*_: object) -> None:
        raise gs.ResourceError("all arguments are fine")

    monkeypatch.setattr("glshadow.study.run.Floor", stop)
    assert faults(function, {key: given(value) for key, value in given_arguments.items()}, name) == []


BATCH = {
    "jobs": given([batch.Job("courtyard", "a.png")]), "folder": given("out"), "processes": given(1), "backend": given("auto"),
    "fresh": given(False), "progress": given(None), "dask": given(None),
}  # fmt: skip


@pytest.mark.parametrize("name", BATCH)
def test_batches(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs are not rendered: only the checks before `run_batch` are tested."""
    monkeypatch.chdir(tmp_path)

    def stop(*_: object) -> None:
        raise gs.ResourceError("all arguments are fine")

    monkeypatch.setattr("glshadow.batch.run._local", stop)
    monkeypatch.setattr("glshadow.batch.cluster.on_cluster", stop)
    assert faults(batch.run_batch, BATCH, name) == []


def test_jobs_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert faults(batch.read_jobs, {"path": given("jobs.jsonl")}, "path") == []


MAP = {
    "draw": {"casters": given(lambda caster: None)}, "fit": {"light": given(gs.DirectionalLight()), "bounds": given(None)},
    "source": {"name": given("lamp"), "version": given(True)}, "include": {"name": given("lamp")},
    "apply": {"program": given(None), "name": given("lamp"), "unit": given(0)},
}  # fmt: skip


@pytest.mark.parametrize(
    ("method", "name"), [(method, name) for method, arguments in MAP.items() for name in arguments]
)
def test_shadow_maps_of_other_programs(method: str, name: str) -> None:
    context = moderngl.create_standalone_context(require=330, backend="egl")
    program = context.program(
        vertex_shader="#version 330\nvoid main() { gl_Position = vec4(0.0); }",
        fragment_shader="#version 330\nout vec4 color;\nvoid main() { color = vec4(1.0); }",
    )
    with gs.ShadowMap(context, gs.DirectionalLight(), SCENE.bounds) as shadow:
        arguments = MAP[method] | ({"program": given(program)} if method == "apply" else {})
        getattr(shadow, method)(**{key: value() for key, value in arguments.items()})
        found = faults(getattr(shadow, method), arguments, name)
        called = ("casters=function", "casters=raising")  # they raise errors of their own
        assert [each for each in found if not each.startswith(called)] == []
    context.release()


def test_camera_sequence(renderer: gs.Renderer) -> None:
    arguments = {"scene": given(SCENE), "cameras": given(())}
    assert faults(lambda **values: list(itertools.islice(renderer.sequence(**values), 2)), arguments, "cameras") == []
