from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_results import ablation
from scipy import stats

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.studies.results.analysis import estimate_of, mean_estimate, verdicts
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.differences import (
    Difference,
    difference,
    differences,
    paired_difference,
    ratio,
    select_shared,
)
from nested_agents.studies.results.results import (
    STEPS,
    Results,
    StepLimits,
    describe_number,
    from_arrays,
    step_limits,
)
from nested_agents.studies.results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate


def within(estimate: Estimate, bounds: tuple[float, float]) -> bool:
    """Return whether an interval, if there is one, lies within bounds and contains its value."""
    least, greatest = bounds
    value, low, high = map(float, estimate)
    if np.isnan([low, high]).all():
        return least <= value <= greatest
    return least <= low <= value + 1e-9 and value - 1e-9 <= high <= greatest


MEASURES = (
    Measure("share", "share", least=0.0, greatest=1.0),
    Measure("distance", "distance", "m", least=0.0),
    Measure("angle", "angle", "rad", least=-3.0, greatest=3.0),
)


@given(st.data(), st.sampled_from(MEASURES), st.integers(2, 12))
def test_no_interval_leaves_the_range_of_its_measure(data, measure, n_seeds) -> None:
    least, greatest = measure.bounds
    values = st.lists(st.floats(least, min(greatest, 1e6)), min_size=n_seeds, max_size=n_seeds).map(
        np.array
    )
    own, base = data.draw(values), data.draw(values)
    assert within(mean_estimate(measure, pd.DataFrame(own)), measure.bounds)
    reach = greatest - least
    assert within(paired_difference(own, base, measure), (-reach, reach))


@given(st.lists(st.booleans(), min_size=2, max_size=12), st.data())
def test_no_interval_of_rates_leaves_their_range(own, data) -> None:
    base = data.draw(st.lists(st.booleans(), min_size=len(own), max_size=len(own)))
    one, other = np.array(own, float), np.array(base, float)
    assert within(mean_estimate(SUCCESS, pd.DataFrame(one)), (0.0, 1.0))
    assert within(paired_difference(one, other, SUCCESS), (-1.0, 1.0))


def lengths(steps: list[list[int]], limits: StepLimits) -> Results:
    phases = {"evaluation": {"a": {"steps": steps, "success": np.ones(np.shape(steps))}}}
    results = from_arrays(phases, {"a": range(len(steps))}, {}, {}, {"a": {}}, (SUCCESS,))
    return replace(results, step_limits=limits)


@pytest.mark.parametrize("base", [[0.1, 0.4, 0.7], [1 / 3, 0.0, 2 / 3], [0.5, 0.25, 0.0]])
def test_rates_that_differ_equally_except_for_rounding_have_a_wide_interval(base):
    own = np.array(base) + 0.2
    estimate = paired_difference(own, np.array(base), SUCCESS)
    assert estimate.low < 0.0 < estimate.value < estimate.high - 0.2


def test_lengths_of_episodes_end_at_the_longest_allowed() -> None:
    """Of 150, 150 and 100 steps Student's interval would reach from 62 to 205."""
    results = lengths([[150], [150], [100]], (450, 150))
    estimate = estimate_of(results, "a", "evaluation", STEPS)
    assert float(estimate.high) == 150.0
    assert float(estimate.low) == pytest.approx(400 / 3 - 4.3027 * 28.868 / 3**0.5, abs=0.1)
    compared = compare_conditions(results, "steps").table[0].estimates
    assert float(compared["evaluation steps to success"].high) == 150.0
    equal = estimate_of(lengths([[25]] * 8, (25, 25)), "a", "evaluation", STEPS)
    assert tuple(map(float, equal)) == (25.0, 25.0, 25.0)


@pytest.mark.parametrize(
    ("spec", "training", "evaluation"),
    [({"steps": 90}, 90, 90), ({"steps": 90, "evaluation_steps": 150}, 90, 150), ({}, None, None)],
)
def test_the_longest_episode_is_that_of_the_spec(spec, training, evaluation) -> None:
    results = lengths([[1], [2]], step_limits(spec))
    phases = ("training", "training:first", "weights kept", "evaluation", "evaluation:b", "after 9")
    limits = [training] * 3 + [evaluation] * 3
    assert [results.steps(phase).greatest for phase in phases] == limits


@pytest.mark.parametrize("name", ["seconds.learning", "cpu.1000", "messages", "decision_median"])
def test_times_and_counts_are_never_negative(name) -> None:
    measure, _ = describe_number(name)
    estimate = bootstrap([0.1, 1.1], bounds=measure.bounds)
    assert measure.bounds == NOT_NEGATIVE
    assert float(estimate.low) == 0.0


def with_first(results: Results) -> tuple[Difference, ...]:
    first, *others = results.conditions
    base = results.means(first, "evaluation")
    pairs = [(c, "greedy", results.means(c, "evaluation"), base) for c in others]
    return differences({"all": pairs})["all"]


