"""Tables of the techniques: description, cost, error, and known failures."""

from __future__ import annotations

from dataclasses import fields

from glshadow.shader.source import root
from glshadow.shadows.filters import FILTERS, Filter
from scripts.pages.markdown import Blocks, Numbers, Part, fixed, percent, table

NUMBERS = ("cost", "wrong", "acne", "leak", "grain")


def tried(kind: type[Filter]) -> tuple[Filter, ...]:
    """The settings of a technique that plans, studies and the hard cases try."""
    return tuple(dict.fromkeys((*kind.rungs(), *kind.studied(), *kind.extremes())))


def measured(kind: type[Filter]) -> tuple[Filter, ...]:
    """The settings of a technique in the tables: its default first, then those that are tried; empty if the technique is never tried."""
    return tuple(dict.fromkeys((kind(), *tried(kind)))) if tried(kind) else ()


def called(filter_: Filter) -> str:
    """Python code for a filter: `Disc()`, or `BabylonEsm(close=True)`."""
    values = [(item.name, getattr(filter_, item.name), item.default) for item in fields(filter_)]  # type: ignore[arg-type]
    return (
        f"{type(filter_).__name__}({', '.join(f'{name}={value!r}' for name, value, usual in values if value != usual)})"
    )


def where(kind: type[Filter]) -> str:
    """Files of a technique: its settings, and its GLSL."""
    snippets = sorted(path.relative_to(root()).as_posix() for path in root().rglob(f"{kind.spelling}.glsl"))
    return ", ".join([f"`{kind.__module__.replace('.', '/')}.py`", *(f"`glsl/{path}`" for path in snippets)])


def _condensed(results: Numbers) -> Numbers:
    return {str(kind): {each: results[str(kind)][each] for each in NUMBERS} for kind in _all()}


def _all() -> list[Filter]:
    return [each for kind in FILTERS for each in measured(kind)]


def _blocks(numbers: Numbers) -> Blocks:
    found = {kind: numbers["results"].get(str(kind), dict.fromkeys(NUMBERS)) for kind in _all()}
    long = [
        (f"`{kind.usage()}`", kind.summary, where(kind), kind.source, kind.fails)
        for kind in FILTERS
    ]  # fmt: skip
    costs = [
        (f"`{kind}`", fixed(row["cost"], 2), *(percent(row[each], 3) for each in NUMBERS[1:]))
        for kind, row in found.items()
    ]
    brief = [
        (
            f"`{called(each)}`",
            kind.summary,
            kind.source,
            fixed(row["cost"], 2, "-"),
            percent(row["wrong"], 3, "-"),
            kind.fails,
        )
        for kind in FILTERS
        for each in dict.fromkeys((kind(), *tried(kind)[:1]))
        for row in [found.get(each) or dict.fromkeys(NUMBERS)]
    ]
    return {
        "techniques": table(("`--filter`", "what it does", "where it lives", "source", "where it fails"), long),
        "costs": table(("setting", "time over the floor", *(f"{each}, %" for each in NUMBERS[1:])), costs),
        "techniques in short": table(("filter", "what it does", "source", "time", "wrong %", "where it fails"), brief),
    }


PART = Part("techniques", ("techniques",), _condensed, _blocks)
