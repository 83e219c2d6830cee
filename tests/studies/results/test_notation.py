import numpy as np
import pytest

from nested_agents.studies.results.notation import bracketed, signed, two_decimals, two_figures
from nested_agents.studies.results.statistics import Estimate


@pytest.mark.parametrize(
    ("form", "shown"),
    [
        (two_figures, "1.0 [-0.05, 2.2]"),
        (two_decimals, "1.04 [-0.05, 2.25]"),
        (signed, "+1.04 [-0.05, +2.25]"),
    ],
)
def test_an_interval_has_one_notation(form, shown):
    assert bracketed(Estimate(*map(np.asarray, (1.04, -0.05, 2.25))), form) == shown


def test_what_has_no_interval_is_a_number():
    assert bracketed(Estimate(*map(np.asarray, (0.5, np.nan, np.nan)))) == "0.50"
