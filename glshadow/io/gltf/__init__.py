"""glTF 2.0 read from its JSON and buffers, so that what cannot be honoured is refused by name."""

from glshadow.io.gltf.read import read_gltf

__all__ = ["read_gltf"]
