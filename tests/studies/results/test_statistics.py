"""Estimates with intervals and permutation tests, against exact enumeration and SciPy."""

import tracemalloc
from fractions import Fraction
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import nested_agents as na
from nested_agents.studies.results.permutation_tests import (
    BITS,
    EXACT,
    _flips,
    friedman,
    holm,
    paired_permutation,
)
from nested_agents.studies.results.statistics import (
    FEW,
    PROBABILITY_RESAMPLES,
    RESAMPLES,
    bootstrap,
    cliffs_delta,
    probability_higher,
    rate,
    rates,
    resample_weights,
    welch,
)
from research import RESULTS

RNG = np.random.default_rng(0)


def test_the_interval_has_the_percentiles_of_resampled_means():
    values = RNG.normal(size=30)
    runs = np.random.default_rng(0).integers(30, size=(RESAMPLES, 30))
    tail = stats.norm.cdf(stats.t.ppf(0.025, 29) * np.sqrt(30 / 29))  # Hesterberg 2015
    low, high = np.quantile(values[runs].mean(axis=1), [tail, 1.0 - tail])
    estimate = bootstrap(values)
    assert (estimate.low, estimate.high) == (pytest.approx(low), pytest.approx(high))


@pytest.mark.parametrize("shape", [(8,), (20, 5), (700,)])  # 700 runs are resampled in blocks
def test_the_bootstrap_is_that_of_scipy(shape):
    values = np.random.default_rng(3).normal(size=shape)
    n_runs = shape[0]
    tail = stats.norm.cdf(stats.t.ppf(0.025, n_runs - 1) * np.sqrt(n_runs / (n_runs - 1)))
    reference = stats.bootstrap(
        (values,),
        np.mean,
        method="percentile",
        confidence_level=1.0 - 2.0 * tail,
        n_resamples=RESAMPLES,
        rng=np.random.default_rng(0),
    ).confidence_interval
    estimate = bootstrap(values)
    assert np.allclose(estimate.low, reference.low, rtol=0.0, atol=1e-12)
    assert np.allclose(estimate.high, reference.high, rtol=0.0, atol=1e-12)


def test_points_are_estimated_apart():
    values = RNG.normal(size=(8, 3))
    together = bootstrap(values)
    for point in range(3):
        alone = bootstrap(values[:, point])
        for end in ("value", "low", "high"):
            assert getattr(together, end)[point] == pytest.approx(getattr(alone, end), abs=1e-12)


def test_one_run_has_no_interval():
    for estimate in (bootstrap([3.0]), rate([[1, 0]])):
        assert np.isnan(estimate.low)
        assert np.isnan(estimate.high)


@pytest.mark.parametrize("runs", [2, 3, 4, 5, 6, 7, 8, 10, 15, 30])
def test_the_mean_is_covered_about_as_often_as_promised(runs):
    rng, times = np.random.default_rng(0), 600
    values = rng.normal(3.0, 2.0, size=(runs, times))  # points are estimated apart
    found = [bootstrap(column) for column in values.T]
    covered = np.mean([e.low <= 3.0 <= e.high for e in found])
    assert 0.92 <= covered <= 0.975


@pytest.mark.parametrize("runs", [2, 3, 5, 7, 8, 12, 20, 30])
@pytest.mark.parametrize("success", [0.5, 0.9, 0.98])
def test_rates_are_covered_however_few_the_runs(runs, success):
    rng, covered, times = np.random.default_rng(1), 0, 500
    for _ in range(times):
        chances = rng.beta(9.0 * success, 9.0 * (1.0 - success), size=runs)
        estimate = rate(rng.random((runs, 10)) < chances[:, None])
        assert 0.0 <= estimate.low < estimate.high <= 1.0
        covered += bool(estimate.low <= success <= estimate.high)
    assert covered / times >= 0.92


def test_few_runs_have_students_interval_by_hand():
    # t(0.975, 2) = 4.3027; the standard error of the mean of 1, 2, 3 is 1 / sqrt(3).
    estimate = bootstrap([1.0, 2.0, 3.0])
    assert estimate.low == pytest.approx(2.0 - 4.302653 / np.sqrt(3.0), abs=1e-6)
    bounded = bootstrap([0.9, 1.0, 1.0], bounds=(0.0, 1.0))
    assert bounded.high == 1.0
    assert bounded.low == pytest.approx(29 / 30 - 4.302653 / 30, abs=1e-6)


