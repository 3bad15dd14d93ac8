"""compare: one image under several settings as a contact sheet: the reference, and each setting with its error and cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import as_scene, frame_arguments
from glshadow.budget import times_of
from glshadow.core.cameras import Camera
from glshadow.core.setting import refuse
from glshadow.core.spelling import parse
from glshadow.errors import SettingsError, printable
from glshadow.frame import Frame
from glshadow.gl.driver.context import Backend
from glshadow.inline import notebook_bar
from glshadow.lights import Light, Lights, traced_points
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scoring.error import Measurement, measure
from glshadow.scoring.score import COLORS, Outcome
from glshadow.shadows.filters import FILTERS, Filter
from glshadow.shadows.shadow import Shadow
from glshadow.triptych import GAP, triptych

Picture = NDArray[np.uint8]

COLUMNS = 4  # columns of the sheet
ROUNDS = 1  # rounds of timed frames
LINE = 18  # pixels: height of a caption's line
TRUTH = "reference"


@dataclass(frozen=True, eq=False)
class Compared:
    """One setting with its measurements.

    Attributes
    ----------
    name : str
    shadow : Shadow
    frame : Frame
    error : Measurement
    ms : float
        Median time of a frame that draws everything.
    """

    name: str
    shadow: Shadow
    frame: Frame = field(repr=False)
    error: Measurement = field(repr=False)
    ms: float
    pictures: tuple[Picture, ...] = field(repr=False)

    @property
    def caption(self) -> str:
        """Time and error as text."""
        if any(each.has_size for each in self.frame.lights):  # pixels of a penumbra are not right or wrong
            return f"{self.ms:.1f} ms, off by {self.error.mean:.4f}, in penumbrae {self.error.penumbra:.3f}"
        grain = f", grain {self.error.grain:.2%}" if self.error.grain > self.error.wrong else ""
        return f"{self.ms:.1f} ms, wrong {self.error.wrong:.3%}{grain}"

    @property
    def title(self) -> str:
        """The name, made safe to print."""
        return printable(self.name)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Several settings of one image, in the given order.

    Attributes
    ----------
    entries : tuple of Compared
    truth : tuple of (H, W, 3) uint8
        The image with traced visibility, one for each light that casts shadows, shaded by that light alone.
    """

    entries: tuple[Compared, ...]
    truth: tuple[Picture, ...]

    def __getitem__(self, name: str) -> Compared:
        found = [each for each in self.entries if each.name == name]
        if not found:
            raise KeyError(f"{name!r}; there are: {', '.join(each.name for each in self.entries)}")
        return found[0]

    def __len__(self) -> int:
        return len(self.entries)

    def __repr__(self) -> str:
        return f"Comparison({', '.join(f'{each.title}: {each.caption}' for each in self.entries)})"

    def __str__(self) -> str:
        width = max(len(each.title) for each in self.entries)
        return "\n".join(f"{each.title:{width}s}  {each.caption}" for each in self.entries)

    @property
    def image(self) -> Picture:
        """(H, W, 3) contact sheet: the reference, then each setting with its error below; as many columns as fit."""
        cells = [_captioned(np.vstack(pictures), *words) for pictures, words in self._cells()]
        rows = [cells[i : i + COLUMNS] for i in range(0, len(cells), COLUMNS)]
        blank = np.full_like(cells[0], 255)
        several = len(rows) > 1
        return np.vstack([np.hstack(row + [blank] * (COLUMNS - len(row)) * several) for row in rows])

    def save(self, path: str | PathLike[str]) -> None:
        """Write the contact sheet as an image."""
        from glshadow import image

        image.write(path, self.image)

    def _repr_html_(self) -> str:
        from glshadow.inline import figure

        cells = [
            f'<div style="width:{pictures[0].shape[1]}px">{figure(np.vstack(pictures), ": ".join(words))}</div>'
            for pictures, words in self._cells()
        ]
        return f'<div style="display:flex;flex-wrap:wrap;gap:8px">{"".join(cells)}</div>'

    def _cells(self) -> list[tuple[list[Picture], tuple[str, ...]]]:
        legend = _legend(self.truth[0].shape)
        truth: list[Picture] = [part for picture in self.truth for part in (picture, legend)]
        cells: list[tuple[list[Picture], tuple[str, ...]]] = [(truth, (TRUTH, "traced rays"))]
        return cells + [(list(each.pictures), (each.title, each.caption)) for each in self.entries]


