"""Wheel speeds and twists that every robot may be commanded in the next decision.

A *robot action* is the actions of a robot's wheels read as one number in base ``A``; a
*joint-action index*, those of all wheels. Several robot actions often command the same wheel
speeds: a resting wheel is maintained or zeroed, and one at its limit is maintained or increased.
"""

from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit


class WheelCommands(NamedTuple):
    """Wheel speeds and twists of ``M`` robots by robot action, ``K = A ** w`` for each."""

    speeds: FloatArray
    """``(M, K, w)`` commanded wheel speeds [m/s]."""
    twists: FloatArray
    """``(M, K, 3)`` twist in the frame of the robot [m/s, m/s, rad/s]."""
    alike: IntArray
    """``(M, K)`` the first robot action that commands the same wheel speeds."""


@njit(cache=True)
def wheel_commands_of(commands: FloatArray, effects: FloatArray) -> WheelCommands:
    """Return the commands of robots of ``w`` wheels each.

    Parameters
    ----------
    commands
        ``(M, w, A)`` the speed that every action of every wheel commands [m/s].
    effects
        ``(M, 3, w + 1)`` twist = effect @ [wheel speeds, 1].
    """
    n, w, n_actions = commands.shape
    count = n_actions**w
    speeds = np.empty((n, count, w))
    twists = np.empty((n, count, 3))
    alike = np.zeros((n, count), np.int64)
    for r in range(n):
        for c in range(count):
            place = count
            for j in range(w):
                place //= n_actions
                action = c // place % n_actions
                speed = commands[r, j, action]
                speeds[r, c, j] = speed
                first = 0
                while commands[r, j, first] != speed:
                    first += 1
                alike[r, c] += first * place
            for i in range(3):  # an assignment of slices would take a second longer to compile
                twists[r, c, i] = effects[r, i, w]
                for j in range(w):
                    twists[r, c, i] += effects[r, i, j] * speeds[r, c, j]
    return WheelCommands(speeds, twists, alike)


@njit(cache=True)
def robot_actions(joint_actions: IntArray, n_robots: int, n_actions: int) -> IntArray:
    """Return the robot actions ``(M, m)`` of joint actions ``(m, n)``."""
    wheels = joint_actions.shape[1] // n_robots
    actions = np.zeros((n_robots, len(joint_actions)), np.int64)
    for r in range(n_robots):
        for c in range(len(joint_actions)):
            for j in range(r * wheels, (r + 1) * wheels):
                actions[r, c] = actions[r, c] * n_actions + joint_actions[c, j]
    return actions


@njit(cache=True)
def speeds_of(actions: IntArray, speeds: FloatArray) -> FloatArray:
    """Return the wheel speeds ``(n, m)`` of all agents under robot actions ``(M, m)`` [m/s]."""
    n, m = actions.shape
    wheels = speeds.shape[2]
    wheel_speeds = np.empty((n * wheels, m))
    for r in range(n):
        for j in range(wheels):
            for c in range(m):
                wheel_speeds[r * wheels + j, c] = speeds[r, actions[r, c], j]
    return wheel_speeds
