"""What the wheels of every robot may be told next, and how the robots would move under it.

Several actions often command one speed (a resting wheel is maintained or zeroed, one at its limit
is maintained or increased), so that the distinct *drives* of a robot, its wheel speeds, are far
fewer than ``A ** w``. Wheels on one side of a skid-steer do the same to its motion, so that its
distinct *motions* are fewer still.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from ....core.arrays import FloatArray, IntArray

SAME_TWIST = 1e-11
"""Twists [m/s, rad/s] that differ by less are one motion."""


class Drives(NamedTuple):
    """Drives and motions of ``M`` robots; robots with fewer than most are padded with zeros.

    Attributes
    ----------
    counts
        ``(M,)`` number of drives of each robot, K at most.
    speeds
        ``(M, K, w)`` wheel speeds of every drive [m/s].
    twists
        ``(M, K, 3)`` twist of every drive in the frame of the robot [m/s, m/s, rad/s].
    which
        ``(M, A ** w)`` the drive of every local code.
    n_levels
        ``(M, w)`` number of speeds that each wheel may be told.
    levels
        ``(M, w, A)`` these speeds [m/s], increasing.
    level
        ``(M, w, A ** w)`` which of them every local code tells each wheel.
    n_motions
        ``(M,)`` number of motions of each robot.
    first
        ``(M, K)`` the first drive of every motion.
    motions
        ``(M, K)`` the motion of every drive.
    """

    counts: IntArray
    speeds: FloatArray
    twists: FloatArray
    which: IntArray
    n_levels: IntArray
    levels: FloatArray
    level: IntArray
    n_motions: IntArray
    first: IntArray
    motions: IntArray


@njit(cache=True)
def drives_of(commands: FloatArray, effects: FloatArray, merge: bool) -> Drives:
    """Enumerate the drives of robots of ``w`` wheels each.

    Parameters
    ----------
    commands
        ``(M, w, A)`` the speed that every action of every wheel commands [m/s].
    effects
        ``(M, 3, w + 1)`` twist = effect @ [wheel speeds, 1].
    merge
        Whether drives of one twist are one motion; otherwise each is its own.
    """
    n, w, a = commands.shape
    # Per wheel the distinct speeds in increasing order, and which of them each action commands.
    distinct, number = np.zeros((n, w, a)), np.empty((n, w, a), np.int64)
    sizes = np.ones((n, w), np.int64)
    counts = np.ones(n, np.int64)
    for r in range(n):
        for j in range(w):
            ordered = np.sort(commands[r, j])
            distinct[r, j, 0] = ordered[0]
            for k in range(1, a):
                if ordered[k] != ordered[k - 1]:
                    distinct[r, j, sizes[r, j]] = ordered[k]
                    sizes[r, j] += 1
            for k in range(a):
                number[r, j, k] = np.searchsorted(distinct[r, j, : sizes[r, j]], commands[r, j, k])
            counts[r] *= sizes[r, j]
    most, codes = counts.max(), a**w
    speeds, twists = np.zeros((n, most, w)), np.zeros((n, most, 3))
    which, level = np.empty((n, codes), np.int64), np.empty((n, w, codes), np.int64)
    n_motions = np.zeros(n, np.int64)
    first, motions = np.zeros((n, most), np.int64), np.zeros((n, most), np.int64)
    for r in range(n):
        for d in range(counts[r]):
            rest = d
            for j in range(w - 1, -1, -1):
                speeds[r, d, j] = distinct[r, j, rest % sizes[r, j]]
                rest //= sizes[r, j]
            for i in range(3):
                twists[r, d, i] = effects[r, i, w]
                for j in range(w):
                    twists[r, d, i] += effects[r, i, j] * speeds[r, d, j]
            known = _find(twists[r], d, first[r, : n_motions[r]]) if merge else -1
            if known < 0:
                known = n_motions[r]
                first[r, known] = d
                n_motions[r] += 1
            motions[r, d] = known
        for c in range(codes):
            place, drive = codes, 0
            for j in range(w):
                place //= a
                level[r, j, c] = number[r, j, c // place % a]
                drive = drive * sizes[r, j] + level[r, j, c]
            which[r, c] = drive
    return Drives(
        counts, speeds, twists, which, sizes, distinct, level, n_motions, first, motions
    )  # fmt: skip


@njit(cache=True)
def _find(twists, drive, first):  # type: ignore[no-untyped-def]
    """Return which of the drives `first` has the twist of `drive`, -1 if none."""
    for m in range(len(first)):
        off = 0.0
        for i in range(3):
            off = max(off, abs(twists[drive, i] - twists[first[m], i]))
        if off < SAME_TWIST:
            return m
    return -1


@njit(cache=True)
def choices_of(joint_actions: IntArray, which: IntArray, n_actions: int) -> IntArray:
    """Return the drive ``(m, M)`` of each robot in joint actions ``(m, n)``."""
    m, n = len(joint_actions), len(which)
    wheels = joint_actions.shape[1] // n
    choices = np.empty((m, n), np.int64)
    for c in range(m):
        for r in range(n):
            local = 0
            for j in range(wheels):
                local = local * n_actions + joint_actions[c, r * wheels + j]
            choices[c, r] = which[r, local]
    return choices


@njit(cache=True)
def motion_table(drives: Drives) -> tuple[IntArray, IntArray]:
    """Return all combinations of motions, as drives ``(m, M)``, and the one of every code.

    The codes are those of joint actions, ``(A ** n,)``.
    """
    n, codes = drives.which.shape
    rows = drives.n_motions.prod()
    choices = np.empty((rows, n), np.int64)
    for c in range(rows):
        rest = c
        for r in range(n - 1, -1, -1):
            choices[c, r] = drives.first[r, rest % drives.n_motions[r]]
            rest //= drives.n_motions[r]
    row = np.zeros(1, np.int64)
    for r in range(n):
        longer = np.empty(len(row) * codes, np.int64)
        for c in range(len(row)):
            start = row[c] * drives.n_motions[r]
            for local in range(codes):
                drive = drives.which[r, local]
                longer[c * codes + local] = start + drives.motions[r, drive]
        row = longer
    return choices, row
