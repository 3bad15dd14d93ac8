"""The filters that there are. A new one is named here, and everything else derives from this list."""

from glshadow.core.filters.babylon_esm import BabylonEsm
from glshadow.core.filters.disc import Disc
from glshadow.core.filters.edge_pcf import EdgePcf
from glshadow.core.filters.esm import Esm
from glshadow.core.filters.exact import Exact
from glshadow.core.filters.filter import Filter
from glshadow.core.filters.gaussian import Gaussian
from glshadow.core.filters.hard import Hard
from glshadow.core.filters.light_samples import LightSamples
from glshadow.core.filters.msm import Msm
from glshadow.core.filters.pcf import Pcf
from glshadow.core.filters.pcss import Pcss
from glshadow.core.filters.poisson import Poisson
from glshadow.core.filters.vsm import Evsm, Vsm

# From the plainest to the dearest: the order of help, tables and plans.
FILTERS: tuple[type[Filter], ...] = (
    Hard, Poisson, Pcf, EdgePcf, Gaussian, Disc, BabylonEsm, Esm, Vsm, Evsm, Msm, Pcss, LightSamples, Exact,
)  # fmt: skip

# Also the names that glshadow itself exports.
__all__ = [
    "BabylonEsm", "Disc", "EdgePcf", "Esm", "Evsm", "Exact", "Filter", "Gaussian", "Hard", "LightSamples", "Msm", "Pcf", "Pcss", "Poisson",
    "Vsm",
]  # fmt: skip
