"""Control loop of many environments: one team acts and learns in all of them at once.

When an episode ends in one environment, the next episode starts there while the others continue.
Episodes are numbered in the order in which they start, and the number determines the seed of the
environment, as in the loop of one environment.

A checkpoint holds no states of environments but their episode numbers and the joint actions since
the oldest running episode started. To resume, these episodes are started and stepped again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..interface.agents import StateDict, Vectorized
from ..interface.environments import Environments
from ..interface.experience import Observation
from ..interface.scenario import Scenario
from ..numerics import AnyArray, FloatArray, IntArray
from .loop import world_seed
from .team import Team


class Finished(NamedTuple):
    """Summary of an episode that has ended."""

    steps: int
    """Number of decisions."""
    return_: float
    """Sum of rewards, averaged over agents."""
    terminated: bool
    """Whether the task was solved, or lost."""


class ManyEnvironmentsLoop:
    """Training in ``E`` environments.

    Parameters
    ----------
    environments
        Environments that are stepped together.
    scenario
        Scenario of every environment.
    team
        Team that acts and learns in all environments.
    steps
        Maximum number of decisions in an episode.
    seed
        Seed of the environments, see `world_seed`.

    Attributes
    ----------
    decisions
        Number of joint decisions so far, in all environments.

    Raises
    ------
    ValueError
        If some agents of the team cannot act in many environments; one line.
    """

    def __init__(
        self, environments: Environments, scenario: Scenario, team: Team, steps: int, seed: int
    ) -> None:
        unable = [part for part in team.parts if not isinstance(part, Vectorized)]
        if unable:
            raise ValueError(f"{type(unable[0]).__name__}: acts in one environment only")
        self._environments = environments
        self._scenario = scenario
        self._team = team
        self._max_steps = steps
        self._seed = seed
        self._started = 0
        self.decisions = 0
        self._episodes: IntArray = np.zeros(environments.count, dtype=np.int64)
        self._joint_actions: deque[IntArray] = deque()
        """Joint actions since the oldest running episode started."""
        self._states = self._start(range(environments.count))
        self._steps = np.zeros(environments.count, dtype=np.int64)
        self._returns: FloatArray = np.zeros(environments.count)

    def _start(self, indices: range | list[int]) -> FloatArray:
        """Start the next episodes in some environments and return their states."""
        seeds = [world_seed(self._seed, self._started + k) for k in range(len(indices))]
        states = self._environments.begin(indices, seeds, self._started)
        self._episodes[indices] = self._started + np.arange(len(indices))
        self._started += len(indices)
        return states

    def state_dict(self) -> StateDict:
        """Return the state of the loop, without that of the team."""
        n = len(self._scenario.agents)
        joint_actions = np.array(self._joint_actions, dtype=np.int32)
        return {
            "episodes": self._episodes.copy(),
            "steps": self._steps.copy(),
            "actions": joint_actions.reshape(-1, len(self._steps), n),
            "states": self._states.copy(),
            "returns": self._returns.copy(),
            "started": np.array(self._started),
            "decisions": np.array(self.decisions),
        }

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict` by repeating the running episodes.

        Raises
        ------
        ValueError
            If the environments reach other states; the loop cannot be used afterward.
        """
        self._steps = state["steps"].astype(np.int64)
        self._episodes = state["episodes"].astype(np.int64)
        self._joint_actions = deque(state["actions"].astype(np.int64))
        self._returns = state["returns"].astype(np.float64)
        self._started = int(state["started"])
        self.decisions = int(state["decisions"])
        starts = len(self._joint_actions) - self._steps
        ended = np.ones(len(starts), dtype=bool)
        states = self._states.copy()
        for step in range(len(self._joint_actions) + 1):
            # Environments that start an episode later are restarted if they end before that.
            for index in np.flatnonzero((starts == step) | (ended & (starts > step))).tolist():
                episode = int(self._episodes[index])
                seed = world_seed(self._seed, episode)
                states[index] = self._environments.begin([index], [seed], episode)[0]
            if step < len(self._joint_actions):
                transitions = self._environments.step(self._joint_actions[step])
                states = transitions.states.copy()
                ended = transitions.terminated | transitions.truncated
        if not np.array_equal(states, state["states"]):
            raise ValueError("environments: the same joint actions have led to other states")
        self._states = states

    def step(self) -> list[Finished]:
        """Take one step in all environments; return the episodes that end, by environment."""
        decision = self._team.act(Observation(self._states), explore=True)
        transitions = self._environments.step(decision.joint_action)
        self._joint_actions.append(decision.joint_action)
        self._steps += 1
        last = transitions.terminated | transitions.truncated | (self._steps >= self._max_steps)
        self._team.learn_batch(decision, transitions, last)
        self.decisions += self._environments.count
        self._returns += transitions.rewards.mean(axis=1)
        indices = np.flatnonzero(last).tolist()
        finished = [
            Finished(int(self._steps[k]), float(self._returns[k]), bool(transitions.terminated[k]))
            for k in indices
        ]
        self._states = transitions.states
        if indices:
            self._states = transitions.states.copy()
            self._states[indices] = self._start(indices)
            self._steps[indices] = 0
            self._returns[indices] = 0.0
        while len(self._joint_actions) > self._steps.max():
            self._joint_actions.popleft()
        return finished
