"""OBJ, PLY, STL and OFF, read block by block into arrays; nothing is taken on trust from a header."""

from glshadow.io.mesh_files.read import read_mesh_file

__all__ = ["read_mesh_file"]
