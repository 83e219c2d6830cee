"""Twists in the frame of a body, and the arcs along which they move it."""

from math import pi

import numpy as np

from ....core.numerics import FloatArray, njit
from ...angles import rotate

Twist = tuple[float, float, float]
"""Speed ahead and to the left [m/s], turning rate [rad/s]."""


@njit(cache=True, forceinline=True)
def displacement(heading: float, twist: Twist, seconds: float) -> Twist:
    """Return the motion (x, y [m], turn [rad]) along the arc of a twist."""
    half = 0.5 * twist[2] * seconds
    chord = seconds * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    cos, sin = np.cos(heading + half), np.sin(heading + half)
    dx, dy = rotate(cos, sin, chord * twist[0], chord * twist[1])
    return dx, dy, 2.0 * half


@njit(cache=True, forceinline=True)
def move(pose: FloatArray, twist: Twist, seconds: float) -> None:
    """Move a pose ``(3,)`` along the arc of a twist."""
    dx, dy, turn = displacement(pose[2], twist, seconds)
    pose[0] += dx
    pose[1] += dy
    pose[2] += turn


@njit(cache=True)
def moved(poses: FloatArray, twists: FloatArray, seconds: float) -> FloatArray:
    """Return poses ``(m, 3)`` after moving with constant twists ``(m, 3)`` in their own frames."""
    after = poses.copy()
    for i in range(len(poses)):
        move(after[i], (twists[i, 0], twists[i, 1], twists[i, 2]), seconds)
    return after


@njit(cache=True)
def twist_between(before: FloatArray, after: FloatArray, seconds: float, out: FloatArray) -> None:
    """Write the constant twist ``(3,)`` in its own frame that leads from one pose to another."""
    half = 0.5 * (after[2] - before[2])
    # The chord of an arc is shorter than the arc by the sinc of half its angle.
    clipped = min(max(half, -0.5 * pi), 0.5 * pi)
    longer = clipped / np.sin(clipped) if abs(clipped) > 1e-9 else 1.0
    cos, sin = np.cos(before[2] + half), np.sin(before[2] + half)
    x, y = after[0] - before[0], after[1] - before[1]
    along, across = rotate(cos, -sin, x * longer, y * longer)
    out[0], out[1], out[2] = along / seconds, across / seconds, 2.0 * half / seconds


@njit(cache=True)
def mean_twists(before: FloatArray, after: FloatArray, seconds: float) -> FloatArray:
    """Return the constant twists ``(M, 3)``, own frame, between poses ``(M, 3)``.

    Headings count whole turns. For arcs beyond half a turn the speed is too low, because their
    chord no longer determines their length.
    """
    twists = np.empty(before.shape)
    for r in range(len(before)):
        twist_between(before[r], after[r], seconds, twists[r])
    return twists
