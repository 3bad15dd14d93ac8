"""Runs a command: warnings, progress, times, JSON, exit codes."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any, Self

import click

from glshadow.errors import GlshadowError, listening, printable

FAILED, INTERRUPTED, TERMINATED = 1, 130, 143  # 128 + SIGINT, 128 + SIGTERM, as a shell reports them
DELAY_S = 1.0  # before progress is shown: a quick command prints nothing


class Terminated(KeyboardInterrupt):
    """SIGTERM was received."""


@contextmanager
def terminable() -> Iterator[None]:
    """Handle SIGTERM like Ctrl-C, so that resources are cleaned up; a second SIGTERM kills the process."""

    def end(*_: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        raise Terminated

    if threading.current_thread() is not threading.main_thread():  # only the main thread may set handlers
        yield
        return
    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class Progress:
    """The current stage and its duration: a line on a terminal, shown after DELAY_S."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._text = ""
        self._ended = False
        self._display: Any = None
        self._timer = threading.Timer(DELAY_S, self._show)
        self._timer.daemon = True
        if sys.stderr is not None and sys.stderr.isatty():  # None: the caller closed it
            self._timer.start()

    def _show(self) -> None:
        from rich.console import Console
        from rich.progress import Progress as Display
        from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
        display = Display(*columns, console=Console(stderr=True), transient=True)
        with self._lock:
            if self._ended:
                return
            self._task = display.add_task(self._text, total=None)
            display.start()
            self._display = display

    def stage(self, text: str) -> None:
        """Set the current stage."""
        with self._lock:
            self._text = text = printable(text)
            if self._display is not None:
                self._display.update(self._task, description=text)

    def say(self, line: str) -> None:
        """Print a permanent line on standard error."""
        with self._lock:
            if self._display is not None:
                self._display.console.print(printable(line), markup=False, emoji=False, highlight=False, soft_wrap=True)
                return
        say(line)

    def end(self) -> None:
        """Remove the line."""
        self._timer.cancel()
        with self._lock:
            self._ended = True
            if self._display is not None:
                self._display.stop()
                self._display = None


class Work:
    """A running command: a context manager that turns errors into messages and an exit code.

    Parameters
    ----------
    as_json : bool
        Print one JSON object on standard output at the end, also after an error.
    debug : bool
        Show the traceback of an error.
    """

    def __init__(self, as_json: bool = False, debug: bool = False) -> None:
        self.as_json, self.debug = as_json, debug
        self.warnings: list[str] = []
        self.timings: dict[str, float] = {}

    def __enter__(self) -> Self:
        self.progress = Progress()
        self._listening = listening(self.warn)
        self._listening.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._listening.__exit__(kind, error, trace)
        self.progress.end()
        if error is None or isinstance(error, click.ClickException | click.exceptions.Exit | SystemExit):
            return
        if self.debug:
            traceback.print_exception(kind, error, trace)
        if not isinstance(error, BrokenPipeError):  # otherwise the reader has gone, and no one would see a message
            self._tell(error)
        if isinstance(error, OSError):
            _give_up_output()  # it may be the cause
        raise click.exceptions.Exit(exit_code(error)) from None

    def _tell(self, error: BaseException) -> None:
        message = one_line(error)
        notes = [" ".join(str(each).split()) for each in getattr(error, "__notes__", ())]
        say(f"error: {message}")
        for each in notes:
            say(f"  {each}")
        if self.as_json:
            report = {"error": message, "kind": type(error).__name__, "warnings": self.warnings}
            with suppress(OSError):
                print_json({**report, "notes": notes} if notes else report)

    def warn(self, message: str) -> None:
        """Print one `warning:` line per message, and add it to "warnings"."""
        message = " ".join(message.split())
        if message not in self.warnings:
            self.warnings.append(message)
            self.progress.say(f"warning: {message}")

    def say(self, line: str) -> None:
        """Print a line about the result on standard error."""
        self.progress.say(line)

    @contextmanager
    def stage(self, name: str, text: str) -> Iterator[None]:
        """Time a block under `name`, and show `text` meanwhile."""
        self.progress.stage(text)
        start = time.perf_counter()
        yield
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - start

    def finish(self, report: dict[str, Any]) -> None:
        """Print the JSON object, if requested."""
        self.progress.end()
        if self.as_json:
            print_json({**report, "timings": {**self.timings, **report.get("timings", {})}, "warnings": self.warnings})


def exit_code(error: BaseException) -> int:
    """The exit code of a command that ended with an error."""
    if isinstance(error, Terminated):
        return TERMINATED
    return INTERRUPTED if isinstance(error, KeyboardInterrupt) else FAILED


def say(line: str) -> None:
    """Print a line on standard error, if that can be written."""
    with suppress(OSError):
        click.echo(printable(line), err=True)


def _give_up_output() -> None:
    """Redirect unwritable standard output to nowhere, so that flushing it causes no error at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except AttributeError:  # None: the caller closed it
        pass


def one_line(error: BaseException) -> str:
    """The message of an error on one line; unexpected errors include their type."""
    text = " ".join(str(error).split())
    if isinstance(error, GlshadowError):
        return text
    if isinstance(error, KeyboardInterrupt):
        return "terminated" if isinstance(error, Terminated) else "interrupted"
    if isinstance(error, OSError) and error.strerror:
        return f"cannot read or write {error.filename or 'the output'}: {error.strerror}"
    if isinstance(error, MemoryError):
        return "there is not enough memory; try a smaller --size or --resolution" + (f" ({text})" if text else "")
    return f"unexpected {type(error).__name__}: {text or 'no message'}; please report this (--debug shows where)"


def print_json(report: dict[str, Any]) -> None:
    """Print one object on standard output; numbers that JSON does not have become null."""
    click.echo(json.dumps(_plain(report), allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy
        return _plain(value.tolist())
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value
