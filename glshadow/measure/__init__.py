"""How wrong a picture's shadows are, against the traced truth."""

from glshadow.measure.error import Score, ShadowError, measure

__all__ = ["Score", "ShadowError", "measure"]
