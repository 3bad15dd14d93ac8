"""How wrong a picture's shadows are, against the traced truth."""

from glshadow.scoring.error import Measurement, measure
from glshadow.scoring.score import Score

__all__ = ["Measurement", "Score", "measure"]
