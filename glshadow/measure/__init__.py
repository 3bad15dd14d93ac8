"""How wrong a picture's shadows are, against the traced truth."""

from glshadow.measure.error import ShadowError, measure
from glshadow.measure.score import Score

__all__ = ["Score", "ShadowError", "measure"]
