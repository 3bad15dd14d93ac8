"""Kept: a resource that is rebuilt only if its inputs have changed."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar


class _Releasable(Protocol):
    def release(self) -> None: ...


T = TypeVar("T", bound=_Releasable)


class Kept(Generic[T]):
    """A cache of one resource and its key."""

    def __init__(self) -> None:
        self.thing: T | None = None
        self._key: Hashable = None

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The resource of that key; if the key differs, the old one is released and a new one made."""
        if self.thing is None or self._key != key:
            self.release()
            self.thing = make()
            self._key = key
        return self.thing

    def differs(self, key: Hashable) -> bool:
        """Whether `get` would make the resource."""
        return self.thing is None or self._key != key

    def release(self) -> None:
        """Release the resource; may be called twice."""
        thing, self.thing = self.thing, None
        if thing is not None:
            thing.release()
