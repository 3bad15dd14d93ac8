"""glTF animations: channels read and checked, and their values at a time (glTF 2.0, 3.11 and appendix C), in float64."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.accessor import read_floats
from glshadow.io.gltf.document import Document, as_object, extensions
from glshadow.io.limits import OverLimit

STEP, LINEAR, CUBIC = "STEP", "LINEAR", "CUBICSPLINE"
KINDS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
"""What a channel may animate, and the type of its values."""
_NOTED = 4  # kinds of unusable channels that are named one by one
POINTER = re.compile(r"/nodes/(0|[1-9][0-9]{0,8})/(translation|rotation|scale|weights)")
"""What is followed of KHR_animation_pointer: the properties that channels animate without it."""


@dataclass(frozen=True, eq=False)
class Track:
    """One property of a node over time.

    Parameters
    ----------
    node : int
        Of the file.
    path : {"translation", "rotation", "scale", "weights"}
    times : (K,) float64
        Seconds, none less than the one before.
    values : (K, n) or (K, 3, n) float64
        One row per time; of a cubic spline three: the tangent before it, the value, the tangent after it.
    interpolation : {"STEP", "LINEAR", "CUBICSPLINE"}
    """

    node: int
    path: str
    times: Array
    values: Array
    interpolation: str

    def at(self, seconds: float) -> Array:
        """The value (n,) at a time; before the first and after the last key that of the key."""
        first = int(np.searchsorted(self.times, seconds, side="right")) - 1
        if first < 0 or first == len(self.times) - 1 or self.interpolation == STEP:
            return self._key(max(first, 0))
        # the key times differ: the second is later than `seconds`
        span = float(self.times[first + 1] - self.times[first])
        share = float(seconds - self.times[first]) / span
        if self.interpolation == CUBIC:
            return _spline(self.values[first], self.values[first + 1], span, share)
        a, b = self.values[first], self.values[first + 1]
        return slerp(a, b, share) if self.path == "rotation" else np.asarray((1.0 - share) * a + share * b)

    def _key(self, index: int) -> Array:
        return np.asarray(self.values[index, 1] if self.interpolation == CUBIC else self.values[index])


def slerp(a: Array, b: Array, share: float) -> Array:
    """The rotation at a share of the shorter way from quaternion a to b, (4,) each, of any length but zero."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    if a @ b < 0.0:  # -b is the same rotation
        b = -b
    # exact also for small angles, where the arc cosine of a . b is not
    angle = 2.0 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b))
    sine = np.sin(angle)
    if sine == 0.0:
        return np.asarray(a)
    return np.asarray((np.sin((1.0 - share) * angle) * a + np.sin(share * angle) * b) / sine)


def _spline(before: Array, after: Array, span: float, share: float) -> Array:
    """The cubic Hermite spline between two keys (3, n), `span` seconds apart."""
    t, t2, t3 = share, share * share, share * share * share
    return np.asarray(
        (2.0 * t3 - 3.0 * t2 + 1.0) * before[1]
        + span * (t3 - 2.0 * t2 + t) * before[2]
        + (-2.0 * t3 + 3.0 * t2) * after[1]
        + span * (t3 - t2) * after[0]
    )


@dataclass(frozen=True, eq=False)
class Animation:
    """The tracks of one animation, and its length in seconds."""

    tracks: tuple[Track, ...]
    duration: float


