"""Images in which the model is not seen, or is a speck: the error or the warning, with a camera that shows more."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from glshadow.errors import SceneError

if TYPE_CHECKING:
    from glshadow.cli.running import Work
    from glshadow.frame import Frame
    from glshadow.renderer import Renderer

SPECK = 0.002
"""Share of the image below which the default camera may have framed something else than the model."""


def covered_by_model(frame: Frame, renderer: Renderer | None = None) -> float:
    """The share of pixels that see the model, not its ground if `frame` has its nodes; `frame` has its alpha.

    `node` sees neither blending surfaces nor what is smaller than a pixel: where it sees no model, `renderer` draws the frame again without
    the ground.
    """
    scene = frame.scene
    seen = frame.alpha > 0.0
    grounds = [index for index, node in enumerate(scene.nodes) if node.ground]
    model = tuple(node for node in scene.nodes if not node.ground)
    if grounds and "node" in frame.outputs and any(node.drawn for node in model):
        seen &= ~np.isin(frame.node, grounds)
        if renderer is not None and not seen.any():
            bare = replace(scene, nodes=model)
            seen = renderer.render(bare, frame.camera, frame.lights, frame.size, outputs="alpha").alpha > 0.0
    return float(seen.mean())


def refuse_blank(frame: Frame, renderer: Renderer | None = None, work: Work | None = None) -> float:
    """What `covered_by_model` says; a warning if that is a speck by the default camera, a SceneError if it is nothing."""
    scene, camera = frame.scene, frame.camera
    covered = covered_by_model(frame, renderer)
    framed = camera == scene.camera
    if covered >= SPECK or (covered > 0.0 and (work is None or not framed)):
        return covered
    help_ = _help(frame) if framed else ""
    if covered > 0.0:
        if work is not None and help_:
            work.warn(f"{scene.name} is seen in {100.0 * covered:.2g} % of the image: {help_}")
        return covered
    low, high = ("(" + ", ".join(f"{x:.6g}" for x in point) + ")" for point in scene.bounds)
    planes = "".join(f", {name} {d:g}" for name, d in (("near", camera.near), ("far", camera.far)) if d is not None)
    advice = "move the camera with --eye and --target, or leave these options out"
    if framed:
        advice = help_ or "the model is too thin or too small to be visible from there; try another --eye"
    raise SceneError(
        f"nothing is in view: {scene.name} is between {low} and {high}, and the camera {camera}{planes}; {advice}"
    )


def _help(frame: Frame) -> str:
    """Why the framed model is a speck, and the options of a camera that shows more."""
    from glshadow.scene.stray import speck_cause

    cause = speck_cause(frame.scene)
    if cause is None:
        return ""
    top = cause.camera.window(frame.size)[3]
    eye, target = (",".join(f"{x:.9g}" for x in point) for point in (cause.camera.position, cause.camera.target))
    fov = 2.0 * np.degrees(np.arctan(top))
    return f"{cause.what}; more is seen with --eye={eye} --target={target} --fov {fov:.4g}"
