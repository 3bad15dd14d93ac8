"""Shared: a GPU thing made once for all that show the same arrays, released with the last of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

from numpy.typing import NDArray


class _Releasable(Protocol):
    def release(self) -> None: ...


T = TypeVar("T", bound=_Releasable)


class Shared(Generic[T]):
    """Things by the arrays they are made of: the very same arrays, not equal ones."""

    def __init__(self) -> None:
        self._held: dict[
            tuple[int, ...], tuple[T, tuple[NDArray[Any], ...], int]
        ] = {}  # arrays live as long as their id is a key

    def take(self, make: Callable[[], T], *arrays: NDArray[Any]) -> T:
        """The thing of these arrays; to be given back as often as it was taken."""
        key = tuple(map(id, arrays))
        thing, _, users = self._held.get(key) or (make(), arrays, 0)
        self._held[key] = (thing, arrays, users + 1)
        return thing

    def give_back(self, *arrays: NDArray[Any]) -> None:
        """One user less."""
        key = tuple(map(id, arrays))
        thing, held, users = self._held.pop(key)
        if users > 1:
            self._held[key] = (thing, held, users - 1)
        else:
            thing.release()
