"""Frequencies given the own action: what they are counted from, and what is made of them."""

import numpy as np
import pytest
from acting import fuzzy, joint_of

from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.learners.td import TDLambdaSettings
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.topologies import build, parse


def team_of(evaluator="exact", topology="chain", carts=3):
    scenario = LineUpSettings(carts=carts).build()
    settings = TDLambdaSettings(
        step_size=0.1, decision=DecisionSettings(teammates="conditional", evaluator=evaluator)
    )
    hierarchy = build(parse(topology), scenario.agents)
    return scenario, Team(settings, scenario, hierarchy, policy_seed(0))


def test_values_are_means_by_what_was_seen_with_the_same_own_action():
    scenario, team = team_of()
    taken = [r.joint_action for r in control_loop(scenario, team, episodes=1, steps=30, seed=0)]
    counts = np.ones((3, 4, 3, 4))
    for joint in taken:
        for i in range(3):
            for j in range(3):
                counts[i, joint[i], j, joint[j]] += 1.0
    assert (fuzzy(team).action_counts.conditional == counts).all()
    given = counts[0] / counts[0].sum(axis=2, keepdims=True)
    captured = {}

    def values(deliberation):
        captured.setdefault(deliberation.agent, (deliberation, original(deliberation)))
        return captured[deliberation.agent][1]

    original = fuzzy(team).evaluator.values
    fuzzy(team).evaluator.values = values
    prediction = scenario.predict()
    joint_of(team, scenario, explore=False)
    deliberation, found = captured[0]
    assert (deliberation.given == given).all()
    for a in range(4):
        joint = np.array([[a, b, c] for b in range(4) for c in range(4)])
        each = fuzzy(team).evaluator.rules.values(
            fuzzy(team).learner.theta[0], prediction.states(0, joint)
        )
        p = np.array([given[a, 1, b] * given[a, 2, c] for b in range(4) for c in range(4)])
        assert found[a] == pytest.approx(p @ each)


def test_it_is_saved_and_loaded(tmp_path):
    scenario, team = team_of()
    list(control_loop(scenario, team, episodes=1, steps=5, seed=0))
    team.save(tmp_path / "team.npz")
    other = team_of()[1]
    other.load(tmp_path / "team.npz")
    assert (fuzzy(other).action_counts.conditional == fuzzy(team).action_counts.conditional).all()
    assert fuzzy(other).action_counts.conditional.sum() > 3 * 4 * 3 * 4


def test_sampling_refuses_it():
    with pytest.raises(ValueError, match=r"'conditional': sampling evaluates .* use exact"):
        team_of("sampling")


def test_neighbors_consider_each_other_and_are_told_nothing():
    scenario, team = team_of(topology="simultaneous")
    seen = []
    original = fuzzy(team).evaluator.values

    def values(deliberation):
        seen.append(deliberation.joint_action.tolist())
        return original(deliberation)

    fuzzy(team).evaluator.values = values
    scenario.reset(0)
    joint_of(team, scenario)
    assert seen == [[2, 2, 2]] * 3
