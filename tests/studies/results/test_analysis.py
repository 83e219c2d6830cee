import numpy as np
import pytest
from made_up_results import ablation

from nested_agents.studies.results.analysis import (
    Difference,
    difference,
    differences,
    ratio,
    select_shared,
    verdicts,
)
from nested_agents.studies.results.results import Results
from nested_agents.studies.results.statistics import Estimate


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
    arrays.seeds["b"] = tuple(range(100, 120))
    assert with_first(arrays.frames()) == ()


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
    found = Difference("a", "evaluation success", 8, estimate, p, p, sample)
    text = " ".join(" ".join(verdicts({"all": [found, found]})).split())
    assert text.count("where they seem to disagree about 0, p decides.") == is_explained
    assert "probability 0.80 in evaluation success." in text
