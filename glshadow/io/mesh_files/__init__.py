"""Reads OBJ, PLY, STL and OFF block by block into arrays; every header is verified."""

SUFFIXES = (".obj", ".ply", ".stl", ".off")
