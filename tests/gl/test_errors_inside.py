"""An error inside a frame has a name, and cached data survives unless it may be incomplete."""

from __future__ import annotations

import warnings

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.resources import ResourceCache
from glshadow.renderer import Renderer

SIZE = (64, 48)
LIGHT = gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Pcf(1), resolution=64))
OTHER = gs.DirectionalLight(direction=(0.3, -1.0, 0.2), shadow=gs.Shadow(filter=gs.Pcf(1), resolution=64))


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
    """Whether the cache is unchanged after an error in a frame with another light; the next frame is correct in any case."""
    expected = renderer.render(scene, None, [LIGHT], SIZE, samples=1)
    cache = renderer._cache

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
    return renderer._cache is cache


FITTED = "glshadow.shadows.fits.ViewFit.fitted"  # before anything is drawn
DRAWN = "glshadow.gl.passes.caster.draw_nodes"  # inside a map's draw calls, in a GL state of its own
READ = "glshadow.gl.resources.read_means"


@pytest.mark.parametrize("where", [FITTED, DRAWN, READ])
@pytest.mark.parametrize(
    "error", [ZeroDivisionError("float division by zero"), np.linalg.LinAlgError("singular"), IndexError(7)]
)
def test_failed_formula_is_reported_and_keeps_the_cache(
    renderer: Renderer, scene: gs.Scene, where: str, error: Exception
) -> None:
    match = rf"unexpected {type(error).__name__}: {error}; please report this, with the input: scene box.*DirectionalLight\(.*64, 48"
    assert kept_after(renderer, scene, where, error, gs.GlshadowError, match)


@pytest.mark.parametrize("error", [TypeError("no"), AttributeError("none"), moderngl.Error("incomplete")])
def test_unexpected_error_is_reported_and_clears_the_cache(
    renderer: Renderer, scene: gs.Scene, error: Exception
) -> None:
    match = f"unexpected {type(error).__name__}: {error}; please report this"
    assert not kept_after(renderer, scene, DRAWN, error, gs.GlshadowError, match)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), TimeoutError("late"), SystemExit(1)])
def test_signal_handler_exceptions_propagate(renderer: Renderer, scene: gs.Scene, error: BaseException) -> None:
    """They may come at any line, so the cache is cleared."""
    assert not kept_after(renderer, scene, DRAWN, error, type(error), None)


def test_named_error_keeps_the_cache(renderer: Renderer, scene: gs.Scene) -> None:
    error = gs.SettingsError("of a setting")
    assert kept_after(renderer, scene, DRAWN, error, gs.SettingsError, "of a setting")


def test_memory_error_clears_the_cache(renderer: Renderer, scene: gs.Scene) -> None:
    assert not kept_after(renderer, scene, READ, MemoryError(), gs.ResourceError, "not enough memory for 64 x 48")


def test_failed_gpu_allocation_is_not_cached(
    renderer: Renderer, scene: gs.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if a fallback succeeded: a buffer without memory would be taken for one that is large enough."""
    light = gs.DirectionalLight()  # triangle lists, or else a map
    expected = renderer.render(scene, None, [light], SIZE, samples=1)
    first = renderer._cache
    assert isinstance(first, ResourceCache)
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
        first.techniques.clear()
        frame = renderer.render(scene, None, [light], SIZE, samples=1)
    assert frame.used[0].filter == gs.Pcf(1)
    assert "ran out of memory" in frame.used[0].why
    assert renderer._cache is not first
    again = renderer.render(scene, None, [light], SIZE, samples=1)
    assert again.used[0].filter == gs.Exact()
    np.testing.assert_array_equal(again.visibility, expected.visibility)


def test_warning_turned_into_an_error_propagates(renderer: Renderer, scene: gs.Scene) -> None:
    away = gs.PerspectiveCamera((0.0, 2.0, 5.0), (0.0, 4.0, 10.0))
    cache = renderer._cache
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(gs.GlshadowWarning, match="nothing is in view"):
            renderer.render(scene, away, [LIGHT], SIZE, samples=1)
    assert renderer._cache is cache
