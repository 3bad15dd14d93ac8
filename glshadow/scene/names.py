"""Makes the names of a scene's nodes unique."""

from __future__ import annotations

from copy import copy
from typing import Any, TypeVar

N = TypeVar("N", bound=Any)


def numbered(nodes: tuple[N, ...]) -> tuple[N, ...]:
    """Nodes with unique names: those that repeat a name are copied, with a number appended."""
    taken = {node.name for node in nodes}
    seen: set[str] = set()
    last: dict[str, int] = {}
    result = []
    for node in nodes:
        if node.name in seen:
            number = last.get(node.name, 1) + 1
            while f"{node.name} {number}" in taken:
                number += 1
            last[node.name] = number
            named = copy(node)  # checked already
            object.__setattr__(named, "name", f"{node.name} {number}")
            taken.add(named.name)
            node = named
        seen.add(node.name)
        result.append(node)
    return tuple(result)
