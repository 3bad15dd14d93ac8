"""Speed against error: a grid of shadow settings measured for both, and the page that shows the result."""

from glshadow.study.grid import Grid
from glshadow.study.report import write_report
from glshadow.study.result import Result, Study, pareto_front
from glshadow.study.sweep import run_study

__all__ = ["Grid", "Result", "Study", "pareto_front", "run_study", "write_report"]
