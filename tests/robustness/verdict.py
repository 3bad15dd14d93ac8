"""Result of one frame: ok, rendered with a warning, refused with a named error, or FAIL; and the invariants of a frame."""

from __future__ import annotations

import re
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import glshadow as gs

OK, WARNED, REFUSED, FAIL = "ok", "warned", "named error", "FAIL"
OUTPUTS = ("image", "visibility", "linear", "depth")


# A warning that announces an empty image; one about a missing texture does not.
BLANK = re.compile(r"nothing|nowhere|already lost|smaller than one texel")


@dataclass(frozen=True)
class Verdict:
    """One of the four kinds; cases of the same kind are grouped by `cause`; `detail` has the full text."""

    kind: str
    cause: str = ""
    detail: str = ""


class Wrong(AssertionError):
    """A frame violates an invariant."""


def judged(work: Callable[[], None]) -> Verdict:
    """Run `work` and classify its result. Anything but a GlshadowError or a GlshadowWarning is a failure."""
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="warn", under="ignore"):
        warnings.simplefilter("always")
        try:
            work()
            error: BaseException | None = None
        except Exception as raised:
            error = raised
    foreign = [w for w in caught if not issubclass(w.category, gs.GlshadowWarning)]
    if isinstance(error, Wrong):
        cause, _, rest = str(error).partition(": ")
        said = [w for w in caught if BLANK.search(str(w.message))]
        if cause == "blank without a warning" and said:
            return Verdict(WARNED, f"blank, {_first(said)}")
        return Verdict(FAIL, cause, rest)
    if error is not None and not isinstance(error, gs.GlshadowError):
        story = "".join(traceback.format_exception(error))
        return Verdict(FAIL, f"{type(error).__name__} at {_place(error)}: {str(error)[:90]}", story)
    if foreign:
        name = Path(foreign[0].filename)
        return Verdict(FAIL, f"{foreign[0].category.__name__} at {name.name}:{foreign[0].lineno}: {foreign[0].message}")
    if error is not None:
        return Verdict(REFUSED, _shape(f"{type(error).__name__}: {error}"), str(error))
    return Verdict(WARNED, _first(caught)) if caught else Verdict(OK)


def _first(caught: Sequence[warnings.WarningMessage]) -> str:
    return _shape(next(str(w.message) for w in caught if issubclass(w.category, gs.GlshadowWarning)))


def _place(error: BaseException) -> str:
    """Innermost line of the package, otherwise of any code."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "/glshadow/" in frame.filename] or list(frames)
    return f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"


def _shape(message: str) -> str:
    """A message without its names and numbers, so that equal causes are grouped."""
    words = ["#" if any(c.isdigit() for c in word) else word for word in message.split() if ".glb" not in word]
    return " ".join(words)[:100]


def small_maps(lights: Sequence[Any], resolution: int = 128) -> tuple[Any, ...]:
    """The lights with small shadow maps."""
    return tuple(
        light if light.shadow is None else replace(light, shadow=replace(light.shadow, resolution=resolution))
        for light in lights
    )


def checked_case(renderer: gs.Renderer, case: Any) -> gs.Frame:
    """`checked_render` of a case of random_settings."""
    options = {"ambient": case.ambient, "background": case.background}
    return checked_render(renderer, case.scene, case.camera, case.lights, case.size, **options)


def checked_render(
    renderer: gs.Renderer, scene: gs.Scene, camera: Any, lights: Any, size: tuple[int, int], **options: Any
) -> gs.Frame:
    """Render twice; raises Wrong unless both are equal, finite, in range, of the right shape, and show a surface."""
    frame = renderer.render(scene, camera, lights, size, outputs=OUTPUTS, **{"samples": 1, **options})
    _check(frame)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gs.GlshadowWarning)
        again = renderer.render(scene, camera, lights, size, outputs=OUTPUTS, **{"samples": 1, **options})
    for name in OUTPUTS:
        differing = _differing(getattr(frame, name), getattr(again, name), name)
        if differing:
            raise Wrong(f"two pictures differ in {name}: {differing} values")
    transparent = any(node.blends for node in scene.nodes)  # depth is that of opaque surfaces
    if not np.isfinite(frame.depth).any() and not (transparent and (frame.image != frame.image[0, 0]).any()):
        raise Wrong(f"blank without a warning: near {frame.near}, far {frame.far}, camera {frame.camera}")
    return frame


def _differing(first: NDArray[Any], second: NDArray[Any], name: str) -> int:
    """How many values differ by more than float32's subnormal numbers, below 1.2e-38.

    llvmpipe's threads may or may not flush these to zero (Mesa 22.3); a light then multiplies the difference by its
    strength, which reaches 1e18.
    """
    if first.dtype.kind != "f":
        return int((first != second).sum())
    least = float(np.finfo(np.float32).tiny) * (1e18 if name == "linear" else 1.0)
    return int((~np.isclose(first, second, rtol=0.0, atol=least, equal_nan=True)).sum())


def _check(frame: gs.Frame) -> None:
    width, height = frame.size
    kinds: dict[str, tuple[tuple[int, ...], Any]] = {
        "image": ((height, width, 3), np.uint8),
        "visibility": ((len(frame.lights), height, width), np.float32),
        "linear": ((height, width, 3), np.float32),
        "depth": ((height, width), np.float32),
    }
    for name, (shape, dtype) in kinds.items():
        value: NDArray[Any] = getattr(frame, name)
        if value.shape != shape or value.dtype != dtype:
            raise Wrong(f"{name} of the wrong form: {value.shape} {value.dtype}")
    surface = np.isfinite(frame.depth)
    if not (surface | np.isposinf(frame.depth)).all() or (frame.depth[surface] <= 0.0).any():
        raise Wrong("depth neither positive nor +inf: " + _sample(frame.depth, ~(frame.depth > 0.0)))
    if not np.isfinite(frame.linear).all():
        raise Wrong("linear not finite: " + _sample(frame.linear, ~np.isfinite(frame.linear)))
    for i, plane in enumerate(frame.visibility):
        unknown = np.isnan(plane)
        if (unknown & surface).any():
            raise Wrong(f"visibility NaN on a surface: {int((unknown & surface).sum())} pixels of {frame.lights[i]}")
        if (~unknown & ~surface).any():
            raise Wrong(
                f"visibility where there is no surface: {int((~unknown & ~surface).sum())} pixels of {frame.lights[i]}"
            )
        seen = plane[surface]
        if seen.size and not (seen.min() >= 0.0 and seen.max() <= 1.0):
            raise Wrong(f"visibility beyond 0 to 1: {seen.min()} to {seen.max()} of {frame.lights[i]}")


def _sample(values: NDArray[Any], bad: NDArray[np.bool_]) -> str:
    return f"{int(bad.sum())} values, first {values[bad].ravel()[:3].tolist()}"
