"""Every exception and warning of the package, as one tree.

Exception
└── GlshadowError
    ├── ContextError            no usable OpenGL context, or it lacks a required feature
    ├── ResourceError           the driver ran out of memory for a map, an image or a mesh
    ├── SceneError              the model, mesh or file cannot be rendered as it is
    ├── SettingsError           a setting is out of range or two settings cannot work together (also a ValueError)
    │   └── MissingOutput       a frame was rendered without the requested output (also an AttributeError)
    ├── ShaderError             a GLSL snippet is missing, cyclic or does not compile
    └── ReferenceUnavailable    the ray-traced reference needs an extra that is not installed
UserWarning
└── GlshadowWarning             rendered, but some of the input was ignored or replaced
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_LONGEST = 2000  # characters of a message


def printable(text: str, keep: str = "") -> str:
    """Text that may come from a file, made safe to print: characters that are not visible are escaped as in a Python string.

    These are the characters for which `str.isprintable` is false: control characters, which drive terminals; direction marks and
    zero-width characters, which make text look like other text; line separators; lone surrogates, which cannot be encoded.

    Parameters
    ----------
    keep : str
        Characters that are not escaped.
    """
    if text.isprintable():
        return text
    return "".join(each if each.isprintable() or each in keep else repr(each)[1:-1] for each in text)


def _said(value: object, lines: bool) -> object:
    """An argument of an error or a warning; text in its printable form, shortened in the middle if it is very long."""
    if not isinstance(value, str):
        return value
    if len(value) > _LONGEST:
        value = f"{value[: _LONGEST // 2]} ... {value[-_LONGEST // 2 :]}"
    return printable(value, keep="\n\t") if lines else printable(" ".join(value.split()))


class GlshadowError(Exception):
    """Base of all errors that glshadow raises on purpose. The message contains no terminal control characters."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(_said(each, lines=True) for each in args))


class ContextError(GlshadowError):
    """No usable OpenGL context could be made, or the given one lacks a required feature."""


class ResourceError(GlshadowError):
    """The driver could not allocate GPU memory."""


class SceneError(GlshadowError):
    """A model, mesh or file cannot be rendered as it is. Its message is one line."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(_said(each, lines=False) for each in args))


class SettingsError(GlshadowError, ValueError):
    """A setting is out of its range, or two settings cannot work together."""


class MissingOutput(SettingsError, AttributeError):
    """A frame was rendered without the requested output. Also an AttributeError, so that `hasattr` works."""


class ShaderError(GlshadowError):
    """A GLSL snippet is missing, includes itself, or does not compile."""


class ReferenceUnavailable(GlshadowError):
    """The ray-traced reference needs an optional dependency that is not installed."""


def unexpected(error: BaseException, given: str) -> GlshadowError:
    """The error that replaces an unexpected one, which only a defect of this package can cause."""
    return GlshadowError(f"unexpected {type(error).__name__}: {error}; please report this, with the input: {given}")


def required(what: str, extra: str, *modules: str) -> None:
    """Raise a GlshadowError with the pip command unless these modules of an extra can be imported; `what` needs them."""
    for name in modules:
        try:
            importlib.import_module(name)
        except ImportError as error:
            raise GlshadowError(f"{what} needs {error.name}: pip install 'glshadow[{extra}]'") from error


class GlshadowWarning(UserWarning):
    """An image was made, but some of the input was ignored or replaced. The message is one printable line."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(_said(each, lines=False) for each in args))


_listener: ContextVar[Callable[[str], None] | None] = ContextVar("glshadow_listener", default=None)


def warn(message: str, stacklevel: int = 3) -> None:
    """Issue a GlshadowWarning for the caller's caller, or for the frame `stacklevel` calls up; the listener receives it if there is one."""
    listener = _listener.get()
    if listener is None:
        warnings.warn(message, GlshadowWarning, stacklevel=stacklevel)
    else:
        listener(str(GlshadowWarning(message)))


@contextmanager
def listening(listener: Callable[[str], None]) -> Iterator[None]:
    """Redirect this thread's GlshadowWarnings to a function. (`warnings.catch_warnings` would affect all threads.)"""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
