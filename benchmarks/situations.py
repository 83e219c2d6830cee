"""What is timed: a team of n wheel agents in the middle of an episode of box pushing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Observation
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.learners import LEARNERS
from nested_agents.core.learners.td import TDLambda
from nested_agents.core.numerics import FloatArray, IntArray
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing

SETTLING = 12
"""Random steps taken before anything is timed, so that robots are in motion."""

DENSE: dict[str, Any] = {"membership": "sigmoid", "memberships": 5, "order": 7}
"""The paper's rule base: 5^7 rules, all of them active everywhere."""
COMPACT: dict[str, Any] = {"membership": "triangular", "memberships": 5, "order": 7}
"""The same rules with triangular membership functions: 2^7 active."""
ADDITIVE: dict[str, Any] = {"membership": "triangular", "memberships": 5, "order": 1}
"""One rule per variable and membership function."""


@dataclass
class Moment:
    """A team, the world it acts in, and the moment at which it is timed."""

    scenario: BoxPushing
    """The world."""
    hierarchy: Hierarchy
    """A chain over its agents."""
    team: Team
    """A team with random consequent weights."""
    prediction: Prediction
    """Of the moment."""
    states: FloatArray
    """Two successive states ``(2, n, d)`` and the rewards ``(2,)`` on entering them."""
    rewards: FloatArray
    side: int = 0
    """Which of the two has been entered last."""

    @property
    def joint_actions(self) -> int:
        """Joint actions that the whole chain tries in a decision by exact enumeration."""
        return self.hierarchy.joint_actions(len(self.scenario.action_set))

    def act(self) -> IntArray:
        """Decide greedily in the moment, from the tables that the prediction already holds."""
        seen = Observation(self.states[1], self.scenario, imagined=self.prediction)
        return self.team.act(seen, explore=False).joint_action

    def predict_and_act(self) -> IntArray:
        """Predict anew and decide."""
        self.prediction = self.scenario.predict()
        return self.act()

    def learn(self) -> None:
        """Make one TD update of all agents."""
        learner = self.team.only(FuzzyAgents).learner
        assert isinstance(learner, TDLambda)
        self.side = 1 - self.side
        learner.observe(self.states[self.side], float(self.rewards[self.side]), False)

    def step(self) -> None:
        """Decide and learn."""
        self.act()
        self.learn()


def situation(
    n_agents: int,
    rule_base: Mapping[str, Any],
    decision: Mapping[str, Any] | None = None,
    seed: int = 6,
) -> Moment:
    """Bring `n_agents` wheel agents, two to an e-puck, into the middle of an episode."""
    scenario = BoxPushingSettings(robots=n_agents // 2, state_space="paper").build()
    hierarchy = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    settings = LEARNERS.model("td-lambda").model_validate(
        {
            "rule_base": dict(rule_base),
            "decision": {"teammates": "empirical", **(decision or {})},
        }
    )
    team = Team(settings, scenario, hierarchy, np.random.SeedSequence(seed))
    rng = np.random.default_rng(seed)
    scenario.reset(seed)
    history = []
    for _ in range(SETTLING):
        taken = scenario.step(rng.integers(len(scenario.action_set), size=n_agents))
        history.append((taken.states, taken.reward))
    theta = team.only(FuzzyAgents).learner.theta
    for row in theta:
        row[:] = rng.normal(scale=0.01, size=row.shape)
    states = np.array([states for states, _ in history[-2:]])
    rewards = np.array([reward for _, reward in history[-2:]])
    return Moment(scenario, hierarchy, team, scenario.predict(), states, rewards)
