"""Control loop of many environments: one team acts and learns in all of them at once.

When an episode ends in one environment, the next episode starts there while the others continue.
Episodes are numbered in the order in which they start, and the number determines the seed of the
environment, as in the loop of one environment.
"""

from __future__ import annotations

import numpy as np

from ..interface.agents import Vectorized
from ..interface.environments import Environments
from ..interface.experience import Observation
from ..numerics import FloatArray
from .loop import world_seed
from .team import Team

Finished = tuple[int, float, bool]
"""An episode that has ended: number of decisions, sum of rewards averaged over agents, and whether
the task was solved, or lost."""


class ManyEnvironmentsLoop:
    """Training in ``E`` environments.

    Parameters
    ----------
    environments
        Environments that are stepped together.
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

    def __init__(self, environments: Environments, team: Team, steps: int, seed: int) -> None:
        unable = [part for part in team.parts if not isinstance(part, Vectorized)]
        if unable:
            raise ValueError(f"{type(unable[0]).__name__}: acts in one environment only")
        self._environments = environments
        self._team = team
        self._max_steps = steps
        self._seed = seed
        self._started = 0
        self.decisions = 0
        self._states = self._start(range(environments.count))
        self._steps = np.zeros(environments.count, dtype=np.int64)
        self._returns: FloatArray = np.zeros(environments.count)

    def _start(self, indices: range | list[int]) -> FloatArray:
        """Start the next episodes in some environments and return their states."""
        seeds = [world_seed(self._seed, self._started + k) for k in range(len(indices))]
        states = self._environments.begin(indices, seeds, self._started)
        self._started += len(indices)
        return states

    def step(self) -> list[Finished]:
        """Take one step in all environments; return the episodes that end, by environment."""
        self._team.learns = True  # an evaluation may have been run since the last step
        decision = self._team.act(Observation(self._states), explore=True)
        transitions = self._environments.step(decision.joint_action)
        self._steps += 1
        last = transitions.terminated | transitions.truncated | (self._steps >= self._max_steps)
        self._team.learn_batch(decision, transitions, last)
        self.decisions += self._environments.count
        self._returns += transitions.rewards.mean(axis=1)
        indices = np.flatnonzero(last).tolist()
        finished = [
            (int(self._steps[k]), float(self._returns[k]), bool(transitions.terminated[k]))
            for k in indices
        ]
        self._states = transitions.states
        if indices:
            self._states = self._states.copy()
            self._states[indices] = self._start(indices)
            self._steps[indices] = 0
            self._returns[indices] = 0.0
        return finished
