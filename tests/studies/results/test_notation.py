"""Rounding: numbers by hand, and intervals that contain the exact ones."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.studies.results.notation import format_estimate, format_number, format_p
from nested_agents.studies.results.statistics import Estimate


@pytest.mark.parametrize(
    ("estimate", "shown"),
    [
        ((97.6, 78.2, 113.7), "98 [78, 114]"),
        ((4.3, -3.7, 11.94), "4.3 [-3.7, 12.0]"),
        ((1.04, -0.05, 2.25), "1.0 [-0.1, 2.3]"),
        ((1.04, 0.961, 1.13), "1.04 [0.96, 1.13]"),
        ((1.0, 0.7601, 1.0), "1.00 [0.76, 1.00]"),
        ((0.0, 0.0, 0.2401), "0 [0, 0.25]"),
        ((0.004, -0.001, 0.009), "0 [-0.01, 0.01]"),
        ((12.0, 12.0, 12.0), "12 [12, 12]"),
        ((1234.5, 976.1, 1511.2), "1235 [976, 1512]"),
        ((2.7e11, 1.23e11, 5.11e11), "2.7e11 [1.2e11, 5.2e11]"),
        ((1.2, 0.5, math.inf), "1.2 [0.5, inf]"),
        ((0.5, math.nan, math.nan), "0.50"),
        ((0.0, -7e-16, 7e-16), "0 [0, 0]"),
        ((3.5e-4, -1.31e-4, 8.31e-4), "3.5e-4 [-1.4e-4, 8.4e-4]"),
        ((2.1e-3, 0.0, 4.9e-3), "2.1e-3 [0, 4.9e-3]"),
    ],
)
def test_estimates_by_hand(estimate, shown):
    assert format_estimate(Estimate(*estimate)) == shown


def test_differences_have_their_sign():
    assert format_estimate(Estimate(0.5, -0.05, 0.691), signed=True) == "+0.50 [-0.05, +0.70]"
    assert [format_number(x, signed=True) for x in (0.5, -1.25, 1e-9)] == ["+0.50", "-1.3", "0"]


@pytest.mark.parametrize("value", [-0.025, -0.1 / 4, (0.4 - 0.5) / 4, 0.3 - 0.325])
def test_one_number_is_shown_alike_however_it_was_computed(value):
    shown = [format_number(value), format_number(value, signed=True)]
    shown += [format_estimate(Estimate(value, -0.2, 0.1), signed=s).split()[0] for s in (0, 1)]
    assert shown == ["-0.03"] * 4


@pytest.mark.parametrize(
    ("p", "shown"),
    [(0.0009, "< 0.001"), (0.0044, "= 0.004"), (0.0625, "= 0.062"), (0.1, "= 0.10")],
)
def test_p_by_hand(p, shown):
    assert format_p(p) == shown


numbers = st.floats(-1e12, 1e12, allow_nan=False)


@given(st.tuples(numbers, numbers, numbers).map(sorted))
def test_an_interval_shown_contains_the_exact_one(parts):
    low, value, high = parts
    shown = format_estimate(Estimate(value, low, high))
    _, least, greatest = map(float, re.findall(r"[-\d.e]+", shown))
    assert least - low <= 1e-9 + 1e-11 * abs(low)
    assert high - greatest <= 1e-9 + 1e-11 * abs(high)


rates = st.floats(0.0, 1.0)


@given(st.tuples(rates, rates, rates).map(sorted))
def test_rates_shown_are_rates(parts):
    low, value, high = parts
    shown = re.findall(r"[-\d.e]+", format_estimate(Estimate(value, low, high)))
    assert all(0.0 <= float(text) <= 1.0 for text in shown)
    assert not any(text.startswith((".", "-")) for text in shown)
