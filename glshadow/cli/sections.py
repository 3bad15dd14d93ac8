"""Options in sections of a help page, and values that report the option they belong to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from glshadow.errors import SceneError, SettingsError

F = TypeVar("F", bound=Callable[..., Any])

LAST = "Other"  # last section of the help page


class Value(click.ParamType):  # type: ignore[type-arg]  # generic since click 8.4 only
    """Text read by a function of `values`; its error becomes a usage error that names the option."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        self.name, self.read = name, read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except (SettingsError, SceneError) as error:
            self.fail(f"{error}.", param, ctx)


class Option(click.Option):
    """An option with a section of the help page."""

    def __init__(self, *names: Any, section: str = LAST, **settings: Any) -> None:
        super().__init__(*names, **settings)
        self.section = section


class Command(click.Command):
    """A command whose help groups its options by section."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None and isinstance(param, click.Option):
                sections.setdefault(getattr(param, "section", LAST), []).append(record)
        for title, records in sorted(sections.items(), key=lambda item: item[0] == LAST):
            with formatter.section(title):
                formatter.write_dl(records)


def option(
    section: str, name: str, *more: str, read: Callable[[str], Any] | None = None, **settings: Any
) -> Callable[[F], F]:
    """`click.option` with a section, and a reader from `values`."""
    if read is not None:
        settings["type"] = Value(settings.get("metavar", "text"), read)
    return click.option(name, *more, cls=Option, section=section, **settings)


def all_of(*decorators: Callable[[Any], Any]) -> Callable[[F], F]:
    """The decorators as one."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate
