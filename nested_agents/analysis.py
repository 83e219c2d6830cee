"""Estimates, tests and notation for analyses of results.

A study's `analyse` and programs that read kept or published results are written with these names;
`nested_agents.figures` draws what they return.
"""

from .core.interface.measures import RETURN, SUCCESS
from .studies.catalogue.ablation import compared_with_first as compare_with_first
from .studies.catalogue.experience import AFTER, evaluated_after
from .studies.catalogue.hierarchies import analysis_of as compare_hierarchies
from .studies.catalogue.hierarchies import estimates as estimates_of_hierarchy
from .studies.catalogue.sized import SizedCase
from .studies.catalogue.study import analyse_as, distinct, system_of
from .studies.catalogue.wheel_failure import courses_of
from .studies.laws import fitting, samples
from .studies.results.analysis import (
    EVALUATED,
    Analysis,
    Case,
    Figures,
    Summary,
    estimate_of,
    evaluated,
    judged,
    phases_of,
)
from .studies.results.comparison import ComparisonGroup, compare_conditions
from .studies.results.differences import (
    BySeed,
    Difference,
    adjust,
    difference,
    differences,
    paired_difference,
    ratio,
    select_shared,
)
from .studies.results.notation import format_estimate, format_number, format_p, wrapped
from .studies.results.permutation_tests import (
    LEVEL,
    Friedman,
    friedman,
    holm,
    paired_permutation,
    paired_tests,
)
from .studies.results.power import deviation_of
from .studies.results.power_text import power_lines
from .studies.results.results import CPU, NOTHING, Results
from .studies.results.sizes import Sizes
from .studies.results.statistics import (
    NOT_NEGATIVE,
    Array,
    Estimate,
    bootstrap,
    exactly,
    rate,
    stack_estimates,
)
from .studies.spec.tables import column_value, label, label_but

__all__ = [
    "AFTER",
    "CPU",
    "EVALUATED",
    "LEVEL",
    "NOTHING",
    "NOT_NEGATIVE",
    "RETURN",
    "SUCCESS",
    "Analysis",
    "Array",
    "BySeed",
    "Case",
    "ComparisonGroup",
    "Difference",
    "Estimate",
    "Figures",
    "Friedman",
    "Results",
    "SizedCase",
    "Sizes",
    "Summary",
    "adjust",
    "analyse_as",
    "bootstrap",
    "column_value",
    "compare_conditions",
    "compare_hierarchies",
    "compare_with_first",
    "courses_of",
    "deviation_of",
    "difference",
    "differences",
    "distinct",
    "estimate_of",
    "estimates_of_hierarchy",
    "evaluated",
    "evaluated_after",
    "exactly",
    "fitting",
    "format_estimate",
    "format_number",
    "format_p",
    "friedman",
    "holm",
    "judged",
    "label",
    "label_but",
    "paired_difference",
    "paired_permutation",
    "paired_tests",
    "phases_of",
    "power_lines",
    "rate",
    "ratio",
    "samples",
    "select_shared",
    "stack_estimates",
    "system_of",
    "wrapped",
]
