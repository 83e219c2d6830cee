"""Inspection of decisions: the same decisions, with the reasons of every agent."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from acting import fuzzy, look

from nested_agents.core.agents.inspection import explain_decision
from nested_agents.core.agents.loop import policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import LostMessages
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Experience
from nested_agents.core.learners import LEARNERS
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.line_up import LineUpSettings

EXPLORING = {"exploration": {"kind": "burst", "rate": 0.4}}
LEARNERS_OF = {
    "exact": {"kind": "batch-td", **EXPLORING, "decision": {"evaluator": {"kind": "exact"}}},
    "best response": {
        "kind": "batch-td",
        **EXPLORING,
        "decision": {"evaluator": {"kind": "best-response"}},
    },
    "action values": {"kind": "fitted-q", **EXPLORING},
    "policies": {"kind": "ppo"},
}


def team_of(table: dict[str, Any], scenario: Any, *failures: LostMessages) -> Team:
    chain = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    settings = LEARNERS.model(table["kind"]).model_validate(table)
    return Team(settings, scenario, chain, policy_seed(1), failures)


def train(scenario: Any, team: Team, *, inspect: bool) -> list[list[int]]:
    """Return the joint actions of an episode of training."""
    seen = team.observe(scenario, scenario.reset(3))
    team.reset(3, 0, learn=True)
    joint_actions = []
    for step in range(12):
        decision = team.act(seen, inspect=inspect)
        transition = scenario.step(decision.joint_action)
        team.learn(Experience(seen, decision, transition, step == 11))
        joint_actions.append(decision.joint_action.tolist())
        seen = team.observe(scenario, transition.states, decision.joint_action)
    return joint_actions


@pytest.mark.parametrize("name", LEARNERS_OF)
def test_inspection_changes_neither_decisions_nor_learning(name: str) -> None:
    settings = BoxPushingSettings(robots=2)
    plain, inspected = (team_of(LEARNERS_OF[name], settings.build()) for _ in range(2))
    without = train(settings.build(), plain, inspect=False)
    assert train(settings.build(), inspected, inspect=True) == without
    first = plain.state_dict()
    second = inspected.state_dict()
    assert all(np.array_equal(first[key], second[key]) for key in first)


def test_values_messages_and_exploration_of_every_agent() -> None:
    scenario = LineUpSettings(carts=3).build()
    team = team_of(LEARNERS_OF["exact"], scenario, LostMessages(agents="cart2"))
    train(scenario, team, inspect=False)
    explored = 0
    for _ in range(40):
        decision = team.act(look(scenario, scenario.reset(5)), inspect=True)
        assert [agent.agent for agent in decision.agents] == list(scenario.agents)
        names = [scenario.action_set.names[action] for action in decision.joint_action]
        assert [agent.action for agent in decision.agents] == names
        heard = [agent.received for agent in decision.agents]
        assert heard == [{}, {"cart1": names[0]}, {"cart1": names[0]}]
        for agent in decision.agents:
            assert list(agent.values) == list(scenario.action_set.names)
            is_greatest = agent.values[agent.action] >= max(agent.values.values()) - 1e-12
            assert agent.explored != is_greatest
            explored += agent.explored
    assert explored


def test_values_of_the_last_agent_are_values_of_predicted_states() -> None:
    scenario = LineUpSettings(carts=2).build()
    team = team_of(LEARNERS_OF["exact"], scenario)
    train(scenario, team, inspect=False)
    observation = look(scenario, scenario.reset(5))
    decision = team.act(observation, explore=False, inspect=True)
    tried = np.tile(decision.joint_action, (len(scenario.action_set), 1))
    tried[:, 1] = np.arange(len(scenario.action_set))
    expected = team.value(scenario.agents[1], observation.prediction.states(1, tried))
    np.testing.assert_allclose(list(decision.agents[1].values.values()), expected, atol=1e-9)


def test_value_function_by_hand() -> None:
    scenario = LineUpSettings(carts=2).build()
    team = team_of(LEARNERS_OF["exact"], scenario)
    fuzzy(team).learner.theta[1] = 2.0
    states = np.zeros((3, 5, scenario.state_space.n_variables))
    n_terms = len(fuzzy(team).rules.terms)
    assert team.value(scenario.agents[0], states).tolist() == [[0.0] * 5] * 3
    assert team.value(scenario.agents[1], states[0, 0]) == pytest.approx(2.0 * n_terms)


def test_a_value_that_does_not_exist_is_refused() -> None:
    scenario = LineUpSettings(carts=2).build()
    team = team_of(LEARNERS_OF["exact"], scenario)
    with pytest.raises(ValueError, match=r"^agent = 'cart9', allowed: cart1, cart2$"):
        team.value("cart9", np.zeros((1, 2)))
    with pytest.raises(ValueError, match=r"^states: shape \(1, 7\), allowed: \(\.\.\., \d\)"):
        team.value("cart1", np.zeros((1, 7)))
    policies = team_of(LEARNERS_OF["policies"], scenario)
    with pytest.raises(ValueError, match="has no value function"):
        policies.value("cart1", np.zeros((1, scenario.state_space.n_variables)))


def test_messages_of_functions_are_shown() -> None:
    source = "def decide(observation):\n    return {'action': 0, 'message': {'plan': [1]}}\n"
    scenario = LineUpSettings(carts=2).build()
    with Sources(texts={"f.py": source}).active():
        team = team_of({"kind": "f.py:decide"}, scenario)
        decision = team.act(look(scenario, scenario.reset(0)), inspect=True)
    assert decision.agents[1].payloads == {"cart1": {"plan": [1]}}
    assert not decision.agents[1].values
    text = explain_decision(decision)
    assert "from cart1 with the message {'plan': [1]}" in text
    assert "greatest value" not in text


def test_a_decision_without_details_is_refused() -> None:
    scenario = LineUpSettings(carts=2).build()
    team = team_of(LEARNERS_OF["exact"], scenario)
    with pytest.raises(ValueError, match="inspect=True"):
        explain_decision(team.act(look(scenario, scenario.reset(0))))
