"""Job: one line of a batch, checked before any work begins."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from itertools import count
from pathlib import Path
from typing import Any, TextIO

from glshadow.arguments import USUAL_SIZE, pixels
from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.sampling import PICTURE, USUAL
from glshadow.core.setting import (
    Settings,
    as_path,
    flag,
    instance,
    one_of,
    optional,
    setting,
    several,
    shown,
    text,
    whole,
)
from glshadow.core.spelling import parse
from glshadow.derive.look import BACKGROUND, look_of
from glshadow.errors import GlshadowError, SettingsError
from glshadow.image import SUFFIXES
from glshadow.lights import LIGHTS, DirectionalLight, Light, as_lights
from glshadow.numbered import MOST_IMAGES, has_field, numbered
from glshadow.shadows.bias import BIASES
from glshadow.shadows.filters import FILTERS
from glshadow.shadows.fits import FITS
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow

CAMERAS = {"perspective": PerspectiveCamera, "orthographic": OrthographicCamera, "intrinsics": IntrinsicsCamera}
BUILTIN = ("courtyard", "outdoors", "street", "landscape:1", "landscape:2", "landscape:3")
MOST_LINE = 2**20  # characters
MOST_PICTURES = 1_000_000  # of one file of jobs
MOST_SAID = 20  # lines that are no jobs, one by one
EXAMPLE = '{"scene": "courtyard", "output": "a.png", "size": [640, 360], "lights": [{"kind": "sun", "direction": [-1, -2, -1]}]}'


def _scene(name: str, value: Any) -> str:
    return value if isinstance(value, str) and value in BUILTIN else str(as_path(name, value))


def _background(name: str, value: Any) -> Any:
    return look_of(0.0, value, 1).background


@dataclass(frozen=True)
class Job(Settings):
    """One picture, or one scene from several cameras.

    Parameters
    ----------
    scene : str
        Path of a model, or a built-in scene: courtyard, outdoors, street, landscape:1 to 3.
    output : str
        Path of the picture, relative to the folder of the batch: .png .jpg .tif .exr; of several pictures with one field for the
        number, as view_{:03d}.png.
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

    Raises
    ------
    SettingsError
        If one of them is not what it must be, if cameras and orbit are both given, or if the output leaves the folder, or has a field
        and there is one picture, or none and there are several.
    """

    scene: str = setting(_scene)
    output: str = setting(text())
    cameras: tuple[Camera, ...] = setting(several(instance(Camera), "cameras", MOST_IMAGES), ())
    orbit: int | None = setting(optional(whole(1, MOST_IMAGES), "no orbit"), None)
    lights: tuple[Light, ...] | None = setting(optional(as_lights, "the scene's own"), None)
    shadow: Shadow | None = setting(optional(instance(Shadow)), None)
    size: tuple[int, int] = setting(pixels, USUAL_SIZE)
    samples: int = setting(PICTURE, USUAL)
    background: tuple[float, float, float] | None = setting(_background, BACKGROUND)
    ground: bool = setting(flag(), False)
    up_axis: str | None = setting(optional(one_of("x", "y", "z"), "y"), None)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.orbit and self.cameras:
            raise SettingsError("Job cameras and orbit do not go together")
        if not self._several and has_field(self.output):
            raise SettingsError(f"Job output {shown(self.output)} has a field for a number, and there is one picture")
        path = as_path("Job output", self._name(self.pictures - 1))
        if path.suffix.lower() not in SUFFIXES:
            raise SettingsError(f"Job output must end in one of {', '.join(SUFFIXES)}, got {shown(self.output)}")
        if path.is_absolute() or ".." in path.parts:
            raise SettingsError(f"Job output must stay in the batch's folder, got {shown(self.output)}")
        object.__setattr__(self, "output", Path(self.output).as_posix())  # ./a.png is a.png

    @property
    def _several(self) -> bool:
        return self.orbit is not None or len(self.cameras) > 1

    @property
    def _name(self) -> Callable[[int], str]:
        return numbered("Job output", self.output) if self._several else lambda _: self.output

    @property
    def pictures(self) -> int:
        """How many it draws."""
        return self.orbit or max(len(self.cameras), 1)

    def names(self) -> Iterator[str]:
        """Where they go, relative to the folder of the batch, one at a time."""
        return map(self._name, range(self.pictures))


def read_jobs(path: str | os.PathLike[str]) -> list[Job]:
    """The jobs of a file of JSON lines; empty lines and those that begin with # are left out.

    Raises
    ------
    SettingsError
        If the file cannot be read; if one of its lines is no job: the error's notes name the lines, up to twenty of them, and what is
        wrong with each; if two jobs write the same file, or all together more than a million pictures.
    """
    path = as_path("jobs", path)
    if path.exists() and not path.is_file():
        raise SettingsError(f"{path} is a folder, a device or a pipe, where a file of jobs is needed")
    jobs: list[Job] = []
    wrong: list[str] = []
    taken: dict[bytes, int] = {}  # hashes: a million long names are gigabytes
    try:
        with path.open(encoding="utf-8") as file:
            for number, line in _lines(file):
                try:
                    job = parse_job(line, path.parent)
                    _take(job, number, taken)
                    jobs.append(job)
                except GlshadowError as error:
                    wrong.append(f"line {number}: {error}" if len(wrong) < MOST_SAID else "")
    except (OSError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path}: {error}") from None
    if wrong:
        lines = "1 line that is no job" if len(wrong) == 1 else f"{len(wrong)} lines that are no jobs"
        refusal = SettingsError(f"{path.name} has {lines}")
        for each in wrong[:MOST_SAID]:
            refusal.add_note(each)
        if len(wrong) > MOST_SAID:
            refusal.add_note(f"and {len(wrong) - MOST_SAID} more")
        raise refusal
    if not jobs:
        raise SettingsError(f"{path.name} has no job: one JSON object in each line, as {EXAMPLE}")
    return jobs


def _lines(file: TextIO) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines that say something, of one that is too long its beginning."""
    for number in count(1):
        line = file.readline(MOST_LINE + 1)
        if not line:
            return
        rest = line
        while rest and not rest.endswith("\n"):
            rest = file.readline(MOST_LINE)
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def _take(job: Job, number: int, taken: dict[bytes, int]) -> None:
    """Note the files that a job writes, each with the number of its line."""
    if len(taken) + job.pictures > MOST_PICTURES:
        raise SettingsError(
            f"{len(taken) + job.pictures} pictures up to here are more than a file of jobs may ask for ({MOST_PICTURES}); "
            "give several files"
        )
    for name in job.names():
        key = hashlib.blake2b(os.fsencode(name), digest_size=16).digest()
        if taken.setdefault(key, number) != number:
            raise SettingsError(f"output {shown(name)} is also that of line {taken[key]}")


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
    known = {item.name for item in fields(Job)}
    if unknown := set(given) - known:
        raise SettingsError(f"{', '.join(sorted(map(repr, unknown)))}: unknown; there are {', '.join(sorted(known))}")
    for needed in ("scene", "output"):
        if needed not in given:
            raise SettingsError(f"{needed} is missing")
    for name, read in READ.items():
        if name in given and not (given[name] is None and name != "cameras"):
            given[name] = read(name, given[name])
    if isinstance(given["scene"], str) and given["scene"] not in BUILTIN:
        model = base / given["scene"]
        if not model.is_file():
            raise SettingsError(
                f"scene: there is no such file: {model}, and no built-in scene; those are {', '.join(BUILTIN)}"
            )
        given["scene"] = str(model)
    return Job(**given)


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
    def all_of(name: str, value: Any) -> Any:
        if not isinstance(value, list):
            raise SettingsError(f"{name} must be a list, got {shown(value)}")
        return tuple(rule(f"{name}[{number}]", each) for number, each in enumerate(value))

    return all_of


def _shadow(name: str, value: Any) -> Shadow:
    if not isinstance(value, dict):
        raise SettingsError(f"{name} must be an object, got {shown(value)}")
    read: dict[str, Callable[[Any], Any]] = {
        "filter": lambda each: parse(str(each), FILTERS, "filter"),
        "bias": lambda each: parse(str(each), BIASES, "bias"),
        "fit": lambda each: parse(str(each), FITS, "fit"),
        "target": lambda each: next((known for known in Target if known.value == each), each),
    }
    known = {*read, "resolution", "strength", "edge_falloff"}
    if unknown := set(value) - known:
        raise SettingsError(
            f"{name}: {', '.join(sorted(map(repr, unknown)))} unknown; there are {', '.join(sorted(known))}"
        )
    return Shadow(**{key: read.get(key, lambda each: each)(each) for key, each in value.items()})


READ: dict[str, Callable[[str, Any], Any]] = {
    "cameras": _each(_made(CAMERAS, "perspective")),
    "lights": _each(_light),
    "shadow": _shadow,
}
"""What JSON says in its own way; everything else is as `Job` takes it."""
