import numpy as np
import pytest
from made_up_results import ablation

from nested_agents.studies.comparison import differences, paired, ratio

MEASURES = {"greedy": lambda r, c: r.evaluation[c]["success"].mean(axis=1)}


def test_a_difference_is_found_and_none_is_not() -> None:
    results = ablation({"default": 0.9, "same": 0.9, "worse": 0.3})
    same, worse = differences(results, "default", ["same", "worse"], MEASURES)
    assert same.p > 0.05
    assert same.estimate.low < 0.0 < same.estimate.high
    assert worse.p < 0.001
    assert worse.estimate.high < -0.4
    assert worse.seeds == 20
    assert "p < .001" in worse.shown


def test_only_seeds_that_both_have_are_compared() -> None:
    results = ablation({"a": 0.5, "b": 0.5})
    results.seeds["a"] = tuple(range(20))
    results.seeds["b"] = tuple(range(15, 35))
    pairs = paired(results, "a", "b", MEASURES["greedy"])
    assert pairs.shape == (5, 2)
    assert (pairs[:, 1] == MEASURES["greedy"](results, "b")[:5]).all()
    results.seeds["b"] = tuple(range(100, 120))
    assert differences(results, "a", ["b"], MEASURES) == ()


def test_a_ratio_by_hand_and_its_interval_by_brute_force() -> None:
    rng = np.random.default_rng(0)
    below, above = rng.uniform(0.5, 1.0, 30), rng.uniform(0.3, 0.6, 30)
    found = ratio(above, below)
    assert found.value == pytest.approx(above.sum() / below.sum())
    again = np.random.default_rng(9)
    draws = [again.integers(30, size=30) for _ in range(4000)]
    brute = np.quantile([above[d].sum() / below[d].sum() for d in draws], [0.025, 0.975])
    assert [found.low, found.high] == pytest.approx(brute, abs=0.01)


def test_a_ratio_to_nothing_is_not_a_number() -> None:
    assert np.isnan(ratio([1.0, 1.0], [0.0, 0.0]).value)
    assert np.isnan(ratio([1.0], [1.0]).low)
    assert ratio([1.0, 1.0, 1.0], [0.0, 0.0, 1.0]).high == np.inf
