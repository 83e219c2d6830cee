"""Agents with views of their own: errors that stay, plans of their own, what is measured of it."""

from itertools import pairwise

import numpy as np
import pytest
from acting import look

from nested_agents.core.agents.action_counts import ActionCounts
from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.team import Team
from nested_agents.core.agents.views import agreement
from nested_agents.core.hierarchy.failures import AbsentAgents, LostMessages
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.search.errors import Errors, ErrorSettings
from nested_agents.core.search.settings import DecisionSettings

SEED = np.random.SeedSequence(7)


def team_of(world, communication: str = "ancestors", **decision) -> Team:
    settings = BatchTDSettings(
        decision=DecisionSettings(**{"evaluator": "best-response"} | decision)
    )
    hierarchy = Hierarchy(world.agents, list(pairwise(world.agents)), communication=communication)
    team = Team(settings, world, hierarchy, SEED)
    rng = np.random.default_rng(3)
    theta = team.only(FuzzyAgents).learner.theta
    theta[:] = rng.standard_normal(theta.shape)
    return team


@pytest.fixture
def world(line_world):
    return line_world(carts=3, wheels=1, closed=0.05)


def test_errors_are_of_the_size_that_is_said_and_stay() -> None:
    theta = np.random.default_rng(0).standard_normal((2, 5000)) * [[1.0], [10.0]]
    every = [np.array([0]), np.array([0, 1])]
    errors = Errors(ErrorSettings(weights=0.3), every, [0, 1], 5000, SEED)
    off = errors.weights(1, theta) - theta
    np.testing.assert_allclose(off.std(axis=1) / theta.std(axis=1), 0.3, rtol=0.05)
    np.testing.assert_array_equal(errors.weights(1, theta) - theta, off)
    np.testing.assert_array_equal(errors.weights(0, theta)[1], theta[1])  # not its concern
    assert (errors.weights(0, theta)[0] != errors.weights(1, theta)[0]).any()
    half = Errors(ErrorSettings(weights=0.15), every, [0, 1], 5000, SEED)
    np.testing.assert_allclose(half.weights(1, theta) - theta, off / 2)


def test_agreement_by_hand() -> None:
    joint = np.array([1, 2, 3])
    assert agreement({0: joint, 1: joint}, joint) == 1.0
    assert agreement({0: np.array([0, 2, 0])}, joint) == 0.5  # its own action does not count
    assert agreement({0: np.array([1, 0, 0]), 2: joint}, joint) == 0.5
    assert agreement({0: np.array([1, 2, 0])}, joint, np.array([1])) == 0.0  # its action is known


def test_silent_agents_without_errors_do_what_they_did(world) -> None:
    world.reset(0)
    seen = look(world, world.present())
    joint = [
        team_of(world, "none", errors=errors).act(seen, explore=False).joint_action
        for errors in (None, ErrorSettings())
    ]
    np.testing.assert_array_equal(*joint)


def test_what_was_expected_and_communicated_is_measured(world) -> None:
    world.reset(0)
    seen = look(world, world.present())
    plain = team_of(world, value_of="own")
    plain.act(seen)
    assert plain.costs == ()
    told = team_of(world, value_of="own", errors=ErrorSettings(weights=0.2))
    told.act(seen, explore=False)
    assert told.decision_costs["received"] == 3.0
    assert told.decision_costs["broadcast"] == 6.0
    assert 0.0 <= told.decision_costs["agreement"] <= 1.0
    silent = team_of(world, "none", value_of="own", errors=ErrorSettings(weights=0.2))
    silent.act(seen, explore=False)
    assert silent.decision_costs["received"] == 0.0


def test_who_makes_no_plans_has_no_agreement(world) -> None:
    team = team_of(world, evaluator="exact", errors=ErrorSettings(weights=0.2))
    world.reset(0)
    team.act(look(world, world.present()), explore=False)
    assert {m.name for m in team.costs} >= {"received", "broadcast"}
    assert "agreement" not in team.decision_costs
    assert (team.decision_costs["received"], team.decision_costs["broadcast"]) == (3.0, 6.0)


def test_agents_without_errors_that_tell_expect_what_is_done(world) -> None:
    """The last of a chain is told all; with one value of the team each expects the same."""
    team = team_of(world, value_of="team", errors=ErrorSettings())
    world.reset(0)
    team.act(look(world, world.present()), explore=False)
    assert team.decision_costs["agreement"] >= 2 / 3


def test_a_common_plan_of_agents_that_differ_is_refused(world) -> None:
    with pytest.raises(ValueError, match="so their plans differ") as error:
        team_of(world, errors=ErrorSettings(), plan="common")
    assert "\n" not in str(error.value)


def test_costs_are_those_of_the_agents_that_decide(world) -> None:
    """Of three in a chain the first is absent: two states of others each, one message."""
    settings = BatchTDSettings(decision=DecisionSettings(errors=ErrorSettings(weights=0.1)))
    chain = Hierarchy(world.agents, list(pairwise(world.agents)))
    first = world.agents[0]
    costs = []
    for failures in ([], [AbsentAgents(agents=first)], [LostMessages(agents=first)]):
        team = Team(settings, world, chain, SEED, failures)
        team.act(look(world))
        costs.append((team.decision_costs["received"], team.decision_costs["broadcast"]))
    assert costs == [(3, 6), (1, 4), (1, 6)]


def test_agents_that_have_left_are_not_counted() -> None:
    counts = ActionCounts(3, 2, is_conditional=True)
    counts.add(np.array([0, 1, 1]), np.array([1]))
    assert counts.totals.tolist() == [[2, 1], [1, 1], [1, 2]]
    assert counts.conditional.sum() == 3 * 2 * 3 * 2 + 4
