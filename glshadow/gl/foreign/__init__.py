"""Shadows for moderngl programs of others."""
