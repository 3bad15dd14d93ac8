"""The filters that there are. A new one is named here, and everything else derives from this list."""

from glshadow.core.filters.disc import Disc
from glshadow.core.filters.exact import Exact
from glshadow.core.filters.filter import Filter
from glshadow.core.filters.hard import Hard
from glshadow.core.filters.light_samples import LightSamples
from glshadow.core.filters.pcf import Pcf
from glshadow.core.filters.pcss import Pcss

# From the plainest to the dearest: the order of help, tables and plans.
FILTERS: tuple[type[Filter], ...] = (Hard, Pcf, Disc, Pcss, LightSamples, Exact)

# Also the names that glshadow itself exports.
__all__ = ["Disc", "Exact", "Filter", "Hard", "LightSamples", "Pcf", "Pcss"]
