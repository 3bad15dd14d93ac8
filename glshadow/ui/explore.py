"""explore: an image in a notebook with controls beside it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from glshadow.arguments import as_scene, frame_arguments
from glshadow.core.cameras import Camera
from glshadow.core.sampling import SAMPLES
from glshadow.core.spelling import parse
from glshadow.errors import GlshadowError, SettingsError
from glshadow.gl.driver.context import Backend
from glshadow.inline import jpeg, png, words
from glshadow.lights import Lights
from glshadow.shadows.bias import BIASES
from glshadow.shadows.filters import FILTERS
from glshadow.shadows.shadow import ASKED_FOR
from glshadow.ui.showing import STEEPEST, Showing
from glshadow.ui.viewer import TRACING, View, Viewer

DERIVED = "derived"
CHOICES = tuple(dict.fromkeys(str(each) for kind in FILTERS for each in (*kind.rungs(), *kind.studied(), *kind.soft())))
BIAS_CHOICES = ("receiver-plane", "slope", "normal-offset", "constant:0.05", "none")
RESOLUTIONS = (256, 512, 1024, 2048, 4096, 8192)
REST = 0.25  # seconds without a change, after which the image is drawn in full
LARGEST = 30.0  # largest angle of a directional light, degrees
LARGEST_SHARE = 0.1  # largest radius of a local light, as a share of the scene's size


class Explorer:
    """An image that follows its controls: light, filter, map, bias, samples, overlays. Displays itself in a notebook.

    Attributes
    ----------
    showing : Showing
        The current state.
    view : View
        The last image: `view.frame`, `view.error`.
    widget : ipywidgets.Widget
        For use in a custom layout.
    controls : dict
        The widgets by name.
    """

    def __init__(self, showing: Showing, size: tuple[int, int], backend: Backend) -> None:
        self.showing, self._size = showing, size
        self._viewer = Viewer(backend)
        self._pending: asyncio.TimerHandle | None = None
        self._filling = False
        self._placed = {"turn": 0.0, "tilt": 0.0, "zoom": 0.0}
        widgets = _widgets()
        self.controls: dict[str, Any] = _controls(widgets, showing)
        self._image = widgets.Image(format="png", layout=widgets.Layout(max_width="100%"))
        self._facts = widgets.HTML()
        for name, control in self.controls.items():
            control.observe(self._observer(name), names="value")
        panel = widgets.VBox(list(self.controls.values()), layout=widgets.Layout(min_width="330px"))
        self.widget = widgets.HBox([widgets.VBox([self._image, self._facts]), panel])
        self._fill()
        self.view: View
        self.draw()

    def draw(self, moving: bool = False) -> None:
        """Draw the current state: in full, or coarsely while something moves. Errors follow later, since tracing takes seconds."""
        measured = self.showing.error and not moving
        if self._drawn(replace(self.showing, error=False), moving, [TRACING] * measured) and measured:
            self._drawn(self.showing, moving)

    def _drawn(self, showing: Showing, moving: bool, more: Sequence[str] = ()) -> bool:
        try:
            self.view = self._viewer.draw(showing, self._size, moving)
        except GlshadowError as error:  # settings that cannot be combined: show the message, keep the last image
            self._facts.value = f'<span style="color:#b00">{words(str(error))}</span>'
            return False
        self._image.format = "jpeg" if moving else "png"
        self._image.value = (jpeg if moving else png)(self.view.image)
        why = [used.why for used in self.view.frame.used if used.why and used.why != ASKED_FOR]
        said = [self.view.facts, *why, *(each for used in self.view.frame.used for each in used.fallbacks), *more]
        self._facts.value = "<br>".join(map(words, said))
        return True

    def close(self) -> None:
        """Release the renderer; the image stays."""
        if self._pending is not None:
            self._pending.cancel()
        self._viewer.release()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)

    # -- actions of the controls

    def _observer(self, name: str) -> Callable[[Any], None]:
        def changed(change: Any) -> None:
            if self._filling:
                return
            self._take(name, change["new"])
            dragged = name in ("azimuth", "elevation", "size", "turn", "tilt", "zoom")
            self._rest_later() if dragged else self.draw()

        return changed

    def _rest_later(self) -> None:
        """Draw coarsely now, and in full once nothing has moved for a while; in full immediately if no event loop runs."""
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            self.draw()
            return
        if self._pending is not None:
            self._pending.cancel()
        self.draw(moving=True)
        self._pending = loop.call_later(REST, self.draw)

    def _take(self, name: str, value: Any) -> None:
        showing = self.showing
        if name == "light":
            self.showing = replace(showing, light=value)
            self._fill()
        elif name in ("azimuth", "elevation"):
            aim = dict(zip(("azimuth", "elevation"), showing.aim, strict=True)) | {name: value}
            self.showing = showing.lit_from(**aim)
        elif name == "size":
            self.showing = showing.sized(value)
        elif name == "filter":
            self.showing = replace(showing, filter=None if value == DERIVED else parse(value, FILTERS, "filter"))
        elif name == "bias":
            self.showing = replace(showing, bias=None if value == DERIVED else parse(value, BIASES, "bias"))
        elif name == "resolution":
            self.showing = replace(showing, resolution=None if value == DERIVED else int(value))
        elif name == "samples":
            self.showing = replace(showing, samples=value)
        elif name in ("map", "gizmo"):
            chosen = {"map": ("map",), "gizmo": ("lights", "axes", "grid")}[name]
            rest = tuple(each for each in showing.overlays if each not in chosen)
            self.showing = replace(showing, overlays=rest + (chosen if value else ()))
        elif name == "error":
            self.showing = replace(showing, error=value)
        elif name in ("turn", "tilt", "zoom"):
            self._moved(name, value)

    def _moved(self, name: str, value: float) -> None:
        """Move the camera to the sliders' position, relative to the first view."""
        old, self._placed[name] = self._placed[name], value
        if name == "zoom":
            self.showing = self.showing.zoomed(2.0 ** (value - old))
        else:
            step = {"turn": (value - old, 0.0), "tilt": (0.0, value - old)}[name]
            self.showing = self.showing.turned(*step)

    def _fill(self) -> None:
        """Set the controls to the selected light."""
        light = self.showing.lights[self.showing.light] if self.showing.lights else None
        if light is None:
            return
        self._filling = True
        azimuth, elevation = self.showing.aim
        self.controls["azimuth"].value, self.controls["elevation"].value = azimuth, elevation
        size = self.controls["size"]
        size.disabled = not light.sized_by
        size.max = LARGEST if light.at_infinity else LARGEST_SHARE
        size.step = size.max / 60.0
        size.description = light.sized_by or "size"
        size.value = self.showing.light_size
        self._filling = False


