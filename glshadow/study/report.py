"""A study as one HTML page that needs nothing else, with its plot as PNG and its numbers as JSON."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.shadow import Shadow
from glshadow.errors import GlshadowError
from glshadow.study.grid import bias_name, filter_name
from glshadow.study.pictures import Panel, Region
from glshadow.study.result import Result, Study
from glshadow.study.sweep import FLOOR_RESOLUTION, WARM_UP

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Cases = Mapping[str, Mapping[str, "float | str | None"]]

PAGE, NUMBERS = "study.html", "study.json"
TEMPLATE = "report.html.jinja"

INK, FAINT = "#1c1e21", "#8a8f98"
COLORS = (
    "#0a6cb4",
    "#d1611c",
    "#1f8a5b",
    "#a04a9c",
    "#b58900",
    "#6b7280",
)  # by kind of bias; told apart by the colour-blind
MARKERS = ("s", "o", "^", "D", "v")  # by filter
AREAS = (22.0, 44.0, 80.0, 130.0, 190.0)  # points squared, by resolution
LINE_POINTS = 11.0  # between two labels
JPEG_QUALITY = 88
NONE = "\N{EN DASH}"  # in place of a number


def require() -> None:
    """Raise what is missing before a study has taken its minutes.

    Raises
    ------
    GlshadowError
        Names the pip command.
    """
    try:
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401  # type: ignore[unused-ignore]
    except ImportError as error:
        raise GlshadowError(f"the report of a study needs {error.name}: pip install 'glshadow[study]'") from error


def write_report(study: Study, folder: str | PathLike[str], cases: Cases | None = None) -> Path:
    """Write study.html, study.json and a plot per light (plot.png, or plot-0.png and so on) into a folder.

    Parameters
    ----------
    folder : path
        Made if it is not there.
    cases : mapping, optional
        A table case -> technique -> wrong, as a fraction (or a word, or None for "not measured"), shown below.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    GlshadowError
        If jinja2 or matplotlib is missing.
    """
    require()
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    numbers: dict[str, Any] = study.as_dict()
    if cases is not None:
        numbers["cases"] = {case: dict(row) for case, row in cases.items()}
    (out / NUMBERS).write_text(json.dumps(numbers, indent=1, allow_nan=False) + "\n")
    plots = []
    for light in range(len(study.lights)):
        figure = _figure(study, light)
        name = "plot.png" if len(study.lights) == 1 else f"plot-{light}.png"
        figure.savefig(out / name, format="png", dpi=160)
        plots.append(_svg(figure))
    page = out / PAGE
    page.write_text(_page(study, plots, cases), encoding="utf-8")
    return page


def percent(value: float) -> str:
    """A fraction for reading: 0, 0.0535, 1.04, 24.0 (percent), with as many digits as say something."""
    if np.isnan(value):
        return NONE
    share = 100.0 * value
    return (
        "0" if share == 0.0 else f"{share:.4f}" if share < 1.0 else f"{share:.2f}" if share < 10.0 else f"{share:.1f}"
    )


# -- plot


def _figure(study: Study, light: int) -> Figure:
    """Speed against error of one light."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    results, front = study.of_light(light), study.front(light)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(10.4, 5.4), layout="constrained")
        axes = figure.add_subplot()
        positive = [r.score.wrong for r in results if r.score.wrong > 0.0]
        least = 0.5 * min(positive, default=1e-4)
        height = {r.key: 100.0 * max(r.score.wrong, least) for r in results}
        costs = [r.cost for r in front]
        heights = [height[r.key] for r in front]
        axes.step([*costs, 1.04 * max(r.cost for r in results)], [*heights, heights[-1]], where="post",
                  color=INK, linewidth=1.0, alpha=0.55, zorder=1)  # fmt: skip
        _points(axes, results, height, {r.key for r in front})
        _axes(axes, min(positive, default=0.0) if len(positive) < len(results) else None, 100.0 * least)
        _legend(axes, results)
        figure.draw_without_rendering()  # the labels need to know where the points have come to lie
        _labels(axes, front, height)
    return figure


