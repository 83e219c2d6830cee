"""Many arms at once: postures and states of all worlds in one call, with the bits of a single one.

Arms of one's own state variables, and arms that fail, are stepped one by one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.interface.worlds import StackedWorlds, Transitions
from ...core.numerics import FloatArray, IntArray, njit
from .config import PERIOD
from .variables import columns, postures_of

if TYPE_CHECKING:
    from .scenario import KinematicChain


@njit(cache=True)
def observe(
    places: FloatArray,
    angles: FloatArray,
    speeds: FloatArray,
    goals: FloatArray,
    before: FloatArray,
    rows: IntArray,
) -> FloatArray:
    """Return the states ``(W, n, len(rows))`` of all joints of all worlds, see `columns`."""
    count, n = angles.shape
    states = np.empty((count, n, len(rows)))
    for k in range(count):
        posture = places[k : k + 1]
        seen = columns(
            posture, angles[k : k + 1], speeds[k : k + 1], goals[k], before[k], 0, n, rows
        )
        states[k] = seen[:, 0]
    return states


class ChainWorlds(StackedWorlds["KinematicChain"]):
    """Many arms of as many joints, none of which fails."""

    def stack(self, world: KinematicChain, count: int) -> None:
        """Make room."""
        n = len(world.agents)
        self._angles: FloatArray = np.zeros((count, n))
        self._speeds: FloatArray = np.zeros((count, n))
        self._goals: FloatArray = np.zeros((count, 2))
        self._before: FloatArray = np.zeros(count)
        self._done = np.zeros(count, dtype=np.int64)

    def take(self, place: int, world: KinematicChain) -> None:
        """Put an arm and its goal in their place."""
        self._angles[place] = world._angles
        self._speeds[place] = 0.0
        self._goals[place] = world._goal
        self._before[place] = world._distance()
        self._done[place] = 0

    def step(self, joint_actions: IntArray) -> Transitions:
        """Turn all joints of all arms for one decision period."""
        arm = self.scenario
        settings = arm.settings
        unit = settings.speed_increment * arm._limits
        self._speeds = arm.action_set.apply(self._speeds, joint_actions, unit, arm._limits)
        turned = self._angles + PERIOD * self._speeds
        self._angles = np.clip(turned, -arm._most, arm._most)
        self._done += 1
        places = postures_of(self._angles, arm.length)
        fractions = self._speeds / settings.top_speed
        rows = arm._states.rows
        states = observe(places, self._angles, fractions, self._goals, self._before, rows)
        away = np.hypot(*(self._goals - places[:, -1]).T)
        rewards = arm._reward(away, self._before - away)
        self._before = away
        reached = away < settings.tolerance
        late = ~reached & (self._done >= settings.most_decisions)
        paid = np.broadcast_to(rewards[:, None], joint_actions.shape)
        return Transitions(states, paid, reached, late)
