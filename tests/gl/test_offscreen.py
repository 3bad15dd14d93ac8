"""PyrenderRenderer beside the real pyrender: the same images without shadows, depth, segmentation, and shadows that only darken."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import glshadow as gs

from ..tolerances import PATIENCE_S

CHECKS = Path(__file__).with_name("offscreen_checks.py")


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PYOPENGL_PLATFORM": "egl"}
    done = subprocess.run(
        [sys.executable, str(CHECKS)], env=environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    read: dict[str, Any] = json.loads(done.stdout)
    return read


@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_results_match_pyrender(found: dict[str, Any], kind: str) -> None:
    one = found[kind]
    picture, depth = [240, 320, 3], [240, 320]
    assert one["shapes"] == [picture, depth, picture, picture, [240, 320, 4], depth]
    assert one["types"] == ["uint8", "float32", "uint8", "float32"]
    # the specular part that is left out is 1 or 2 of 255 on rough dielectrics; edges are more, and where a spot fades: its square there
    assert one["median"] <= 2.0
    assert one["far"] < (0.12 if kind == "spot" else 0.05)
    assert one["depth"] < 0.1, (
        "the first of four samples, a quarter of a pixel aside; most where the ground is seen flat"
    )
    assert abs(one["nearer"] - 1.0) < 0.004, "a quarter of a pixel's share of the depth"
    assert one["covered"] < 0.01
    assert one["seg"] < 0.02
    assert one["alpha"] == 0.0
    theirs, ours = one["background"]
    assert max(abs(a - b) for a, b in zip(theirs, ours, strict=True)) <= 1


@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_shadows_only_darken(found: dict[str, Any], kind: str) -> None:
    """Including point lights, whose shadow flag pyrender ignores."""
    assert found[kind]["darker"] > 0.01
    assert found[kind]["own"] > 0.01, "by its own flag"
    assert found[kind]["others"] == 0.0, "and no other"
    # of 765: where samples are shaded once and shadows part them; at a cone's border, over which strength falls within a pixel, by more
    assert found[kind]["brighter"] >= (-20 if kind == "spot" else -12)


def test_reused_resources_and_changed_inputs(found: dict[str, Any]) -> None:
    assert found["kept"], "meshes go to the GPU once"
    assert found["moved"]
    assert found["resized"] == [240, 100, 3]
    assert found["empty"] == [[240, 100, 3], [240, 100]]
    sharp, soft = found["greys"]
    assert soft > 1.3 * sharp, "a directional light with a size"


def test_bad_arguments_are_refused() -> None:
    class Camera:
        pass

    class Node:
        camera = Camera()

    class Fake:
        mesh_nodes: tuple[Any, ...] = ()
        light_nodes: tuple[Any, ...] = ()
        main_camera_node: Any = None
        bg_color = (0.0, 0.0, 0.0, 1.0)

    with gs.PyrenderRenderer(32, 24) as renderer:
        for flags, said in (
            (8, "ALL_WIREFRAME"),
            (256, "VERTEX_NORMALS"),
            (512 | 4, "FLIP_WIREFRAME, RenderFlags.FACE_NORMALS"),
        ):
            with pytest.raises(gs.SettingsError, match=said):
                renderer.render(Fake(), flags)
        for odd in (-1, 2**15, "none", None, True, 1.0):
            with pytest.raises(gs.SettingsError, match="flags must be"):
                renderer.render(Fake(), odd)  # type: ignore[arg-type]
        with pytest.raises(gs.SceneError, match="no main camera"):
            renderer.render(Fake())
        with pytest.raises(gs.SceneError, match=r"pyrender\.Scene is needed"):
            renderer.render(gs.scenes.courtyard())
        placed = Fake()
        placed.main_camera_node = Node()
        with pytest.raises(gs.SettingsError, match="SEG needs seg_node_map"):
            renderer.render(placed, 8192)
    for wrong in (
        {"viewport_width": 0},
        {"viewport_height": "a"},
        {"angle": -1.0},
        {"radius": float("nan")},
        {"shadow": 3},
    ):
        with pytest.raises(gs.SettingsError):
            gs.PyrenderRenderer(**({"viewport_width": 8, "viewport_height": 8} | wrong))  # type: ignore[arg-type]
