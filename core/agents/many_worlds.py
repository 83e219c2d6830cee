"""The control loop of many worlds at once: a team learns in all of them by the same weights.

An episode that ends in one world is followed by the next one there, while others go on. Episodes
are numbered in the order in which they begin, and a number is a world, as in the loop of one.

What is remembered of worlds is their episodes, and what has been done in them so far: to continue,
they are begun again and it is done again, which any world repeats to the same bits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..interface.agents import Memory
from ..interface.experience import Observation
from ..interface.scenario import Scenario
from ..interface.worlds import Worlds
from ..numerics import AnyArray, FloatArray, IntArray
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
        self._episodes: IntArray = np.zeros(worlds.count, dtype=np.int64)
        self._actions: deque[IntArray] = deque()
        """What has been done since the longest of the present episodes began."""
        self._states = self._begin(range(worlds.count))
        self._done = np.zeros(worlds.count, dtype=np.int64)
        self._return = 0.0

    def _begin(self, places: range | list[int]) -> FloatArray:
        seeds = [world_seed(self._seed, self._begun + k) for k in range(len(places))]
        states = self._worlds.begin(places, seeds, self._begun)
        self._episodes[places] = self._begun + np.arange(len(places))
        self._begun += len(places)
        return states

    def memory(self) -> Memory:
        """Return what `restore` needs to continue; the team's memory is its own."""
        n = len(self._scenario.agents)
        return {
            "episodes": self._episodes.copy(),
            "done": self._done.copy(),
            "actions": np.array(self._actions, dtype=np.int32).reshape(-1, len(self._done), n),
            "states": self._states.copy(),
            "return": np.array(self._return),
            "begun": np.array(self._begun),
            "decisions": np.array(self.decisions),
        }

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned: what was done in the episodes is done again.

        Raises
        ------
        ValueError
            If the worlds do not come to the same states by it; nothing can be continued then.
        """
        self._done = memory["done"].astype(np.int64)
        self._episodes = memory["episodes"].astype(np.int64)
        self._actions = deque(memory["actions"].astype(np.int64))
        self._return = float(memory["return"])
        self._begun = int(memory["begun"])
        self.decisions = int(memory["decisions"])
        begins = len(self._actions) - self._done
        ended = np.ones(len(begins), dtype=bool)
        states = self._states.copy()
        for step in range(len(self._actions) + 1):
            # Whose time has not come is begun for nothing, and again where it has ended meanwhile.
            for place in np.flatnonzero((begins == step) | (ended & (begins > step))).tolist():
                episode = int(self._episodes[place])
                seed = world_seed(self._seed, episode)
                states[place] = self._worlds.begin([place], [seed], episode)[0]
            if step < len(self._actions):
                after = self._worlds.step(self._actions[step])
                states = after.states.copy()
                ended = after.terminated | after.truncated
        if not np.array_equal(states, memory["states"]):
            raise ValueError("worlds: the same actions have led to other states")
        self._states = states

    def step(self) -> Finished | None:
        """Take a decision in every world; return the first one's episode if it has ended."""
        decision = self._team.act(Observation(self._states, self._scenario), explore=True)
        steps = self._worlds.step(decision.joint_action)
        self._actions.append(decision.joint_action)
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
        while len(self._actions) > self._done.max():
            self._actions.popleft()
        return finished
