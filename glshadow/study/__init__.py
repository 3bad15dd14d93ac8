"""Speed against error: measures a grid of shadow settings, writes a report, and finds the cheapest settings for a budget."""

from glshadow.study.grid import Grid
from glshadow.study.pictures import Panel, Region
from glshadow.study.plan import Choice, Plan, run_plan
from glshadow.study.report import write_report
from glshadow.study.result import Result, Study, pareto_front
from glshadow.study.sweep import run_study

__all__ = [
    "Choice",
    "Grid",
    "Panel",
    "Plan",
    "Region",
    "Result",
    "Study",
    "pareto_front",
    "run_plan",
    "run_study",
    "write_report",
]
