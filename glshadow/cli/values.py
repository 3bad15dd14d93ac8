"""Text of the options -> settings. Every refusal is a SettingsError that says what is allowed."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glshadow.core.spaces import CLIP_SPACES
from glshadow.core.spelling import parse
from glshadow.errors import SettingsError
from glshadow.image import image_path
from glshadow.shadows.bias import BIASES, Bias
from glshadow.shadows.filters import FILTERS, Filter
from glshadow.shadows.fits import FITS, Fit
from glshadow.shadows.metric import Target

if TYPE_CHECKING:
    from glshadow.core.lights import Light
    from glshadow.core.spaces import ClipSpace, Triple
    from glshadow.shadows.cookie import Cookie


TARGETS = tuple(target.value for target in Target)
CLIPS = tuple(map(str, CLIP_SPACES))
OVERLAYS = (
    "map",
    "lights",
    "axes",
    "grid",
)  # named here too: the module that draws them takes long to import; a test compares them
LARGEST_SIDE = 16384  # pixels; the driver's own limit is checked when the picture is made

LIGHTS = (
    "sun:dx,dy,dz, spot:px,py,pz:dx,dy,dz[:outer[:inner]], point:x,y,z, rect:px,py,pz:dx,dy,dz:width,height, sky, each with any "
    ":key=value after it"
)
COMMON_KEYS = ("intensity", "color", "near", "far", "shadow")
LIGHT_KEYS = {
    "sun": (*COMMON_KEYS, "angle", "cookie", "cookie_size"),
    "spot": (*COMMON_KEYS, "range", "falloff", "radius", "cookie"),
    "point": (*COMMON_KEYS, "range", "falloff", "radius"),
    "rect": (*COMMON_KEYS, "range", "up"),
    "sky": ("intensity", "color", "shadow"),
}
INNER_SHARE = 2.0 / 3.0  # of the outer angle, as SpotLight's own 20 of 30 degrees


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    match = re.fullmatch(r"(\d{1,9})[xX](\d{1,9})", text.strip())
    width, height = (int(match[1]), int(match[2])) if match else (0, 0)
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise SettingsError(f"{text!r} is not WIDTHxHEIGHT in pixels, each from 1 to {LARGEST_SIDE}, such as 1280x720")
    return width, height


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SettingsError(f"{text!r} is not a finite number")
    return value


def numbers(text: str, count: int) -> tuple[float, ...]:
    """So many finite numbers with commas between them."""
    parts = text.split(",")
    try:
        values = tuple(number(part) for part in parts)
    except SettingsError:
        values = ()
    if len(values) != count:
        example = ",".join(("1", "2.5", "-3")[:count])
        raise SettingsError(f"{text!r} is not {count} finite numbers with commas between them, such as {example}")
    return values


def vector(text: str) -> Triple:
    """x,y,z."""
    x, y, z = numbers(text, 3)
    return x, y, z


def color(text: str) -> Triple:
    """r,g,b in sRGB."""
    red, green, blue = numbers(text, 3)
    if not all(0.0 <= value <= 1.0 for value in (red, green, blue)):
        raise SettingsError(f"{text!r} is not r,g,b with each from 0 to 1 (sRGB)")
    return red, green, blue


def background(text: str) -> Triple | None:
    """r,g,b in sRGB, or none."""
    return None if text.strip() == "none" else color(text)


def ambient(text: str) -> tuple[float | Triple, float | Triple]:
    """One number, or r,g,b in linear light; or two of these with a slash between them: from above and from below."""
    parts = text.split("/")
    values = [vector(part) if "," in part else number(part) for part in parts[:2]]
    if len(parts) > 2 or min(min(value) if isinstance(value, tuple) else value for value in values) < 0.0:
        raise SettingsError(
            f"{text!r} is no ambient light: one number or r,g,b (linear), each 0 or more; or two of these, ABOVE/BELOW"
        )
    return values[0], values[-1]


def samples(text: str) -> int:
    """In a pixel."""
    from glshadow.core.sampling import PICTURE

    count: int = PICTURE("samples", int(text) if text.strip().isdigit() else text)
    return count


def fov(text: str) -> float:
    """Degrees."""
    from glshadow.core.cameras import PerspectiveCamera

    return PerspectiveCamera(fov_y=number(text)).fov_y


def height(text: str) -> float:
    """World units."""
    from glshadow.core.cameras import OrthographicCamera

    return OrthographicCamera(height=number(text)).height


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
    """0 to 1."""
    from glshadow.shadows.shadow import Shadow

    return Shadow(strength=number(text)).strength


def share(text: str) -> float:
    """0.1% or 0.001."""
    percent = text.endswith("%")
    try:
        value = number(text[:-1] if percent else text) / (100.0 if percent else 1.0)
    except SettingsError:
        value = math.nan
    if not 0.0 <= value < 1.0:
        raise SettingsError(f"{text!r} is not a share of the pixels from 0 to below 1, such as 0.1% or 0.001")
    return value


def milliseconds(text: str) -> float:
    """More than 0."""
    from glshadow.budget import Budget

    budget = Budget(max_ms=number(text))
    return budget.max_ms or 0.0


def shadow_filter(text: str) -> Filter:
    """As a filter is spelled: hard, pcf:1, ..."""
    return parse(text, FILTERS, "filter")


def filter_help() -> str:
    """Every filter with what it does and what its numbers are."""
    parts = []
    for kind in FILTERS:
        notes = [f"{item.name.upper()} {item.metadata['help']}" for item in fields(kind) if item.metadata["help"]]  # type: ignore[arg-type]
        parts.append(f"{kind.usage()} ({'; '.join([kind.summary, *notes])})")
    return ", ".join(parts)


def bias(text: str) -> Bias:
    """As a bias is spelled: receiver-plane, slope:1.1,4, ..."""
    return parse(text, BIASES, "bias")


def fit(text: str) -> Fit:
    """As a fit is spelled: view, cascades:4, ..."""
    return parse(text, FITS, "fit")


def clip(text: str) -> ClipSpace:
    """One of `CLIPS`."""
    found = next((space for space in CLIP_SPACES if str(space) == text.replace(" ", "")), None)
    if found is None:
        raise SettingsError(f"{text!r} is none of: {'  '.join(CLIPS)}")
    return found


def overlays(text: str) -> tuple[str, ...]:
    """Names of overlays with commas between them."""
    names = tuple(name.strip() for name in text.split(","))
    if not set(names) <= set(OVERLAYS):
        raise SettingsError(f"{text!r} is not a list of: {','.join(OVERLAYS)}")
    return names


def picture(text: str) -> Path:
    """A file that an image can be written to."""
    try:
        path = image_path("-o", text)
        if path.is_dir():
            raise SettingsError(f"{text!r} is a folder")
    except OSError as error:
        raise SettingsError(f"{text!r} is no name for a file: {error.strerror}") from error
    return path


def strength_of_sky(text: str) -> float:
    """`--sky`: not negative."""
    value = number(text)
    if value < 0.0:
        raise SettingsError(f"{text!r} is no intensity: it must not be negative")
    return value


def light(text: str) -> Light:
    """`LIGHTS`."""
    from glshadow.core.lights import DirectionalLight, PointLight, RectLight, SkyLight, SpotLight

    kind, *parts = text.split(":")
    places = [part for part in parts if "=" not in part]
    if kind not in LIGHT_KEYS or parts[: len(places)] != places:
        raise SettingsError(f"{text!r} is none of: {LIGHTS}")
    least, most = {"sun": (1, 1), "spot": (2, 4), "point": (1, 1), "rect": (3, 3), "sky": (0, 0)}[kind]
    if not least <= len(places) <= most:
        raise SettingsError(f"{text!r} is none of: {LIGHTS}")
    keys = dict(_key(kind, part) for part in parts[len(places) :])
    if "cookie" in keys or "cookie_size" in keys:
        keys["cookie"] = _cookie(kind, keys.pop("cookie", None), keys.pop("cookie_size", 1.0))
    if kind == "sky":
        return SkyLight(**keys)
    if kind == "rect":
        width, height = numbers(places[2], 2)
        direction = vector(places[1])
        if "up" not in keys and abs(direction[1]) < 0.9 * math.hypot(*direction):
            keys["up"] = (0.0, 1.0, 0.0)  # but for panels that look up or down
        return RectLight(position=vector(places[0]), direction=direction, width=width, height=height, **keys)
    if kind == "sun":
        return DirectionalLight(direction=vector(places[0]), **keys)
    if kind == "point":
        return PointLight(position=vector(places[0]), **keys)
    if len(places) > 2:
        keys["outer_angle"] = number(places[2])
        keys["inner_angle"] = number(places[3]) if len(places) > 3 else INNER_SHARE * keys["outer_angle"]
    return SpotLight(position=vector(places[0]), direction=vector(places[1]), **keys)


def _cookie(kind: str, path: str | None, size: float) -> Cookie:
    """An image file; of a sun it is repeated."""
    from glshadow.image import read
    from glshadow.shadows.cookie import Cookie

    if path is None:
        raise SettingsError("cookie_size needs a cookie: cookie=FILE")
    return Cookie(image=read(path), repeat=kind == "sun", size=size)


def _key(kind: str, text: str) -> tuple[str, Any]:
    key, _, value = text.partition("=")
    if key not in LIGHT_KEYS[kind]:
        raise SettingsError(f"a {kind} has no {key!r}; it takes {', '.join(LIGHT_KEYS[kind])}")
    if key in ("color", "up"):
        return key, vector(value)
    if key == "cookie":
        return key, value
    if key != "shadow":
        return key, number(value)
    from glshadow.shadows.shadow import Shadow

    if value not in ("on", "off"):
        raise SettingsError(f"shadow must be on or off, got {value!r}")
    return key, Shadow() if value == "on" else None
