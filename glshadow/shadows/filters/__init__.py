"""All filters. A new filter is added here; command line, help, studies and tables are derived from this list."""

from glshadow.shadows.filters.babylon_esm import BabylonEsm
from glshadow.shadows.filters.direction_maps import DirectionMaps
from glshadow.shadows.filters.disc import Disc
from glshadow.shadows.filters.edge_pcf import EdgePcf
from glshadow.shadows.filters.esm import Esm
from glshadow.shadows.filters.exact import Exact
from glshadow.shadows.filters.filter import Filter
from glshadow.shadows.filters.gaussian import Gaussian
from glshadow.shadows.filters.hard import Hard
from glshadow.shadows.filters.light_samples import LightSamples
from glshadow.shadows.filters.msm import Msm
from glshadow.shadows.filters.pcf import Pcf
from glshadow.shadows.filters.pcss import Pcss
from glshadow.shadows.filters.poisson import Poisson
from glshadow.shadows.filters.vsm import Evsm, Vsm

# From the simplest to the most expensive: the order of help, tables and plans.
FILTERS: tuple[type[Filter], ...] = (
    Hard, Poisson, Pcf, EdgePcf, Gaussian, Disc, BabylonEsm, Esm, Vsm, Evsm, Msm, Pcss, DirectionMaps, LightSamples, Exact,
)  # fmt: skip

# Also the names that glshadow itself exports.
__all__ = [
    "BabylonEsm", "DirectionMaps", "Disc", "EdgePcf", "Esm", "Evsm", "Exact", "Filter", "Gaussian", "Hard", "LightSamples", "Msm", "Pcf",
    "Pcss", "Poisson", "Vsm",
]  # fmt: skip
