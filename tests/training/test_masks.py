"""Masks of each node's shadow: against images in which that node alone casts, and their COCO annotations."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.training.runs import from_text, mask_of

from ..reference.test_blockers import NEAR, SIZE, SLANT, several


@pytest.fixture(scope="module")
def frame(renderer: gs.Renderer) -> gs.Frame:
    outputs = ("image", "visibility", "triangle", "node", "blocker", "blocker_distance")
    return renderer.render(several(), lights=[SLANT, NEAR], size=SIZE, outputs=outputs, samples=1)


@pytest.mark.parametrize("number", [0, 1])
def test_a_mask_is_the_shadow_where_that_node_alone_casts(renderer: gs.Renderer, frame: gs.Frame, number: int) -> None:
    scene = frame.scene
    masks = gs.shadow_masks(frame, light=number)
    assert masks.nodes == ("low", "ring", "high")  # not the ground
    bare = renderer.render(
        gs.Scene([gs.Node(n.mesh, n.world_from_mesh, n.name, casts=False) for n in scene.nodes], camera=scene.camera),
        lights=frame.lights, size=SIZE, samples=1,
    )  # fmt: skip
    away = bare.visibility[number] == 0.0
    for k, name in enumerate(masks.nodes):
        alone = [gs.Node(n.mesh, n.world_from_mesh, n.name, casts=n.name == name) for n in scene.nodes]
        drawn = renderer.render(gs.Scene(alone, camera=scene.camera), lights=frame.lights, size=SIZE, samples=1)
        expected = (drawn.visibility[number] == 0.0) & ~away
        assert expected.sum() > 30
        assert (masks.shadows[k] != expected).sum() <= 2  # silhouettes, by float32's rounding
        np.testing.assert_array_equal(masks.objects[k], frame.node == scene.places[name])


def test_together_they_are_what_is_in_shadow_and_share_pixels(frame: gs.Frame) -> None:
    masks = gs.shadow_masks(frame, of=range(4), attached=True)
    np.testing.assert_array_equal(masks.shadows.any(axis=0), frame.blocker[0] >= 0)
    assert (masks.shadows.sum(axis=0) > 1).any()
    first = np.clip(frame.blocker[0], 0, None)
    named = np.take_along_axis(masks.shadows, first[None], axis=0)[0]
    assert named[frame.blocker[0] >= 0].all()


def test_attached_shadows_are_added_on_demand(frame: gs.Frame) -> None:
    cast, both = (gs.shadow_masks(frame, "low", attached=each).shadows[0] for each in (False, True))
    facing_away = (frame.blocker_distance[0] == 0.0) & (frame.blocker[0] == 0)
    assert facing_away.any()
    np.testing.assert_array_equal(both, cast | facing_away)
    assert not (cast & facing_away).any()


def test_a_light_without_a_shadow_has_empty_masks(renderer: gs.Renderer) -> None:
    bare = gs.DirectionalLight(direction=SLANT.direction, shadow=None)
    frame = renderer.render(several(), lights=bare, size=SIZE, outputs="triangle", samples=1)
    assert not gs.shadow_masks(frame).shadows.any()


def test_annotations_hold_the_masks_in_pairs(frame: gs.Frame, tmp_path: Path) -> None:
    masks = gs.shadow_masks(frame)
    made = gs.to_coco({"a.png": masks, "b.png": gs.shadow_masks(frame, "ring", light=1)}, tmp_path / "set.json")
    assert json.loads((tmp_path / "set.json").read_text()) == made
    assert made["images"][1] == {"id": 2, "file_name": "b.png", "width": SIZE[0], "height": SIZE[1]}
    assert [each["id"] for each in made["annotations"]] == list(range(1, 9))
    kinds = {each["id"]: each["name"] for each in made["categories"]}
    for k, name in enumerate(masks.nodes):
        pair = [each for each in made["annotations"] if each["image_id"] == 1 and each["name"] == name]
        assert [kinds[each["category_id"]] for each in pair] == ["object", "shadow"]
        assert pair[0]["association"] == pair[1]["association"]
        for annotation, mask in zip(pair, (masks.objects[k], masks.shadows[k]), strict=True):
            run = annotation["segmentation"]
            np.testing.assert_array_equal(mask_of(from_text(run["counts"]), tuple(run["size"])), mask)
            assert annotation["area"] == mask.sum()
            x, y, width, height = annotation["bbox"]
            assert mask[y : y + height, x : x + width].sum() == mask.sum()
            assert mask[y].any()
            assert mask[:, x + width - 1].any()
    plain = gs.to_coco({"a.png": masks}, compressed=False, objects=False)
    assert [each["category_id"] for each in plain["annotations"]] == [2, 2, 2]
    assert plain["annotations"][0]["segmentation"]["counts"] == from_text(
        made["annotations"][1]["segmentation"]["counts"]
    )


def test_what_is_wrong_is_named(renderer: gs.Renderer, frame: gs.Frame, tmp_path: Path) -> None:
    image = renderer.render(several(), size=(16, 9), samples=1)
    bent = gs.render_distorted(
        several(), None, gs.BrownDistortion(-0.1), size=(16, 9), outputs="triangle", renderer=renderer
    )
    masks = gs.shadow_masks(frame, "ring")
    for call, kind, message in (
        (lambda: gs.shadow_masks(image), gs.MissingOutput, 'no "triangle": render it with outputs='),
        (lambda: gs.shadow_masks(several()), gs.SettingsError, "frame must be"),  # type: ignore[arg-type]
        (lambda: gs.shadow_masks(frame, "roof"), gs.SettingsError, "of must be nodes of the scene"),
        (lambda: gs.shadow_masks(frame, light=2), gs.SettingsError, r"light must be an integer in \[0, 1\]"),
        (lambda: gs.shadow_masks(frame, attached=1), gs.SettingsError, "attached must be"),  # type: ignore[arg-type]
        (lambda: gs.shadow_masks(bent), gs.SettingsError, "without distortion"),
        (lambda: gs.shadow_masks(pickle.loads(pickle.dumps(frame))), gs.SettingsError, "pickled frame"),
        (lambda: gs.to_coco([masks]), gs.SettingsError, "images must be a mapping"),  # type: ignore[arg-type]
        (lambda: gs.to_coco({"a.png": masks}, tmp_path / "a.txt"), gs.SettingsError, "path must end in .json"),
    ):
        with pytest.raises(kind, match=message):
            call()  # type: ignore[no-untyped-call]
