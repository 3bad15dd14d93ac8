"""Overlays on an image: shadow maps, lights and what their maps cover, axes, a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import one_of, refuse, several, whole
from glshadow.core.spaces import Array, project
from glshadow.errors import SettingsError
from glshadow.frame import Frame
from glshadow.lights import Light
from glshadow.lines import Canvas, Color
from glshadow.shadows.view import ShadowView

if TYPE_CHECKING:
    from glshadow.derive.used import Used

__all__ = ["OVERLAYS", "light_color", "overlay", "required_outputs"]

OVERLAYS = ("map", "lights", "axes", "grid")
"""All overlays: shadow maps in a corner, lights and what their maps cover, axes, a grid on the ground."""

_NEEDS = {
    "map": ("image", "shadow_maps"),
    "lights": ("image", "depth"),
    "axes": ("image", "depth"),
    "grid": ("image", "depth"),
}

LIGHT_COLORS: tuple[Color, ...] = (
    (255, 196, 48),
    (72, 190, 255),
    (255, 110, 190),
    (130, 224, 90),
    (178, 140, 255),
    (255, 140, 70),
)
AXIS_COLORS: tuple[Color, ...] = ((235, 72, 60), (84, 200, 74), (70, 130, 255))
GRID_COLOR: Color = (96, 128, 176)
GRID_CELLS = 20  # approximate count across the scene

MAP_SIDE = 0.26  # side of one preview, as a share of the image's height
MAPS_WIDTH = 0.5  # largest width of a point light's six views, as a share of the image's width
EMPTY = (22, 26, 38)  # colour of texels without a caster

# Strokes of the letters x, y, z in a unit square, y down
LETTERS = (
    (((0, 0), (1, 1)), ((0, 1), (1, 0))),
    (((0, 0), (0.5, 0.5)), ((1, 0), (0.5, 0.5)), ((0.5, 0.5), (0.5, 1))),
    (((0, 0), (1, 0)), ((1, 0), (0, 1)), ((0, 1), (1, 1))),
)

Segment = tuple[tuple[float, float, float], tuple[float, float, float]]

_CUBE: Array = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 1.0)])
_CUBE_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if (_CUBE[a] != _CUBE[b]).sum() == 1]


def required_outputs(names: Sequence[str]) -> tuple[str, ...]:
    """The outputs that a frame needs for these overlays."""
    return tuple(dict.fromkeys(output for name in _checked(names) for output in _NEEDS[name]))


def overlay(frame: Frame, names: Sequence[str] = OVERLAYS) -> NDArray[np.uint8]:
    """A frame's image with overlays drawn on it.

    Parameters
    ----------
    frame : Frame
        Rendered with the outputs that `required_outputs(names)` gives.
    names : sequence of str
        Any of `OVERLAYS`. "map": the shadow maps in the top right corner, a row per light; bright is near the light, dark blue is empty.
        "lights": their positions and directions, and what each map covers, in the colour of their maps. "axes": x red, y green, z blue, at
        a corner of the scene. "grid": on the floor, with a round step (1, 2 or 5 times a power of ten). Lines behind a surface are faint.

    Returns
    -------
    (H, W, 3) uint8

    Raises
    ------
    SettingsError
        For unknown names, and outputs that the frame does not have.
    """
    if not isinstance(frame, Frame):
        raise refuse("frame", "a glshadow.Frame", frame)
    names = _checked(names)
    for output in required_outputs(names):
        if output not in frame.outputs:
            raise SettingsError(f'these overlays need the output "{output}": render with {required_outputs(names)}')
    canvas = Canvas(frame)
    if "grid" in names:
        _draw_grid(canvas, frame)
    if "axes" in names:
        _draw_axes(canvas, frame)
    if "lights" in names:
        for number, (light, used) in enumerate(zip(frame.lights, frame.used, strict=True)):
            _draw_light(canvas, frame, light, used, light_color(number))
    if "map" in names:
        _draw_maps(canvas, frame)
    return canvas.image


def light_color(number: int) -> Color:
    """Colour of a light's gizmo, frustum and maps."""
    return LIGHT_COLORS[whole(0, 1 << 31)("number", number) % len(LIGHT_COLORS)]


def _checked(names: Sequence[str]) -> tuple[str, ...]:
    try:
        chosen: tuple[str, ...] = several(one_of(*OVERLAYS), "overlays")("overlays", names)
    except SettingsError:
        raise refuse("overlays", f"a sequence of {', '.join(OVERLAYS)}", names) from None
    return chosen


# -- grid and axes


def _extent(frame: Frame) -> float:
    return float(np.linalg.norm(frame.scene.extent[1] - frame.scene.bounds[0]))


