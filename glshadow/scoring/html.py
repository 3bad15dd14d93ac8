"""An error measurement in a notebook: its numbers and images."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glshadow.inline import figure, table
from glshadow.scoring.score import COLORS, Outcome, Score

SHARES = ("wrong", "edge", "acne", "leak", "contact", "grain", "counted")


def error_html(lights: Sequence[Score], whole: Score, pictures: Sequence[NDArray[np.uint8]]) -> str:
    """A table with a row per light, and an error image of each light."""
    named = [(f"light {number}", score) for number, score in enumerate(lights)]
    if len(named) > 1:
        named.append(("all", whole))
    rows = [[name, *_numbers(score)] for name, score in named]
    figures = [figure(picture, f"light {number}") for number, picture in enumerate(pictures)]
    return table(["", *SHARES, "mean", "window"], rows) + _key() + "".join(figures)


def _numbers(score: Score) -> list[str]:
    values = [(getattr(score, name), "{:.4%}") for name in SHARES] + [(score.mean, "{:.5f}"), (score.window, "{:.5f}")]
    return [form.format(value) if np.isfinite(value) else "\N{EN DASH}" for value, form in values]


def _key() -> str:
    """Legend of the colours."""
    words = [
        f'<span style="white-space:nowrap"><span style="color:rgb{COLORS[kind]}">&#9632;</span> '
        f"{kind.name.lower().replace('_', ' ')}</span>"
        for kind in (Outcome.EDGE, Outcome.ACNE, Outcome.LEAK, Outcome.GRAIN, Outcome.NOT_COUNTED)
    ]
    return f"<p>{' &ensp; '.join(words)} &ensp; grey: correct, lit or dark</p>"
