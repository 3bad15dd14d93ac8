"""Hard cases: pictures with their exact answer, which techniques must pass or fail them, and why."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array, ClipSpace
from glshadow.lights import Light
from glshadow.scene.nodes import Scene
from glshadow.scenes.analytic import AnalyticScene
from glshadow.shadows.bias import ClipBias, ConstantBias, NoBias, NormalOffsetBias, SlopeScaledBias
from glshadow.shadows.filters import (
    FILTERS,
    BabylonEsm,
    EdgePcf,
    Esm,
    Evsm,
    Exact,
    Filter,
    Hard,
    Msm,
    Pcf,
    Poisson,
    Vsm,
)
from glshadow.shadows.fits import SceneFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, Shadow

SIZE = (192, 192)

ClosedForm = Callable[[Array, Array], Array]  # world points (N, 3), normals facing the viewer (N, 3) -> visibility (N,)


@dataclass(frozen=True, eq=False)
class Picture:
    """One light on one scene, seen by one camera, and its closed form if there is one.

    Parameters
    ----------
    lit, dark : bool
        Whether the reference has lit and dark pixels among those that face the light: then the test demands them.
    length : float
        Size of the caster, world units: biases in world units are relative to it.
    closed_form_share : float
        Share of pixels at which mesh and closed form may differ: facets of a sphere, steps of a search.
    """

    name: str
    scene: Scene
    light: Light
    camera: PerspectiveCamera
    exact: ClosedForm | None = None
    resolution: int = 1024
    size: tuple[int, int] = SIZE
    lit: bool = True
    dark: bool = True
    length: float = 2.0
    closed_form_share: float = 0.0


class Verdict(Enum):
    """The expected result of a technique in a case."""

    PASS = "pass"
    FAILS = "fails as predicted"
    FINDING = "fails, to be mended"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True)
class Expected:
    """A verdict with its reason; `size`: the predicted extent of the failure, in words."""

    verdict: Verdict
    why: str = ""


@dataclass(frozen=True)
class Technique:
    """A shadow technique: settings that depend on the picture only through its resolution and its length."""

    name: str
    filter: Filter = field(default_factory=Pcf)
    target: Target | None = None
    clip: ClipSpace | None = None
    scene_fit: bool = False
    faces: Faces | None = None
    bias: str = "receiver plane"  # or constant, slope, normal offset, clip, none

    def shadow(self, picture: Picture) -> Shadow:
        bias = {
            "receiver plane": None,
            "constant": ConstantBias(CONSTANT * picture.length),
            "slope": SlopeScaledBias(1.1, 4.0),
            "normal offset": NormalOffsetBias(1.5),
            "clip": ClipBias(CLIP_BIAS),
            "none": NoBias(),
        }[self.bias]
        settings = Shadow(resolution=picture.resolution, filter=self.filter, target=self.target, clip=self.clip, bias=bias,
                          faces=self.faces)  # fmt: skip
        return replace(settings, fit=SceneFit()) if self.scene_fit else settings


CONSTANT = 0.025  # of the picture's length: the 5 cm of N9 for its wall of 2 m
CLIP_BIAS = 0.01

DEFAULT, HARD = Technique("default"), Technique("hard", filter=Hard())
EXACT = Technique("exact", filter=Exact())
THOROUGH = (DEFAULT, HARD, EXACT)  # draw every picture of a case, the others the first ones
SCATTERED = (Technique("poisson 1", filter=Poisson()), Technique("edgepcf 4", filter=EdgePcf()))
MOMENTS = tuple(
    Technique(name, filter=each)
    for name, each in {
        "esm": Esm(), "babylonesm close": BabylonEsm(close=True), "vsm": Vsm(), "evsm": Evsm(), "msm": Msm(),
    }.items()
)  # fmt: skip
CLAIMING = (
    *THOROUGH,
    *(
        Technique(str(each).replace(":", " "), filter=each)
        for kind in FILTERS
        for each in kind.extremes()
        if each not in (Hard(), Exact())
    ),
    *SCATTERED,
    *MOMENTS,
    Technique("-1..1", clip=ClipSpace(False, False)),
    Technique("-1..1 reversed", clip=ClipSpace(False, True)),
    Technique("scene fit", scene_fit=True),
    Technique("both faces", faces=Faces.BOTH),
    Technique("r32f", target=Target.R32F),
    Technique("rgba8", target=Target.RGBA8),
    Technique("depth24", target=Target.DEPTH24),
)
COARSE = (
    Technique("depth16", target=Target.DEPTH16),
    Technique("r16f", target=Target.R16F),
    Technique("r8", target=Target.R8),
)
CLASSIC = tuple(
    Technique(name, filter=Hard(), bias=name) for name in ("constant", "slope", "normal offset", "clip", "none")
)
TECHNIQUES = {technique.name: technique for technique in (*CLAIMING, *COARSE, *CLASSIC)}


@dataclass(frozen=True)
class Known:
    """An unexpected failure of a technique that claims the case: to be fixed.

    Parameters
    ----------
    pictures : tuple of str
        Names of the pictures that fail.
    techniques : tuple of str
    why : str
    creases_only : bool
        All mismatches lie next to a lit surface that rises above the receiver's own plane.
    """

    pictures: tuple[str, ...]
    techniques: tuple[str, ...]
    why: str
    creases_only: bool = False


CREASES = (
    "lit neighbours that rise above the receiver's extended plane count as occluders: a darker seam along concave edges "
    "and beside faces that graze the light"
)


def crease(*pictures: str, techniques: tuple[str, ...] = ("default",)) -> Known:
    """The seam that percentage-closer filtering draws along concave edges and beside grazing faces."""
    return Known(pictures, techniques, CREASES, creases_only=True)


LEAKS: Mapping[str, Mapping[int, int]] = {
    "esm": {1: 559, 3: 1, 7: 16320, 8: 1494, 9: 12864, 10: 46, 11: 1630, 15: 1673, 16: 74, 35: 35},
    "babylonesm close": {1: 911, 7: 16320, 8: 1494, 9: 17664, 10: 122, 11: 1630, 15: 2607, 16: 305, 35: 45},
    "vsm": {1: 295, 2: 8, 3: 44, 7: 16320, 8: 1494, 9: 17472, 10: 55, 11: 1630, 15: 1125, 35: 33},
    "evsm": {1: 82, 8: 1481, 9: 2688, 35: 30},
    "msm": {1: 620, 2: 1, 7: 16320, 8: 1494, 9: 17472, 10: 153, 11: 1630, 14: 14, 15: 1179, 16: 74, 35: 33, 40: 1},
}
"""Technique -> case -> pixels of its first picture that a moment map lights too much. It bounds visibility from above: none is too dark."""

AS_DEFAULT = {each.name: "left to default, hard and exact" for each in CLAIMING if each not in THOROUGH}
NO_CLAIM = "claims no zero; N1, N5, N6, N7, N8, N9 and N11 show what it costs"


@dataclass(frozen=True, eq=False)
class Case:
    """One row of the table.

    Parameters
    ----------
    answer : str
        The exact answer, in words.
    build : callable
        Its pictures; the first ones, `probes` of them, are drawn with every technique, the others with the default, the
        nearest texel and the exact filter.
    fails : mapping from technique name to why
        The techniques that must fail every probe, by as many pixels as predicted within a factor of 2.
    passes : tuple of str
        Techniques that claim nothing, but must pass the probes.
    skips : mapping from technique name to why
        Not applicable. Coarse formats and biases with a knob are not applicable unless listed above.
    findings : tuple of Known
        What fails although it should not.
    elsewhere : str
        What of the case is tested elsewhere.
    """

    number: int
    title: str
    answer: str
    build: Callable[[], list[Picture]]
    fails: Mapping[str, str] = field(default_factory=dict)
    passes: tuple[str, ...] = ()
    skips: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Known, ...] = ()
    probes: int = 1
    elsewhere: str = ""

    def expected(self, technique: str) -> Expected:
        if technique in self.fails:
            return Expected(Verdict.FAILS, self.fails[technique])
        if technique in self.skips:
            return Expected(Verdict.NOT_APPLICABLE, self.skips[technique])
        if self.number in LEAKS.get(technique, {}):
            return Expected(Verdict.FAILS, TECHNIQUES[technique].filter.fails)
        claims = technique in self.passes or technique in {each.name for each in CLAIMING}
        if not claims:
            return Expected(Verdict.NOT_APPLICABLE, NO_CLAIM)
        known = [f"{', '.join(each.pictures)}: {each.why}" for each in self.findings if technique in each.techniques]
        return Expected(Verdict.FINDING if known else Verdict.PASS, "; ".join(known))

    def known(self, technique: str, pictures: list[str]) -> dict[str, Known]:
        """Listed failures of a technique among some pictures."""
        return {
            name: each
            for each in self.findings
            if technique in each.techniques
            for name in each.pictures
            if name in pictures
        }


def picture_of(
    name: str,
    built: AnalyticScene,
    light: Light | None = None,
    camera: PerspectiveCamera | None = None,
    **options: object,
) -> Picture:
    """An analytic scene as a picture; another light or camera replaces its own."""
    scene = built.scene if light is None else replace(built.scene, lights=(light,))
    exact = AnalyticScene(scene, built.blocked).exact
    return Picture(name, scene, scene.lights[0], camera or scene.camera, exact, **options)  # type: ignore[arg-type]


def overhead(
    x: tuple[float, float], z: tuple[float, float], height: float, size: tuple[int, int] = SIZE
) -> PerspectiveCamera:
    """Camera straight above a rectangle of the plane y = 0, which fills a picture of that size; x right, z down."""
    width, depth = x[1] - x[0], z[1] - z[0]
    middle = (0.5 * (x[0] + x[1]), 0.5 * (z[0] + z[1]))
    fov_y = float(2.0 * np.degrees(np.arctan(0.5 * depth / height)))
    return PerspectiveCamera(
        (middle[0], height, middle[1]), (middle[0], 0.0, middle[1]), (0.0, 0.0, -1.0), fov_y,
        pixel_aspect=width / depth * size[1] / size[0],
    )  # fmt: skip


def sun_direction(elevation: float, azimuth: float = 0.0) -> tuple[float, float, float]:
    """The direction in which a directional light travels; azimuth rotates it about y from -x."""
    e, a = np.radians(elevation), np.radians(azimuth)
    level = 0.0 if elevation == 90.0 else float(np.cos(e))
    return (-level * float(np.cos(a)), -float(np.sin(e)), level * float(np.sin(a)))
