"""The gap at a caster's foot due to R8, RGBA8 and D16 equals the format's step, for every kind of light."""

from __future__ import annotations

import pytest

from glshadow.renderer import Renderer
from glshadow.shadows.metric import Target
from glshadow.study.formats import PROBES, foot_gap

TIMES = 2.0
"""Storing rounds by half a step either way: the gap of one place is half to one and a half times the step. Texels add to it."""


@pytest.mark.parametrize("target", [Target.R8, Target.RGBA8, Target.DEPTH16], ids=lambda target: target.value)
@pytest.mark.parametrize("light", PROBES)
def test_gap_at_a_foot_is_one_step_of_the_format(renderer: Renderer, light: str, target: Target) -> None:
    gap = foot_gap(renderer, light, target)
    assert gap.predicted > 2e-3, "must be large against a texel"
    assert gap.predicted / TIMES <= gap.measured <= gap.predicted * TIMES, str(gap)
