"""Geometry in float64: fitting, clusters of triangles, frustums, adjacency, closed meshes, smooth surfaces."""
