"""Reads the text of options as settings. Every refusal is a SettingsError that states what is allowed."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from glshadow.core.spaces import CLIP_SPACES
from glshadow.core.spelling import number, numbers, parse, vector
from glshadow.core.tone import EXPOSURE, Exposure
from glshadow.errors import SettingsError
from glshadow.image import frame_path
from glshadow.shadows.bias import BIASES, Bias
from glshadow.shadows.filters import FILTERS, Filter
from glshadow.shadows.fits import FITS, Fit
from glshadow.shadows.metric import Target
from glshadow.video import SUFFIXES as video_suffixes

if TYPE_CHECKING:
    from glshadow.core.spaces import ClipSpace, Triple
    from glshadow.lights import Light


TARGETS = tuple(target.value for target in Target)
CLIPS = tuple(map(str, CLIP_SPACES))
OVERLAYS = (
    "map",
    "lights",
    "axes",
    "grid",
)  # repeated here because the overlay module is slow to import; a test compares the lists
LARGEST_SIDE = 16384  # pixels; the driver's own limit is checked when the image is made


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    match = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text.strip())
    width, height = (int(match[1]), int(match[2])) if match else (0, 0)
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise SettingsError(f"{text!r} is not WIDTHxHEIGHT in pixels, each from 1 to {LARGEST_SIDE}, such as 1280x720")
    return width, height


def color(text: str) -> Triple:
    """r,g,b in sRGB."""
    red, green, blue = numbers(text, 3)
    if not all(0.0 <= value <= 1.0 for value in (red, green, blue)):
        raise SettingsError(f"{text!r} is not r,g,b with each from 0 to 1 (sRGB)")
    return red, green, blue


def exposure(text: str) -> Exposure:
    """A number of stops, auto, scene or none."""
    if text in ("none", "auto", "scene"):
        return EXPOSURE("exposure", None if text == "none" else text)
    try:
        stops = number(text)
    except SettingsError:
        raise SettingsError(f"{text!r} is not a number of stops, auto, scene or none") from None
    return EXPOSURE("exposure", stops)


def background(text: str) -> Triple | str | None:
    """r,g,b in sRGB, none for a transparent background, or look for that of the scene's look."""
    known = {"none": None, "look": "look"}
    return known[text.strip()] if text.strip() in known else color(text)


def ambient(text: str) -> tuple[float | Triple, float | Triple]:
    """One number, or r,g,b in linear light; or two of these separated by a slash: from above and from below."""
    parts = text.split("/")
    values = [vector(part) if "," in part else number(part) for part in parts[:2]]
    if len(parts) > 2 or min(min(value) if isinstance(value, tuple) else value for value in values) < 0.0:
        raise SettingsError(
            f"{text!r} is not an ambient light: one number or r,g,b (linear), each 0 or more; or two of these, ABOVE/BELOW"
        )
    return values[0], values[-1]


def samples(text: str) -> int:
    """Samples per pixel."""
    from glshadow.core.sampling import IMAGE_SAMPLES

    count: int = IMAGE_SAMPLES("samples", int(text) if text.strip().isdigit() else text)
    return count


def fov(text: str) -> float:
    """Degrees."""
    from glshadow.core.cameras import PerspectiveCamera

    return PerspectiveCamera(fov_y=number(text)).fov_y


def height(text: str) -> float:
    """Height of an orthographic camera's image, world units."""
    from glshadow.core.cameras import OrthographicCamera

    return OrthographicCamera(height=number(text)).height


def degrees(text: str) -> float:
    """Crease angle."""
    value = number(text)
    if not 0.0 <= value <= 180.0:
        raise SettingsError(f"{text!r} is not an angle from 0 to 180 degrees")
    return value


def plane(text: str) -> float:
    """Distance of the camera's near or far plane."""
    value = number(text)
    if value <= 0.0:
        raise SettingsError(f"{text!r} is not a distance greater than 0")
    return value


def resolution(text: str) -> int:
    """Texels."""
    from glshadow.shadows.shadow import Shadow

    try:
        value = int(text)
    except ValueError as error:
        raise SettingsError(f"{text!r} is not an integer from 1 to 16384 (texels)") from error
    Shadow(resolution=value)
    return value