def round_step(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `length`."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= length * (1.0 + 1e-9)))


def floor_height(canvas: Canvas, frame: Frame) -> float:
    """The scene's lowest y; or the height of the ground, if a fifth of the visible surface is level within the lowest tenth."""
    low, high = frame.scene.extent[:, 1]
    rows, columns = (np.arange(0, n, max(1, n // 180)) for n in frame.depth.shape)
    depth = frame.depth[np.ix_(rows, columns)].astype(np.float64)
    places = np.stack(np.meshgrid(columns + 0.5, rows + 0.5), axis=-1)
    seen = np.isfinite(depth)
    heights = canvas.point(places[seen], depth[seen])[:, 1]
    step = 2e-3 * max(float(high - low), 1e-3 * _extent(frame))
    lowest = heights[heights <= low + 0.1 * (high - low)]
    if len(lowest) == 0:
        return float(low)
    count = np.bincount(np.maximum(0, np.rint((lowest - low) / step)).astype(np.int64))
    level = int(np.argmax(count))
    if count[level] < 0.2 * len(heights):
        return float(low)
    return float(np.median(lowest[np.abs(lowest - low - level * step) <= step]))


def _draw_grid(canvas: Canvas, frame: Frame) -> None:
    low, high = frame.scene.extent
    width = max(float(high[0] - low[0]), float(high[2] - low[2])) or _extent(frame)
    step, y = round_step(width / GRID_CELLS), floor_height(canvas, frame)
    fine: list[Segment] = []
    coarse: list[Segment] = []
    x0, x1, z0, z1 = (step * edge for edge in (np.floor(low[0] / step), np.ceil(high[0] / step),
                                               np.floor(low[2] / step), np.ceil(high[2] / step)))  # fmt: skip
    for x in np.arange(round(x0 / step), round(x1 / step) + 1):
        (coarse if x % 5 == 0 else fine).append(((x * step, y, z0), (x * step, y, z1)))
    for z in np.arange(round(z0 / step), round(z1 / step) + 1):
        (coarse if z % 5 == 0 else fine).append(((x0, y, z * step), (x1, y, z * step)))
    for segments, opacity in ((fine, 0.45), (coarse, 0.9)):
        canvas.lines(np.array(segments, dtype=np.float64).reshape(-1, 2, 3), GRID_COLOR, 1.0, opacity, halo=False)


def _draw_axes(canvas: Canvas, frame: Frame) -> None:
    low, high = frame.scene.extent
    y, length = floor_height(canvas, frame), 0.12 * _extent(frame)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for z in (low[2], high[2])])
    tips = corners[:, None] + length * np.eye(3)
    seen = canvas.inside(corners, 8.0) & canvas.inside(tips, 16.0).all(axis=-1)
    if seen.any():
        _, depth = canvas.place(corners)
        origin = corners[np.argmin(np.where(seen, depth, np.inf))]
        _draw_triad(canvas, origin, length, flat=False)
        return
    # No corner is in the image: draw only the directions, at the lower left
    places = canvas.height * np.array([[0.09, 0.87], [0.09, 0.80]])
    origin, top = canvas.point(places, 0.5 * (frame.near + frame.far))
    _draw_triad(canvas, origin, float(np.linalg.norm(top - origin)), flat=True)


def _draw_triad(canvas: Canvas, origin: Array, length: float, flat: bool) -> None:
    for axis, color in enumerate(AXIS_COLORS):
        tip = origin + length * np.eye(3)[axis]
        if flat:
            canvas.strokes(canvas.place([origin, tip])[0], color, 2.5)
        else:
            canvas.lines([[origin, tip]], color, 2.5)
        ends, _ = canvas.place([origin, tip])
        away = ends[1] - ends[0]
        side = 9.0 * canvas.unit
        towards = away / max(float(np.linalg.norm(away)), 1e-9)
        _arrow_head(canvas, ends[1], towards, color)
        corner = ends[1] + towards * 1.8 * side - 0.5 * side
        canvas.strokes(np.array(LETTERS[axis]) * side + corner, color, 2.0)


def _arrow_head(canvas: Canvas, tip: Array, towards: Array, color: Color) -> None:
    across, size = np.array([-towards[1], towards[0]]), 7.0 * canvas.unit
    canvas.strokes([[tip, tip - size * towards + sign * 0.6 * size * across] for sign in (-1.0, 1.0)], color, 2.5)


# -- lights


def _draw_light(canvas: Canvas, frame: Frame, light: Light, used: Used, color: Color) -> None:
    for view in used.views:
        canvas.lines(frustum_edges(view), color, 1.0, 0.55, halo=False)
    far = max((view.far for view in used.views), default=0.5 * _extent(frame))
    gizmo = light.gizmo(_extent(frame), far)
    canvas.lines(gizmo.lines, color, gizmo.width, gizmo.opacity)
    if light.at_infinity:
        _draw_entry(canvas, frame, light.rays_to(np.zeros(3)), used, color, gizmo.rays)
    else:
        _draw_source(canvas, light.place[:3], color, gizmo.rays)


def frustum_edges(view: ShadowView) -> Array:
    """World edges (12, 2, 3) of the volume that a map covers."""
    corners = _CUBE.copy()
    if not view.clip.zero_to_one:
        corners[:, 2] = 2.0 * corners[:, 2] - 1.0
    world = project(np.linalg.inv(view.clip_from_world).astype(np.float64), corners)
    world = world[:, :3] / world[:, 3:]
    return np.asarray([[world[a], world[b]] for a, b in _CUBE_EDGES])


def _draw_entry(canvas: Canvas, frame: Frame, direction: Array, used: Used, color: Color, rays: int) -> None:
    """Disc and arrow where a directional light enters the map's box, or as near to it as the image reaches."""
    if used.views:
        view = used.views[0]
        middle, reach = -view.view_from_world[:3, :3].T @ view.view_from_world[:3, 3], -view.near
    else:
        middle, reach = frame.scene.extent.mean(axis=0), 0.5 * _extent(frame)
    reach = max(reach, 0.25 * _extent(frame))
    places = middle - direction * np.linspace(1.0, 0.0, 65)[:, None] * reach
    seen = canvas.inside(places, 32.0 * canvas.unit)
    if not seen.any():
        return
    source = places[np.argmax(seen)]
    tip = source + direction * min(0.16 * _extent(frame), 0.8 * float(np.linalg.norm(middle - source)) + 1e-3 * reach)
    canvas.lines([[source, tip]], color, 2.5)
    ends, _ = canvas.place([source, tip])
    away = ends[1] - ends[0]
    if np.linalg.norm(away) > 12.0 * canvas.unit:  # not if an end is behind the eye: then it is NaN
        _arrow_head(canvas, ends[1], away / np.linalg.norm(away), color)
    _draw_source(canvas, source, color, rays)


def _draw_source(canvas: Canvas, position: Sequence[float] | Array, color: Color, rays: int) -> None:
    if not canvas.inside(position, -20.0 * canvas.unit):
        return
    place, _ = canvas.place(np.asarray(position, dtype=np.float64))
    radius = (9.0 if rays > 8 else 5.0) * canvas.unit
    if rays:
        angle = 2.0 * np.pi * np.arange(rays) / rays
        spokes = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        canvas.strokes(place + radius * np.stack([1.4 * spokes, 2.1 * spokes], axis=1), color, 2.0)
    canvas.disc(place, radius, color)


# -- shadow maps


def _draw_maps(canvas: Canvas, frame: Frame) -> None:
    # no map is kept for a light whose sample points are drawn one after another
    rows = [number for number, maps in enumerate(frame.shadow_maps) if len(maps)]
    if not rows:
        return
    gap, rim = max(2, round(8 * canvas.unit)), max(1, round(2 * canvas.unit))
    base = min(round(MAP_SIDE * canvas.height), (canvas.height - gap) // len(rows) - gap)
    top = gap
    for number in rows:
        room = round(MAPS_WIDTH * canvas.width) // len(frame.used[number].views) - gap
        side = min(base, room) - 2 * rim
        if side < 1:
            return
        previews = map_previews(frame.shadow_maps[number], frame.used[number], side)
        for column, preview in enumerate(previews):
            framed = np.broadcast_to(np.array(light_color(number)), (side + 2 * rim, side + 2 * rim, 3)).copy()
            framed[rim:-rim, rim:-rim] = preview
            canvas.paste(framed, (canvas.width - (len(previews) - column) * (side + 2 * rim + gap), top))
        top += side + 2 * rim + gap


def map_previews(stored: NDArray[np.float32], used: Used, side: int) -> list[NDArray[np.uint8]]:
    """A light's maps as images (side, side, 3): bright is near the light, one contrast stretch for all views."""
    from PIL import Image

    step = max(1, stored.shape[-1] // (3 * side))  # nine texels per pixel are enough
    distances = [_distance(values[::step, ::step], view, used) for values, view in zip(stored, used.views, strict=True)]
    drawn = np.concatenate([distance[np.isfinite(distance)] for distance in distances])
    low, high = np.percentile(drawn, (1.0, 99.0)) if len(drawn) else (0.0, 1.0)
    span = max(high - low, 1e-12 * abs(high), 1e-300)
    previews = []
    for distance in distances:
        empty = ~np.isfinite(distance)
        bright = np.clip((high - np.where(empty, high, distance)) / span, 0.0, 1.0)
        layers = [
            np.asarray(Image.fromarray(layer.astype(np.float32)).resize((side, side), Image.Resampling.BOX))
            for layer in (bright, empty)
        ]
        grey, gone = (55.0 + 200.0 * layers[0])[..., None], layers[1][..., None]
        previews.append(np.asarray(np.rint(grey * (1.0 - gone) + np.array(EMPTY) * gone), dtype=np.uint8))
    return previews


def _distance(stored: NDArray[np.float32], view: ShadowView, used: Used) -> Array:
    """A value that grows linearly with the distance along the light, infinite where nothing was drawn."""
    value = stored.astype(np.float64)
    if used.target is None or not used.target.is_depth:
        return np.where(value >= 1.0, np.inf, value)
    nothing = value == view.clip.clear_depth
    ndc = value if view.clip.zero_to_one else 2.0 * value - 1.0
    scale, offset = view.clip_from_view[2, 2:]
    if view.projection == "orthographic":
        return np.where(nothing, np.inf, (offset - ndc) / scale)
    return np.where(nothing, np.inf, offset / np.where(nothing, 1.0, ndc + scale))
