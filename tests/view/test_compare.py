"""Contact sheets: errors equal those of measure, captions state them, and invalid settings are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow import image

SIZE = (96, 54)


@pytest.fixture(scope="module")
def compared() -> gs.Comparison:
    settings = {"coarse": gs.Shadow(filter=gs.Hard(), resolution=64), "soft": gs.Pcf(1), "exact": "exact"}
    return gs.compare(gs.scenes.courtyard(), settings, size=SIZE)


def test_errors_equal_those_of_measure(compared: gs.Comparison) -> None:
    scene = gs.scenes.courtyard()
    (sun,) = scene.lights or ()
    truth = gs.trace(scene, size=SIZE, surface=compared["coarse"].frame.triangle, samples=1)
    for entry in compared.entries:
        frame = entry.frame
        assert entry.error.wrong == gs.measure(frame, truth).wrong if frame.scene is scene else entry.error.wrong >= 0.0
        assert entry.ms > 0.0
        assert f"wrong {entry.error.wrong:.3%}" in entry.caption
    assert compared["coarse"].error.wrong > compared["soft"].error.wrong >= compared["exact"].error.wrong
    assert [each.name for each in compared.entries] == ["coarse", "soft", "exact"]
    assert isinstance(sun, gs.DirectionalLight)


def test_sheet_shows_the_reference_and_each_entry_with_its_error(compared: gs.Comparison, tmp_path: Path) -> None:
    assert len(compared) == 3
    assert all(len(entry.pictures) == 2 for entry in compared.entries)
    truth = compared.truth[0]
    assert truth.shape == (SIZE[1], SIZE[0], 3)
    gap = {entry.name: np.abs(entry.pictures[0].astype(int) - truth).mean() for entry in compared.entries}
    assert gap["coarse"] > gap["exact"]
    compared.save(tmp_path / "sheet.png")
    np.testing.assert_array_equal(image.read(tmp_path / "sheet.png")[..., :3], compared.image)
    assert compared._repr_html_().count("<img") == 4
    assert "coarse" in str(compared)
    assert "exact: " in repr(compared)


def test_lights_keep_their_strength_and_have_one_row_each() -> None:
    lights = [gs.DirectionalLight(shadow=gs.Shadow(strength=0.5)), gs.PointLight(position=(0.0, 6.0, 0.0))]
    both = gs.compare(gs.scenes.courtyard(), ["pcf:1"], lights=lights, size=SIZE)
    assert len(both.truth) == 2
    assert len(both.entries[0].pictures) == 4
    assert both.entries[0].frame.lights[0].shadow == gs.Shadow(filter=gs.Pcf(1), strength=0.5)


@pytest.mark.parametrize("wrong", [[], {}, "pcf:1", None, 3, [3], [None], ["pfc:1"], {"a": gs.NoBias()}])
def test_invalid_settings_are_refused(wrong: object) -> None:
    with pytest.raises(gs.SettingsError):
        gs.compare(gs.scenes.courtyard(), wrong, size=SIZE)  # type: ignore[arg-type]


def test_lights_without_shadow_are_refused() -> None:
    with pytest.raises(gs.SettingsError, match="no light casts"):
        gs.compare(gs.scenes.courtyard(), ["hard"], lights=[gs.DirectionalLight(shadow=None)], size=SIZE)


def test_explorer_follows_its_controls() -> None:
    explorer = gs.explore(gs.scenes.courtyard(), size=SIZE)
    try:
        first = explorer.view.image.copy()
        explorer.controls["filter"].value = "pcf:1"
        assert explorer.view.frame.used[0].filter == gs.Pcf(1)
        explorer.controls["azimuth"].value = -100.0
        assert explorer.showing.aim[0] == pytest.approx(-100.0)
        assert (np.abs(explorer.view.image.astype(int) - first).max(axis=-1) > 20).mean() > 0.02
        explorer.controls["error"].value = True
        assert explorer.view.error is not None
        explorer.controls["resolution"].value = "256"
        assert explorer.view.frame.used[0].views[0].resolution == 256
        explorer.controls["size"].value = 4.0
        assert explorer.showing.lights[0].angle == 4.0  # type: ignore[union-attr]
        explorer.controls["map"].value = True
        assert explorer.showing.overlays == ("map",)
        explorer.controls["zoom"].value = 1.0
        explorer.controls["zoom"].value = 0.0
        explorer.controls["turn"].value = 30.0
        explorer.controls["turn"].value = 0.0
        assert explorer.showing.camera.position == pytest.approx(gs.scenes.courtyard().camera.position)
        assert explorer.widget._repr_mimebundle_()
        assert explorer._facts.value
    finally:
        explorer.close()


def test_explorer_renders_at_half_size_while_dragging() -> None:
    """In an event loop, as a notebook's kernel has one."""
    import asyncio

    from glshadow.ui.explore import REST

    async def dragged() -> tuple[tuple[int, int], tuple[int, int], str]:
        explorer = gs.explore(gs.scenes.courtyard(), size=SIZE)
        explorer.controls["elevation"].value = 30.0
        moving, kind = explorer.view.frame.size, explorer._image.format
        await asyncio.sleep(2.0 * REST)
        explorer.close()
        return moving, explorer.view.frame.size, kind

    moving, resting, kind = asyncio.run(dragged())
    assert moving == (SIZE[0] // 2, SIZE[1] // 2)
    assert resting == SIZE
    assert kind == "jpeg"
