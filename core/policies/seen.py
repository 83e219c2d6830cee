"""A scenario as those see it who predict nothing: what they decide by is the present states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..interface.measures import measures_of
from ..interface.scenario import Scenario, Transition, groups_of, roles_of
from ..numerics.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Seen:
    """The present states, and what could follow, for those who ask.

    Attributes
    ----------
    present
        ``(n, d)`` states of all agents.
    scenario
        Where they are.
    """

    present: FloatArray
    scenario: Scenario

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` as the scenario predicts them."""
        return self.scenario.predict().states(agent, joint_actions)


class SeenScenario:
    """A scenario whose `predict` gives the present states and costs nothing.

    Parameters
    ----------
    scenario
        The scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.agents, self.groups, self.roles = (
            tuple(scenario.agents), groups_of(scenario), roles_of(scenario)
        )  # fmt: skip
        self.state_space, self.action_set = scenario.state_space, scenario.action_set
        self.measures = measures_of(scenario)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return states ``(n, d)``."""
        self._states = self.scenario.reset(seed, episode)
        return self._states

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out a joint action ``(n,)``."""
        transition = self.scenario.step(joint_action)
        self._states = transition.states
        return transition

    def predict(self) -> Seen:
        """Return the present states."""
        return Seen(self._states, self.scenario)
