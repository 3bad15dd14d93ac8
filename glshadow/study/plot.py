"""Plots speed against error."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from glshadow.shadows.bias import ReceiverPlaneBias
from glshadow.shadows.shadow import Shadow
from glshadow.study.floor import FLOOR_RESOLUTION
from glshadow.study.result import Result, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, FAINT = "#1c1e21", "#8a8f98"
# by kind of bias; distinguishable for colour-blind readers
COLORS = (
    "#0a6cb4",
    "#d1611c",
    "#1f8a5b",
    "#a04a9c",
    "#b58900",
    "#6b7280",
)
MARKERS = ("s", "o", "^", "D", "v")  # by filter
AREAS = (22.0, 44.0, 80.0, 130.0, 190.0)  # points squared, by resolution
LINE_POINTS = 11.0  # between two labels
LETTER_SHARE = 0.01  # share of the axes' width: one letter of a label


def plots(study: Study) -> list[str]:
    """An SVG element per light, with identical bytes every time; empty if matplotlib is not installed."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return []
    return [svg(figure(study, light)) for light in range(len(study.lights))]


def figure(study: Study, light: int) -> Figure:
    """Speed against error of one light."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    results, front = study.of_light(light), study.front(light)
    with mpl.rc_context(_STYLE):
        drawn = Figure(figsize=(10.4, 5.4), layout="constrained")
        axes = drawn.add_subplot()
        positive = [r.error for r in results if r.error > 0.0]
        least = 0.5 * min(positive, default=1e-4)
        height = {r.key: 100.0 * max(r.error, least) for r in results}
        costs = [r.cost for r in front]
        heights = [height[r.key] for r in front]
        axes.step([*costs, 1.04 * max(r.cost for r in results)], [*heights, heights[-1]], where="post",
                  color=INK, linewidth=1.0, alpha=0.55, zorder=1)  # fmt: skip
        _points(axes, results, height, {r.key for r in front})
        _axes(axes, min(positive, default=0.0) if len(positive) < len(results) else None, 100.0 * least)
        _leave_space(axes, max(len(r.name) for r in front))
        _legend(axes, results)
        drawn.draw_without_rendering()  # the labels need the final positions of the points
        _labels(axes, front, height)
    return drawn


def svg(drawn: Figure) -> str:
    """A plot as an SVG element, with identical bytes every time."""
    import matplotlib as mpl

    data = io.StringIO()
    with mpl.rc_context(_STYLE):
        drawn.savefig(data, format="svg", metadata={"Date": None})
    text = data.getvalue()
    return text[text.index("<svg") :]


_STYLE: Any = {
    "font.family": "sans-serif", "font.sans-serif": ["Helvetica Neue", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 10.0, "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": FAINT, "xtick.color": FAINT,
    "ytick.color": FAINT, "xtick.labelcolor": INK, "ytick.labelcolor": INK, "axes.linewidth": 0.8,
    "axes.spines.top": False, "axes.spines.right": False, "svg.fonttype": "path", "svg.hashsalt": "glshadow",
}  # fmt: skip


def _points(axes: Axes, results: tuple[Result, ...], height: dict[str, float], front: set[str]) -> None:
    look, hollows = _Look(results), 0
    for result in results:
        x, y, (low, high) = result.cost, height[result.key], result.cost_spread
        color, marker, area = look.of(result.shadow)
        best = result.key in front
        axes.plot([low, high], [y, y], color=color, linewidth=0.9, alpha=0.25, zorder=2, solid_capstyle="butt")
        hollow = result.shadow.target
        axes.scatter([x], [y], s=area, marker=marker, facecolor="white" if hollow else color, zorder=3.5 if best else 3,
                     edgecolor=INK if best else color if hollow else "white", linewidth=1.4 if best else 0.8)  # fmt: skip
        if hollow:
            hollows += 1
            axes.annotate(hollow.value, (x, y), (0.0, 1.0 + LINE_POINTS * hollows), ha="center",
                          textcoords="offset points", fontsize=7.5, color=FAINT, zorder=4)  # fmt: skip


def _labels(axes: Axes, front: tuple[Result, ...], height: dict[str, float]) -> None:
    """Names below and left of the front's points, at positions without other points or labels."""
    points = 72.0 / axes.figure.dpi
    above = np.inf
    for result in front:
        y = float(axes.transData.transform((result.cost, height[result.key]))[1]) * points
        place = min(y - 5.0, above - LINE_POINTS)
        axes.annotate(result.name, (result.cost, height[result.key]), (-9.0, place - y), textcoords="offset points",
                      fontsize=8.5, color=INK, ha="right", va="center", zorder=4)  # fmt: skip
        above = place


class _Look:
    """Colour, marker and area by bias, filter and resolution, in the order of the results."""

    def __init__(self, results: tuple[Result, ...]) -> None:
        shadows = [result.shadow for result in results]
        self.biases = list(dict.fromkeys(str(shadow.bias or ReceiverPlaneBias()) for shadow in shadows))
        self.filters = list(dict.fromkeys(str(shadow.filter) for shadow in shadows))
        self.resolutions = sorted({shadow.resolved().resolution for shadow in shadows})
        self.formats = any(shadow.target is not None for shadow in shadows)

    def of(self, shadow: Shadow) -> tuple[str, str, float]:
        return (
            COLORS[min(self.biases.index(str(shadow.bias or ReceiverPlaneBias())), len(COLORS) - 1)],
            MARKERS[self.filters.index(str(shadow.filter)) % len(MARKERS)],
            AREAS[min(self.resolutions.index(shadow.resolved().resolution), len(AREAS) - 1)],
        )


def _axes(axes: Axes, zero: float | None, zero_at: float) -> None:
    """Scales and labels; if `zero` is given, the lowest position represents no error at all."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.set_xlabel(f"frame time / floor (Lambert + depth-only pass into {FLOOR_RESOLUTION}²)   faster ←")
    axes.set_ylabel("wrong (or grainy, if more) pixels, %   ↓ better")
    axes.yaxis.set_major_formatter(
        FuncFormatter(lambda y, _: "0" if zero is not None and y <= 1.01 * zero_at else f"{y:g}")
    )
    axes.yaxis.set_minor_formatter(NullFormatter())
    if zero is not None:
        low, high = axes.get_ylim()
        axes.set_yticks([zero_at, *(t for t in axes.get_yticks() if zero_at * 1.5 < t and low <= t <= high)])
        axes.set_ylim(low, high)
    low, high = axes.get_ylim()
    axes.set_ylim(low / (high / low) ** 0.05, high)  # space for the last label
    axes.grid(axis="y", which="major", color="#e8eaed", linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)


def _leave_space(axes: Axes, letters: int) -> None:
    """Leave some at the left, for the first label."""
    low, high = axes.get_xlim()
    axes.set_xlim(low - LETTER_SHARE * letters * (high - low), high + 0.02 * (high - low))


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
    handles.append(Line2D([], [], color=INK, alpha=0.55, linewidth=1.0, label="Pareto front"))
    legend = axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize=9.0,
                         labelspacing=0.55, handletextpad=0.6, borderaxespad=0.0)  # fmt: skip
    for text in legend.get_texts():
        if text.get_text() in ("bias", "filter", "resolution"):
            text.set_fontweight("bold")
            text.set_x(-22.0)
