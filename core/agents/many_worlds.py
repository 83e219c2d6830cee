"""The control loop of many worlds at once: a team learns in all of them by the same weights.

An episode that ends in one world is followed by the next one there, while others go on. Episodes
are numbered in the order in which they begin, and a number is a world, as in the loop of one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..interface.experience import Observation
from ..interface.scenario import Scenario
from ..interface.worlds import Worlds
from ..numerics import FloatArray
from .loop import world_seed
from .team import Team


class Finished(NamedTuple):
    """An episode of the first world that has ended."""

    steps: int
    """Decisions in it."""
    return_: float
    """Sum of the mean rewards of the agents."""
    terminated: bool
    """Whether the task was solved, or lost."""


class ManyWorldsLoop:
    """Training under way in ``W`` worlds.

    Parameters
    ----------
    worlds
        The worlds.
    scenario
        What all of them are.
    team
        Who acts in all of them, and learns.
    steps
        Most decisions in an episode.
    seed
        Seed of the worlds, see `world_seed`.

    Attributes
    ----------
    decisions
        Joint decisions so far, of all worlds.

    Raises
    ------
    ValueError
        If a kind of agents in the team decides in one world only; one line.
    """

    def __init__(
        self, worlds: Worlds, scenario: Scenario, team: Team, steps: int, seed: int
    ) -> None:
        unable = [part for part in team.parts if not part.many_worlds]
        if unable:
            raise ValueError(f"{type(unable[0]).__name__}: decides in one world only")
        self._worlds = worlds
        self._scenario = scenario
        self._team = team
        self._most = steps
        self._seed = seed
        self._begun = 0
        self.decisions = 0
        self._states = self._begin(range(worlds.count))
        self._done = np.zeros(worlds.count, dtype=np.int64)
        self._return = 0.0

    def _begin(self, places: range | list[int]) -> FloatArray:
        seeds = [world_seed(self._seed, self._begun + k) for k in range(len(places))]
        states = self._worlds.begin(places, seeds, self._begun)
        self._begun += len(places)
        return states

    def step(self) -> Finished | None:
        """Take a decision in every world; return the first one's episode if it has ended."""
        decision = self._team.act(Observation(self._states, self._scenario), explore=True)
        steps = self._worlds.step(decision.joint_action)
        self._done += 1
        last = steps.terminated | steps.truncated | (self._done >= self._most)
        self._team.learn_in_worlds(decision, steps, last)
        self.decisions += self._worlds.count
        self._return += float(steps.rewards[0].mean())
        finished = None
        if last[0]:
            finished = Finished(int(self._done[0]), self._return, bool(steps.terminated[0]))
            self._return = 0.0
        self._states = steps.states
        if last.any():
            places = np.flatnonzero(last).tolist()
            self._states = steps.states.copy()
            self._states[places] = self._begin(places)
            self._done[places] = 0
        return finished
