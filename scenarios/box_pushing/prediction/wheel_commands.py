"""Possible wheel commands of every robot in the next decision, and their twists.

Several actions often command the same speed: a resting wheel is maintained or zeroed, and one at
its limit is maintained or increased. Therefore a robot has far fewer distinct *wheel commands*, the
speeds of all its wheels, than ``A ** w``. Wheels on one side of a skid-steer have the same effect
on its motion, so that its distinct *twists* are fewer still. A *robot-action index* is the actions
of a robot's wheels read as one number in base ``A``; a *joint-action index*, those of all wheels.
"""

from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit

SAME_TWIST = 1e-11
"""Twists [m/s, rad/s] that differ by less are one twist."""


class WheelCommands(NamedTuple):
    """Wheel commands and twists of ``M`` robots; of robots with fewer than most, zeros follow."""

    counts: IntArray
    """``(M,)`` number of wheel commands of each robot, K at most."""
    speeds: FloatArray
    """``(M, K, w)`` wheel speeds of every command [m/s]."""
    twists: FloatArray
    """``(M, K, 3)`` twist under every command in the frame of the robot [m/s, m/s, rad/s]."""
    which: IntArray
    """``(M, A ** w)`` the command of every robot-action index."""
    n_levels: IntArray
    """``(M, w)`` number of speeds that each wheel may be commanded."""
    levels: FloatArray
    """``(M, w, A)`` these speeds [m/s], increasing."""
    level: IntArray
    """``(M, w, A ** w)`` which of them every robot-action index tells each wheel."""
    n_distinct: IntArray
    """``(M,)`` number of distinct twists of each robot."""
    first: IntArray
    """``(M, K)`` the first command of every distinct twist."""
    distinct: IntArray
    """``(M, K)`` which of the distinct twists every command gives."""


@njit(cache=True)
def wheel_commands_of(commands: FloatArray, effects: FloatArray, merge: bool) -> WheelCommands:
    """Enumerate the wheel commands of robots of ``w`` wheels each.

    Parameters
    ----------
    commands
        ``(M, w, A)`` the speed that every action of every wheel commands [m/s].
    effects
        ``(M, 3, w + 1)`` twist = effect @ [wheel speeds, 1].
    merge
        Whether commands of one twist count as one; otherwise each twist is its own.
    """
    n, w, a = commands.shape
    # Per wheel the distinct speeds in increasing order, and which of them each action commands.
    ordered, number = np.zeros((n, w, a)), np.empty((n, w, a), np.int64)
    sizes, counts = np.empty((n, w), np.int64), np.ones(n, np.int64)
    most, n_indices = 0, a**w
    for r in range(n):
        for j in range(w):
            # The least, and then the next: of so few speeds that is quick, and quick to compile.
            last, least, place = -np.inf, 0.0, 0
            while least < np.inf:
                least = np.inf
                for k in range(a):
                    if last < commands[r, j, k] < least:
                        least = commands[r, j, k]
                    elif commands[r, j, k] == last:
                        number[r, j, k] = place - 1
                if least < np.inf:
                    ordered[r, j, place] = last = least
                    place += 1
            sizes[r, j] = place
            counts[r] *= place
        most = max(most, counts[r])
    speeds, twists = np.zeros((n, most, w)), np.zeros((n, most, 3))
    which, level = np.empty((n, n_indices), np.int64), np.empty((n, w, n_indices), np.int64)
    n_distinct = np.zeros(n, np.int64)
    first, distinct = np.zeros((n, most), np.int64), np.zeros((n, most), np.int64)
    for r in range(n):
        for d in range(counts[r]):
            rest = d
            for j in range(w - 1, -1, -1):
                speeds[r, d, j] = ordered[r, j, rest % sizes[r, j]]
                rest //= sizes[r, j]
            for i in range(3):
                twists[r, d, i] = effects[r, i, w]
                for j in range(w):
                    twists[r, d, i] += effects[r, i, j] * speeds[r, d, j]
            known = _find(twists[r], d, first[r, : n_distinct[r]]) if merge else -1
            if known < 0:
                known = n_distinct[r]
                first[r, known] = d
                n_distinct[r] += 1
            distinct[r, d] = known
        for c in range(n_indices):
            place, command = n_indices, 0
            for j in range(w):
                place //= a
                level[r, j, c] = number[r, j, c // place % a]
                command = command * sizes[r, j] + level[r, j, c]
            which[r, c] = command
    return WheelCommands(
        counts, speeds, twists, which, sizes, ordered, level, n_distinct, first, distinct
    )


@njit(cache=True)
def _find(twists: FloatArray, command: int, first: IntArray) -> int:
    """Return which of the commands `first` has the twist of `command`, -1 if none."""
    for m in range(len(first)):
        off = 0.0
        for i in range(3):
            off = max(off, abs(twists[command, i] - twists[first[m], i]))
        if off < SAME_TWIST:
            return m
    return -1


@njit(cache=True)
def first_actions(which: IntArray) -> IntArray:
    """Return for every robot-action index ``(M, A ** w)`` the first that gives its command."""
    first = np.empty_like(which)
    for r in range(len(which)):
        for c in range(which.shape[1]):
            first[r, c] = c
            for former in range(c):
                if which[r, former] == which[r, c]:
                    first[r, c] = former
                    break
    return first


@njit(cache=True)
def choices_of(joint_actions: IntArray, which: IntArray, n_actions: int) -> IntArray:
    """Return the wheel command ``(m, M)`` of each robot in joint actions ``(m, n)``."""
    m, n = len(joint_actions), len(which)
    wheels = joint_actions.shape[1] // n
    choices = np.empty((m, n), np.int64)
    for c in range(m):
        for r in range(n):
            index = 0
            for j in range(wheels):
                index = index * n_actions + joint_actions[c, r * wheels + j]
            choices[c, r] = which[r, index]
    return choices


@njit(cache=True)
def twist_table(commands: WheelCommands) -> tuple[IntArray, IntArray]:
    """Return all combinations of distinct twists, and the one of every joint-action index.

    The combinations are wheel commands ``(m, M)``, the indices number them, ``(A ** n,)``.
    """
    n, n_indices = commands.which.shape
    rows = commands.n_distinct.prod()
    choices, row, behind = np.empty((rows, n), np.int64), np.zeros(1, np.int64), rows
    for r in range(n):
        count = commands.n_distinct[r]
        behind //= count
        for c in range(rows):
            choices[c, r] = commands.first[r, c // behind % count]
        former, row = row, np.empty(len(row) * n_indices, np.int64)
        for c in range(len(row)):
            command = commands.which[r, c % n_indices]
            row[c] = count * former[c // n_indices] + commands.distinct[r, command]
    return choices, row


@njit(cache=True)
def speeds_of(choices: IntArray, speeds: FloatArray) -> FloatArray:
    """Return the wheel speeds ``(n, m)`` of all agents under wheel commands ``(M, m)`` [m/s]."""
    n, m = choices.shape
    wheels = speeds.shape[2]
    wheel_speeds = np.empty((n * wheels, m))
    for r in range(n):
        for j in range(wheels):
            for c in range(m):
                wheel_speeds[r * wheels + j, c] = speeds[r, choices[r, c], j]
    return wheel_speeds