def explore(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = (640, 360),
    backend: Backend = "auto",
) -> Explorer:
    """Show an image in a notebook with controls for light position and size, filter, map, bias, samples, overlays and error.

    While a slider is dragged, the image is drawn at half the size; a quarter of a second later it is drawn in full.

    Parameters
    ----------
    scene : Scene, or anything that `load` takes
    camera, lights, size, backend
        As for `Renderer.render`.

    Returns
    -------
    Explorer
        As the last line of a cell it displays itself; `close()` releases its renderer.

    Raises
    ------
    SettingsError
        If ipywidgets is not installed; the message says how to install it.
    """
    _widgets()
    scene = as_scene(scene, usual="plain")
    camera, lights, size = frame_arguments(scene, camera, lights, size)
    return Explorer(Showing(scene, camera, tuple(lights)), size, backend)


def _widgets() -> Any:
    try:
        import ipywidgets
    except ImportError as error:
        raise SettingsError(
            f"explore needs ipywidgets ({error}); install it with: pip install 'glshadow[notebook]'"
        ) from error
    return ipywidgets


def _controls(widgets: Any, showing: Showing) -> dict[str, Any]:
    wide = {"style": {"description_width": "80px"}}
    slider = {**wide, "continuous_update": True, "readout_format": ".1f"}
    lights = [(f"{number}: {type(light).__name__}", number) for number, light in enumerate(showing.lights)]
    controls = {
        "light": widgets.Dropdown(options=lights or [("none", 0)], description="light", **wide),
        "azimuth": widgets.FloatSlider(min=-180, max=180, step=1, description="azimuth", **slider),
        "elevation": widgets.FloatSlider(min=-STEEPEST, max=STEEPEST, step=1, description="elevation", **slider),
        "size": widgets.FloatSlider(
            min=0, max=LARGEST, step=0.5, description="angle", **{**slider, "readout_format": ".3g"}
        ),
        "filter": widgets.Dropdown(options=(DERIVED, *CHOICES), description="filter", **wide),
        "resolution": widgets.Dropdown(options=(DERIVED, *map(str, RESOLUTIONS)), description="resolution", **wide),
        "bias": widgets.Dropdown(options=(DERIVED, *BIAS_CHOICES), description="bias", **wide),
        "samples": widgets.Dropdown(options=SAMPLES, description="samples", **wide),
        "map": widgets.Checkbox(description="shadow map", **wide),
        "gizmo": widgets.Checkbox(description="light, axes, grid", **wide),
        "error": widgets.Checkbox(description="errors against traced rays", **wide),
        "turn": widgets.FloatSlider(min=-180, max=180, step=1, description="turn", **slider),
        "tilt": widgets.FloatSlider(min=-90, max=90, step=1, description="tilt", **slider),
        "zoom": widgets.FloatSlider(min=-3, max=3, step=0.1, description="zoom", **slider),
    }
    for name in ("azimuth", "elevation", "size"):
        controls[name].disabled = not showing.lights
    return controls
