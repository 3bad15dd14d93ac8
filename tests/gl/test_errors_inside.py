"""An error inside a frame: what comes out has a name, and what was kept stays where nothing is half made."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.resources import Store
from glshadow.renderer import Renderer

SIZE = (64, 48)
LIGHT = gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Pcf(1), resolution=64))
OTHER = gs.DirectionalLight(direction=(0.3, -1.0, 0.2), shadow=gs.Shadow(filter=gs.Pcf(1), resolution=64))


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer("egl") as renderer:
        yield renderer


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


def kept_after(
    renderer: Renderer,
    scene: gs.Scene,
    where: str,
    error: BaseException,
    raised: type[BaseException],
    match: str | None,
) -> bool:
    """Whether the store is the same after an error in a frame of another light; the next picture is right in any case."""
    expected = renderer.render(scene, None, [LIGHT], SIZE, samples=1)
    store = renderer._store

    def fails(*_: object, **__: object) -> None:
        raise error

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(where, fails)
        with pytest.raises(raised, match=match) as caught:
            renderer.render(scene, None, [OTHER], SIZE, samples=1)
    assert caught.value is error or caught.value.__cause__ is error
    again = renderer.render(scene, None, [LIGHT], SIZE, samples=1)
    np.testing.assert_array_equal(again.image, expected.image)
    np.testing.assert_array_equal(again.visibility, expected.visibility)
    return renderer._store is store


FITTED = "glshadow.shadows.fits.ViewFit.fitted"  # before anything is drawn
DRAWN = "glshadow.gl.passes.caster.draw_nodes"  # a map that is begun, in a state of its own
READ = "glshadow.gl.resources.read_means"


@pytest.mark.parametrize("where", [FITTED, DRAWN, READ])
@pytest.mark.parametrize(
    "error", [ZeroDivisionError("float division by zero"), np.linalg.LinAlgError("singular"), IndexError(7)]
)
def test_a_formula_that_fails_is_reported_and_costs_nothing(
    renderer: Renderer, scene: gs.Scene, where: str, error: Exception
) -> None:
    match = rf"unexpected {type(error).__name__}: {error}; please report this, with the input: scene box.*DirectionalLight\(.*64, 48"
    assert kept_after(renderer, scene, where, error, gs.GlshadowError, match)


@pytest.mark.parametrize("error", [TypeError("no"), AttributeError("none"), moderngl.Error("incomplete")])
def test_another_defect_is_reported_and_nothing_is_kept(renderer: Renderer, scene: gs.Scene, error: Exception) -> None:
    match = f"unexpected {type(error).__name__}: {error}; please report this"
    assert not kept_after(renderer, scene, DRAWN, error, gs.GlshadowError, match)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), TimeoutError("late"), SystemExit(1)])
def test_what_signal_handlers_raise_comes_out_as_it_is(
    renderer: Renderer, scene: gs.Scene, error: BaseException
) -> None:
    """At any line, so that nothing is kept."""
    assert not kept_after(renderer, scene, DRAWN, error, type(error), None)


def test_a_named_error_costs_nothing(renderer: Renderer, scene: gs.Scene) -> None:
    error = gs.SettingsError("of a setting")
    assert kept_after(renderer, scene, DRAWN, error, gs.SettingsError, "of a setting")


def test_too_little_memory_keeps_nothing(renderer: Renderer, scene: gs.Scene) -> None:
    assert not kept_after(renderer, scene, READ, MemoryError(), gs.ResourceError, "not enough memory for 64 x 48")


def test_what_the_driver_could_not_allocate_is_not_kept(
    renderer: Renderer, scene: gs.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where another way was found: a buffer without memory would be taken for one that is large enough."""
    light = gs.DirectionalLight()  # lists, else a map
    expected = renderer.render(scene, None, [light], SIZE, samples=1)
    first = renderer._store
    assert isinstance(first, Store)
    kind, drain = type(renderer._context.gl), type(renderer._context.gl)._drain
    with monkeypatch.context() as patch:
        check = kind.check

        def fails(self: object, what: str) -> None:
            if what.startswith("allocating lists"):
                patch.setattr(kind, "_drain", lambda _: [0x0505])
            try:
                check(self, what)  # type: ignore[arg-type]
            finally:
                patch.setattr(kind, "_drain", drain)

        patch.setattr(kind, "check", fails)
        first.sources.clear()
        frame = renderer.render(scene, None, [light], SIZE, samples=1)
    assert frame.used[0].filter == gs.Pcf(1)
    assert "ran out of memory" in frame.used[0].why
    assert renderer._store is not first
    again = renderer.render(scene, None, [light], SIZE, samples=1)
    assert again.used[0].filter == gs.Exact()
    np.testing.assert_array_equal(again.visibility, expected.visibility)


def test_a_warning_that_is_made_an_error_comes_out_as_it_is(renderer: Renderer, scene: gs.Scene) -> None:
    away = gs.PerspectiveCamera((0.0, 2.0, 5.0), (0.0, 4.0, 10.0))
    store = renderer._store
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(gs.GlshadowWarning, match="nothing is in view"):
            renderer.render(scene, away, [LIGHT], SIZE, samples=1)
    assert renderer._store is store