def strength(text: str) -> float:
    """Strength of a shadow, 0 to 1."""
    from glshadow.shadows.shadow import Shadow

    return Shadow(strength=number(text)).strength


def share(text: str) -> float:
    """A share of the pixels: 0.1% or 0.001."""
    percent = text.endswith("%")
    try:
        value = number(text[:-1] if percent else text) / (100.0 if percent else 1.0)
    except SettingsError:
        value = math.nan
    if not 0.0 <= value < 1.0:
        raise SettingsError(f"{text!r} is not a share of the pixels from 0 to below 1, such as 0.1% or 0.001")
    return value


def milliseconds(text: str) -> float:
    """A time in milliseconds, more than 0."""
    from glshadow.budget import Budget

    budget = Budget(max_ms=number(text))
    return budget.max_ms or 0.0


def shadow_filter(text: str) -> Filter:
    """A filter: hard, pcf:1, ..."""
    return parse(text, FILTERS, "filter")


def filter_help() -> str:
    """Every filter with its description and its numbers."""
    parts = []
    for kind in FILTERS:
        notes = [f"{item.name.upper()} {item.metadata['help']}" for item in fields(kind) if item.metadata["help"]]  # type: ignore[arg-type]
        parts.append(f"{kind.usage()} ({'; '.join([kind.summary, *notes])})")
    return ", ".join(parts)


def bias(text: str) -> Bias:
    """A bias: receiver-plane, slope:1.1,4, ..."""
    return parse(text, BIASES, "bias")


def fit(text: str) -> Fit:
    """A fit: view, cascades:4, ..."""
    return parse(text, FITS, "fit")


def clip(text: str) -> ClipSpace:
    """A clip convention, one of `CLIPS`."""
    found = next((space for space in CLIP_SPACES if str(space) == text.replace(" ", "")), None)
    if found is None:
        raise SettingsError(f"{text!r} is not one of: {'  '.join(CLIPS)}")
    return found


def overlays(text: str) -> tuple[str, ...]:
    """Names of overlays, separated by commas."""
    names = tuple(name.strip() for name in text.split(","))
    if not set(names) <= set(OVERLAYS):
        raise SettingsError(f"{text!r} is not a list of: {','.join(OVERLAYS)}")
    return names


def outputs(text: str) -> tuple[str, ...]:
    """Names of outputs, separated by commas."""
    from glshadow.core.outputs import checked_outputs

    return checked_outputs([name.strip() for name in text.split(",")])


def picture(text: str) -> Path:
    """A file that an image or a video can be written to."""
    try:
        video = Path(text).suffix.lower() in video_suffixes
        path = Path(text) if video else frame_path("-o", text)
        if video and not path.parent.is_dir():
            raise SettingsError(f"{text!r}: folder not found: {str(path.parent)!r}")
        if path.is_dir():
            raise SettingsError(f"{text!r} is a folder")
    except OSError as error:
        raise SettingsError(f"{text!r} is not a valid file name: {error.strerror}") from error
    return path


def images_per_second(text: str) -> float:
    """From 0.01 to 1000."""
    return _between(text, "images per second", 0.01, 1000.0)


def seconds(text: str) -> float:
    """Any finite number."""
    return _between(text, "seconds")


def _between(text: str, what: str, least: float = -math.inf, most: float = math.inf) -> float:
    value = number(text)
    if not least <= value <= most:
        raise SettingsError(f"{text!r} is not a number of {what} from {least:g} to {most:g}")
    return value


def strength_of_sky(text: str) -> float:
    """Intensity of `--sky`, 0 or more."""
    value = number(text)
    if value < 0.0:
        raise SettingsError(f"{text!r} is not an intensity: it must not be negative")
    return value


def light_help() -> str:
    """Every light with its description."""
    from glshadow.lights import LIGHTS

    return ", ".join(f"{kind.usage} ({kind.summary})" for kind in LIGHTS)


def light(text: str) -> Light:
    """A light: sun:-1,-2,-1, ..."""
    from glshadow.image import read
    from glshadow.lights import LIGHTS, spelling

    return spelling.parse(text, LIGHTS, read)
