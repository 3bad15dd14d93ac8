"""Outputs of a frame that rays on the CPU find: from the triangles that the GPU has drawn, so that both are at the same points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from glshadow.arguments import FrameRequest
from glshadow.core.outputs import TRACED


def drawn_part(request: FrameRequest) -> FrameRequest:
    """The request with what the GPU draws alone, and what the rays begin with."""
    if request.outputs.isdisjoint(TRACED):
        return request
    return replace(request, outputs=request.outputs.difference(TRACED) | {"triangle"})


def with_traced(request: FrameRequest, drawn: Mapping[str, Any]) -> Mapping[str, Any]:
    """The outputs of a request, from those of `drawn_part`.

    Raises
    ------
    ReferenceUnavailable
        If embreex is not installed.
    """
    if request.outputs.isdisjoint(TRACED):
        return drawn
    from glshadow.reference.blockers import pixel_blockers  # slow to import, and seldom needed

    node, distance = pixel_blockers(request.scene, request.camera, request.lights, drawn["triangle"])
    found = {**drawn, "blocker": node, "blocker_distance": distance}
    return {name: value for name, value in found.items() if name in request.outputs}