@pytest.mark.parametrize("runs", [2, 5, 8, 30])
def test_what_all_runs_have_in_full_is_not_certain(runs):
    for value in (0.0, 1.0):
        estimate = bootstrap(np.full(runs, value), bounds=(0.0, 1.0))
        wilson = rate(np.full((runs, 1), value))
        assert (estimate.low, estimate.high) == pytest.approx((wilson.low, wilson.high))
    low = float(bootstrap(np.ones(runs)).low)  # of a number of bytes, say
    assert np.isnan(low) if runs < FEW else low == 1.0


@pytest.mark.parametrize(("successes", "runs"), [(0, 8), (1, 8), (5, 8), (8, 8), (31, 40)])
def test_one_episode_a_run_is_wilsons_interval(successes, runs):
    outcomes = np.arange(runs) < successes
    reference = stats.binomtest(successes, runs).proportion_ci(method="wilson")
    estimate = rate(outcomes[:, None])
    assert estimate.low == pytest.approx(reference.low, abs=1e-12)
    assert estimate.high == pytest.approx(reference.high, abs=1e-12)


def test_runs_that_all_succeed_or_all_fail_count_once():
    outcomes = np.repeat(np.arange(8)[:, None] < 4, 5, axis=1)
    reference = stats.binomtest(4, 8).proportion_ci(method="wilson")
    # The design effect is estimated, with 7 degrees of freedom for 8: hence not exactly the same.
    assert rate(outcomes).low == pytest.approx(reference.low, abs=0.03)


def test_many_failures_spread_over_all_runs_count_as_many_as_their_episodes():
    outcomes = np.tile(np.arange(500) % 5 < 3, (8, 1))
    reference = stats.binomtest(2400, 4000).proportion_ci(method="wilson")
    assert rate(outcomes).low == pytest.approx(reference.low, abs=5e-3)


def test_a_failure_more_hardly_raises_the_lower_end():
    outcomes = np.ones((30, 10))
    ends = [rate(outcomes).low]
    for run in range(12):
        outcomes[run, 0] = 0.0
        ends.append(rate(outcomes).low)
    assert ends[0] == pytest.approx(0.886, abs=1e-3)
    # One failure tells that episodes of a run need not end alike, which is worth a little.
    assert max(np.diff(ends)) < 0.03


@pytest.mark.parametrize(("runs", "dead"), [(10, 0.05), (10, 0.0), (30, 0.05), (30, 0.0)])
def test_intervals_cover_when_some_runs_never_learn(runs, dead):
    covered = 0
    for _ in range(300):
        chances = np.where(RNG.random(runs) < dead, 0.0, 0.99)
        estimate = rate(RNG.random((runs, 10)) < chances[:, None])
        covered += bool(estimate.low <= (1.0 - dead) * 0.99 <= estimate.high)
    assert covered / 300 >= 0.9


def test_rates_are_by_column():
    outcomes = RNG.random((8, 4)) < 0.5
    together = rates(outcomes)
    assert together.high[2] == rate(outcomes[:, 2:3]).high


@settings(max_examples=100)
@given(st.integers(2, 9), st.integers(1, 6), st.randoms(use_true_random=False))
def test_a_rate_lies_within_its_interval(runs, episodes, random):
    outcomes = [[random.random() < 0.5 for _ in range(episodes)] for _ in range(runs)]
    estimate = rate(outcomes)
    assert 0.0 <= estimate.low <= estimate.value <= estimate.high <= 1.0


@pytest.mark.parametrize("values", [[], np.zeros((2, 2, 2))])
def test_what_cannot_be_estimated_is_refused(values):
    with pytest.raises(ValueError, match="allowed \\(n_runs,\\) or"):
        bootstrap(values)


