"""Many worlds of boxes at once: their physics in one compiled call, their states in a few of NumPy.

What each has is, bit by bit, what it has by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.interface.stacked import StackedWorlds
from ...core.interface.worlds import Transitions
from ...core.numerics import FloatArray, IntArray, wrap
from .world.settings import reward
from .world.starts import GOAL
from .world.world import TOUCHING, World

if TYPE_CHECKING:
    from .scenario import BoxPushing


class BoxWorlds(StackedWorlds["BoxPushing"]):
    """Many worlds of as many robots, without failures and without noise of sensors.

    Box2D keeps the bodies of a world where it likes, so that every place has a `World` of its own:
    that in which the scenario has begun the episode.
    """

    def stack(self, world: BoxPushing, count: int) -> None:
        """Make room."""
        one = world.world
        n_robots = len(one.robots)
        self._worlds = [World(one.robots, one.box, infrared=one.sensor) for _ in range(count)]
        self._addresses: IntArray = np.zeros((count, n_robots + 2), dtype=np.int64)
        self._last: FloatArray = np.zeros((count, n_robots, 3))
        self._wrenches: FloatArray = np.zeros((count, n_robots, 3))
        self._speeds: FloatArray = np.zeros((count, len(world.agents)))
        self._boxes: FloatArray = np.zeros((count, 3))

    def take(self, place: int, world: BoxPushing) -> None:
        """Keep the world that has begun in a place; the scenario has the former one of it."""
        begun = world.world
        world.world = self._worlds[place]
        self._worlds[place] = begun
        self._addresses[place] = begun.addresses
        self._last[place] = 0.0
        self._wrenches[place] = 0.0
        self._speeds[place] = 0.0
        self._boxes[place] = begun.box_pose

    def step(self, joint_actions: IntArray) -> Transitions:
        """Command the wheels of all worlds for one decision period, observe and reward."""
        one = self.scenario
        before = self._boxes
        self._speeds = one.commanded(self._speeds, joint_actions)
        poses, gaps, readings = one.world.advance_many(
            self._addresses, self._speeds, one.settings.action_repeat, self._last, self._wrenches
        )
        boxes = np.ascontiguousarray(poses[:, 0])
        self._boxes = boxes
        states = one.states_at(poses[:, 1:], boxes, gaps, before, self._speeds)
        away = np.hypot(*(GOAL[:2] - boxes[:, :2]).T)
        way = away - np.hypot(*(GOAL[:2] - before[:, :2]).T)
        turn = wrap(boxes[:, 2] - GOAL[2])
        reached = one.task.reached(away, turn)
        paid = reward(one.task, away, way, turn, gaps < TOUCHING, readings)
        if one.settings.reward.of == "robot":
            paid = paid[:, one.body]
        rewards = np.broadcast_to(paid, joint_actions.shape)
        return Transitions(states, rewards, reached, ~reached & (away > one.farthest))
