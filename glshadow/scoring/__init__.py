"""Measures the error of an image's shadows against a traced reference."""

from glshadow.scoring.error import Measurement, measure
from glshadow.scoring.score import Score

__all__ = ["Measurement", "Score", "measure"]
