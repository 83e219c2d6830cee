"""Motion planning of a single robot, around the box and clear of the other robots.

Scripted controllers and options (Sutton, Precup and Singh 1999) are made of this; agents that learn
do without. A robot searches over short sequences of its own actions. A decision costs at most
`MAX_SEQUENCES` sequences. Sequences with equal wheel speeds are simulated once, and only the other
robots within reach count.
"""

from __future__ import annotations

from math import log

import numpy as np

from ...core.numerics import BoolArray, FloatArray, wrap
from .prediction.predictors import push_model
from .prediction.twists import moved
from .scenario import BoxPushing
from .world.boxes import BoxSpec
from .world.geometry import distances
from .world.robots import nominal_effect, side_actions

CLEARANCE = 0.006
"""Least gap [m] to box and other robots on the way to a slot."""
MAX_SEQUENCES = 5000
"""Maximum number of action sequences per robot and decision, duplicates included."""


class Drivers:
    """Motion planners of all robots of a team.

    Parameters
    ----------
    scenario
        The robots, the box and the decision period.

    Attributes
    ----------
    model
        Model of robots and box.
    seconds
        The decision period [s].
    choices
        ``(k, w)`` the robot actions, the same of every robot.
    wheels
        Slice of each robot's wheels among all wheels.
    """

    def __init__(self, scenario: BoxPushing) -> None:
        self.robot = scenario.robot
        self.box = scenario.box
        self.actions = scenario.action_set
        self.model = push_model("push", list(scenario.world.robots), self.box)
        self.increment = scenario.settings.speed_increment
        self.seconds = scenario.settings.period
        self.choices = side_actions(self.robot, len(self.actions))
        self.wheels = [slice(group[0], group[-1] + 1) for group in scenario.groups]
        self._effect = nominal_effect(self.robot)

    def next(self, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return wheel speeds ``(m, k, w)`` and twists ``(m, k, 3)`` after the k robot actions.

        `speeds` is ``(m, w)``.
        """
        limit = np.full(speeds.shape[-1], self.robot.max_speed)
        after = self.actions.apply(
            speeds[:, None], self.choices[None], self.increment * limit, limit
        )
        return after, after @ self._effect[:, :-1].T + self._effect[:, -1]

    def rest(self, robot: int, speeds: FloatArray) -> int:
        """Return the robot action after which a robot's wheels are slowest."""
        after, _ = self.next(speeds[self.wheels[robot]][None])
        return int(np.abs(after[0]).sum(axis=1).argmin())

    def drive(
        self,
        robot: int,
        robots: FloatArray,
        box: FloatArray,
        speeds: FloatArray,
        target: FloatArray,
    ) -> int:
        """Return the robot action that leads a robot towards a pose ``(3,)``.

        `robots` ``(M, 3)`` and `box` ``(3,)`` are present poses, `speeds` ``(n,)`` those of all
        wheels.
        """
        now = speeds[self.wheels[robot]][None]
        depth = int(log(MAX_SEQUENCES) / log(len(self.choices)))
        span = 2.0 * self.robot.radius + CLEARANCE
        within = span + depth * self.seconds * self.robot.max_speed
        near = np.hypot(*(robots[:, :2] - robots[robot, :2]).T) < within
        near[robot] = False
        others = robots[near, :2]
        poses = robots[robot][None]
        cost = np.zeros(1)
        first = np.zeros(1, dtype=np.int64)
        for level in range(depth):
            after, twists = self.next(now)
            row, option = np.nonzero(_distinct(after))
            poses = poses[row]
            cost = cost[row]
            first = first[row] if level else option
            now = after[row, option]
            twists = twists[row, option]
            for _ in range(2):
                poses = moved(poses, twists, self.seconds / 2)
                apart = np.hypot(*(poses[:, None, :2] - others).transpose(2, 0, 1))
                cost = cost + 10.0 * np.maximum(span - apart, 0.0).sum(axis=1)
                path = paths(poses, target[:2], box, self.box, self.robot.radius + CLEARANCE)
                turn = np.abs(wrap(poses[:, 2] - target[2]))
                left = path + 0.06 * turn * np.exp(-path / 0.05)
                cost = cost + 0.1 * left
        return int(first[(cost + left).argmin()])


def _distinct(speeds: FloatArray) -> BoolArray:
    """Return which of ``(m, k, w)`` wheel speeds no earlier option gives, ``(m, k)``."""
    by_wheel = np.ascontiguousarray(speeds.transpose(2, 0, 1))  # not to reduce along a short axis
    same = (by_wheel[..., None] == by_wheel[:, :, None]).all(axis=0)
    first: BoolArray = same.argmax(axis=2) == np.arange(speeds.shape[1])
    return first


def paths(
    poses: FloatArray, target: FloatArray, box_pose: FloatArray, box: BoxSpec, margin: float
) -> FloatArray:
    """Return the approximate lengths ``(m,)`` of paths from poses to a target, around the box.

    A path is straight if all of it keeps `margin` from the box, and otherwise follows a circle
    around the box. Positions too close to the box are penalized.
    """
    cos, sin = np.cos(box_pose[2]), np.sin(box_pose[2])
    to_frame = np.array([[cos, -sin], [sin, cos]])  # of row vectors
    x, y = ((poses[:, :2] - box_pose[:2]) @ to_frame).T
    target_x, target_y = (target - box_pose[:2]) @ to_frame
    shares = np.linspace(0.0, 1.0, 9)[:, None]
    along_x, along_y = x + (target_x - x) * shares, y + (target_y - y) * shares
    gaps = distances(along_x.ravel(), along_y.ravel(), box.shape).reshape(along_x.shape)
    is_blocked = (gaps[1:] < np.minimum(margin, gaps[0])).any(axis=0)
    ring = box.reach + margin + 0.01
    turn = np.abs(np.arctan2(x * target_y - y * target_x, x * target_x + y * target_y))
    detour = ring * turn + np.abs(np.hypot(x, y) - ring) + abs(np.hypot(target_x, target_y) - ring)
    straight = np.hypot(target_x - x, target_y - y)
    return np.where(is_blocked, detour, straight) + 20.0 * np.maximum(margin - gaps[0], 0.0)
