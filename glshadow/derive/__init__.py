"""Derives from settings, scene and camera, in float64: casting bodies, triangle lists, resolved settings."""
