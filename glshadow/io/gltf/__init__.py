"""Reads glTF 2.0 from its JSON and buffers; unsupported features are refused by name."""

from glshadow.io.gltf.read import read_gltf

__all__ = ["read_gltf"]
