"""The exported page in a real browser: its pixels against ours, its stored metric against our map's, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow.cli import main
from glshadow.shadows.metric import unpack

from ..view.screen import kept
from .browser import pixels_of

SIZE = (160, 100)
# A sphere and some columns: SwiftShader would take seconds for the whole courtyard.
COURTYARD = gs.scenes.courtyard()
SCENE = gs.Scene(COURTYARD.nodes[:4], COURTYARD.camera, COURTYARD.lights, name="courtyard")
LIGHTS: dict[str, gs.Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, 0.35)),
    "spot": gs.SpotLight(position=(7.0, 9.0, 6.0), direction=(-7.0, -9.0, -6.0), outer_angle=40.0, inner_angle=40.0),
    "point": gs.PointLight(position=(1.0, 6.0, 2.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["point", *(pytest.param(name, marks=pytest.mark.exhaustive) for name in ("sun", "spot"))]
)
def test_browser_image_matches_the_renderer(browser: Callable[[Path, str], str], tmp_path: Path, name: str) -> None:
    light = replace(
        LIGHTS[name], shadow=gs.Shadow(filter=gs.Pcf(1), resolution=256, target=gs.Target.RGBA8, fit=gs.SceneFit())
    )
    path = gs.export_page(SCENE, tmp_path / "page", lights=[light], resolution=256)
    page = browser(path, f"test{SIZE[0]}x{SIZE[1]}")
    theirs = pixels_of(page, "pixels", SIZE[0])
    kept(f"page {name}", np.ascontiguousarray(theirs[..., :3]))
    with gs.Renderer("egl") as renderer:
        ours = renderer.render(SCENE, None, [light], SIZE, ambient=0.2, outputs=("image", "visibility"), samples=1)
        dark = renderer.render(
            SCENE, None, [replace(light, shadow=None)], SIZE, ambient=0.2, outputs=("image",), samples=1
        )
    gap = np.abs(theirs[..., :3].astype(int) - ours.image).max(axis=-1)
    # another rasteriser, another map: edges of triangles and of shadows; everywhere else the same shading
    assert np.median(gap) <= 1
    assert (gap > 4).mean() < 0.04
    shadow = np.abs(ours.image.astype(int) - dark.image).max(axis=-1) > 30
    assert shadow.mean() > 0.01
    assert (gap[shadow] <= 4).mean() > 0.8
    # the metric of the map itself: the share of texels that a caster covers, and its spread
    stored = pixels_of(
        page, "map", 256 if name != "point" else int(re.findall(r'"size": \[(\d+)', path.read_text())[0])
    )
    metric = unpack(stored / 255.0)
    assert 0.0 <= metric.min() < 0.95
    assert metric.max() > 0.99, "empty texels: the far end"
    assert len(np.unique(metric)) > 1000


@pytest.mark.slow
@pytest.mark.exhaustive
def test_one_byte_map_gives_a_similar_image(browser: Callable[[Path, str], str], tmp_path: Path) -> None:
    pages = {
        target: browser(
            gs.export_page(SCENE, tmp_path / target, lights=[LIGHTS["sun"]], resolution=256, target=target),
            "test96x64",
        )
        for target in ("packed", "unorm8")
    }
    one, other = (pixels_of(page, "pixels", 96)[..., :3].astype(int) for page in pages.values())
    assert (np.abs(one - other).max(axis=-1) > 8).mean() < 0.06
    assert len(np.unique(pixels_of(pages["unorm8"], "map", 256)[..., 0])) > 20


def test_command_writes_one_self_contained_file(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        main, ["export", "-o", str(tmp_path / "a" / "page"), "--filter", "pcf:2", "--light", "spot:6,6,6:-1,-1,-1"]
    )
    assert done.exit_code == 0, done.output
    (page,) = (tmp_path / "a" / "page").iterdir()
    text = page.read_text()
    assert page.name == "index.html"
    assert not re.findall(r"(?:src|href)=", text), "nothing is fetched"
    assert "#version 100" in text
    assert "<title>courtyard</title>" in text


def test_bad_arguments_are_refused(tmp_path: Path) -> None:
    for filter_ in (gs.Exact(), gs.Evsm(), gs.Pcss()):
        with pytest.raises(gs.SettingsError, match="is not available in WebGL 1; available are: hard"):
            gs.export_page(SCENE, tmp_path, filter=filter_)
    with pytest.raises(gs.SettingsError, match="no directional, spot or point light casts"):
        gs.export_page(SCENE, tmp_path, lights=[gs.SkyLight()])
    with pytest.raises(gs.SettingsError, match="target must be"):
        gs.export_page(SCENE, tmp_path, target="float")
    with pytest.warns(gs.GlshadowWarning, match="shows only one light of 2"):
        gs.export_page(SCENE, tmp_path, lights=[LIGHTS["sun"], LIGHTS["point"]])
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(gs.ResourceError, match="cannot be created"):
        gs.export_page(SCENE, blocked / "page")