@pytest.mark.parametrize(
    ("function", "values", "options", "named"),
    [
        (rate, [[0, 2]], {}, r"outcomes\[0, 1\] = 2.0"),
        (rate, [[1], [-0.5]], {}, r"outcomes\[1, 0\] = -0.5"),
        (rate, [[1], [np.nan]], {}, r"outcomes\[1, 0\] = nan"),
        (rate, [[1], [0]], {"level": 1.0}, "level = 1.0"),
        (rate, [[1], [0]], {"level": np.nan}, "level = nan"),
        (bootstrap, [1.0, np.inf], {}, r"values\[1\] = inf"),
        (bootstrap, [[1.0], [np.nan]], {}, r"values\[1, 0\] = nan"),
        (bootstrap, [1.0, 2.0], {"level": 95.0}, "level = 95.0"),
        (bootstrap, [1.0, 2.0], {"bounds": (1.0, 0.0)}, "bounds = "),
        (bootstrap, [1.0, 2.0], {"bounds": (np.nan, 1.0)}, "bounds = "),
    ],
)
def test_an_argument_out_of_range_is_named(function, values, options, named) -> None:
    with pytest.raises(ValueError, match=f"^{named}.*, allowed: "):
        function(values, **options)


@pytest.mark.filterwarnings("error")
def test_welchs_interval_is_that_of_scipy_and_rounding_errors_are_no_spread() -> None:
    own, base = np.random.default_rng(0).normal(size=(2, 7))
    expected = stats.ttest_ind(own, base[:4], equal_var=False).confidence_interval(0.95)
    assert welch(own, base[:4])[1:] == pytest.approx(expected)
    assert welch([1.0, 2.0, 3.0], [4.0] * 3) == pytest.approx([-2.0, -4.4841377, 0.4841377])
    assert welch([0.3, 0.1 + 0.2], [0.1 + 0.2] * 2) == (0.0, 0.0, 0.0)


def test_friedman_is_scipys_statistic_with_ties_and_without() -> None:
    rng = np.random.default_rng(0)
    for values in (rng.normal(size=(9, 4)), rng.integers(3, size=(12, 5)).astype(float)):
        found = friedman(values, permutations=99)
        assert found.statistic == pytest.approx(stats.friedmanchisquare(*values.T).statistic)
        n, k = values.shape
        assert found.concordance == pytest.approx(found.statistic / (n * (k - 1)))


def test_friedman_p_is_that_of_all_permutations() -> None:
    values = np.array([[1.0, 2.0, 3.0], [1.0, 3.0, 2.0], [2.0, 1.0, 3.0]])
    sums = [
        (np.sum(rows, axis=0) ** 2).sum() for rows in product(permutations((-1, 0, 1)), repeat=3)
    ]
    observed = ((values - 2).sum(axis=0) ** 2).sum()
    exact = np.mean(np.array(sums) >= observed)
    assert friedman(values, permutations=20000).p == pytest.approx(exact, abs=0.02)


def test_friedman_of_equal_conditions_says_nothing() -> None:
    assert friedman(np.ones((5, 3))) == friedman(np.zeros((5, 3)))
    assert friedman(np.ones((5, 3))).p == 1.0
    with pytest.raises(ValueError, match="1 seeds x 3 conditions"):
        friedman(np.ones((1, 3)))


def test_false_alarms_are_as_rare_as_promised() -> None:
    rng = np.random.default_rng(1)
    alarms = np.mean([friedman(rng.normal(size=(6, 3)), 199, seed=s).p <= 0.05 for s in range(400)])
    assert 0.02 < alarms < 0.08


def test_sign_flips_by_hand() -> None:
    # Differences 1, 2, 3: only +++ and --- reach a sum of 6.
    assert paired_permutation([1, 2, 3], [0, 0, 0]) == 2 / 8
    assert paired_permutation([1, 2], [1, 2]) == 1.0