_STYLE: Any = {
    "font.family": "sans-serif", "font.sans-serif": ["Helvetica Neue", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 10.0, "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": FAINT, "xtick.color": FAINT,
    "ytick.color": FAINT, "xtick.labelcolor": INK, "ytick.labelcolor": INK, "axes.linewidth": 0.8,
    "axes.spines.top": False, "axes.spines.right": False, "svg.fonttype": "path", "svg.hashsalt": "glshadow",
}  # fmt: skip


def _points(axes: Axes, results: tuple[Result, ...], height: dict[str, float], front: set[str]) -> None:
    look = _Look(results)
    for result in results:
        x, y, (low, high) = result.cost, height[result.key], result.cost_spread
        color, marker, area = look.of(result.shadow)
        best = result.key in front
        axes.plot([low, high], [y, y], color=color, linewidth=0.9, alpha=0.25, zorder=2, solid_capstyle="butt")
        hollow = result.shadow.target is not None
        axes.scatter([x], [y], s=area, marker=marker, facecolor="white" if hollow else color, zorder=3,
                     edgecolor=INK if best else color if hollow else "white", linewidth=1.4 if best else 0.8)  # fmt: skip


def _labels(axes: Axes, front: tuple[Result, ...], height: dict[str, float]) -> None:
    """Names below and left of the front's points, where no other point can be; apart from each other."""
    points = 72.0 / axes.figure.dpi
    above = np.inf
    for result in front:
        y = float(axes.transData.transform((result.cost, height[result.key]))[1]) * points
        place = min(y - 5.0, above - LINE_POINTS)
        axes.annotate(result.name, (result.cost, height[result.key]), (-9.0, place - y), textcoords="offset points",
                      fontsize=8.5, color=INK, ha="right", va="center", zorder=4)  # fmt: skip
        above = place


class _Look:
    """Colour, marker and area by bias, filter and resolution, in the order in which the results have them."""

    def __init__(self, results: tuple[Result, ...]) -> None:
        shadows = [result.shadow for result in results]
        self.biases = list(dict.fromkeys(bias_name(shadow.bias) for shadow in shadows))
        self.filters = list(dict.fromkeys(filter_name(shadow.filter) for shadow in shadows))
        self.resolutions = sorted({shadow.resolution for shadow in shadows})
        self.formats = any(shadow.target is not None for shadow in shadows)

    def of(self, shadow: Shadow) -> tuple[str, str, float]:
        return (
            COLORS[min(self.biases.index(bias_name(shadow.bias)), len(COLORS) - 1)],
            MARKERS[self.filters.index(filter_name(shadow.filter)) % len(MARKERS)],
            AREAS[min(self.resolutions.index(shadow.resolution), len(AREAS) - 1)],
        )


def _axes(axes: Axes, zero: float | None, zero_at: float) -> None:
    """Scales and labels; `zero` not None: the lowest place stands for no error at all."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.set_xlabel(f"frame time / floor (Lambert + depth-only pass into {FLOOR_RESOLUTION}²)   faster ←")
    axes.set_ylabel("wrong pixels, % of those counted   ↓ better")
    axes.yaxis.set_major_formatter(
        FuncFormatter(lambda y, _: "0" if zero is not None and y <= 1.01 * zero_at else f"{y:g}")
    )
    axes.yaxis.set_minor_formatter(NullFormatter())
    if zero is not None:
        low, high = axes.get_ylim()
        axes.set_yticks([zero_at, *(t for t in axes.get_yticks() if zero_at * 1.5 < t and low <= t <= high)])
        axes.set_ylim(low, high)
    axes.grid(axis="y", which="major", color="#e8eaed", linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)
    low, high = axes.get_xlim()
    axes.set_xlim(low - 0.14 * (high - low), high + 0.02 * (high - low))  # room for the first label


def _legend(axes: Axes, results: tuple[Result, ...]) -> None:
    from matplotlib.lines import Line2D

    look = _Look(results)

    def key(label: str, marker: str, color: str, area: float, hollow: bool = False) -> Line2D:
        return Line2D([], [], linestyle="none", marker=marker, markersize=area**0.5, label=label,
                      markerfacecolor="white" if hollow else color, markeredgecolor=color if hollow else "white")  # fmt: skip

    def title(text: str) -> Line2D:
        return Line2D([], [], linestyle="none", label=text)

    handles = [title("bias"), *(key(n, "o", COLORS[min(i, len(COLORS) - 1)], 44.0) for i, n in enumerate(look.biases))]
    handles += [title("filter"), *(key(n, MARKERS[i % len(MARKERS)], FAINT, 44.0) for i, n in enumerate(look.filters))]
    handles += [title("resolution"), *(key(str(n), "o", FAINT, AREAS[min(i, len(AREAS) - 1)])
                                       for i, n in enumerate(look.resolutions))]  # fmt: skip
    if look.formats:
        handles.append(key("another format", "o", FAINT, 44.0, hollow=True))
    handles.append(Line2D([], [], color=INK, alpha=0.55, linewidth=1.0, label="not beaten"))
    legend = axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize=9.0,
                         labelspacing=0.55, handletextpad=0.6, borderaxespad=0.0)  # fmt: skip
    for text in legend.get_texts():
        if text.get_text() in ("bias", "filter", "resolution"):
            text.set_fontweight("bold")
            text.set_x(-22.0)


def _svg(figure: Figure) -> str:
    """The plot as an SVG element, the same bytes every time."""
    import matplotlib as mpl

    data = io.StringIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(data, format="svg", metadata={"Date": None})
    text = data.getvalue()
    return text[text.index("<svg") :]


# -- page


def _page(study: Study, plots: list[str], cases: Cases | None) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["percent"] = percent
    fronts = {result.key for light in range(len(study.lights)) for result in study.front(light)}
    return environment.get_template(TEMPLATE).render(
        study=study,
        plots=[Markup(plot) for plot in plots],  # our own SVG
        rows=[_row(result, result.key in fronts) for result in study.results],
        fronts=[_ordered(study, light) for light in range(len(study.lights))],
        lights=[_light(light) for light in study.lights],
        default=next((r for r in study.results if r.shadow == Shadow()), None),
        cases=cases,
        techniques=list(dict.fromkeys(name for row in (cases or {}).values() for name in row)),
        floor_ms=float(np.median([ms for result in study.results for ms in result.floors_ms])),
        floor_resolution=FLOOR_RESOLUTION,
        warm_up=WARM_UP,
    )


def _light(light: Any) -> str:
    """Kind and where it is, in words."""
    kind = type(light).__name__.removesuffix("Light").lower()
    place = getattr(light, "position", None) or light.direction
    word = "at" if hasattr(light, "position") else "travelling"
    return f"{kind} light {word} ({', '.join(f'{x:.3g}' for x in place)})"


def _row(result: Result, front: bool) -> dict[str, Any]:
    shadow = result.shadow
    low, high = result.spread_ms
    return {
        "light": result.light, "front": front, "resolution": shadow.resolution, "filter": filter_name(shadow.filter),
        "bias": bias_name(shadow.bias), "target": result.used["target"] or NONE, "cost": result.cost, "ms": result.ms,
        "low": low, "high": high, "score": result.score, "default": shadow == Shadow(),
        "fallbacks": "; ".join(result.used["fallbacks"]), "sampled": result.used["sampled"],
    }  # fmt: skip


def _ordered(study: Study, light: int) -> list[dict[str, Any]]:
    """The pictures of one light: its front, cheapest first, then the default if it is not on it."""
    front = study.front(light)
    others = [r for r in study.of_light(light) if r.key in study.panels and r not in front]
    return [
        {
            "result": result,
            "front": result in front,
            "default": result.shadow == Shadow(),
            **_pictures(study.panels[result.key]),
        }
        for result in (*front, *others)
        if result.key in study.panels
    ]


def _pictures(panel: Panel) -> dict[str, Any]:
    height, width = panel.truth.shape[:2]
    return {
        "truth": _uri(panel.truth, "jpeg"),
        "ours": _uri(panel.ours, "jpeg"),
        "error": _uri(panel.error, "png"),
        "regions": [
            {"wrong": region.wrong, "box": _box(region, width, height), "aspect": f"{region.width} / {region.height}",
             "images": [_uri(region.cut(image), "png") for image in (panel.truth, panel.ours, panel.error)]}
            for region in panel.regions
        ],
    }  # fmt: skip


def _box(region: Region, width: int, height: int) -> str:
    """A region as CSS, in percent of the picture."""
    parts = (region.x / width, region.y / height, region.width / width, region.height / height)
    return "left:{:.3%};top:{:.3%};width:{:.3%};height:{:.3%}".format(*parts)


def _uri(image: NDArray[np.uint8], form: str) -> str:
    from PIL import Image

    data = io.BytesIO()
    picture = Image.fromarray(np.ascontiguousarray(image))
    if form == "jpeg":
        picture.save(data, format="jpeg", quality=JPEG_QUALITY, subsampling=0)
    else:
        picture.save(data, format="png", optimize=True)
    return f"data:image/{form};base64,{base64.b64encode(data.getvalue()).decode()}"
