"""Numbers as Markdown, and the description of a measurement."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

Numbers = dict[str, Any]
Blocks = dict[str, str]

NOT_MEASURED = "not measured"


@dataclass(frozen=True)
class Part:
    """One benchmark and its tables.

    Parameters
    ----------
    name : str
        Name of the file with its numbers.
    command : tuple of str
        Arguments of scripts/bench.
    condensed : callable
        Reduces the benchmark's results to the numbers that the tables show.
    blocks : callable
        Makes tables by name from these numbers.
    """

    name: str
    command: tuple[str, ...]
    condensed: Callable[[Any], Numbers]
    blocks: Callable[[Numbers], Blocks]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def measured_line(part: Part, measured: dict[str, str]) -> str:
    """Date, machine and command of a part's measurement."""
    return f"*`scripts/bench {' '.join(part.command)}`, {measured['on']}, commit {measured['commit']}: {measured['machine']}.*"


def fixed(value: float | None, places: int, unknown: str = NOT_MEASURED) -> str:
    """A number with a fixed number of decimal places."""
    return unknown if value is None else f"{value:.{places}f}"


def percent(value: float | None, places: int, unknown: str = NOT_MEASURED) -> str:
    """A fraction in percent, without the sign; with more places if it would otherwise look like 0."""
    if value is None:
        return unknown
    if value and not float(f"{100.0 * value:.{places}f}"):
        places = -math.floor(math.log10(abs(100.0 * value)))
    return f"{100.0 * value:.{places}f}"


def span(values: Sequence[float], places: int) -> str:
    """The least and the greatest of some values: `0.70 to 0.85`."""
    least, most = (f"{value:.{places}f}" for value in (min(values), max(values)))
    return least if least == most else f"{least} to {most}"


def rounded(value: Any, digits: int = 4) -> Any:
    """Rounds every float in a JSON value to significant digits."""
    if isinstance(value, dict):
        return {key: rounded(each, digits) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(each, digits) for each in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value


def short(name: str) -> str:
    """A model's name without folder and suffix, with spaces."""
    return name.rpartition("/")[2].partition(".")[0].replace("_", " ")