@pytest.mark.parametrize("scale", [1e-9, 0.1, 1.0, 1e4, 1e12])
def test_ties_are_ties_whatever_the_size_of_the_values(scale: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(160):
        whole = rng.integers(0, 6, size=(2, int(rng.integers(1, 9))))
        difference = [int(a) - int(b) for a, b in whole.T]
        sums = [sum(s * d for s, d in zip(signs, difference, strict=True))
                for signs in product((-1, 1), repeat=len(difference))]  # fmt: skip
        exact = np.mean([abs(found) >= abs(sum(difference)) for found in sums])
        assert paired_permutation(whole[0] * scale, whole[1] * scale) == exact
        assert (
            paired_permutation(whole[0] / 7 * scale + 3 * scale, (whole[1] / 7 + 3) * scale)
            == exact
        )


@pytest.mark.parametrize("size", [2.0**47, 1e14, 2.0**51])
@pytest.mark.parametrize("large", [1, 8])
def test_large_values_hide_no_differences(size: float, large: int) -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        n = int(rng.integers(2, 9))
        values = rng.integers(0, 9, size=(2, n)) + np.where(np.arange(n) < large, size, 0.0)
        difference = [Fraction(a) - Fraction(b) for a, b in values.T]
        sums = [sum(s * d for s, d in zip(signs, difference, strict=True))
                for signs in product((-1, 1), repeat=n)]  # fmt: skip
        exact = np.mean([abs(found) >= abs(sum(difference)) for found in sums])
        assert paired_permutation(*values) == exact


def test_what_is_no_pairs_is_refused() -> None:
    for one, other in (([1.0, 2.0, 3.0], [1.0]), ([], []), ([[1.0]], [[1.0]])):
        with pytest.raises(ValueError, match="as many on both sides"):
            paired_permutation(one, other)
    with pytest.raises(ValueError, match="finite"):
        paired_permutation([1.0, np.nan], [0.0, 0.0])


def test_drawn_sign_flips_are_near_all_of_them() -> None:
    rng = np.random.default_rng(2)
    difference = rng.normal(0.4, 1.0, size=14)
    exact = paired_permutation(difference, np.zeros(14))
    drawn = paired_permutation(difference, np.zeros(14), permutations=10000)
    assert drawn == pytest.approx(exact, abs=0.02)


def test_holm_by_hand() -> None:
    np.testing.assert_allclose(holm([0.01, 0.02, 0.03, 0.005]), [0.03, 0.04, 0.04, 0.02])
    assert holm([0.6, 0.7]).tolist() == [1.0, 1.0]


@pytest.mark.parametrize("n", [3, 10, 11, 16, 17, 37])
def test_signs_are_those_that_are_drawn_at_once(n: int) -> None:
    if 2**n <= EXACT:
        expected = np.array(list(product((0, 1), repeat=n)))[:, ::-1]
    else:
        expected = 1 - np.random.default_rng(0).integers(0, 2, size=(EXACT, n))
    numbers = _flips(n, EXACT)
    signs = [part[:, None] >> np.arange(BITS) & 1 for part in numbers]
    assert np.array_equal(np.concatenate(signs, axis=1)[:, :n], expected)


def test_a_test_of_many_seeds_takes_little_memory() -> None:
    values = np.random.default_rng(0).normal(size=(2, 1200))
    tracemalloc.start()
    p = paired_permutation(*values)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert p == 0.75361  # as when all signs were drawn at once
    assert peak < 60e6


def pairwise_probability(own, base):
    """Return the probability of a higher value and its percentiles by all pairs of runs."""
    won = 0.5 + 0.5 * np.sign(np.subtract.outer(own, base))
    weights, base_weights = (
        np.concatenate([*resample_weights(n_runs, PROBABILITY_RESAMPLES, seed)])
        for seed, n_runs in enumerate(won.shape)
    )
    drawn = np.einsum("ri,ij,rj->r", weights, won, base_weights, optimize=True)
    return won.mean(), *np.quantile(drawn, [0.025, 0.975])


@pytest.mark.parametrize("name", ["scaling", "arms", "hierarchies"])
def test_ranks_give_the_probabilities_of_all_pairs_on_published_tables(name) -> None:
    for d in na.load(RESULTS / f"{name}.json").compare(measure="steps").differences:
        own, base = d.values
        pairs = np.sign(np.subtract.outer(own, base))
        assert cliffs_delta(own, base) == d.cliffs_delta == pytest.approx(pairs.mean(), abs=1e-15)
        if abs(pairs.mean()) < 1.0:
            expected = pairwise_probability(own, base)
            assert [*probability_higher([(own, base)])] == pytest.approx(expected, abs=1e-12)


def test_no_matrix_of_all_pairs_of_runs_is_built() -> None:
    values = np.random.default_rng(0).normal(size=(2, 30_000))
    tracemalloc.start()
    assert abs(cliffs_delta(*values)) < 0.02
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6
