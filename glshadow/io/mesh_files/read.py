"""Reads one mesh file as nodes."""

from __future__ import annotations

from pathlib import Path

from glshadow.errors import SceneError
from glshadow.io.imported import Imported, blended
from glshadow.io.limits import Budget
from glshadow.io.mesh_files import SUFFIXES
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.obj import read_obj
from glshadow.io.mesh_files.off import read_off
from glshadow.io.mesh_files.ply import read_ply
from glshadow.io.mesh_files.soup import placed
from glshadow.io.mesh_files.stl import read_stl
from glshadow.io.model_file import ModelFile, model_file

READERS = dict(zip(SUFFIXES, (read_obj, read_ply, read_stl, read_off), strict=True))
MOST_NOTES = 50  # reported one by one


def read_mesh_file(source: Path | ModelFile, budget: Budget) -> Imported:
    """Read a .obj, .ply, .stl or .off file.

    Parameters
    ----------
    source : Path or ModelFile
    budget : Budget
        Budget of the file; the file's size is added to its read bytes.

    Raises
    ------
    SceneError
        If it is broken, declares more than it contains, or exceeds the budget.
    """
    file = model_file(source)
    data = file.read(budget)
    notes: list[str] = []
    soup = READERS[file.suffix](data, Beside(file.folder, notes, budget), notes, budget)
    del data  # half a gigabyte for ten million facets
    nodes = placed(soup, notes, budget)
    if not nodes and notes and len(soup.counts):
        raise SceneError(f"nothing to render: {'; '.join(notes[:MOST_NOTES])}")
    if not nodes and len(soup.positions):
        raise SceneError("nothing to render: it holds only points or lines, and no triangles")
    if len(notes) > MOST_NOTES:
        notes[MOST_NOTES:] = [f"{len(notes) - MOST_NOTES} more of such notes"]
    return Imported(nodes, notes=notes + blended(nodes))
