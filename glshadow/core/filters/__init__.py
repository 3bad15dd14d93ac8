"""The filters that there are. A new one is one line here, and everything else derives from this list."""

from glshadow.core.filters.exact import Exact
from glshadow.core.filters.filter import Filter, Needs
from glshadow.core.filters.hard import Hard
from glshadow.core.filters.pcf import Pcf

FILTERS: tuple[type[Filter], ...] = (
    Hard,
    Pcf,
    Exact,
)  # from the plainest to the dearest: the order of help, tables and plans

__all__ = ["FILTERS", "Exact", "Filter", "Hard", "Needs", "Pcf"]
