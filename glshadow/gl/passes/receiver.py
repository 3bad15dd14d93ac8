"""Receiver: the text and the values that ask a light's shadow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from glshadow.core.spaces import Array
from glshadow.gl.passes.per_sample import PerSample


@dataclass(frozen=True, eq=False)
class Receiver:
    """One way to ask one light.

    Parameters
    ----------
    slots, defines : mapping
        What a pass is composed with: <light>, <shadow> and what that includes.
    dialect : str
        What the snippets need.
    axes : (3, 3) float64
        Of the frame in which surface points are given.
    offset : (3,) float64
        Where the scene's origin lies in it.
    uniforms, textures : mapping
        By name; textures as `Program.bind` takes them.
    marks : mapping
        Defines with which pass/resolve.frag marks pixels whose samples may see the light differently; empty: it cannot.
    collected : mapping
        Defines of pass/collect.frag: which pixels the light asks for, by its marks and by their neighbours.
    densely : callable, optional
        How the samples of collected pixels ask it; None: alike.
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
