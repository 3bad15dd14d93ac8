"""Job: one line of a batch, checked before any work begins."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from glshadow.core.bias import BIASES
from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.filters import FILTERS
from glshadow.core.fits import FITS
from glshadow.core.look import BACKGROUND, look_of
from glshadow.core.metric import Target
from glshadow.core.setting import as_path, flag, one_of, optional, shown, text, whole
from glshadow.core.shadow import Shadow
from glshadow.core.spelling import parse
from glshadow.errors import GlshadowError, SettingsError
from glshadow.lights import LIGHTS, DirectionalLight, Light
from glshadow.scene.arguments import pixels

CAMERAS = {"perspective": PerspectiveCamera, "orthographic": OrthographicCamera, "intrinsics": IntrinsicsCamera}
BUILTIN = ("courtyard", "outdoors", "street", "landscape:1", "landscape:2", "landscape:3")
ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr")
MOST_LINE = 2**20  # characters


@dataclass(frozen=True)
class Job:
    """One picture, or one scene from several cameras.

    Parameters
    ----------
    scene : str
        Path of a model, or a built-in scene: courtyard, outdoors, street, landscape:1 to 3.
    output : str
        Path of the picture, relative to the folder of the batch: .png .jpg .tif .exr; of several cameras with a field for the number,
        as view_{:03d}.png.
    cameras : tuple of Camera
        Empty: the scene's own.
    orbit : int
        So many cameras round the scene's, instead.
    lights : tuple of Light, optional
        None: the scene's own.
    shadow : Shadow, optional
        Of every light that casts and says nothing of its own.
    size, samples, background, ground, up_axis
        As in `render` and `load`.
    """

    scene: str
    output: str
    cameras: tuple[Camera, ...] = ()
    orbit: int | None = None
    lights: tuple[Light, ...] | None = None
    shadow: Shadow | None = None
    size: tuple[int, int] = (1280, 720)
    samples: int = 4
    background: tuple[float, float, float] | None = BACKGROUND
    ground: bool = False
    up_axis: str | None = None
    key: str = ""

    @property
    def pictures(self) -> int:
        """How many it draws."""
        return self.orbit or max(len(self.cameras), 1)

    def outputs(self, folder: Path) -> list[Path]:
        """Where they go."""
        several = self.orbit is not None or len(self.cameras) > 1
        names = [self.output.format(number) for number in range(self.pictures)] if several else [self.output]
        return [folder / name for name in names]


def read_jobs(path: str | os.PathLike[str]) -> list[Job]:
    """The jobs of a file of JSON lines; empty lines and those that begin with # are left out.

    Raises
    ------
    SettingsError
        If the file cannot be read or one of its lines is no job: names the lines, up to twenty of them, and what is wrong with each; if two
        jobs write the same file.
    """
    path = as_path("jobs", path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path}: {error}") from None
    jobs: list[Job] = []
    wrong: list[str] = []
    taken: dict[Path, int] = {}
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            job = parse_job(line, path.parent)
            for output in job.outputs(Path()):
                if output in taken:
                    raise SettingsError(f"output {str(output)!r} is also that of line {taken[output]}")
                taken[output] = number
        except GlshadowError as error:
            wrong.append(f"line {number}: {error}")
            continue
        jobs.append(job)
    if wrong:
        more = f"\n  and {len(wrong) - 20} more" if len(wrong) > 20 else ""
        raise SettingsError(
            f"{path.name} has {len(wrong)} lines that are no jobs:\n  " + "\n  ".join(wrong[:20]) + more
        )
    if not jobs:
        raise SettingsError(f"{path.name} has no job: one JSON object in each line, as {EXAMPLE}")
    return jobs


EXAMPLE = '{"scene": "courtyard", "output": "a.png", "size": [640, 360], "lights": [{"kind": "sun", "direction": [-1, -2, -1]}]}'


def parse_job(line: str, base: Path) -> Job:
    """One line; paths of models are relative to `base`."""
    if len(line) > MOST_LINE:
        raise SettingsError(f"it is longer than {MOST_LINE} characters")
    try:
        given = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise SettingsError(f"it is no JSON: {error}") from None
    if not isinstance(given, dict):
        raise SettingsError(f"it must be an object, got {shown(given)}")
    known = {item.name for item in fields(Job)} - {"key"}
    if unknown := set(given) - known:
        raise SettingsError(f"{', '.join(sorted(map(repr, unknown)))}: unknown; there are {', '.join(sorted(known))}")
    for needed in ("scene", "output"):
        if needed not in given:
            raise SettingsError(f"{needed} is missing")
    kept: dict[str, Any] = {name: RULES[name](name, value) for name, value in given.items()}
    if kept["scene"] not in BUILTIN:
        model = base / kept["scene"]
        if not model.is_file():
            raise SettingsError(
                f"scene: there is no such file: {model}, and no built-in scene; those are {', '.join(BUILTIN)}"
            )
        kept["scene"] = str(model)
    if kept.get("orbit") and kept.get("cameras"):
        raise SettingsError("cameras and orbit do not go together")
    several = kept.get("orbit") is not None or len(kept.get("cameras", ())) > 1
    _check_field(kept["output"], several)
    look_of(0.0, kept.get("background", BACKGROUND), kept.get("samples", 4))
    stamp = json.dumps(given, sort_keys=True)
    if kept["scene"] not in BUILTIN:  # another file of the same name is another job
        facts = Path(kept["scene"]).stat()
        stamp += f" {facts.st_size} {facts.st_mtime_ns}"
    return Job(**kept, key=hashlib.sha256(stamp.encode()).hexdigest()[:24])


def _check_field(output: str, several: bool) -> None:
    try:
        first, second = output.format(0), output.format(1)
    except (ValueError, IndexError, KeyError) as error:
        raise SettingsError(f"output {output!r} has a field that is no number's: {error}") from None
    if several and first == second:
        raise SettingsError(f"output {output!r} needs a field for the picture's number, as view_{{:03d}}.png")
    if not several and first != output:
        raise SettingsError(f"output {output!r} has a field for a number, and there is one picture")
    path = Path(first)
    if path.suffix.lower() not in ENDINGS:
        raise SettingsError(f"output must end in one of {', '.join(ENDINGS)}, got {output!r}")
    if path.is_absolute() or ".." in path.parts:
        raise SettingsError(f"output must stay in the batch's folder, got {output!r}")


def _made(kinds: Mapping[str, Callable[..., Any]], usual: str) -> Callable[[str, Any], Any]:
    """The rule of an object with a kind; its other keys are the settings of that."""

    def rule(name: str, value: Any) -> Any:
        if not isinstance(value, dict):
            raise SettingsError(f"{name} must be an object, got {shown(value)}")
        rest = dict(value)
        kind = one_of(*kinds)(f"{name}.kind", rest.pop("kind", usual))
        if "shadow" in rest:
            rest["shadow"] = None if rest["shadow"] is None else _shadow(f"{name}.shadow", rest["shadow"])
        if "cookie" in rest:
            raise SettingsError(f"{name}: cookies are not part of a batch")
        try:
            return kinds[kind](**rest)
        except (TypeError, SettingsError) as error:
            raise SettingsError(f"{name}: {str(error).replace('__init__() ', '')}") from None

    return rule


def _light(name: str, value: Any) -> Light:
    """The rule of a light."""
    made: Light = _made({kind.spelling: kind for kind in LIGHTS}, DirectionalLight.spelling)(name, value)
    return made


def _each(rule: Callable[[str, Any], Any]) -> Callable[[str, Any], Any]:
    def several(name: str, value: Any) -> Any:
        if not isinstance(value, list):
            raise SettingsError(f"{name} must be a list, got {shown(value)}")
        return tuple(rule(f"{name}[{number}]", each) for number, each in enumerate(value))

    return several


def _shadow(name: str, value: Any) -> Shadow:
    if not isinstance(value, dict):
        raise SettingsError(f"{name} must be an object, got {shown(value)}")
    read: dict[str, Callable[[Any], Any]] = {
        "filter": lambda each: parse(str(each), FILTERS, "filter"),
        "bias": lambda each: parse(str(each), BIASES, "bias"),
        "fit": lambda each: parse(str(each), FITS, "fit"),
        "target": lambda each: Target(each) if each in {t.value for t in Target} else each,
    }
    known = {*read, "resolution", "strength", "edge_falloff"}
    if unknown := set(value) - known:
        raise SettingsError(
            f"{name}: {', '.join(sorted(map(repr, unknown)))} unknown; there are {', '.join(sorted(known))}"
        )
    return Shadow(**{key: read.get(key, lambda each: each)(each) for key, each in value.items()})


def _color(name: str, value: Any) -> Any:
    return None if value is None else tuple(value) if isinstance(value, list) else value


RULES: dict[str, Callable[[str, Any], Any]] = {
    "scene": text(),
    "output": text(),
    "cameras": _each(_made(CAMERAS, "perspective")),
    "orbit": optional(whole(1, 100_000), "no orbit"),
    "lights": optional(_each(_light), "the scene's own"),
    "shadow": optional(_shadow, "derived"),
    "size": lambda name, value: pixels(name, tuple(value) if isinstance(value, list) else value),
    "samples": one_of(1, 4, 8, 16),
    "background": _color,
    "ground": flag(),
    "up_axis": optional(one_of("x", "y", "z"), "y"),
}
