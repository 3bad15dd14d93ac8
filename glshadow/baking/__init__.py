"""Light and ambient occlusion on the faces, vertices or texels of a scene."""
