"""A scene on the GPU: meshes, triangles in world space, draw loops, and culling."""