def compare(
    scene: Any,
    settings: Mapping[str, Shadow | Filter | str] | Sequence[Shadow | Filter | str],
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = (480, 270),
    backend: Backend = "auto",
) -> Comparison:
    """Render one image under several settings; measure and time each.

    Parameters
    ----------
    scene : Scene, or anything that `load` takes
    settings : sequence of Shadow, Filter or str, or mapping
        Shadow settings for every light that casts shadows; each light keeps its strength. A text gives a filter: "pcf:1". The keys of a
        mapping are names.
    camera, lights, size, backend
        As for `Renderer.render`.

    Returns
    -------
    Comparison
        Displays itself in a notebook; `save` writes it.

    Raises
    ------
    SettingsError
        If there is nothing to compare (no setting, or no light that casts shadows), or a setting is not allowed.
    ReferenceUnavailable
        If embreex is not installed.
    """
    named = _named(settings)
    scene = as_scene(scene, usual="plain")
    camera, lights, size = frame_arguments(scene, camera, lights, size)
    casting = [light for light in lights if light.shadow is not None]
    if not casting:
        raise SettingsError("there is nothing to compare: no light casts a shadow (Light.shadow is None)")

    def lit_by(shadow: Shadow, given: Sequence[Light] = casting) -> list[Light]:
        return [replace(each, shadow=replace(shadow, strength=each.shadow.strength)) for each in given if each.shadow]

    entries = []
    truth_pictures: tuple[Picture, ...] = ()
    bar = notebook_bar()
    with Renderer(backend) as renderer, closing(bar) if bar else nullcontext():
        truth = None
        drawn = []
        for number, (name, shadow) in enumerate(named):
            if bar:
                bar(number, len(named), printable(name))
            frame = renderer.render(
                scene, camera, lit_by(shadow), size, outputs=("image", "visibility", "triangle", "linear"), samples=1
            )
            if truth is None:
                points = traced_points(casting)
                truth = trace(scene, camera, casting, size, light_samples=points, surface=frame.triangle, samples=1)
            drawn.append((name, shadow, frame))

        def draw(moved: Sequence[Light], outputs: tuple[str, ...]) -> Frame:
            return renderer.render(scene, camera, moved, size, outputs=outputs, samples=1)

        bare = lit_by(Shadow())
        times = times_of(draw, bare, [shadow for _, shadow, _ in drawn], ROUNDS)
        assert truth is not None
        for (name, shadow, frame), taken in zip(drawn, times, strict=True):
            error = measure(frame, truth)
            rows = triptych(renderer, frame, truth, error)
            parts = [_parts(rows, size, number) for number in range(len(casting))]
            truth_pictures = truth_pictures or tuple(part[0] for part in parts)
            pictures = tuple(picture for part in parts for picture in part[1:])
            entries.append(Compared(name, shadow, frame, error, 1e3 * float(np.median(taken)), pictures))
    return Comparison(tuple(entries), truth_pictures)


def _named(settings: Any) -> list[tuple[str, Shadow]]:
    if isinstance(settings, str) or not isinstance(settings, Mapping | Sequence) or len(settings) == 0:
        raise refuse("settings", "a sequence or mapping of Shadow, Filter or the text of a filter", settings)
    pairs = list(settings.items()) if isinstance(settings, Mapping) else [(None, each) for each in settings]
    found = []
    for number, (name, given) in enumerate(pairs):
        if isinstance(given, str):
            name = given if name is None else name
            given = parse(given, FILTERS, "filter")
        shadow = Shadow(filter=given) if isinstance(given, Filter) else given
        if not isinstance(shadow, Shadow) or shadow.channel is not None:
            raise refuse(f"settings[{number}]", "a Shadow, a Filter or the text of a filter", given)
        found.append((str(name) if name is not None else _name(shadow), shadow))
    return found


def _name(shadow: Shadow) -> str:
    from glshadow.study.grid import setting_name

    return "derived" if replace(shadow, strength=1.0) == Shadow() else setting_name(shadow)


def _parts(rows: Picture, size: tuple[int, int], light: int) -> tuple[Picture, Picture, Picture]:
    """Reference, rendered and error image of one light."""
    width, height = size
    row = rows[light * (height + GAP) :][:height]
    first, second, third = (row[:, k * (width + GAP) :][:, :width] for k in range(3))
    return first, second, third


LEGEND = {
    Outcome.EDGE: "edge off by a texel",
    Outcome.ACNE: "acne: lit rendered dark",
    Outcome.LEAK: "leak: dark rendered lit",
    Outcome.GRAIN: "grain: off by 1/16",
    Outcome.NOT_COUNTED: "not counted",
}


def _legend(shape: tuple[int, ...]) -> Picture:
    """A legend of the error colours, as large as an image."""
    from PIL import Image, ImageDraw, ImageFont

    sheet = Image.new("RGB", (shape[1], shape[0]), (255, 255, 255))
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=12)
    for number, (kind, text) in enumerate(LEGEND.items()):
        top = 8 + LINE * number
        pen.rectangle((8, top, 20, top + 12), fill=COLORS[kind])
        pen.text((26, top - 1), text, fill=(20, 20, 20), font=font)
    return np.asarray(sheet)


def _captioned(picture: Picture, *lines: str) -> Picture:
    """An image with lines of text below, and a margin."""
    from PIL import Image, ImageDraw, ImageFont

    height, width = picture.shape[:2]
    sheet = Image.new("RGB", (width + 2 * GAP, height + 2 * GAP + LINE * len(lines)), (255, 255, 255))
    sheet.paste(Image.fromarray(picture), (GAP, GAP))
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=13)
    for number, line in enumerate(lines):
        pen.text((GAP + 2, height + GAP + 2 + LINE * number), line, fill=(20, 20, 20), font=font)
    return np.asarray(sheet)
