"""The error of a frame's shadows: size, kind and location.

Takes the frame and the reference as plain arrays: neither the renderer nor the tracer is imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import checked_scene
from glshadow.core.cameras import Camera
from glshadow.core.setting import refuse, whole
from glshadow.core.spaces import Array, Bools
from glshadow.errors import GlshadowError, SettingsError
from glshadow.lights import Light, as_lights
from glshadow.scene.nodes import Scene
from glshadow.scoring.html import error_html
from glshadow.scoring.score import COLORS, DARK, LIT, Outcome, Score
from glshadow.scoring.windows import window_sums
from glshadow.shadows.shadow import Shadow

# These numbers define the error and are not tunable: changing one of these changes what every published number means.
LEAST_COSINE = 0.05  # N.L from which a pixel is counted
SMOOTH_COSINE = float(np.cos(np.radians(25.0)))  # largest angle between face normals of neighbouring pixels
WRONG = 0.5  # |visibility - reference| above which a pixel is wrong
GRAIN = 1.0 / 16.0  # |visibility - reference| above which it is grainy, away from edges
CONTACT_TEXELS = 2.0


class Frame(Protocol):
    """The attributes of a rendered frame that `measure` uses."""

    @property
    def visibility(self) -> NDArray[np.float32]: ...  # (L, H, W)
    @property
    def scene(self) -> Scene: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def lights(self) -> Sequence[Light]: ...


class Truth(Frame, Protocol):
    """The attributes and methods of a reference that `measure` uses."""

    @property
    def cosine(self) -> NDArray[np.float32]: ...  # (L, H, W)
    @property
    def reached(self) -> Bools: ...  # (L, H, W)
    @property
    def position(self) -> Array: ...  # (H, W, 3)
    @property
    def normal(self) -> Array: ...  # (H, W, 3)
    @property
    def triangle(self) -> NDArray[np.int32]: ...  # (H, W)
    @property
    def body(self) -> NDArray[np.int32]: ...  # (H, W)
    def near_edge(self, light: int, radius: Array | float, where: Bools | None = None) -> Bools: ...
    def near_foot(self, radius: Array | float, where: Bools) -> Bools: ...


@dataclass(frozen=True, repr=False)
class Measurement(Score):
    """Errors of a frame over all its lights, and of each light.

    Attributes
    ----------
    lights : tuple of Score
        In the frame's order.
    kinds : (L, H, W) uint8
        `Outcome` of every pixel.
    """

    lights: tuple[Score, ...]
    kinds: NDArray[np.uint8] = field(repr=False, compare=False)
    truth: NDArray[np.float32] = field(repr=False, compare=False)

    def __repr__(self) -> str:
        kinds = ", ".join(f"{name} {getattr(self, name):.4%}" for name in ("wrong", "edge", "acne", "leak", "grain"))
        lights = f"{len(self.lights)} light{'' if len(self.lights) == 1 else 's'}"
        return f"Measurement({lights}: {kinds}, window {self.window:.5f})"

    def __str__(self) -> str:
        return "\n".join(f"light {number}: {score}" for number, score in enumerate(self.lights))

    def as_dict(self) -> dict[str, object]:
        """Plain numbers for JSON; None if no pixel is counted."""
        return {**_plain(self), "lights": [_plain(score) for score in self.lights]}

    def picture(self, light: int = 0) -> NDArray[np.uint8]:
        """Image (H, W, 3) uint8 of the errors of one light.

        Acne red, leak blue, edge yellow, grain orange, not counted green; correct pixels grey: light where lit, darker where
        dark.
        """
        light = whole(0, len(self.lights) - 1)("light", light)
        kinds, truth = self.kinds[light], self.truth[light]
        image = np.where(truth > 0.5, np.uint8(LIT), np.uint8(DARK))[..., None].repeat(3, axis=-1)
        for kind, color in COLORS.items():
            image[kinds == kind] = color
        return image

    def _repr_html_(self) -> str:
        """In a notebook: the numbers, and the error images of all lights."""
        return error_html(self.lights, self, [self.picture(number) for number in range(len(self.lights))])


def _texels(frame: Frame, number: int) -> tuple[int, float]:
    """Resolution of a light's map, and half the width of its soft edge in texels; as used, if the frame reports it."""
    resolved = (frame.lights[number].shadow or Shadow()).resolved()
    used = getattr(frame, "used", ())
    known = used[number].filter if number < len(used) else None
    return resolved.resolution, (known or resolved.filter).radius


def _plain(score: Score) -> dict[str, object]:
    numbers = {item.name: getattr(score, item.name) for item in fields(Score)}
    return {name: value if np.isfinite(value) else None for name, value in numbers.items()}


