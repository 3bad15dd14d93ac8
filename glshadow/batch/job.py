"""Job: one line of a batch file, checked before any work begins."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from itertools import count
from pathlib import Path
from typing import Any, TextIO

from glshadow.arguments import DEFAULT_SIZE, pixels
from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.outputs import FLOATS, STORED, checked_outputs
from glshadow.core.sampling import DEFAULT_SAMPLES, IMAGE_SAMPLES
from glshadow.core.setting import (
    Settings,
    as_path,
    flag,
    instance,
    number,
    one_of,
    optional,
    setting,
    several,
    shown,
    text,
    whole,
)
from glshadow.core.spelling import parse
from glshadow.core.strict_json import strict_json
from glshadow.core.tone import EXPOSURE, TONE, Exposure
from glshadow.derive.look import BACKGROUND, look_of
from glshadow.errors import GlshadowError, SceneError, SettingsError
from glshadow.image import FRAME_SUFFIXES
from glshadow.io.imported import name_or_number
from glshadow.lights import LIGHTS, DirectionalLight, Light, as_lights
from glshadow.numbered import MOST_IMAGES, has_field, numbered
from glshadow.shadows.bias import BIASES
from glshadow.shadows.filters import FILTERS
from glshadow.shadows.fits import FITS
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow

CAMERAS = {"perspective": PerspectiveCamera, "orthographic": OrthographicCamera, "intrinsics": IntrinsicsCamera}
BUILTIN = ("courtyard", "outdoors", "street", "landscape:1", "landscape:2", "landscape:3")
OF_FILES = ("camera", "smooth", "time", "animation")
MOST_LINE = 2**20  # characters
MOST_PICTURES = 1_000_000  # in one file of jobs
MOST_SAID = 20  # invalid lines that are reported one by one
EXAMPLE = '{"scene": "courtyard", "output": "a.png", "size": [640, 360], "lights": [{"kind": "sun", "direction": [-1, -2, -1]}]}'


def _scene(name: str, value: Any) -> str:
    return value if isinstance(value, str) and value in BUILTIN else str(as_path(name, value))


def _background(name: str, value: Any) -> Any:
    return look_of(0.0, value, 1).background


def _outputs(name: str, value: Any) -> tuple[str, ...]:
    return checked_outputs(value)


@dataclass(frozen=True)
class Job(Settings):
    """One image, or one scene from several cameras.

    Parameters
    ----------
    scene : str
        Path of a model, or the name of a built-in scene: courtyard, outdoors, street, landscape:1 to 3.
    output : str
        Path of the image, relative to the folder of the batch: .png .jpg .tif .exr. For several images it has one field for the number,
        such as view_{:03d}.png; or .npz.
    cameras : tuple of Camera
        Empty: the scene's own.
    orbit : int
        Number of cameras around the scene's camera, instead of `cameras`.
    lights : tuple of Light, optional
        None: the scene's own.
    shadow : Shadow, optional
        For every light that casts shadows and has no shadow settings of its own.
    outputs : tuple of str, optional
        Outputs that .npz and .exr hold; None: as for `glshadow render`.
    camera, smooth, time, animation : optional
        As for `load`, of a model's file: its camera by name or number, the crease angle in degrees, seconds of its animation.
    size, samples, background, exposure, tone, ground, up_axis
        As for `render` and `load`.

    Raises
    ------
    SettingsError
        If a value is not allowed, if cameras are given beside an orbit or a camera, if a built-in scene is given what only files
        have, if the output leaves the folder, or if the output has a field for one image, or no field for several.
    """

    scene: str = setting(_scene)
    output: str = setting(text())
    cameras: tuple[Camera, ...] = setting(several(instance(Camera), "cameras", MOST_IMAGES), ())
    orbit: int | None = setting(optional(whole(1, MOST_IMAGES), "no orbit"), None)
    lights: tuple[Light, ...] | None = setting(optional(as_lights, "the scene's own"), None)
    shadow: Shadow | None = setting(optional(instance(Shadow)), None)
    size: tuple[int, int] = setting(pixels, DEFAULT_SIZE)
    samples: int = setting(IMAGE_SAMPLES, DEFAULT_SAMPLES)
    background: tuple[float, float, float] | None = setting(_background, BACKGROUND)
    exposure: Exposure = setting(EXPOSURE, "scene")
    tone: str = setting(TONE, "neutral")
    ground: bool = setting(flag(), False)
    up_axis: str | None = setting(optional(one_of("x", "y", "z"), "y"), None)
    outputs: tuple[str, ...] | None = setting(optional(_outputs, "those of the file's format"), None)
    camera: str | int | None = setting(optional(name_or_number("a camera"), "the first"), None)
    smooth: float | None = setting(optional(number(0.0, 180.0, unit="degrees"), "flat"), None)
    time: float | None = setting(optional(number(unit="s"), "the file's pose"), None)
    animation: str | int | None = setting(optional(name_or_number("an animation"), "the first"), None)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.orbit and self.cameras:
            raise SettingsError("Job cameras and orbit cannot be combined")
        if self.cameras and self.camera is not None:
            raise SettingsError("Job cameras and camera cannot be combined")
        if self.animation is not None and self.time is None:
            raise SettingsError("Job animation needs time: without, the file is drawn at rest")
        of_files = {name: getattr(self, name) for name in OF_FILES if getattr(self, name) is not None}
        if of_files and self.scene in BUILTIN:
            raise SettingsError(f"Job {', '.join(of_files)} needs a model's file, got the scene {self.scene!r}")
        if not self._several and has_field(self.output):
            raise SettingsError(
                f"Job output {shown(self.output)} has a field for a number, but there is only one image"
            )
        path = as_path("Job output", self._name(self.pictures - 1))
        if path.suffix.lower() not in FRAME_SUFFIXES:
            raise SettingsError(f"Job output must end in one of {', '.join(FRAME_SUFFIXES)}, got {shown(self.output)}")
        if self.outputs is not None and path.suffix.lower() not in (".npz", ".exr"):
            raise SettingsError(f"Job outputs need an output that ends in .npz or .exr, got {shown(self.output)}")
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
        """Number of images."""
        return self.orbit or max(len(self.cameras), 1)

    @property
    def stored(self) -> tuple[str, ...]:
        """Outputs that the files hold."""
        return self.outputs or {".exr": FLOATS, ".npz": STORED}.get(Path(self.output).suffix.lower(), ("image",))

    def names(self) -> Iterator[str]:
        """Names of the images, relative to the folder of the batch, one at a time."""
        return map(self._name, range(self.pictures))


def read_jobs(path: str | os.PathLike[str]) -> list[Job]:
    """Read the jobs of a file of JSON lines. Empty lines and lines that begin with # are skipped.

    Raises
    ------
    SettingsError
        If the file cannot be read, if lines are not valid jobs (the error's notes list up to twenty of them with their errors), if two
        jobs write the same file, or if all jobs together make more than a million images.
    """
    path = as_path("jobs", path)
    if path.exists() and not path.is_file():
        raise SettingsError(f"{path} is a folder, a device or a pipe; a file of jobs is needed")
    jobs: list[Job] = []
    wrong: list[str] = []
    taken: dict[bytes, int] = {}  # hashes: a million long names would take gigabytes
    try:
        with path.open(encoding="utf-8-sig") as file:
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
        lines = "1 line that is not a job" if len(wrong) == 1 else f"{len(wrong)} lines that are not jobs"
        refusal = SettingsError(f"{path.name} has {lines}")
        for each in wrong[:MOST_SAID]:
            refusal.add_note(each)
        if len(wrong) > MOST_SAID:
            refusal.add_note(f"and {len(wrong) - MOST_SAID} more")
        raise refusal
    if not jobs:
        raise SettingsError(f"{path.name} has no job; it needs one JSON object per line, such as {EXAMPLE}")
    return jobs


def _lines(file: TextIO) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines with content; of an overlong line only the beginning."""
    for place in count(1):
        line = file.readline(MOST_LINE + 1)
        if not line:
            return
        rest = line
        while rest and not rest.endswith("\n"):
            rest = file.readline(MOST_LINE)
        if line.strip() and not line.lstrip().startswith("#"):
            yield place, line


def _take(job: Job, number: int, taken: dict[bytes, int]) -> None:
    """Record the files that a job writes, each with the number of its line."""
    if len(taken) + job.pictures > MOST_PICTURES:
        raise SettingsError(
            f"{len(taken) + job.pictures} images up to this line exceed the limit of a file of jobs ({MOST_PICTURES}); "
            "use several files"
        )
    for name in job.names():
        key = hashlib.blake2b(os.fsencode(name), digest_size=16).digest()
        if taken.setdefault(key, number) != number:
            raise SettingsError(f"output {shown(name)} is already used by line {taken[key]}")


def parse_job(line: str, base: Path) -> Job:
    """Parse one line; paths of models, and of lights' images, are relative to `base`."""
    if len(line) > MOST_LINE:
        raise SettingsError(f"the line is longer than {MOST_LINE} characters")
    try:
        given = strict_json(line)
    except ValueError as error:
        raise SettingsError(f"the line is not JSON: {error}") from None
    if not isinstance(given, dict):
        raise SettingsError(f"the line must be an object, got {shown(given)}")
    known = {item.name for item in fields(Job)}
    if unknown := set(given) - known:
        raise SettingsError(
            f"{', '.join(sorted(map(repr, unknown)))}: unknown; the keys are {', '.join(sorted(known))}"
        )
    for needed in ("scene", "output"):
        if needed not in given:
            raise SettingsError(f"{needed} is missing")
    lights = given.get("lights")
    for light in lights if isinstance(lights, list) else ():
        if isinstance(light, dict) and isinstance(light.get("image"), str):
            light["image"] = str(base / light["image"])
    for name, read in READ.items():
        if name in given and not (given[name] is None and name != "cameras"):
            given[name] = read(name, given[name])
    if isinstance(given["scene"], str) and given["scene"] not in BUILTIN:
        model = base / given["scene"]
        if not model.is_file():
            raise SettingsError(f"scene: file not found: {model}; the built-in scenes are {', '.join(BUILTIN)}")
        given["scene"] = str(model)
    return Job(**given)


def _made(kinds: Mapping[str, Callable[..., Any]], usual: str) -> Callable[[str, Any], Any]:
    """The rule of an object with a kind; its other keys are the settings of that kind."""

    def rule(name: str, value: Any) -> Any:
        if not isinstance(value, dict):
            raise SettingsError(f"{name} must be an object, got {shown(value)}")
        rest = dict(value)
        kind = one_of(*kinds)(f"{name}.kind", rest.pop("kind", usual))
        if "shadow" in rest:
            rest["shadow"] = None if rest["shadow"] is None else _shadow(f"{name}.shadow", rest["shadow"])
        if "cookie" in rest:
            raise SettingsError(f"{name}: cookies are not supported in a batch")
        try:
            return kinds[kind](**rest)
        except (TypeError, SettingsError, SceneError) as error:
            raise SettingsError(f"{name}: {str(error).replace('__init__() ', '')}") from None

    return rule


def _light(name: str, value: Any) -> Light:
    """Check a light."""
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
            f"{name}: {', '.join(sorted(map(repr, unknown)))} unknown; the keys are {', '.join(sorted(known))}"
        )
    return Shadow(**{key: read.get(key, lambda each: each)(each) for key, each in value.items()})


READ: dict[str, Callable[[str, Any], Any]] = {
    "cameras": _each(_made(CAMERAS, "perspective")),
    "lights": _each(_light),
    "shadow": _shadow,
}
"""Rules for values that JSON writes in its own way; all others are as `Job` takes them."""
