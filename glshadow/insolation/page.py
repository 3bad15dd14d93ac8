"""Writes hours of sun as one HTML page with images of the model, tables, and a CSV file beside it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_path, instance, refuse
from glshadow.core.spaces import Array
from glshadow.errors import printable, required
from glshadow.files import replacing
from glshadow.inline import PAGE_LEVEL, address, png
from glshadow.insolation.result import MONTHS, SunHours
from glshadow.insolation.views import colored_scene, images
from glshadow.renderer import Renderer
from glshadow.scene.faces import face_starts

TEMPLATE = "page.html.jinja"
SIZE = (640, 480)
COLORS = "inferno"
MOST_NODES = 200  # lines of the table of nodes
DASH = "\N{EN DASH}"


def require() -> None:
    """Raise an error for missing packages before hours are computed for minutes.

    Raises
    ------
    GlshadowError
        If a package is missing; the message names the pip command.
    """
    required("the page of hours", "sun,study", "jinja2", "matplotlib")


def page_path(name: str, value: Any) -> Path:
    """Rule of the page's path: it ends in .html."""
    path = as_path(name, value)
    if path.suffix.lower() not in (".html", ".htm"):
        raise refuse(name, "a file that ends in .html", str(path))
    return path


def write_page(found: SunHours, path: str | os.PathLike[str], renderer: Renderer | None = None) -> tuple[Path, Path]:
    """Write a page that needs no server or network, and a .csv file of the same name.

    Parameters
    ----------
    found : SunHours
        Of faces or vertices.
    path : path
        Ends in .html.
    renderer : Renderer, optional
        Draws the images; None: a temporary one.

    Returns
    -------
    (Path, Path)
        The page and the table.

    Raises
    ------
    SettingsError
        For a result at points, or another ending.
    GlshadowError
        If jinja2 or matplotlib is missing, or a file cannot be written.
    """
    require()
    found, path = instance(SunHours)("found", found), page_path("path", path)
    drawn = pictures_of(found, SIZE, renderer)
    table = found.save(path.with_suffix(".csv"))
    with replacing(path) as part:
        part.write_text(_page(found, table.name, drawn, _colors(), found.top), encoding="utf-8")
    return path, table


def pictures_of(
    found: SunHours, size: tuple[int, int], renderer: Renderer | None = None
) -> dict[str, NDArray[np.uint8]]:
    """See `SunHours.images`."""
    require()
    scene = colored_scene(found, found.hours, _colors(), found.top)
    if renderer is not None:
        return images(scene, size, renderer)
    with Renderer() as own:
        return images(scene, size, own)


def _colors() -> Array:
    from matplotlib import colormaps

    return np.asarray(colormaps[COLORS](np.linspace(0.0, 1.0, 64))[:, :3], dtype=np.float64)


def _page(found: SunHours, table: str, drawn: dict[str, Any], colors: Array, top: float) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, finalize=lambda value: printable(value) if type(value) is str else value,
    )  # fmt: skip
    stops = ", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255.0 * each)) for each in colors[::3])
    return environment.get_template(TEMPLATE).render(
        found=found,
        path=found.path,
        table=table,
        images={name: address(png(image, PAGE_LEVEL)) for name, image in drawn.items()},
        gradient=f"linear-gradient(to right, {stops})",
        ticks=[f"{top * share:.4g}" for share in (0.0, 0.25, 0.5, 0.75, 1.0)],
        months=[name.capitalize() for name in MONTHS],
        rows=_rows(found),
        by_month=_months(found),
        nodes=_nodes(found),
        most_nodes=MOST_NODES,
    )


def _rows(found: SunHours) -> list[list[dict[str, str]]]:
    """Cells of the table of shaded shares: text and colour."""
    rows = []
    for shares, possible in zip(found.shaded, found.table_possible, strict=True):
        cells = []
        for share, hours in zip(shares, possible, strict=True):
            known = hours > 0.0 and np.isfinite(share)
            share = max(float(share), 0.0) if known else 0.0
            grey = round(255.0 - 190.0 * share)
            style = (
                f"background: rgb({grey} {grey} {grey}); color: {'#fff' if grey < 140 else '#1c1e21'}" if known else ""
            )
            cells.append({"text": f"{100.0 * share:.0f}" if known else "", "style": style})
        rows.append(cells)
    return rows


def _months(found: SunHours) -> list[dict[str, str]]:
    """Mean and possible hours and shaded share of each month."""
    shaded = found.shaded_by_month
    return [
        {
            "hours": f"{hours:.1f}",
            "possible": f"{possible:.1f}",
            "shaded": f"{100.0 * max(share, 0.0):.1f}" if possible > 0.0 else DASH,
        }
        for hours, possible, share in zip(
            found.table_hours.sum(axis=1), found.table_possible.sum(axis=1), shaded, strict=True
        )
    ]


def _nodes(found: SunHours) -> list[dict[str, str]]:
    """Area, and least, mean and greatest hours of each node; empty for vertices."""
    if found.faces is None:
        return []
    starts = face_starts(found.scene)
    rows = []
    for number, node in enumerate(found.scene.nodes):
        mine = (found.faces >= starts[number]) & (found.faces < starts[number + 1])
        area = float(found.areas[mine].sum())
        if not mine.any() or area == 0.0:
            continue
        mean = [float(each[mine] @ found.areas[mine]) / area for each in (found.hours, found.possible)]
        row = {
            "name": node.name, "faces": f"{int(mine.sum()):,}", "area": f"{area:.4g}", "least": f"{found.hours[mine].min():.0f}",
            "mean": f"{mean[0]:.0f}", "most": f"{found.hours[mine].max():.0f}", "possible": f"{mean[1]:.0f}",
        }  # fmt: skip
        for name in ("direct", "diffuse"):
            values = getattr(found, name)
            row[name] = "" if values is None else f"{float(values[mine] @ found.areas[mine]) / area:.0f}"
        rows.append(row)
    return rows
