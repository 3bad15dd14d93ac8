"""Exports a scene as a page for browsers: WebGL 1, GLSL ES 1.00, no library."""

from glshadow.web.export import export_page

__all__ = ["export_page"]
