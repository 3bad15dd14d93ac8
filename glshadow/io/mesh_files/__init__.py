"""Reads OBJ, PLY, STL and OFF block by block into arrays; every header is verified."""

from glshadow.io.mesh_files.read import read_mesh_file

__all__ = ["read_mesh_file"]
