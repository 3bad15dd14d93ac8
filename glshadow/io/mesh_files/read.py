"""Reads one mesh file as nodes."""

from __future__ import annotations

from pathlib import Path

from glshadow.errors import SceneError
from glshadow.io.imported import Imported, shortened
from glshadow.io.limits import Budget
from glshadow.io.mesh_files import SUFFIXES
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.loose import loose_nodes
from glshadow.io.mesh_files.obj import read_obj
from glshadow.io.mesh_files.off import read_off
from glshadow.io.mesh_files.ply import read_ply
from glshadow.io.mesh_files.soup import placed
from glshadow.io.mesh_files.stl import is_binary_stl, read_stl
from glshadow.io.mesh_files.words import without_mark
from glshadow.io.model_file import ModelFile, model_file

READERS = dict(zip(SUFFIXES, (read_obj, read_ply, read_stl, read_off), strict=True))


def read_mesh_file(source: Path | ModelFile, budget: Budget, smooth: float | None = None) -> Imported:
    """Read a .obj, .ply, .stl or .off file.

    Parameters
    ----------
    source : Path or ModelFile
    budget : Budget
        Budget of the file; the file's size is added to its read bytes.
    smooth : float, optional
        Crease angle in degrees for faces without normals; None: flat, or as smoothing groups of OBJ say.

    Raises
    ------
    SceneError
        If it is broken, declares more than it contains, or exceeds the budget.
    """
    file = model_file(source)
    data = file.read(budget)
    notes: list[str] = []
    if not is_binary_stl(data):
        data = without_mark(data)
    soup = READERS[file.suffix](data, Beside(file.folder, notes, budget), notes, budget)
    del data  # half a gigabyte for ten million facets
    nodes = placed(soup, notes, budget, smooth)
    nodes += loose_nodes(soup.positions, soup.colors, soup.loose, notes, budget)
    if not nodes and notes:
        raise SceneError(f"nothing to render: {'; '.join(shortened(notes))}")
    if not nodes and len(soup.positions):
        raise SceneError("nothing to render: it has vertices, but no triangles, points or lines")
    return Imported(nodes, notes=shortened(notes))
