"""The exact answer by ray tracing: needs `pip install 'glshadow[reference]'`."""

from glshadow.reference.trace import trace
from glshadow.reference.truth import Truth

__all__ = ["Truth", "trace"]
