"""Lifetime of an OpenGL context and of what a renderer keeps in it: errors, interruption, release."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

import moderngl

from glshadow.core.setting import instance, optional
from glshadow.errors import GlshadowError, GlshadowWarning, ResourceError, unexpected
from glshadow.gl.driver.context import Backend, backend_of, open_context
from glshadow.gl.resources import ResourceCache

_OF_NUMBERS = (ArithmeticError, LookupError, ValueError)
"""Errors of numerical code. Cache entries get their key once they are complete, so these errors leave nothing half made."""
_DEFECTS = (AssertionError, AttributeError, TypeError, moderngl.Error)
"""Other errors that only a defect raises. Signal handlers may raise the rest, at any line."""


class Lifetime:
    """Base of `Renderer`: owns the cache, and the context unless it was given."""

    def __init__(
        self, backend: Backend = "auto", context: moderngl.Context | None = None, device: int | None = None
    ) -> None:
        self._backend = backend_of(backend, device)
        self._context = open_context(self._backend, optional(instance(moderngl.Context))("context", context))
        self._cache: ResourceCache | None = None
        with self._context.drawing():
            self._cache = ResourceCache(self._context)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Free what the renderer owns on the GPU, and its context if it is its own. May be called twice.

        One with a context of its own that is dropped without it is freed by Python's garbage collector.
        """
        if self._context.released:
            return
        if self._context.lost:  # and everything in it
            self._context.release()
            return
        if self._cache is not None:
            with self._context.drawing():
                self._cache.release()
        self._context.release()

    @property
    def info(self) -> dict[str, Any]:
        """Backend, driver and the driver's limits."""
        return dict(vars(self._context.caps))

    def _check_alive(self) -> None:
        if self._context.released:
            raise GlshadowError("this renderer was released: make a new one")

    @contextmanager
    def _drawing(self, given: object, no_memory: str) -> Iterator[ResourceCache]:
        """The cache, with the context current. Whatever the block raises, what the cache keeps stays valid.

        Parameters
        ----------
        given : object
            The inputs, for the message of an unexpected error.
        no_memory : str
            Message where there is not enough memory.
        """
        with self._context.drawing():
            try:
                if self._cache is None:  # the last frame was interrupted
                    self._cache = ResourceCache(self._context)
                yield self._cache
            except (GlshadowError, GlshadowWarning):
                self._context.recover()
                raise
            except BaseException as error:
                if isinstance(error, _OF_NUMBERS):
                    self._context.recover()
                else:
                    self._start_over(interrupted=not isinstance(error, (MemoryError, *_DEFECTS)))
                if isinstance(error, MemoryError):
                    raise ResourceError(no_memory) from error
                if isinstance(error, _OF_NUMBERS + _DEFECTS):
                    raise unexpected(error, str(given)) from error
                raise
            finally:
                if self._context.gl.failed:
                    self._start_over()
                if self._cache is not None:
                    self._cache.rest()

    def _start_over(self, interrupted: bool = False) -> None:
        """After Ctrl-C, which may come at any line, and where memory was short: nothing half made is kept."""
        old, self._cache = self._cache, None
        if interrupted and self._context.owned:
            # what was made and not yet noted goes with the context alone
            spoilt, self._context = self._context, open_context(self._backend)
            spoilt.release()
            return
        self._context.recover()
        self._context.gl.failed = False
        self._cache = ResourceCache(self._context)
        if old is not None:
            old.release()
