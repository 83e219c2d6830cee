"""Coordination graphs as evaluators of a team, against sums over all joint actions."""

from itertools import product

import numpy as np
import pytest
from acting import fuzzy, joint_of

from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.learners.sums import SparseCooperativeSettings
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.topologies import build, parse

KINDS = ("variable-elimination", "max-plus")


def team_of(evaluator, topology="coordination-graph", carts=4, **decision):
    scenario = LineUpSettings(carts=carts).build()
    settings = SparseCooperativeSettings(
        decision=DecisionSettings(**{"evaluator": evaluator, **decision}),
        exploration={"kind": "burst", "rate": 0.3},
    )
    hierarchy = build(parse(topology), scenario.agents)
    return scenario, Team(settings, scenario, hierarchy, policy_seed(0))


@pytest.mark.parametrize("evaluator", KINDS)
@pytest.mark.parametrize("topology", ["coordination-graph", "coordination-graph:ring"])
def test_the_team_takes_the_joint_action_of_the_greatest_sum(evaluator, topology):
    scenario, team = team_of(evaluator, topology)
    rng = np.random.default_rng(0)
    for seed in range(5):
        scenario.reset(seed)
        fuzzy(team).learner.theta[:] = rng.normal(size=fuzzy(team).learner.theta.shape)
        prediction = scenario.predict()
        joint = np.array(list(product(range(4), repeat=4)))
        sums = np.zeros(len(joint))
        for i in range(4):
            supposed = np.full_like(joint, team.action_set.neutral)
            scope = [i, *team.hierarchy.searched(i)]
            supposed[:, scope] = joint[:, scope]
            states = prediction.states(i, supposed)
            sums += fuzzy(team).evaluator.rules.values(fuzzy(team).learner.theta[i], states)
        taken = joint_of(team, scenario, explore=False)
        place = np.flatnonzero((joint == taken).all(axis=1))[0]
        assert sums[place] == pytest.approx(sums.max(), abs=1e-9)


@pytest.mark.parametrize("evaluator", KINDS)
def test_agents_who_are_told_nothing_agree_on_one_of_two_optima(evaluator):
    # Before anything is learned all joint actions are equal; after, maintain and zero often are.
    scenario, team = team_of(evaluator, carts=6)
    list(control_loop(scenario, team, episodes=1, steps=10, seed=0))
    scenario.reset(1)  # at rest: to maintain and to make zero come to the same
    assert len({tuple(joint_of(team, scenario, explore=False)) for _ in range(20)}) == 1


@pytest.mark.parametrize("evaluator", KINDS)
def test_what_it_does_not_evaluate_is_refused(evaluator):
    with pytest.raises(
        ValueError, match="needs neighbors, but the topology has none; use coordination-graph"
    ):
        team_of(evaluator, "chain")
    for key, value in (("rule", "reward"), ("teammates", "uniform"), ("value_of", "team")):
        with pytest.raises(ValueError, match=rf"decision\.{key} = '{value}': {evaluator} adds up"):
            team_of(evaluator, **{key: value})
    with pytest.raises(ValueError, match=r"4 \*\* 12 entries, allowed"):
        team_of(evaluator, "simultaneous", carts=12)