def measure(frame: Frame, truth: Truth) -> Measurement:
    """Compare a frame's visibility with the reference of the same image.

    Counted are pixels that see a surface with N.L > 0.05 within the light's cone and range, if their 3 x 3 neighbourhood sees one
    connected body with face normals within 25 degrees: at silhouettes and creases rasterisers may differ. Pixels on the image's border
    are not counted. A pixel without a surface in the frame but with one in the reference counts as wrong.

    Parameters
    ----------
    frame : glshadow.Frame
        The frame to measure, or any object with `visibility`, `scene`, `camera` and `lights`.
    truth : glshadow.Truth

    Raises
    ------
    SettingsError
        If they do not have the same scene (the same object), camera, lights and size. The lights' shadow settings may differ: one
        reference serves many settings.
    """
    _check_same(frame, truth)
    smooth = smooth_pixels(truth.body, truth.normal)
    tallies, kinds, amounts = [], [], []
    for number in range(len(truth.lights)):
        tally, kind, amount = _score_light(frame.visibility[number], truth, number, smooth, *_texels(frame, number))
        tallies.append(tally)
        kinds.append(kind)
        amounts.append(amount)
    total = _Tally(*(sum(values) for values in zip(*(asdict(tally).values() for tally in tallies), strict=True)))
    shape = truth.visibility.shape
    return Measurement(
        **asdict(total.score(np.concatenate(amounts))),
        lights=tuple(tally.score(amount) for tally, amount in zip(tallies, amounts, strict=True)),
        kinds=np.array(kinds, dtype=np.uint8).reshape(shape),
        truth=truth.visibility,
    )


FRAME_HAS = ("visibility", "scene", "camera", "lights")
TRUTH_HAS = (*FRAME_HAS, "cosine", "reached", "position", "normal", "triangle", "body", "near_edge", "near_foot")


