"""glshadow sun: hours of direct sun on a model, as an HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

from glshadow.cli.bar import Bar
from glshadow.cli.options import common, driver_options
from glshadow.cli.running import Work
from glshadow.cli.sections import Command, option
from glshadow.core.spelling import number, numbers, vector
from glshadow.errors import SettingsError, required

EXAMPLES = """
\b
Examples:
  glshadow sun house.glb --place 48.1,11.6 --year 2026 --zone Europe/Berlin -o hours.html
  glshadow sun house.glb --place 48.1,11.6 --from 2026-12-21T00:00+01:00 --until 2026-12-22T00:00+01:00 --step 5 -o winter.html
  glshadow sun house.glb --place 48.1,11.6 --year 2026 --zone Europe/Berlin --weather tmy.csv -o kwh.html
  glshadow sun house.glb ... -o hours.html    the same command goes on after an interruption

\b
Which way is north? -z by default, with y up, as glTF exporters of z-up programs place their +y. Otherwise --north 1,0,0: then the
model's +x points north. The sun of a place below the equator passes in the north: --place -33.9,151.2.
"""


def place(text: str) -> tuple[float, float]:
    """LATITUDE,LONGITUDE in degrees."""
    latitude, longitude = numbers(text, 2)
    if not (-90.0 <= latitude <= 90.0 and -180.0 <= longitude <= 180.0):
        raise SettingsError(
            f"{text!r} is not LATITUDE,LONGITUDE: degrees from -90 to 90, north positive, and from -180 to 180, east positive"
        )
    return latitude, longitude


@click.command(cls=Command, epilog=EXAMPLES)
@click.argument("model", type=click.Path())
@option(
    "Place and time",
    "--place",
    metavar="LAT,LON",
    read=place,
    required=True,
    help="Degrees, north and east positive: 48.1,11.6.",
)
@option(
    "Place and time", "--altitude", metavar="M", read=number, default="0", help="Metres above sea level. Default: 0."
)
@option("Place and time", "--year", metavar="Y", type=int, help="A whole year of the zone, such as 2026.")
@option(
    "Place and time",
    "--zone",
    metavar="NAME",
    help="Time zone of the year, and of months and hours: Europe/Berlin, America/Denver, UTC.",
)
@option(
    "Place and time",
    "--from",
    "start",
    metavar="TIME",
    help="Instead of a year: its beginning, with an offset from UTC: 2026-03-20T00:00+01:00.",
)
@option("Place and time", "--until", "end", metavar="TIME", help="Its end.")
@option("Place and time", "--step", metavar="MINUTES", read=number, default="60", help="Between two suns. Default: 60.")
@option(
    "Model",
    "--up-axis",
    type=click.Choice(["x", "y", "z"]),
    help="Up axis of the file. Default: y; STL and PLY files often use z.",
)
@option(
    "Model",
    "--north",
    metavar="X,Y,Z",
    read=vector,
    default="0,0,-1",
    help="Direction of north in the model, after --up-axis has turned it to y up. Default: 0,0,-1.",
)
@option("Model", "--ground", is_flag=True, help="Put a plane under the model.")
@option(
    "Hours",
    "--to",
    type=click.Choice(["faces", "vertices"]),
    default="faces",
    show_default=True,
    help="What gets a number and a colour.",
)
@option(
    "Hours",
    "--per-face",
    metavar="N",
    type=click.IntRange(1, 4096),
    default=2,
    show_default=True,
    help="Sample points of a face, or of each of its parts.",
)
@option(
    "Hours",
    "--cell",
    metavar="W",
    read=number,
    help="Divide faces until no edge is longer than this, in the model's units; 0: do not. Default with --to faces: 1/64 of the model's "
    "size.",
)
@option(
    "Hours",
    "--within",
    metavar="DEGREES",
    read=number,
    default="0.5",
    help="Suns at most this far apart share a shadow. Default: 0.5: two minutes for each border of a shadow that passes a point.",
)
@option(
    "Hours",
    "--weather",
    metavar="FILE.csv",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Irradiance: first column times with offsets from UTC, columns dni and dhi in W/m². Adds kWh/m².",
)
@option(
    "Hours",
    "--resume/--fresh",
    default=True,
    show_default="resume",
    help="Go on with an interrupted run, or begin again.",
)
@option(
    "Page",
    "-o",
    "--output",
    metavar="FILE.html",
    required=True,
    help="The page to write; a table of the same name ending in .csv is next to it.",
)
@driver_options
@common
def command(as_json: bool, debug: bool, **options: Any) -> None:
    """Count the hours of direct sun on each face of MODEL, and write a page: the coloured model, tables, and a CSV file.

    The sun's path comes from --place with --year and --zone, or with --from and --until. A face counts an hour where the sun is above
    the horizon, before the face, and nothing is between. Clouds are known from --weather alone. Needs pip install 'glshadow[sun,study]'.
    """  # fmt: skip
    with Work(as_json, debug) as work:
        _sun(work, **options)


def _sun(
    work: Work,
    model: str,
    output: str,
    weather: Path | None,
    resume: bool,
    to: str,
    per_face: int,
    within: float,
    cell: float | None,
    **options: Any,
) -> None:
    from glshadow.insolation import page

    target = page.page_path("--output", output)
    page.require()
    path = _path(
        **{name: options[name] for name in ("place", "altitude", "year", "zone", "start", "end", "step", "north")}
    )
    if cell is not None and cell < 0.0:
        raise click.UsageError("--cell must be a length in the model's units, or 0 to leave faces as they are")
    if not target.parent.is_dir():
        raise SettingsError(f"--output: there is no folder {target.parent}")
    with work.stage("load", f"loading {Path(model).name}"):
        from glshadow.io.limits import Budget
        from glshadow.io.load import read_scene

        scene = read_scene(model, Budget(), options["ground"], options["up_axis"], usual="plain")
        table = None if weather is None else _table(weather)
        len(path.is_up)  # an extra that is missing is named now
    from glshadow.gl.driver.context import backend_of
    from glshadow.insolation.hours import sun_hours
    from glshadow.renderer import Renderer

    if cell is None and to == "faces":
        cell = float(np.linalg.norm(scene.bounds[1] - scene.bounds[0])) / 64.0
    keep = target.with_name(f".{target.stem}.unfinished.npz")
    if not resume:
        keep.unlink(missing_ok=True)
    with Renderer(backend_of(options["backend"], options["device"])) as renderer:
        with work.stage("hours", "summing hours"), Bar(work) as bar:
            found = sun_hours(
                scene, path, to, per_face=per_face, cell=cell or None, within=within, weather=table, keep=keep, renderer=renderer,
                progress=bar,
            )  # fmt: skip
        with work.stage("page", "writing the page"):
            written, csv = page.write_page(found, target, renderer)
    for each in (keep, keep.with_suffix(".jsonl")):
        each.unlink(missing_ok=True)
    work.say(f"{written}, {csv}: {found!r}")
    work.finish(
        {
            "path": str(written), "table": str(csv), "faces": len(found.hours), "mean_hours": found.mean,
            "possible_hours": found.possible_mean,
            "shaded_by_month": found.shaded_by_month, "shaded_by_hour": found.shaded_by_hour, "suns": found.suns, "steps": len(path.hours),
            "error_degrees": found.error,
        }
    )  # fmt: skip


def _path(
    place: tuple[float, float], year: int | None, zone: str | None, start: str | None, end: str | None, **site: Any
) -> Any:
    """The path of the sun that the options name."""
    from glshadow.solar.path import SunPath

    settings = {"altitude": site["altitude"], "north": site["north"]}
    if year is not None:
        if start is not None or end is not None:
            raise click.UsageError("--year is a whole year: leave out --from and --until")
        if zone is None:
            raise click.UsageError("--year needs --zone, the time zone of the place: --zone Europe/Berlin")
        return SunPath.of_year(*place, year, zone, site["step"], **settings)
    if start is None or end is None:
        raise click.UsageError("give --year and --zone, or --from and --until")
    return SunPath(*place, start, end, site["step"], **settings)


def _table(file: Path) -> Any:
    """Irradiance from a CSV file."""
    required("--weather", "sun", "pandas")
    import pandas

    try:
        frame = pandas.read_csv(file, index_col=0, comment="#")
        frame.index = (
            pandas.to_datetime(frame.index, utc=True) if _have_offsets(frame.index) else pandas.to_datetime(frame.index)
        )
    except (OSError, ValueError) as error:
        raise SettingsError(
            f"--weather {file} cannot be read as a table of times: {' '.join(str(error).split())}"
        ) from error
    return frame


def _have_offsets(times: Any) -> bool:
    return all(str(each).endswith("Z") or "+" in str(each) or str(each)[10:].count("-") == 1 for each in times[:1])
