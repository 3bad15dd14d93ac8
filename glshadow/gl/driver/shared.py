"""Shared: GPU resources shared by all users of the same arrays, released with the last user."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar


class _Releasable(Protocol):
    def release(self) -> None: ...


T = TypeVar("T", bound=_Releasable)


class Shared(Generic[T]):
    """GPU resources by the identity of the arrays and other objects they are made from, not by their values."""

    def __init__(self) -> None:
        self._held: dict[
            tuple[int, ...], tuple[T, tuple[object, ...], int]
        ] = {}  # the entry keeps the arrays alive, so that their ids stay unique

    def take(self, make: Callable[[], T], *arrays: object) -> T:
        """The resource of these arrays; each `take` needs one `give_back`."""
        key = tuple(map(id, arrays))
        thing, _, users = self._held.get(key) or (make(), arrays, 0)
        self._held[key] = (thing, arrays, users + 1)
        return thing

    def give_back(self, *arrays: object) -> None:
        """Drop one user; the last one releases the resource."""
        key = tuple(map(id, arrays))
        thing, held, users = self._held.pop(key)
        if users > 1:
            self._held[key] = (thing, held, users - 1)
        else:
            thing.release()
