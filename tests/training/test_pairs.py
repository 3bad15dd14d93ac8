"""Images with and without shadows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow import image

from ..reference.test_blockers import SIZE, SLANT, several


def test_a_pair_differs_where_there_is_shadow_and_nowhere_else(renderer: gs.Renderer) -> None:
    pair = gs.shadow_pair(several(), lights=SLANT, size=SIZE, renderer=renderer, samples=1, outputs=("node", "normal"))
    lit, free = pair.shadowed, pair.shadow_free
    cast = (lit.visibility[0] == 0.0) & (free.visibility[0] == 1.0)
    assert cast.sum() > 200
    np.testing.assert_array_equal(pair.mask(), cast)
    np.testing.assert_array_equal(lit.image[~cast], free.image[~cast])
    assert (pair.removed[~cast] < 1e-5).all()  # a few dozen roundings of float32 in the lighting
    assert (pair.matte[~cast] == 255).all()
    assert (pair.matte[cast] < 255).all()
    assert lit.exposure == free.exposure
    # nothing but the ambient light is left: its share of the whole is what the matte says
    facing = (lit.normal[cast] * (0.0, 1.0, 0.0)).sum(axis=1) > 0.99
    ambient, sun = 0.27, -SLANT.direction[1]
    np.testing.assert_allclose(pair.removed[cast][facing], sun / (sun + ambient), rtol=1e-4)


def test_no_ambient_light_leaves_nothing_in_shadow(renderer: gs.Renderer) -> None:
    pair = gs.shadow_pair(several(), lights=SLANT, size=SIZE, renderer=renderer, samples=1, ambient=0.0)
    assert set(np.unique(pair.matte).tolist()) == {0, 255}


def test_metered_exposure_is_that_of_the_image_with_shadows(renderer: gs.Renderer) -> None:
    sun = gs.DirectionalLight(direction=SLANT.direction, intensity=1e5, photometric=True)
    pair = gs.shadow_pair(several(), lights=sun, size=SIZE, renderer=renderer)
    assert pair.shadowed.exposure == pair.shadow_free.exposure < -10.0
    assert 0.0 < pair.mask().mean() < 0.5


def test_soft_shadows_remove_a_part(renderer: gs.Renderer) -> None:
    soft = gs.DirectionalLight(direction=SLANT.direction, angle=8.0)
    pair = gs.shadow_pair(several(), lights=soft, size=SIZE, renderer=renderer, samples=1, ambient=0.0)
    assert ((pair.removed > 0.2) & (pair.removed < 0.8)).sum() > 50
    assert pair.mask(0.9).sum() < pair.mask(0.1).sum()


def test_files_are_one_name_in_four_folders(renderer: gs.Renderer, tmp_path: Path) -> None:
    pair = gs.shadow_pair(several(), lights=SLANT, size=SIZE, renderer=renderer)
    pair.save(tmp_path / "set", "0001.png")
    for kind, expected in (
        ("shadow", pair.shadowed.image),
        ("shadow_free", pair.shadow_free.image),
        ("mask", np.where(pair.mask(), 255, 0)),
        ("matte", pair.matte),
    ):
        read = image.read(tmp_path / "set" / kind / "0001.png")[..., :3]
        np.testing.assert_array_equal(read, expected if expected.ndim == 3 else expected[..., None].repeat(3, axis=2))


def test_what_is_wrong_is_named(renderer: gs.Renderer, tmp_path: Path) -> None:
    pair = gs.shadow_pair(several(), lights=SLANT, size=(16, 9), renderer=renderer)
    (tmp_path / "file").write_text("")
    for call, kind, message in (
        (lambda: gs.shadow_pair(several(), max_ms=5.0), gs.SettingsError, "no max_wrong and no max_ms"),
        (lambda: gs.shadow_pair(several(), renderer=3), gs.SettingsError, "renderer must be"),
        (lambda: gs.shadow_pair(several(), outputs="deep"), gs.SettingsError, "outputs must be"),
        (lambda: pair.mask(0.0), gs.SettingsError, r"least must be .*\(0, 1\]"),
        (lambda: pair.save(tmp_path, "a/b.png"), gs.SettingsError, "name must be a file name"),
        (lambda: pair.save(tmp_path, "a.jpg"), gs.SettingsError, "ends in .png or .tif"),
        (lambda: pair.save(tmp_path / "file", "a.png"), gs.GlshadowError, "cannot be made"),
    ):
        with pytest.raises(kind, match=message):
            call()  # type: ignore[no-untyped-call]
