"""Mesh files without a scene: OBJ, PLY, STL and OFF."""

SUFFIXES = (".obj", ".ply", ".stl", ".off")
