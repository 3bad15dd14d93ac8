"""Receiver: GLSL and uniforms that find a light's visibility."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from glshadow.core.spaces import Array
from glshadow.gl.passes.per_sample import PerSample


@dataclass(frozen=True, eq=False)
class Receiver:
    """One way to find the visibility of one light.

    Parameters
    ----------
    slots, defines : mapping
        Snippets and defines of the pass: <light>, <shadow> and what they include.
    dialect : str
        GLSL dialect that the snippets need.
    axes : (3, 3) float64
        Axes of the frame in which surface points are given.
    offset : (3,) float64
        Position of the scene's origin in that frame.
    uniforms, textures : mapping
        By name; textures as `Program.bind` takes them.
    marks : mapping
        Defines with which pass/resolve.frag marks pixels whose samples may see the light differently; empty: there are no marks.
    collected : mapping
        Defines of pass/collect.frag: pixels for which the light requests per-sample shading, by its marks and by their neighbours.
    per_sample : callable, optional
        The receiver for samples of collected pixels; None: the same.
    """

    slots: Mapping[str, str]
    axes: Array
    offset: Array
    defines: Mapping[str, int | str] = field(default_factory=dict)
    dialect: str = "core330"
    uniforms: Mapping[str, Any] = field(default_factory=dict)
    textures: Mapping[str, Any] = field(default_factory=dict)
    marks: Mapping[str, int | str] = field(default_factory=dict)
    collected: Mapping[str, int | str] = field(default_factory=dict)
    per_sample: Callable[[PerSample], Receiver] | None = None
