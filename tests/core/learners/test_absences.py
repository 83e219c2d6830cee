"""Agents that are absent or have left learn nothing, whatever the learner."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import AbsentAgents, LeftAgents
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners import LEARNERS
from nested_agents.scenarios.line_up import LineUpSettings

TABLES: dict[str, dict[str, Any]] = {
    "td-lambda": {},
    "averaged": {"kind": "td-lambda", "normalized": True, "averaging": 5},
    "optimistic-td": {},
    "fmq": {},
    "sparse-cooperative": {},
    "vdn": {},
    "batch-td": {"interval": 3, "trace_decay": 0.5},
    "fitted-q": {"interval": 3, "forgetting": 0.1},
}


def team_of(name: str, failures: Any = (), **table: Any) -> tuple[Team, Any]:
    world = LineUpSettings(carts=3).build()
    chain = Hierarchy(world.agents, list(pairwise(world.agents)))
    settings = LEARNERS.parsed(TABLES[name].get("kind", name), **(_options(name) | table))
    return Team(settings, world, chain, policy_seed(0), failures), world


def _options(name: str) -> dict[str, Any]:
    return {key: value for key, value in TABLES[name].items() if key != "kind"}


@pytest.mark.parametrize("absence", [AbsentAgents, LeftAgents])
@pytest.mark.parametrize("name", list(TABLES)[:-2])
def test_own_weights_stay_while_an_agent_is_absent(name: str, absence: Any) -> None:
    team, world = team_of(name, [absence(agents="cart2", episode=1)])
    learner = team.only(FuzzyAgents).learner
    # Averages go on approaching the weights.
    name = "weights" if name == "averaged" else "theta"
    thetas = [learner.state_dict()[name].copy()]
    for episode in range(2):
        for _ in control_loop(world, team, episodes=1, steps=8, seed=1, first_episode=episode):
            pass
        thetas.append(learner.state_dict()[name].copy())
    changed = [(a != b).any(axis=1).tolist() for a, b in pairwise(thetas)]
    assert changed == [[True, True, True], [True, False, True]]


@pytest.mark.parametrize("name", TABLES)
def test_shared_weights_do_not_learn_from_absent_agents(name: str) -> None:
    """The second of three agents is absent in two steps; its state and reward between differ."""
    thetas = []
    for offset in (0.0, 0.3):
        team, _ = team_of(name, weights="role")
        agents = team.only(FuzzyAgents)
        learner = type(agents.learner)(agents.settings, agents.rules, np.zeros(3, int))
        rng = np.random.default_rng(0)
        d = len(agents.rules.partitions) - (name == "fitted-q")
        states = rng.uniform(-0.5, 0.5, (9, 3, d))
        actions = rng.integers(4, size=(8, 3))
        states[3, 1, 0] += offset
        actions[2:4, 1] = round(10 * offset)
        for t in range(8):
            learner.idle = np.array([1] if t in (2, 3) else [], dtype=int)
            reward = np.full(3, rng.normal())
            reward[1] += 1e4 * offset * (t == 2)  # batch learners clip targets to a range
            learner.observe_decision(states[t], actions[t], states[t + 1], reward, t == 7)
        learner.end_episode()
        thetas.append(learner.theta)
    assert thetas[0].any()
    assert np.array_equal(*thetas)
