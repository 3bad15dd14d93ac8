"""Spaces, cameras, settings and sampling in float64; no files, windows or GPU."""