def test_a_difference_is_found_and_none_is_not() -> None:
    results = ablation({"default": 0.9, "same": 0.9, "worse": 0.3}).frames()
    same, worse = with_first(results)
    assert same.p > 0.05
    assert same.estimate.low < 0.0 < same.estimate.high
    assert worse.p < 0.001
    assert worse.estimate.high < -0.4
    assert worse.seeds == 20
    assert "p < 0.001" in worse.shown


def test_only_seeds_that_both_have_are_compared() -> None:
    arrays = ablation({"a": 0.5, "b": 0.5})
    arrays.seeds["a"] = tuple(range(20))
    arrays.seeds["b"] = tuple(range(15, 35))
    results = arrays.frames()
    means = [results.means(condition, "evaluation") for condition in ("a", "b")]
    one, other = select_shared(means)
    assert (one == means[0].to_numpy()[15:]).all()
    assert (other == means[1].to_numpy()[:5]).all()


def test_without_common_seeds_the_samples_are_independent() -> None:
    arrays = ablation({"a": 0.5, "b": 0.5})
    arrays.seeds["b"] = tuple(range(100, 120))
    results = arrays.frames()
    (found,) = with_first(results)
    own, base = (results.means(condition, "evaluation") for condition in ("b", "a"))
    expected = stats.ttest_ind(own, base, equal_var=False).confidence_interval()
    assert not found.paired
    assert (found.estimate.low, found.estimate.high) == pytest.approx(tuple(expected))
    assert "independent samples" in found.shown
    assert "permutation of labels" in " ".join(verdicts({"all": [found]}))
    arrays.seeds["b"] = (0, *range(100, 119))  # one common seed cannot be paired
    assert not with_first(arrays.frames())[0].paired


def outcomes(rng: np.random.Generator, chance: float) -> np.ndarray:
    return rng.random((20, 10)) < chance


@pytest.mark.parametrize(("above", "below"), [(0.9, 0.95), (0.5, 0.9), (0.3, 0.6)])
def test_intervals_of_differences_and_ratios_cover(above: float, below: float) -> None:
    rng = np.random.default_rng(0)
    hit = np.zeros(2)
    for _ in range(300):
        one, other = outcomes(rng, above), outcomes(rng, below)
        for i, (found, truth) in enumerate(
            [(difference(one, other), above - below), (ratio(one, other), above / below)]
        ):
            assert found.low <= found.value <= found.high
            hit[i] += found.low <= truth <= found.high
    assert (hit / 300 > 0.93).all()


def test_newcombe_by_hand() -> None:
    # Newcombe 1998, table II, method 10, case (a): 56/70 - 48/80.
    one = np.repeat([1, 0], [56, 14])[:, None]
    other = np.repeat([1, 0], [48, 32])[:, None]
    found = difference(one, other)
    assert [round(float(v), 4) for v in (found.value, found.low, found.high)] == [
        0.2, 0.0524, 0.3339,
    ]  # fmt: skip


def test_bounds_of_a_ratio_are_where_the_difference_has_a_bound_of_zero() -> None:
    """The interval of a - r b, from those of a and b as in `difference`, ends at 0 (Zou 2008)."""
    one, other = np.eye(8)[:, :4], np.tile([1, 1, 0, 1], (8, 1))
    a, b, r = rate(one), rate(other), ratio(one, other)
    assert r.value == pytest.approx(a.value / b.value)
    low = np.hypot(a.value - a.low, r.low * (b.high - b.value))
    high = np.hypot(a.high - a.value, r.high * (b.value - b.low))
    assert a.value - r.low * b.value == pytest.approx(low)
    assert r.high * b.value - a.value == pytest.approx(high)


def test_runs_that_all_ended_alike_still_leave_doubt() -> None:
    all_, none = np.ones((6, 5)), np.zeros((6, 5))
    found = ratio(all_, all_)
    assert found.low < 0.7
    assert found.high > 1.4
    assert np.isnan(ratio(all_, none).value)
    assert ratio(np.eye(6)[:, :5], np.eye(6)[:, :5]).high < np.inf
    once = none.copy()
    once[0, 0] = 1.0
    assert ratio(all_, once).high > 100.0


@pytest.mark.parametrize(
    ("low", "p", "is_explained"), [(0.01, 0.2, True), (-0.1, 0.2, False), (0.01, 0.01, False)]
)
def test_an_interval_that_seems_to_contradict_p_is_explained_once(
    low: float, p: float, is_explained: bool
) -> None:
    estimate = Estimate(*map(np.array, (0.2, low, 0.4)))
    sample = np.linspace(0.0, 0.4, 8)
    values = (sample, np.zeros(8))
    found = Difference("a", "evaluation success", estimate, p, p, values)
    text = " ".join(" ".join(verdicts({"all": [found, found]})).split())
    assert text.count("seem to disagree about 0, p decides.") == is_explained
    assert "in evaluation success with power 0.80 (p adjusted over 2 comparisons)." in text
