"""The exact answer by ray tracing: needs `pip install 'glshadow[reference]'`."""

from glshadow.reference.trace import Truth, trace

__all__ = ["Truth", "trace"]
