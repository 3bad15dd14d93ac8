"""Meshes, materials, nodes and scenes."""
