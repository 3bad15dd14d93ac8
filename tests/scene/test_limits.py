"""A small file must not take minutes or gigabytes: it is rendered, or refused with the name of a limit before allocation."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import SceneError, SettingsError
from glshadow.io.limits import Budget, Limits
from glshadow.io.load import load

from ..pace import pace
from ..pairwise import mostly
from . import costly
from .glb import Glb

SECONDS = 10.0
"""Processor time of an idle core, for one load and one frame of 96 x 64; measured: 5 at most."""
MEMORY = 1_400_000_000
"""Bytes: six million triangles, the maximum of a group, of 200 each, and Python with its libraries."""


LIKE_OTHERS = (
    "6,000 nodes of 1,000 triangles", "1e5 GPU instances in one place", "20,000 materials of 1,000 triangles", "PNG of 8192 x 8192",
    "PNG of 16384 x 16384", "20,000 materials", "50 PNGs of 4096 x 4096", "a primitive 20,000 times", "a chain of 1e5 nodes",
)  # fmt: skip


@pytest.mark.parametrize("name", mostly(costly.GROUPS, *LIKE_OTHERS))
def test_costs_little_or_names_its_limit(tmp_path: Path, name: str) -> None:
    make, wanted = costly.GROUPS[name]
    path = make().save(tmp_path / "costly.glb")
    slowness = pace()
    found = subprocess.run(
        [sys.executable, costly.__file__, str(path)], capture_output=True, text=True, check=True, timeout=300
    )
    cost = json.loads(found.stdout)
    if wanted == "drawn":
        assert cost["outcome"] == "drawn"
    else:
        assert (
            f"if you trust the file, raise it with glshadow.load(..., limits=glshadow.Limits({wanted}=...))"
            in cost["outcome"]
        )
        assert "SceneError: costly.glb: " in cost["outcome"]
    assert cost["memory"] <= MEMORY, cost
    slowness = max(slowness, pace())
    assert cost["seconds"] <= SECONDS * slowness, (cost, slowness)


def lit(count: int) -> Glb:
    return costly.lights(count, "point")


@pytest.mark.parametrize(
    ("made", "limits", "said"),
    [
        (costly.nodes(*[{"mesh": 0}] * 11), {"nodes": 10}, "hierarchy: 11 nodes with meshes, and nodes of the hierarchy; the limit is 10"),
        (costly.gpu_instances(11, True), {"nodes": 10}, "11 nodes with meshes"),
        (costly.repeated(11), {"nodes": 10}, "11 nodes with meshes"),
        (costly.amplified(3, 40), {"triangles": 100}, "node 'node2': 120 triangles of all nodes; the limit is 100"),
        (lit(3), {"lights": 2}, "the scene: 3 lights; the limit is 2"),
        (lit(3), {"draws": 2}, "the scene: 3 nodes with meshes times lights; the limit is 2"),
        (costly.textured(costly.png(64)), {"texture_pixels": 4095}, r"images\[0\]: 4096 pixels of one decoded image; the limit is 4095"),
        (costly.textured(*[costly.png(64)] * 5), {"texture_pixels": 4096}, r"images\[4\]: one of 4 parts of all images: 5120 pixels"),
        (costly.nodes({"mesh": 0}), {"seconds": 1e-9}, "seconds of reading; the limit is 1e-09"),
    ],
)  # fmt: skip
def test_every_limit_is_enforced_and_can_be_raised(
    tmp_path: Path, made: Glb, limits: dict[str, Any], said: str
) -> None:
    path = made.save(tmp_path / "made.glb")
    load(path)
    (field,) = limits
    with pytest.raises(SceneError, match=said) as raised:
        load(path, limits=gs.Limits(**limits))
    assert f"glshadow.Limits({field}=...)" in str(raised.value)
    assert str(raised.value).startswith("made.glb: ")


def test_expansion_limit_counts_beyond_the_free_allowance() -> None:
    budget = Budget(Limits(expansion=10.0), read_bytes=1000)
    budget.take(budget.FREE + 9_000, "first")
    with pytest.raises(SceneError, match="second: 11 bytes of memory per byte read"):
        budget.take(2_000, "second")


def test_raised_limit_renders(tmp_path: Path) -> None:
    path = costly.textured(costly.png(8192, 1)).save(tmp_path / "large.glb")
    with pytest.raises(SceneError, match="expansion"):
        load(path)
    texture = load(path, limits=gs.Limits(expansion=1e4)).nodes[0].mesh.material.texture
    assert texture is not None
    assert texture.shape == (8192, 8192, 4)


def test_bad_limits_are_refused() -> None:
    with pytest.raises(SettingsError, match="Limits nodes must be an integer"):
        gs.Limits(nodes=0)
    with pytest.raises(SettingsError, match="limits must be"):
        load("whatever.glb", limits=3)  # type: ignore[arg-type]


def test_oversized_image_differs_from_a_broken_one(tmp_path: Path) -> None:
    """An undecodable image is dropped, an oversized one refuses the scene; both are detected before decoding."""
    path = costly.textured(b"\xff\xd8\xff\xe0 no frame header").save(tmp_path / "made.glb")
    with pytest.warns(gs.GlshadowWarning, match="JPEG without a frame header"):
        load(path)


def test_part_of_a_large_accessor_costs_what_it_uses(tmp_path: Path) -> None:
    """As exporters write whole scenes: one vertex buffer, of which each primitive uses a part."""
    file = Glb(nodes=[{"mesh": 0}])
    positions = np.random.default_rng(0).uniform(0.0, 1.0, (200_000, 3))
    accessor = file.add(positions)
    picks = [np.arange(3 * k, 3 * k + 3) for k in range(2000)]
    file.mesh(*({"attributes": {"POSITION": accessor}, "indices": file.add(pick[:, None], "uint32")} for pick in picks))
    scene = load(file.save(tmp_path / "made.glb"))
    assert len(scene.nodes) == 2000
    for k in (0, 999, 1999):
        np.testing.assert_array_equal(scene.nodes[k].mesh.positions, positions[picks[k]].astype(np.float32))


def test_primitives_that_differ_in_their_material_share_arrays(tmp_path: Path) -> None:
    one, other = (node.mesh for node in load(costly.materials(2).save(tmp_path / "made.glb")).nodes)
    assert one.positions is other.positions
    assert one.triangles is other.triangles
    assert one.material.color != other.material.color
    first, second = load(costly.repeated(2).save(tmp_path / "made.glb")).nodes
    assert first.mesh is second.mesh
