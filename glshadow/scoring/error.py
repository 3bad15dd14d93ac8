"""The error of a frame's shadows: how much, of which kind, and where.

A frame and a truth meet here as plain arrays: neither the renderer nor the tracer is imported.
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

# The definition of error, not tunable: changing one of these changes what every published number means.
LEAST_COSINE = 0.05  # N.L from which a pixel counts
SMOOTH_COSINE = float(np.cos(np.radians(25.0)))  # between face normals of neighbouring pixels
WRONG = 0.5  # |visibility - truth| above which a pixel is wrong
GRAIN = 1.0 / 16.0  # |visibility - truth| above which it is grainy, away from edges
CONTACT_TEXELS = 2.0


class Frame(Protocol):
    """What `measure` needs of a rendered frame."""

    @property
    def visibility(self) -> NDArray[np.float32]: ...  # (L, H, W)
    @property
    def scene(self) -> Scene: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def lights(self) -> Sequence[Light]: ...


class Truth(Frame, Protocol):
    """What `measure` needs of the exact answer, and asks it."""

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
    """Score of a frame over all its lights, with that of each light.

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
        """Plain numbers for JSON; None where no pixel counts."""
        return {**_plain(self), "lights": [_plain(score) for score in self.lights]}

    def picture(self, light: int = 0) -> NDArray[np.uint8]:
        """Where the errors of one light are; (H, W, 3) uint8.

        Acne red, leak blue, edge yellow, grain orange, not counted green, right in grey: light where lit, darker where
        dark.
        """
        light = whole(0, len(self.lights) - 1)("light", light)
        kinds, truth = self.kinds[light], self.truth[light]
        image = np.where(truth > 0.5, np.uint8(LIT), np.uint8(DARK))[..., None].repeat(3, axis=-1)
        for kind, color in COLORS.items():
            image[kinds == kind] = color
        return image

    def _repr_html_(self) -> str:
        """The numbers and the pictures of all lights in a notebook."""
        return error_html(self.lights, self, [self.picture(number) for number in range(len(self.lights))])


def _texels(frame: Frame, number: int) -> tuple[int, float]:
    """Texels along the side of a light's map, and of the soft edge's half width; what was used, where the frame knows it."""
    resolved = (frame.lights[number].shadow or Shadow()).resolved()
    used = getattr(frame, "used", ())
    known = used[number].filter if number < len(used) else None
    return resolved.resolution, (known or resolved.filter).radius


def _plain(score: Score) -> dict[str, object]:
    numbers = {item.name: getattr(score, item.name) for item in fields(Score)}
    return {name: value if np.isfinite(value) else None for name, value in numbers.items()}


def measure(frame: Frame, truth: Truth) -> Measurement:
    """Score a frame's visibility against the truth of the same picture.

    Counted are pixels that see a surface with N.L > 0.05 which the light reaches (cone and range), and whose 3 x 3
    neighbourhood sees one connected body with face normals within 25 degrees (at silhouettes and creases rasterisers
    may differ; pixels on the image's border do not count). A pixel where the frame has no surface but the truth has one
    counts as wrong.

    Parameters
    ----------
    frame : glshadow.Frame
        Or anything with `visibility`, `scene`, `camera` and `lights`.
    truth : glshadow.Truth

    Raises
    ------
    SettingsError
        If they are not of the same scene (the same object), camera, lights and size. How a light's shadow is made is the
        frame's own business: one truth serves many settings.
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
        except GlshadowError:  # a frame says itself which output it lacks
            raise
        except Exception:
            raise refuse(name, f"what glshadow makes (it has no {part})", given) from None
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
        raise SettingsError("there is nothing to measure: the truth has no lights")
    if frame.visibility.shape != truth.visibility.shape:
        raise SettingsError(
            f"frame and truth must have the same lights and size: frame.visibility is {frame.visibility.shape}, "
            f"truth.visibility {truth.visibility.shape} (lights, height, width)"
        )
    ours, theirs = getattr(frame, "samples", 1), getattr(truth, "samples", 1)
    if ours != theirs:
        raise SettingsError(
            f"frame and truth must have as many samples in a pixel: the frame has {ours}, the truth {theirs}; use trace(..., "
            f"samples={ours})"
        )
    asked = [each.filter is not None and each.filter.obeys_size for each in getattr(frame, "used", ())]
    soft = [
        number for number, light in enumerate(truth.lights) if light.has_size and number < len(asked) and asked[number]
    ]
    if soft and getattr(truth, "light_samples", 1) == 1:
        raise SettingsError(
            f"light {soft[0]} has a size, and the frame's shadow of it is soft: trace(..., light_samples=256) is the truth of that"
        )
    if frame.scene is not truth.scene:
        raise SettingsError(
            f"frame and truth must be of the same Scene object: the frame shows {frame.scene.name!r}, "
            f"the truth {truth.scene.name!r}; trace the scene that was rendered"
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
    # Not drawn at all: as far from the truth as can be.
    difference = np.where(surface & np.isnan(difference), np.where(exact > 0.5, -1.0, 1.0), difference)
    amount = np.where(surface, np.abs(difference), 0.0)
    counted = surface & smooth & truth.reached[number] & (truth.cosine[number] > LEAST_COSINE)
    wrong, uneven = counted & (amount > WRONG), counted & (amount > GRAIN)
    texel = texel_size(truth, number, resolution)
    edge = truth.near_edge(number, (radius + 0.5) * np.sqrt(2.0) * texel, wrong)
    grain = uneven & ~edge  # what is within the first band is within the second, wider one
    grain &= ~truth.near_edge(number, (radius + 1.0) * np.sqrt(2.0) * texel, grain)
    several = truth.lights[number].has_size and getattr(truth, "light_samples", 1) > 1
    # of a light that is all seen, and no edge or wall within the kernel, texels are shadowed: by the surface itself
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
    """Pixels (H, W) whose whole 3 x 3 neighbourhood sees their body with normals within 25 degrees of theirs.

    Not those on the image's border: part of their neighbourhood is not seen.
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
    """Size of a texel of a map that fits tightly, in the light plane; world units.

    Parameters
    ----------
    truth : Truth
        Whose visible points a sun's map has to cover.
    number : int
        The light's number.
    resolution : int
        Texels along a side of its map.

    Returns
    -------
    float or (H, W) float64
        Sun: the longer side of the rectangle of least area round the visible points, divided by the resolution. Spot
        and point light: the width of the cone, or of a cube map's face, at the pixel's distance, divided by it.
    """
    light = truth.lights[number]
    return light.map_texel(truth.position, truth.triangle >= 0, resolution)
