"""Builds the API reference with pdoc: every public name with its docstring; a warning or a missing docstring is an error."""

import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pdoc
import pdoc.doc
import pdoc.render

import glshadow
from glshadow.public import MODULES


def modules() -> list[pdoc.doc.Module]:
    """The documented modules, with their lazily imported names."""
    found = []
    for name in MODULES:
        module = import_module(name)
        for public in getattr(module, "__all__", ()):
            getattr(module, public)
        found.append(pdoc.doc.Module(module))
    return found


def undocumented(space: pdoc.doc.Namespace) -> Iterator[str]:
    """Public classes, functions and properties below a module or a class that have no docstring of their own."""
    for member in space.members.values() if isinstance(space, pdoc.doc.Module) else space.own_members:
        if member.name.startswith("_") or isinstance(member, pdoc.doc.Module):
            continue
        # Fields are described by their class.
        field = isinstance(member, pdoc.doc.Variable) and not isinstance(vars(space.obj).get(member.name), property)
        if not (field or member.docstring):
            yield member.fullname
        if isinstance(member, pdoc.doc.Class):
            yield from undocumented(member)


def build(folder: Path) -> None:
    """Write the pages.

    Raises
    ------
    UserWarning
        If pdoc warns: an annotation that names nothing, a name of `__all__` that is not there.
    ValueError
        If something public has no docstring; all such names are listed.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bare = sorted({name for module in modules() for name in undocumented(module)})
        if bare:
            raise ValueError(f"without a docstring: {', '.join(bare)}")
        pdoc.render.configure(docformat="numpy", show_source=False, include_undocumented=False)
        # pdoc finds by itself what `glshadow` lists and holds; `measure` is the function.
        listed = {f"glshadow.{name}" for name in glshadow.__all__}
        pdoc.pdoc(*(name for name in MODULES if name not in listed), "!glshadow.scoring", output_directory=folder)