@dataclass
class _Reader:
    """Reads the animations of one document; `left_out` counts channels by what is wrong with them."""

    document: Document
    left_out: Counter[str] = field(default_factory=Counter)
    stored: dict[tuple[int, str], Array] = field(default_factory=dict)

    def animation(self, given: dict[str, Any], where: str) -> Animation:
        """An animation; without tracks if none of its channels can be used."""
        channels, samplers = given.get("channels", []), given.get("samplers", [])
        if not isinstance(channels, list) or not isinstance(samplers, list):
            self.left_out[f"{where}: its channels and samplers must be arrays"] += 1
            return Animation((), 0.0)
        tracks = []
        for each in channels:
            self.document.budget.check_time(where)
            try:
                track = self._track(as_object(each, f"{where}: a channel"), samplers, where)
            except OverLimit:  # the file is refused, not only a channel left out
                raise
            except SceneError as error:
                self.left_out[str(error)] += 1
            else:
                tracks.append(track)
        return Animation(tuple(tracks), max([0.0, *(float(each.times[-1]) for each in tracks)]))

    def _track(self, channel: dict[str, Any], samplers: list[Any], where: str) -> Track:
        number, path = _target(as_object(channel.get("target"), f"{where}: a target"), where)
        node = self.document.item("nodes", number, where)
        if path != "weights" and "matrix" in node:
            raise SceneError(f"{where}: nodes[{number}] has a matrix, which no channel can animate")
        index = channel.get("sampler")
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(samplers):
            raise SceneError(f"{where}: it has no sampler {index!r}")
        sampler = as_object(samplers[index], f"{where}: a sampler")
        interpolation = sampler.get("interpolation", LINEAR)
        if interpolation not in (STEP, LINEAR, CUBIC):
            raise SceneError(f"{where}: the interpolation {str(interpolation)[:40]!r} is unknown")
        times = self._floats(sampler.get("input"), "SCALAR", f"{where}.input")[:, 0]
        values = self._floats(sampler.get("output"), KINDS[path], f"{where}.output", path in ("rotation", "weights"))
        if not np.isfinite(times).all() or (np.diff(times) < 0.0).any():
            raise SceneError(f"{where}: key times that are not finite, or not in ascending order")
        rows = 3 if interpolation == CUBIC else 1
        columns, rest = divmod(values.size, len(times) * rows)
        if rest or (path != "weights" and columns != values.shape[1]):
            raise SceneError(f"{where}: {len(values)} values for {len(times)} key times")
        shape = (len(times), 3, columns) if rows == 3 else (len(times), columns)
        values = values.reshape(shape)
        keys = values[:, 1] if rows == 3 else values
        if not np.isfinite(values).all() or (path == "rotation" and not keys.any(axis=1).all()):
            raise SceneError(f"{where}: values that are not finite, or rotations of length zero")
        return Track(number, path, times, values, interpolation)

    def _floats(self, index: Any, kind: str, where: str, normalized: bool = False) -> Array:
        """Values of an accessor, read once; `normalized`: integers map to -1..1 or 0..1 even if the file does not say so."""
        accessor = self.document.item("accessors", index, where)
        if (index, kind) not in self.stored:
            if normalized:
                accessor["normalized"] = True
            self.stored[index, kind] = read_floats(self.document, index, (kind,), where)
        return self.stored[index, kind]


def _target(target: dict[str, Any], where: str) -> tuple[Any, str]:
    """Node and property of a channel."""
    number, path = target.get("node"), target.get("path")
    if path == "pointer":
        pointer = as_object(extensions(target).get("KHR_animation_pointer", {}), where).get("pointer")
        match = POINTER.fullmatch(pointer) if isinstance(pointer, str) else None
        if match is None:
            raise SceneError(f"{where}: KHR_animation_pointer to {str(pointer)[:60]!r}, which stays as it is")
        number, path = int(match[1]), match[2]
    if not isinstance(path, str) or path not in KINDS:
        raise SceneError(f"{where}: it animates {str(path)[:40]!r}, which is unknown")
    if number is None:
        raise SceneError(f"{where}: no node is named")
    return number, path


def read_animations(document: Document) -> dict[str, Animation]:
    """The animations of a file that have usable channels, by unique name, in order. Channels that cannot be used are noted.

    Raises
    ------
    SceneError
        If their keys exceed the limits.
    """
    given = document.items("animations")
    if not given:
        return {}
    reader = _Reader(document)
    document.budget.limits.check("nodes", len(given), "its animations")
    found: dict[str, Animation] = {}
    for number, each in enumerate(given):
        if not isinstance(each, dict):
            reader.left_out[f"animations[{number}] is not an object"] += 1
            continue
        name = str(each.get("name") or f"animation{number}")
        name = f"{name}.{number}" if name in found else name
        made = reader.animation(each, f"animation {name!r}")
        if made.tracks:
            found[name] = made
    document.notes += [
        f"{times} animation channel(s) left out: {what}" for what, times in list(reader.left_out.items())[:_NOTED]
    ]
    if len(reader.left_out) > _NOTED:
        document.notes.append(f"{len(reader.left_out) - _NOTED} other kinds of animation channels left out")
    return found
