"""Controls: what keys and the mouse change; independent of any window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from glshadow.core.cameras import OrthographicCamera, PerspectiveCamera
from glshadow.core.sampling import SAMPLES
from glshadow.core.spelling import parse
from glshadow.shadows.bias import BIASES
from glshadow.shadows.filters import FILTERS, Pcf
from glshadow.ui.explore import BIAS_CHOICES, CHOICES, RESOLUTIONS
from glshadow.ui.showing import Showing

TURN = 180.0  # degrees: a drag across the window's height
ZOOM = 1.1  # a step of the wheel
STEP = 5.0  # degrees: an arrow key
SPEED = 40.0  # degrees a second: an animated light
# Angle of a directional light in degrees; for a local light its size in percent of the scene's.
SIZES = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)

HELP = (
    ("drag", "turn"), ("right drag", "pan"), ("wheel", "zoom"), ("o", "orthographic or perspective"), ("space", "reset the view"),
    ("arrows", "move the light"), ("a", "animate it"), ("+ -", "its size"), ("n", "the next light"),
    ("f F", "next, previous filter"), ("r R", "resolution"), ("b B", "bias"), ("s", "samples per pixel"),
    ("d", "shadow map"), ("l", "light and frustum"), ("x", "axes"), ("g", "grid"), ("e", "errors against traced rays, at rest"),
    ("1 2 3", "landscapes"), ("0", "the scene that was opened"), ("c", "save a screenshot"), ("h", "this help"), ("q", "quit"),
)  # fmt: skip
"""Keys and their actions."""


class Controls:
    """The current state, and the actions that change it.

    Attributes
    ----------
    showing : Showing
    animated, helped : bool
        Whether the light moves, and whether the help is shown.
    said : str
        Message about the last key, for the window to show.
    """

    def __init__(self, showing: Showing, scenes: dict[str, Callable[[], Showing]]) -> None:
        self._first = self.showing = showing
        self._scenes = {"0": lambda: showing, **scenes}
        self.animated = self.helped = False
        self.said = ""

    def opened(self, showing: Showing) -> None:
        """Replace the scene; the chosen settings stay."""
        kept = self.showing
        self._first = showing
        self._scenes["0"] = lambda: showing
        self.showing = _with_settings(showing, kept)
        self.said = showing.scene.name

    # -- mouse

    def dragged(self, right: float, down: float, pan: bool) -> None:
        """Drag by fractions of the window's height."""
        if pan:
            tangent = 0.8  # height of the default view at distance 1
            self.showing = self.showing.panned(-right * tangent, down * tangent)
        else:
            self.showing = self.showing.turned(-right * TURN, down * TURN)

    def scrolled(self, steps: float) -> None:
        """Turn the wheel by steps."""
        self.showing = self.showing.zoomed(ZOOM**steps)

    def advanced(self, seconds: float) -> None:
        """Move the animated light for a time."""
        if self.animated and self.showing.lights:
            azimuth, elevation = self.showing.aim
            self.showing = self.showing.lit_from(azimuth + SPEED * seconds, elevation)

    # -- keys

    def pressed(self, key: str) -> bool:
        """Handle a key: a letter, a capital with shift, or up, down, left, right. False: the key has no action."""
        showing = self.showing
        overlays = {"d": "map", "l": "lights", "x": "axes", "g": "grid"}
        if key in self._scenes:
            self.showing = _with_settings(self._scenes[key](), showing)
            self.said = self.showing.scene.name
        elif key in overlays:
            name = overlays[key]
            on = name not in showing.overlays
            rest = tuple(each for each in showing.overlays if each != name)
            self.showing = replace(showing, overlays=(*rest, name) if on else rest)
            self.said = f"{name} {'on' if on else 'off'}"
            if key == "d" and on and showing.filter is None:  # the derived technique may have no map
                self.showing = replace(self.showing, filter=Pcf(1))
                self.said = f"map on, of {self.showing.filter}"
        elif key in ("f", "F"):
            self._chosen("filter", CHOICES, 1 if key == "f" else -1, lambda text: parse(text, FILTERS, "filter"))
        elif key in ("b", "B"):
            self._chosen("bias", BIAS_CHOICES, 1 if key == "b" else -1, lambda text: parse(text, BIASES, "bias"))
        elif key in ("r", "R"):
            self._chosen("resolution", tuple(map(str, RESOLUTIONS)), 1 if key == "r" else -1, int)
        elif key == "s":
            samples = SAMPLES[(SAMPLES.index(showing.samples) + 1) % len(SAMPLES)]
            self.showing, self.said = replace(showing, samples=samples), f"{samples} samples per pixel"
        elif key == "e":
            self.showing = replace(showing, error=not showing.error)
            self.said = f"errors {'off' if showing.error else 'on: yellow edge, red acne, blue leak, orange grain'}"
        elif key == "a":
            self.animated = not self.animated
            self.said = f"light {'moves' if self.animated else 'stopped'}"
        elif key == "h":
            self.helped = not self.helped
        elif key == "o":
            self.showing = replace(showing, camera=_other_projection(showing))
            self.said = "perspective" if self.showing.camera.is_perspective else "orthographic"
        elif key == "space":
            self.showing, self.animated, self.said = _with_settings(self._first, showing), False, "view reset"
        elif showing.lights and key in ("up", "down", "left", "right", "+", "-", "n"):
            self._light(key)
        else:
            return False
        return True

    def _light(self, key: str) -> None:
        showing = self.showing
        if key == "n":
            number = (showing.light + 1) % len(showing.lights)
            self.showing = replace(showing, light=number)
            self.said = f"light {number}: {type(showing.lights[number]).__name__}"
        elif key in ("+", "-"):
            sun = showing.lights[showing.light].at_infinity
            size = showing.light_size * (1.0 if sun else 100.0)
            nearest = min(range(len(SIZES)), key=lambda i: abs(SIZES[i] - size))
            wanted = SIZES[max(min(nearest + (1 if key == "+" else -1), len(SIZES) - 1), 0)]
            self.showing = showing.sized(wanted if sun else wanted / 100.0)
            self.said = f"light: {wanted:g} {'degrees' if sun else '% of the scene'} wide"
        else:
            azimuth, elevation = showing.aim
            azimuth += {"left": -STEP, "right": STEP}.get(key, 0.0)
            elevation += {"up": STEP, "down": -STEP}.get(key, 0.0)
            self.showing = showing.lit_from(azimuth, elevation)
            self.said = "light from azimuth {:.0f}, elevation {:.0f}".format(*self.showing.aim)

    def _chosen(self, name: str, choices: tuple[str, ...], step: int, read: Callable[[str], Any]) -> None:
        """The next value in a list that starts with None, for derived."""
        values = [None, *(read(text) for text in choices)]
        now = getattr(self.showing, name)
        place = (values.index(now) if now in values else 0) + step
        value = values[place % len(values)]
        self.showing = replace(self.showing, **{name: value})
        self.said = f"{name} {'derived' if value is None else value}"


def landscapes() -> dict[str, Callable[[], Showing]]:
    """The scenes of keys 1, 2 and 3."""
    from glshadow import scenes as builtin

    def made(number: int) -> Callable[[], Showing]:
        return lambda: Showing.of(builtin.landscape(number))

    return {str(number): made(number) for number in (1, 2, 3)}


def _with_settings(showing: Showing, kept: Showing) -> Showing:
    return replace(
        showing,
        filter=kept.filter,
        resolution=kept.resolution,
        bias=kept.bias,
        samples=kept.samples,
        overlays=kept.overlays,
        error=kept.error,
    )


def _other_projection(showing: Showing) -> Any:
    """The same view in orthographic or perspective projection, with the same size at the target."""
    camera: Any = showing.camera
    distance = float(np.linalg.norm(np.subtract(camera.position, camera.target)))
    placed = {"position": camera.position, "target": camera.target, "up": camera.up}
    if isinstance(camera, OrthographicCamera):
        fov = np.degrees(2.0 * np.arctan(0.5 * camera.height / distance))
        return PerspectiveCamera(**placed, fov_y=float(np.clip(fov, 1.0, 120.0)))
    low, high = camera.window((100, 100))[2:]
    return OrthographicCamera(**placed, height=distance * float(high - low))
