"""The progress bar of commands that measure many settings."""

from __future__ import annotations

from typing import Self

from glshadow.cli.running import Work


class Bar:
    """A progress bar on a terminal, nothing elsewhere. A context manager, called like the `progress` of `glshadow.study`."""

    def __init__(self, work: Work) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        work.progress.end()  # one display at a time
        console = Console(stderr=True)
        words = TextColumn("{task.description:<44}", markup=False)
        columns = (words, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        self._display = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._display.add_task("", total=None)

    def __enter__(self) -> Self:
        self._display.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._display.stop()

    def __call__(self, done: int, total: int, text: str) -> None:
        self._display.update(self._task, completed=done, total=total, description=text)
