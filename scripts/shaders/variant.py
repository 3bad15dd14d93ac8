"""Variant: one shader, a pass in a dialect with its slots filled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from glshadow.lights import LIGHTS, Light
from glshadow.shader.compose import Text, compose

KINDS: tuple[type[Light], ...] = tuple(kind for kind in LIGHTS if not kind.wide)
"""Lights with a single direction from each receiver; the first is at infinity."""
WIDE: tuple[type[Light], ...] = tuple(kind for kind in LIGHTS if kind.wide)
ONE_VIEW = tuple(kind for kind in KINDS if kind.most_views == 1)
PER_SAMPLE: dict[str, int | str] = {"GLS_PER_SAMPLE": 1, "GLS_LAST": 0}
"""Of samples of collected pixels."""


@dataclass(frozen=True)
class Variant:
    """A pass in a dialect with its slots filled; defines that its snippets do not declare are left out."""

    name: str
    dialect: str
    slots: Mapping[str, str]
    defines: Mapping[str, int | str]

    @property
    def label(self) -> str:
        """For a report: pass, dialect and slots."""
        parts = [self.name, self.dialect, *self.slots.values(), *(f"{k}={v}" for k, v in sorted(self.defines.items()))]
        return " ".join(parts)

    def compose(self) -> Text:
        """The program text."""
        known = compose(self.name, self.dialect, self.slots).declared
        return compose(self.name, self.dialect, self.slots, {k: v for k, v in self.defines.items() if k in known})
