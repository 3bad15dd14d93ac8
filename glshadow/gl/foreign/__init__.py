"""Shadows inside moderngl programs of other authors."""
