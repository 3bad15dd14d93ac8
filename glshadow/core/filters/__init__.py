"""The filters that there are. A new one is named here, and everything else derives from this list."""

from glshadow.core.filters.disc import Disc
from glshadow.core.filters.edge_pcf import EdgePcf
from glshadow.core.filters.exact import Exact
from glshadow.core.filters.filter import Filter
from glshadow.core.filters.gaussian import Gaussian
from glshadow.core.filters.hard import Hard
from glshadow.core.filters.light_samples import LightSamples
from glshadow.core.filters.pcf import Pcf
from glshadow.core.filters.pcss import Pcss
from glshadow.core.filters.poisson import Poisson

# From the plainest to the dearest: the order of help, tables and plans.
FILTERS: tuple[type[Filter], ...] = (
    Hard, Poisson, Pcf, EdgePcf, Gaussian, Disc, Pcss, LightSamples, Exact,
)  # fmt: skip

# Also the names that glshadow itself exports.
__all__ = [
    "Disc", "EdgePcf", "Exact", "Filter", "Gaussian", "Hard", "LightSamples", "Pcf", "Pcss", "Poisson",
]  # fmt: skip
