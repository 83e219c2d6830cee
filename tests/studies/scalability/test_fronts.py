"""Pareto fronts and budgets: small cases that can be checked by hand."""

import numpy as np
import pytest

from nested_agents.core.interface.measures import SUCCESS
from nested_agents.core.numerics import pd
from nested_agents.studies.errors import SpecError
from nested_agents.studies.scalability.data import ScalabilityData, paired
from nested_agents.studies.scalability.fronts import (
    best_within,
    non_dominated,
    pareto_points,
    parse_budget,
    probability_of_best,
)

SEEDS = range(8)


def constant(value):
    return pd.Series(value, SEEDS, dtype=float)


@pytest.fixture
def data():
    performances = {("chain", 2.0): 0.9, ("tree", 2.0): 0.8, ("none", 2.0): 0.7}
    performances |= {("chain", 4.0): 0.5, ("tree", 4.0): 0.8, ("none", 4.0): 0.6}
    messages = {("chain", 2.0): 6, ("tree", 2.0): 4, ("none", 2.0): 0}
    messages |= {("chain", 4.0): 28, ("tree", 4.0): 13, ("none", 4.0): 0}
    cells = {place: constant(value) for place, value in performances.items()}
    return ScalabilityData(
        size="robots",
        scaling="weak",
        performance=SUCCESS,
        performance_title="evaluation success",
        performances=cells,
        performance_estimates={},
        times=cells,
        costs={"messages": {place: constant(value) for place, value in messages.items()}},
    )


def test_a_point_is_beaten_only_if_another_is_no_worse_in_both_and_better_in_one():
    performance = np.array([0.9, 0.9, 0.5, 0.5, 1.0])
    cost = np.array([10.0, 10.0, 5.0, 6.0, 50.0])
    assert non_dominated(performance, cost).tolist() == [True, True, True, False, True]


def test_means_that_differ_by_rounding_tie():
    performance = np.array([0.1 + 0.2, 0.3])
    assert non_dominated(performance, np.array([2.0, 1.0])).tolist() == [False, True]
    assert non_dominated(performance, np.array([1.0, 1.0])).tolist() == [True, True]


def test_the_front_of_every_size(data):
    on_front = {(p.size, p.hierarchy) for p in pareto_points(data).itertuples() if p.on_front}
    assert on_front == {(2.0, "chain"), (2.0, "tree"), (2.0, "none"), (4.0, "tree"), (4.0, "none")}
    assert {p.probability for p in pareto_points(data).itertuples()} == {0.0, 1.0}


def test_seeds_that_differ_make_the_front_uncertain(data):
    values = pd.Series(np.linspace(0.5, 1.1, 8), SEEDS)
    data.performances["chain", 4.0] = values
    (chain,) = [
        p for p in pareto_points(data).itertuples() if (p.size, p.hierarchy) == (4.0, "chain")
    ]
    assert 0.2 < chain.probability < 0.8


def test_the_best_hierarchy_within_a_budget(data):
    two, four = best_within(data, {"messages": 5.0}).itertuples()
    assert (two.hierarchy, two.allowed, two.probability) == ("tree", ("tree", "none"), 1.0)
    assert (four.hierarchy, four.allowed) == ("none", ("none",))


def test_a_hierarchy_of_unknown_cost_is_not_chosen_and_does_not_hide_the_others(data):
    del data.costs["messages"]["none", 4.0]
    four = best_within(data, {"messages": 50.0}).iloc[1]
    assert (four.hierarchy, four.allowed) == ("tree", ("chain", "tree"))
    assert four.unknown == ("none",)


def test_hierarchies_of_equal_performance_share_the_probability_of_being_the_best(data):
    data.performances["tree", 2.0] = data.performances["chain", 2.0]
    two = best_within(data, {"messages": 50.0}).iloc[0]
    assert (two.hierarchy, two.probability) == ("chain", 0.5)


def test_no_hierarchy_of_a_size_may_be_within_the_budget(data):
    del data.performances["none", 4.0]
    assert best_within(data, {"messages": 5.0})["hierarchy"].tolist() == ["tree", None]


def test_seeds_are_paired_by_name_between_performance_and_cost(data):
    performance = pd.Series([1.0, *[0.0] * 7], range(8))
    cost = pd.Series([*[9.0] * 7, 1.0], range(1, 9))  # without seed 0, which alone succeeds
    for name in ("chain", "tree", "none"):
        data.performances[name, 4.0] = performance
        data.costs["messages"][name, 4.0] = cost
    assert {p.performance for p in pareto_points(data).itertuples() if p.size == 4.0} == {0.0}
    assert {p.cost_value for p in pareto_points(data).itertuples() if p.size == 4.0} == {9.0}


def test_a_budget_below_everything_says_what_was_measured(data):
    with pytest.raises(SpecError, match="messages >= 0"):
        best_within(data, {"messages": -1.0})


def test_a_cost_that_was_not_measured_is_refused(data):
    with pytest.raises(SpecError, match=r"decision_ms.*messages"):
        best_within(data, {"decision_ms": 5.0})


@pytest.mark.parametrize(
    "text", ["messages", "messages < ", "messages < 5", "messages >= 5", "messages <= 1e"]
)
def test_a_budget_that_cannot_be_read_is_refused(text):
    with pytest.raises(SpecError, match="must be COST <= NUMBER"):
        parse_budget(text)


def test_a_cost_has_one_limit():
    with pytest.raises(SpecError, match="messages stands twice"):
        parse_budget("messages <= 5, messages <= 9")


def test_probabilities_of_being_best_add_up_to_one():
    rng = np.random.default_rng(0)
    shares = probability_of_best(rng.normal(size=(9, 4)))
    assert shares.sum() == pytest.approx(1.0)
    assert probability_of_best(np.ones((3, 2))).tolist() == [0.5, 0.5]


def test_only_seeds_that_all_have_are_paired():
    own = paired([pd.Series([1.0, 2.0, 3.0], [0, 1, 2]), pd.Series([5.0, 4.0], [2, 1])])
    assert own.tolist() == [[2.0, 4.0], [3.0, 5.0]]
