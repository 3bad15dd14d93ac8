"""Kept: a thing that is made anew only where what it depends on has changed."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar


class _Releasable(Protocol):
    def release(self) -> None: ...


T = TypeVar("T", bound=_Releasable)


class Kept(Generic[T]):
    """Room for one thing and the key it was made for."""

    def __init__(self) -> None:
        self.thing: T | None = None
        self._key: Hashable = None

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The thing of that key; another one is released first."""
        if self.thing is None or self._key != key:
            self.release()
            self.thing = make()
            self._key = key
        return self.thing

    def release(self) -> None:
        """Release it; may be called twice."""
        thing, self.thing = self.thing, None
        if thing is not None:
            thing.release()
