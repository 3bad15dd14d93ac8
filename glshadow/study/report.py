"""Writes a study as one self-contained HTML page, with its plot as PNG and its numbers as JSON."""

from __future__ import annotations

import json
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_path, instance
from glshadow.errors import GlshadowError, printable, required
from glshadow.files import replacing
from glshadow.inline import PAGE_LEVEL, address, jpeg, png
from glshadow.lights import Light
from glshadow.scoring.flip import flip
from glshadow.shadows.bias import ReceiverPlaneBias
from glshadow.study.cases import read_cases
from glshadow.study.floor import FLOOR_RESOLUTION
from glshadow.study.grid import DEFAULT
from glshadow.study.pictures import Panel, Region
from glshadow.study.plot import figure, svg
from glshadow.study.result import Result, Study
from glshadow.study.run import WARM_UP

PAGE, NUMBERS = "study.html", "study.json"
TEMPLATE = "report.html.jinja"

NONE = "\N{EN DASH}"  # shown in place of a missing number


def require() -> None:
    """Raise an error for missing packages before a study runs for minutes.

    Raises
    ------
    GlshadowError
        If a package is missing; the message names the pip command.
    """
    required("the report of a study", "study", "jinja2", "matplotlib")


def write_report(study: Study, folder: str | PathLike[str]) -> Path:
    """Write study.html, study.json and a plot per light (plot.png, or plot-0.png and so on) into a folder.

    With flip-evaluator installed, the settings that are shown as images also get their mean FLIP.

    Parameters
    ----------
    folder : path
        Created if it does not exist.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    GlshadowError
        If jinja2 or matplotlib is missing, or a file cannot be written.
    SettingsError
        If `study` is not a Study, or `folder` not a path.
    """
    require()
    study, out = instance(Study)("study", study), as_path("folder", folder)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadowError(f"the folder {out} cannot be created: {error.strerror or error}") from error
    flips = _flips(study)
    numbers: dict[str, Any] = study.as_dict()
    for row in numbers["results"]:
        row["flip"] = flips.get(row["key"])
    with replacing(out / NUMBERS) as part:
        part.write_text(json.dumps(numbers, indent=1, allow_nan=False) + "\n")
    plots = []
    for light in range(len(study.lights)):
        drawn = figure(study, light)
        name = "plot.png" if len(study.lights) == 1 else f"plot-{light}.png"
        with replacing(out / name) as part:
            drawn.savefig(part, format="png", dpi=160)
        plots.append(svg(drawn))
    page = out / PAGE
    with replacing(page) as part:
        part.write_text(_page(study, plots, flips), encoding="utf-8")
    return page


def _flips(study: Study) -> dict[str, float]:
    """Mean FLIP of each setting with images, against the same shading with the reference's visibility."""
    if find_spec("flip_evaluator") is None:
        return {}
    return {key: flip(panel.ours, panel.truth).mean for key, panel in study.panels.items()}


def percent(value: float) -> str:
    """A fraction in percent, as text: 0, 0.0535, 1.04, 24.0, with a useful number of digits."""
    if np.isnan(value):
        return NONE
    share = 100.0 * value
    return (
        "0" if share == 0.0 else f"{share:.4f}" if share < 1.0 else f"{share:.2f}" if share < 10.0 else f"{share:.1f}"
    )


def _page(study: Study, plots: list[str], flips: dict[str, float]) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, finalize=lambda value: printable(value) if type(value) is str else value,
    )  # fmt: skip
    environment.filters["percent"] = percent
    fronts = {result.key for light in range(len(study.lights)) for result in study.front(light)}
    return environment.get_template(TEMPLATE).render(
        study=study,
        plots=[Markup(plot) for plot in plots],  # our own SVG
        rows=[_row(result, result.key in fronts) for result in study.results],
        fronts=[_ordered(study, light) for light in range(len(study.lights))],
        lights=[_light(light) for light in study.lights],
        default=next((r for r in study.results if r.shadow == DEFAULT), None),
        flips=flips,
        cases=read_cases(),
        floor_ms=float(np.median([ms for result in study.results for ms in result.floors_ms])),
        floor_resolution=FLOOR_RESOLUTION,
        warm_up=WARM_UP,
    )


def _light(light: Light) -> str:
    """Kind and position or direction of a light, as text."""
    kind = type(light).__name__.removesuffix("Light").lower()
    word, place = ("travelling", light.rays_to(np.zeros(3))) if light.at_infinity else ("at", light.place[:3])
    return f"{kind} light {word} ({', '.join(f'{x:.3g}' for x in place)})"


def _row(result: Result, front: bool) -> dict[str, Any]:
    shadow = result.shadow
    low, high = result.spread_ms
    return {
        "light": result.light, "front": front, "resolution": shadow.resolution, "filter": str(shadow.filter),
        "bias": str(shadow.bias or ReceiverPlaneBias()), "target": result.used["target"] or NONE, "cost": result.cost, "ms": result.ms,
        "low": low, "high": high, "score": result.score, "default": shadow == DEFAULT,
        "fallbacks": "; ".join(result.used["fallbacks"]), "sampled": result.used["sampled"],
    }  # fmt: skip


def _ordered(study: Study, light: int) -> list[dict[str, Any]]:
    """The images of one light: its front, cheapest first, then the default if it is not on the front."""
    front = study.front(light)
    others = [r for r in study.of_light(light) if r.key in study.panels and r not in front]
    return [
        {
            "result": result,
            "front": result in front,
            "default": result.shadow == DEFAULT,
            **_pictures(study.panels[result.key]),
        }
        for result in (*front, *others)
        if result.key in study.panels
    ]


def _pictures(panel: Panel) -> dict[str, Any]:
    height, width = panel.truth.shape[:2]
    three = panel.truth, panel.ours, panel.error
    regions = [
        {
            "wrong": region.wrong,
            "grainy": region.grainy,
            "box": _box(region, width, height),
            "aspect": f"{region.width} / {region.height}",
            "images": [_sharp(region.cut(image)) for image in three],
        }
        for region in panel.regions
    ]
    truth, ours = address(jpeg(panel.truth)), address(jpeg(panel.ours))
    return {"truth": truth, "ours": ours, "error": _sharp(panel.error), "regions": regions}


def _box(region: Region, width: int, height: int) -> str:
    """A region as CSS, in percent of the image."""
    parts = (region.x / width, region.y / height, region.width / width, region.height / height)
    return "left:{:.3%};top:{:.3%};width:{:.3%};height:{:.3%}".format(*parts)


def _sharp(image: NDArray[np.uint8]) -> str:
    """An image as a lossless data URL."""
    return address(png(image, PAGE_LEVEL))
