"""Intervals over seeds: hand-worked numbers, and coverage in simulations with known truth."""

import numpy as np
import pytest
from scipy import stats

from nested_agents.studies.laws.inference import (
    mean_interval,
    ratio_interval,
    sign_change,
)


def test_a_mean_has_students_interval():
    values = np.array([1.0, 4.0, 2.5, 3.5])
    low, high = stats.t.interval(0.95, 3, values.mean(), stats.sem(values))
    assert mean_interval(values) == pytest.approx((2.75, low, high))


def test_one_seed_has_no_interval():
    value, low, high = mean_interval(np.array([2.0]))
    assert value == 2.0
    assert np.isnan([low, high]).all()


def test_a_ratio_to_a_constant_is_that_of_the_mean():
    values = np.array([2.0, 2.6, 2.2, 1.6])
    assert ratio_interval(values, np.full(4, 2.0)) == pytest.approx(
        tuple(float(end) / 2.0 for end in mean_interval(values))
    )


def test_fiellers_ends_are_where_the_t_test_turns_significant():
    rng = np.random.default_rng(3)
    top, bottom = rng.gamma(20.0, 0.2, 9), rng.gamma(10.0, 0.1, 9)
    for end in ratio_interval(top, bottom)[1:]:
        assert stats.ttest_1samp(top - float(end) * bottom, 0.0).pvalue == pytest.approx(0.05)


def test_a_ratio_has_no_upper_end_if_the_denominator_may_be_zero():
    value, low, high = ratio_interval(np.array([2.0, 2.1, 1.9]), np.array([0.1, -0.1, 0.06]))
    assert value > 0.0
    assert low > 0.0
    assert high == np.inf


def test_a_ratio_to_a_mean_that_is_not_positive_is_infinite():
    assert ratio_interval(np.array([2.0, 2.1, 1.9]), np.array([-0.1, -0.1, 0.1])).value == np.inf


def test_a_sign_change_between_two_sizes_is_interpolated_on_a_logarithmic_scale():
    differences = np.array([[-1.0, -1.0, 1.0, 2.0]] * 5) + np.linspace(-0.1, 0.1, 5)[:, None]
    size = sign_change([2, 4, 16, 32], differences)
    assert size is not None
    assert float(size.value) == pytest.approx(8.0)
    assert 4.0 < size.low < 8.0 < size.high < 16.0


@pytest.mark.parametrize(
    "means",
    [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [-1.0, -0.5, 0.0], [1.0, -1.0, -1.0]],
    ids=["always better", "always worse", "equal at the end", "worse at the end"],
)
def test_no_sign_change_is_claimed_without_one(means):
    rng = np.random.default_rng(0)
    differences = np.array(means) + rng.normal(size=(8, 3), scale=0.05)
    differences[:, 2] -= differences[:, 2].mean() - means[2]
    assert sign_change([2, 4, 8], differences) is None


def test_sizes_at_which_all_seeds_are_equal_are_left_out():
    differences = np.random.default_rng(0).normal([0.0, 0.5, 0.9], 0.05, (12, 3))
    differences[:, 0] = 0.0
    assert sign_change([1, 2, 4], differences) is None
    differences[:, 1] -= 1.0
    assert float(sign_change([1, 2, 4], differences).value) == pytest.approx(2.7, abs=0.2)


def test_the_interval_of_a_sign_change_covers_the_truth_at_its_level():
    rng = np.random.default_rng(1)
    sizes = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    truth = np.exp(np.log(4.0) + np.log(2.0) * 0.5 / 1.5)  # between -0.5 at 4 and 1 at 8
    covered = []
    for _ in range(600):
        noise = rng.normal(size=(12, 1), scale=0.5) + rng.normal(size=(12, 5))
        found = sign_change(sizes, np.array([-2.0, -1.0, -0.5, 1.0, 2.0]) + noise)
        if found is not None:
            covered.append(found.low <= truth <= found.high)
    assert len(covered) > 590
    assert 0.92 <= np.mean(covered) <= 0.98
