"""Traced references: exact shadows by ray tracing. Needs `pip install 'glshadow[reference]'`."""

from glshadow.reference.trace import trace
from glshadow.reference.truth import Truth

__all__ = ["Truth", "trace"]
