"""Lines on a finished image: 3-D segments, projected, clipped, antialiased, and fainter behind surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.spaces import Array, transform

if TYPE_CHECKING:
    from glshadow.frame import Frame

Color = tuple[int, int, int]

HIDDEN = 0.22  # share of the opacity behind a surface, chosen by eye
HALO, HALO_WIDTH = 0.45, 2.0  # opacity and extra width, in pixels, of the dark rim that makes a line readable on white
NEAREST = 1e-3  # share of a derived near plane, which tightly bounds the surfaces: lines may be nearer
DEPTH_SLACK = 2e-3  # share of the depth, or of an orthographic camera's range: a line on a surface is in front of it


class Canvas:
    """The image of a frame, to draw on. Pixel coordinates (x, y) count from the top left corner of the image.

    Parameters
    ----------
    frame : Frame
        With `image`; with `depth` if surfaces should hide lines.
    """

    def __init__(self, frame: Frame) -> None:
        self.pixels = frame.image.astype(np.float32)
        self.width, self.height = frame.size
        self.unit = max(0.5, min(self.width, self.height) / 720.0)  # so that lines look alike at every size
        self._view = frame.camera.view_from_world
        self._window = frame.camera.window(frame.size)
        self._is_perspective = frame.camera.is_perspective
        if self._is_perspective:
            self._near, slack = frame.camera.near or NEAREST * frame.near, (1.0 + DEPTH_SLACK, 0.0)
        else:
            self._near, slack = frame.camera.near or 0.0, (1.0, DEPTH_SLACK * (frame.far - frame.near))
        farthest = _farthest_around(frame.depth) if "depth" in frame.outputs else None
        self._surface = None if farthest is None else self._nearness(farthest * slack[0] + slack[1])

    @property
    def image(self) -> NDArray[np.uint8]:
        """The image with what has been drawn, (H, W, 3)."""
        return np.asarray(np.rint(np.clip(self.pixels, 0.0, 255.0)), dtype=np.uint8)

    def place(self, points: ArrayLike) -> tuple[Array, Array]:
        """World points (..., 3) as pixels (..., 2) and view depths (...); pixels are NaN unless in front of the camera."""
        local = transform(self._view, points)
        depth = -local[..., 2]
        ahead = depth > (0.0 if self._is_perspective else self._near)
        place = self._pixels(np.where(ahead[..., None], local[..., :2], np.nan), np.where(ahead, depth, 1.0))
        return place, depth

    def point(self, places: ArrayLike, depth: ArrayLike) -> Array:
        """World points (..., 3) at pixels (..., 2) and view depths (...): the inverse of `place`."""
        place = np.asarray(places, dtype=np.float64)
        left, right, bottom, top = self._window
        x = left + place[..., 0] / self.width * (right - left)
        y = top - place[..., 1] / self.height * (top - bottom)
        along = np.broadcast_to(np.asarray(depth, dtype=np.float64), x.shape)
        scale = along if self._is_perspective else np.ones_like(x)
        local = np.stack([x * scale, y * scale, -along], axis=-1)
        return np.asarray((local - self._view[:3, 3]) @ self._view[:3, :3])

    def inside(self, points: ArrayLike, margin: float = 0.0) -> NDArray[np.bool_]:
        """Whether world points (..., 3) are in the image, `margin` pixels from its edges."""
        place, _ = self.place(points)
        limit = np.array([self.width, self.height]) - margin
        return np.asarray(((place >= margin) & (place <= limit)).all(axis=-1))  # NaN compares false

    def lines(
        self, segments: ArrayLike, color: Color, width: float = 1.5, opacity: float = 1.0, halo: bool = True
    ) -> None:
        """Draw world segments (S, 2, 3), `width` in pixels of an image 720 high."""
        local = transform(self._view, np.asarray(segments, dtype=np.float64).reshape(-1, 2, 3))
        local = _clipped_near(local, self._near)
        depth = -local[..., 2]
        place = self._pixels(local[..., :2], depth)
        segments = np.concatenate([place, self._nearness(depth)[..., None]], axis=-1)
        self._draw(segments, color, width, opacity, halo)

    def strokes(
        self, segments: ArrayLike, color: Color, width: float = 1.5, opacity: float = 1.0, halo: bool = True
    ) -> None:
        """Draw pixel segments (S, 2, 2) in front of everything."""
        flat = np.asarray(segments, dtype=np.float64).reshape(-1, 2, 2)
        infinite = np.full((len(flat), 2, 1), np.inf)
        self._draw(np.concatenate([flat, infinite], axis=-1), color, width, opacity, halo)

    def disc(self, centre: ArrayLike, radius: float, color: Color, opacity: float = 1.0) -> None:
        """Fill a circle given in pixels, with a dark rim."""
        rim = radius + 0.5 * HALO_WIDTH * self.unit
        middle = np.asarray(centre, dtype=np.float64)
        low = np.maximum(np.floor(middle - rim - 1.0), 0).astype(int)
        high = np.minimum(np.ceil(middle + rim + 1.0), [self.width, self.height]).astype(int)
        if (low >= high).any():
            return
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]] + 0.5
        distance = np.hypot(x - middle[0], y - middle[1])
        patch = self.pixels[low[1] : high[1], low[0] : high[0]]
        for reach, tint, strength in ((rim, (0, 0, 0), HALO * opacity), (radius, color, opacity)):
            _blend(patch, np.clip(reach + 0.5 - distance, 0.0, 1.0) * strength, tint)

    def paste(self, picture: ArrayLike, corner: tuple[int, int]) -> None:
        """Put a small image (h, w, 3) with its top left corner at pixel (x, y). It must fit."""
        small = np.asarray(picture, dtype=np.float32)
        self.pixels[corner[1] : corner[1] + small.shape[0], corner[0] : corner[0] + small.shape[1]] = small

    def _pixels(self, across: Array, depth: Array) -> Array:
        """Pixels (..., 2) of points at view x, y (..., 2) and a depth (...)."""
        left, right, bottom, top = self._window
        place = across / depth[..., None] if self._is_perspective else across
        x = (place[..., 0] - left) / (right - left) * self.width
        y = (top - place[..., 1]) / (top - bottom) * self.height
        return np.stack([x, y], axis=-1)

    def _nearness(self, depth: Array) -> Array:
        """A value that decreases with view depth (...) and is linear along a projected line."""
        return np.asarray(1.0 / depth if self._is_perspective else -depth)

    def _draw(self, segments: Array, color: Color, width: float, opacity: float, halo: bool) -> None:
        """Draw segments (S, 2, 3) of pixel x, y and nearness."""
        segments = _clipped(segments, self.width, self.height, margin=width * self.unit + HALO_WIDTH + 1.0)
        width = max(1.0, width * self.unit)
        if halo:
            _blend(self.pixels, HALO * opacity * self._coverage(segments, width + HALO_WIDTH * self.unit), (0, 0, 0))
        _blend(self.pixels, opacity * self._coverage(segments, width), color)

    def _coverage(self, segments: Array, width: float) -> NDArray[np.float32]:
        """Coverage (H, W) of the pixels by lines in 0..1, lower where they are hidden."""
        cover = np.zeros((self.height, self.width), dtype=np.float32)
        for start, end in segments:
            x, y, nearness, amount = _rasterised(start, end, width)
            kept = (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height) & (amount > 0.0)
            x, y, nearness, amount = x[kept], y[kept], nearness[kept], amount[kept]
            if self._surface is not None:
                amount = np.where(nearness < self._surface[y, x], HIDDEN * amount, amount)
            np.maximum.at(cover, (y, x), amount.astype(np.float32))
        return cover


def _rasterised(start: Array, end: Array, width: float) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
    """Pixels x and y of one segment with nearness and coverage: a row across the line at each step along it."""
    steep = abs(end[1] - start[1]) > abs(end[0] - start[0])
    a, b = (start[[1, 0, 2]], end[[1, 0, 2]]) if steep else (start, end)
    if a[0] > b[0]:
        a, b = b, a
    run = max(b[0] - a[0], 1e-9)
    slope = (b[1] - a[1]) / run
    lean = 1.0 / np.hypot(1.0, slope)  # distance from the line per pixel across
    reach = int(np.ceil((0.5 * width + 0.5) / lean)) + 1
    along = np.arange(np.floor(a[0]), np.floor(b[0]) + 1.0)
    t = np.clip((along + 0.5 - a[0]) / run, 0.0, 1.0)
    centre = a[1] + t * run * slope
    across = np.floor(centre)[:, None] + np.arange(-reach, reach + 1)
    amount = np.clip(0.5 * width + 0.5 - np.abs(across + 0.5 - centre[:, None]) * lean, 0.0, 1.0)
    nearness = np.full(len(t), np.inf) if np.isinf(a[2]) else a[2] + t * (b[2] - a[2])
    major = np.broadcast_to(along[:, None], across.shape).ravel().astype(np.int64)
    minor = across.ravel().astype(np.int64)
    x, y = (minor, major) if steep else (major, minor)
    return x, y, np.broadcast_to(nearness[:, None], across.shape).ravel(), amount.ravel()


def _clipped_near(segments: Array, near: float) -> Array:
    """View-space segments (S, 2, 3), clipped to the near plane."""
    depth = -segments[..., 2]
    segments, depth = segments[(depth >= near).any(axis=1)], depth[(depth >= near).any(axis=1)]
    span = depth[:, ::-1] - depth
    t = np.where(depth < near, (near - depth) / np.where(span == 0.0, 1.0, span), 0.0)
    moved = segments + t[..., None] * (segments[:, ::-1] - segments)
    moved[..., 2] = np.minimum(moved[..., 2], -near)
    return np.asarray(moved)


def _clipped(segments: Array, width: int, height: int, margin: float) -> Array:
    """Segments (S, 2, 3), clipped to the image and `margin` around it (Liang, Barsky 1984)."""
    start, step = segments[:, 0], segments[:, 1] - np.where(np.isinf(segments[:, 1]), 0.0, segments[:, 0])
    step = np.where(np.isinf(step), 0.0, step)
    first, last = np.zeros(len(segments)), np.ones(len(segments))
    outside = np.zeros(len(segments), dtype=bool)
    for axis, limit in ((0, width), (1, height)):
        for sign, edge in ((1.0, -margin), (-1.0, limit + margin)):
            distance, rate = sign * (start[:, axis] - edge), sign * step[:, axis]
            outside |= (rate == 0.0) & (distance < 0.0)
            crossing = -distance / np.where(rate == 0.0, 1.0, rate)
            first = np.where(rate > 0.0, np.maximum(first, crossing), first)
            last = np.where(rate < 0.0, np.minimum(last, crossing), last)
    kept = (first <= last) & ~outside
    start, step, ends = start[kept], step[kept], np.stack([first, last], axis=1)[kept]
    return np.asarray(start[:, None] + ends[..., None] * step[:, None])


def _farthest_around(depth: NDArray[np.float32]) -> NDArray[np.float64]:
    """Largest depth of each pixel's 3 x 3 neighbourhood, so that a surface at a grazing angle does not hide lines on it."""
    padded = np.pad(depth.astype(np.float64), 1, mode="edge")
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))


def _blend(pixels: NDArray[np.float32], amount: ArrayLike, color: Color) -> None:
    weight = np.asarray(amount, dtype=np.float32)
    touched = weight > 0.0
    part = weight[touched][:, None]
    pixels[touched] = pixels[touched] * (1.0 - part) + np.asarray(color, dtype=np.float32) * part
