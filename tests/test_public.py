"""The public API is listed in glshadow.public: every name exists, is complete, and the types in its signatures are public too."""

from __future__ import annotations

import importlib
import types
import typing
from collections.abc import Iterator
from typing import Any

import pytest

from glshadow.public import MODULES

# Classes that a public signature names and that are not public: their purpose.
INNER = {
    "Channel": "set by PackedShadow",
    "Showing": "what an Explorer shows",
    "ShadowMaps": "a tuple of arrays that a notebook shows",
    "FitRequest": "what the passes request of a fit",
    "Fitted": "what the fit returns",
    "Cascade": "what tells a ShadowView of several from its neighbours",
    "LightTable": "a texture of a light's snippet",
    "Gizmo": "how an overlay draws a light",
    "Needs": "how a filter chooses its source",
    "Rays": "rays that a Truth traces when it is measured",
    "RenderOptions": "the keywords of `render`, for type checkers",
    "Look": "what the word of a scene's look stands for",
    "Motion": "how a loaded scene moves: `Scene.at` uses it",
    "Frame": "a protocol: what `measure` needs of a frame",
    "Truth": "a protocol: what `measure` needs of a truth",
    "Visibility": "a protocol: what `sun_hours` needs of a renderer",
    "Pictured": "a protocol: what `flip` needs of a frame",
    "ResolvedShadow": "a Shadow with what it derives, for the passes",
}


def public() -> dict[str, Any]:
    """Every public name, as module.name."""
    modules = {name: importlib.import_module(name) for name in MODULES}
    return {f"{name}.{each}": getattr(module, each) for name, module in modules.items() for each in module.__all__}


@pytest.mark.parametrize("name", MODULES)
def test_public_module_lists_its_names(name: str) -> None:
    names = importlib.import_module(name).__all__
    assert len(set(names)) == len(names)
    assert [each for each in names if each.startswith("_") and each != "__version__"] == []


def test_signatures_name_public_types() -> None:
    values = public().values()
    known = {value for value in values if isinstance(value, type)}
    named = {
        each for value in values for hints in signatures(value) for hint in hints.values() for each in classes(hint)
    }
    assert {each.__name__ for each in named - known} == set(INNER)


def signatures(value: Any) -> Iterator[dict[str, Any]]:
    """The annotations of a function, or of a class, its public methods and properties."""
    if isinstance(value, type):
        yield hints(value)
        for name, member in vars(value).items():
            inner = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
            generated = (
                isinstance(inner, types.FunctionType) and inner.__code__.co_filename == "<string>"
            )  # the class's fields
            if (
                isinstance(inner, types.FunctionType)
                and not generated
                and (name == "__init__" or not name.startswith("_"))
            ):
                yield hints(inner)
    elif isinstance(value, types.FunctionType):
        yield hints(value)


def hints(value: Any) -> dict[str, Any]:
    """Annotations without those of private fields; names imported only for type checkers are looked up in the module's own file."""
    found = typing.get_type_hints(value)
    return {name: hint for name, hint in found.items() if not name.startswith("_")}


def classes(hint: Any) -> Iterator[type]:
    """Our classes in an annotation."""
    if isinstance(hint, type) and hint.__module__.startswith("glshadow"):
        yield hint
    for part in hint if isinstance(hint, list | tuple) else typing.get_args(hint):
        yield from classes(part)