def _check_has(name: str, given: object, parts: tuple[str, ...]) -> None:
    for part in parts:
        try:
            value = getattr(given, part)
        except GlshadowError:  # the frame's own error names the missing output
            raise
        except Exception:
            raise refuse(name, f"a glshadow object (this one has no {part})", given) from None
        if part == "visibility" and not (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
            raise refuse(f"{name}.visibility", "an array (L, H, W) of floats", value)
        if part == "lights":
            as_lights(f"{name}.lights", value)
        if part == "scene":
            checked_scene(value)


def _check_same(frame: Frame, truth: Truth) -> None:
    _check_has("frame", frame, FRAME_HAS)
    _check_has("truth", truth, TRUTH_HAS)
    if len(truth.lights) == 0:
        raise SettingsError("there is nothing to measure: the reference has no lights")
    if frame.visibility.shape != truth.visibility.shape:
        raise SettingsError(
            f"frame and truth must have the same lights and size: frame.visibility is {frame.visibility.shape}, "
            f"truth.visibility {truth.visibility.shape} (lights, height, width)"
        )
    ours, theirs = getattr(frame, "samples", 1), getattr(truth, "samples", 1)
    if ours != theirs:
        raise SettingsError(
            f"frame and truth must have the same samples per pixel: the frame has {ours}, the reference {theirs}; use trace(..., "
            f"samples={ours})"
        )
    asked = [each.filter is not None and each.filter.obeys_size for each in getattr(frame, "used", ())]
    soft = [
        number for number, light in enumerate(truth.lights) if light.has_size and number < len(asked) and asked[number]
    ]
    if soft and getattr(truth, "light_samples", 1) == 1:
        raise SettingsError(
            f"light {soft[0]} has a size, and its shadow in the frame is soft: trace the reference with trace(..., light_samples=256)"
        )
    if frame.scene is not truth.scene:
        raise SettingsError(
            f"frame and truth must be of the same Scene object: the frame shows {frame.scene.name!r}, "
            f"the reference {truth.scene.name!r}; trace the scene that was rendered"
        )
    if frame.camera != truth.camera:
        raise SettingsError(f"frame and truth must have the same camera: {frame.camera} is not {truth.camera}")
    for number, (drawn, traced) in enumerate(zip(frame.lights, truth.lights, strict=True)):
        if replace(drawn, shadow=None) != replace(traced, shadow=None) or (drawn.shadow is None) != (
            traced.shadow is None
        ):
            raise SettingsError(f"frame and truth must have the same lights: light {number} is {drawn} and {traced}")


@dataclass(frozen=True)
class _Tally:
    """Sums over pixels, so that lights can be added up."""

    surface: float
    counted: float
    mean: float
    wrong: float
    edge: float
    acne: float
    leak: float
    grain: float
    contact: float
    all_wrong: float
    all_mean: float
    penumbra: float
    penumbra_mean: float
    window: float

    def score(self, amounts: Array) -> Score:
        """`amounts` (N,): the differences of the counted pixels."""
        counted, surface = self.counted or np.nan, self.surface or np.nan
        edge, acne, leak = self.edge / counted, self.acne / counted, self.leak / counted
        return Score(
            mean=self.mean / counted,
            wrong=self.wrong / counted,
            edge=edge,
            acne=acne,
            leak=leak,
            grain=self.grain / counted,
            contact=self.contact / counted,
            counted=self.counted / surface,
            all_wrong=self.all_wrong / surface,
            all_mean=self.all_mean / surface,
            p95=float(np.percentile(amounts, 95.0)) if len(amounts) else np.nan,
            penumbra=self.penumbra_mean / (self.penumbra or 1.0),
            window=self.window / counted,
        )


def _score_light(
    visibility: NDArray[np.float32], truth: Truth, number: int, smooth: Bools, resolution: int, radius: float
) -> tuple[_Tally, NDArray[np.uint8], Array]:
    exact = truth.visibility[number].astype(np.float64)
    surface = ~np.isnan(exact)
    difference = visibility - exact
    # Not drawn at all: the largest error.
    difference = np.where(surface & np.isnan(difference), np.where(exact > 0.5, -1.0, 1.0), difference)
    amount = np.where(surface, np.abs(difference), 0.0)
    counted = surface & smooth & truth.reached[number] & (truth.cosine[number] > LEAST_COSINE)
    wrong, uneven = counted & (amount > WRONG), counted & (amount > GRAIN)
    texel = texel_size(truth, number, resolution)
    edge = truth.near_edge(number, (radius + 0.5) * np.sqrt(2.0) * texel, wrong)
    grain = uneven & ~edge  # what is within the first band is also within the second, wider one
    grain &= ~truth.near_edge(number, (radius + 1.0) * np.sqrt(2.0) * texel, grain)
    several = truth.lights[number].has_size and getattr(truth, "light_samples", 1) > 1
    # if a light is fully visible and no edge or wall is within the kernel, shadowed texels are self-shadowing
    partly = grain & (difference < 0.0) & (exact == 1.0) & (not several)
    reach = (radius + 1.0) * np.sqrt(2.0) * texel / np.maximum(truth.cosine[number], LEAST_COSINE)
    partly &= ~truth.near_foot(reach, partly)
    acne, leak = partly | (wrong & ~edge & (difference < 0.0)), wrong & ~edge & (difference > 0.0)
    contact = truth.near_foot(CONTACT_TEXELS * texel, leak)
    kinds = np.full(exact.shape, Outcome.NO_SURFACE, dtype=np.uint8)
    marks = ((surface, Outcome.NOT_COUNTED), (counted, Outcome.GOOD), (grain, Outcome.GRAIN), (edge, Outcome.EDGE))
    for mask, kind in (*marks, (acne, Outcome.ACNE), (leak, Outcome.LEAK)):
        kinds[mask] = kind
    soft = counted & several & (exact > 0.0) & (exact < 1.0)
    sums = (
        surface, counted, amount * counted, wrong, edge, acne, leak, grain, contact, amount > WRONG, amount, soft, amount * soft,
        np.abs(window_sums(np.where(counted, difference, 0.0))),
    )  # fmt: skip
    return _Tally(*(float(values.sum()) for values in sums)), kinds, amount[counted]


def smooth_pixels(body: NDArray[np.int32], normal: Array) -> Bools:
    """Pixels (H, W) whose whole 3 x 3 neighbourhood sees the same body with normals within 25 degrees of theirs.

    Excludes pixels on the image's border, whose neighbourhood is incomplete.
    """
    result = np.zeros(body.shape, dtype=bool)
    height, width = body.shape
    if height < 3 or width < 3:
        return result
    inner = (slice(1, -1), slice(1, -1))
    good = body[inner] >= 0
    for row, column in ((i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)):
        other = (slice(row, height - 2 + row), slice(column, width - 2 + column))
        good &= (body[other] == body[inner]) & (np.einsum("ijk,ijk->ij", normal[other], normal[inner]) >= SMOOTH_COSINE)
    result[inner] = good
    return result


def texel_size(truth: Truth, number: int, resolution: int) -> Array | float:
    """Size of a texel of a tightly fitted map, in the plane perpendicular to the light; world units.

    Parameters
    ----------
    truth : Truth
        Reference with the visible points that a directional light's map must cover.
    number : int
        Index of the light.
    resolution : int
        Texels along each side of the map.

    Returns
    -------
    float or (H, W) float64
        Directional light: the longer side of the least-area rectangle around the visible points, divided by the resolution. Spot
        and point light: the width of the cone or cube face at the pixel's distance, divided by the resolution.
    """
    light = truth.lights[number]
    return light.map_texel(truth.position, truth.triangle >= 0, resolution)
