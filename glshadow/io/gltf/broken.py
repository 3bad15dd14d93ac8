"""What a broken part of a glTF file raises while it is read; the part is left out, with a note that names it."""

from __future__ import annotations

from glshadow.errors import GlshadowError
from glshadow.io.limits import OverLimit

# a value of another type or length than the format says ends in one of Python's own errors
BROKEN = (GlshadowError, TypeError, ValueError, LookupError, AttributeError, OverflowError)


def named(error: Exception, what: str) -> str:
    """The message of a note on a part that cannot be read.

    Raises
    ------
    OverLimit
        The error itself, if it is one: a limit stops the reading of the whole file.
    """
    if isinstance(error, OverLimit):
        raise error
    if not isinstance(error, GlshadowError):
        return f"{what} is not valid glTF ({type(error).__name__}: {error})"
    return str(error) if what in str(error) else f"{what}: {error}"
