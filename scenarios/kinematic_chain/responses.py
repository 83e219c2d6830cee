"""Best responses of all joints of an arm, in one compiled call.

With rules of single variables the value of the team is a sum: of functions of the distance and the
approach of the tip, and of the speed and the bearing of every joint. If a joint turns, it and the
joints before it see the tip move. The joints behind it turn along, so that the goal moves in their
frames.

The result and the random numbers equal those of `BestResponse`, which predicts whole postures;
`tests/scenarios/kinematic_chain` compares the two. Without this module an arm of 64 joints takes
about 20 times as long to decide.
"""

from typing import NamedTuple

import numpy as np

from ...core.interface.prediction import Exploring
from ...core.numerics import FloatArray, IntArray, njit
from ...core.search.drawing import choose_action, draw
from ..angles import angle_of


class PiecewiseLinear(NamedTuple):
    """Piecewise linear functions without their constants: ``sum(bends * max(x - knots, 0))``."""

    knots: FloatArray
    """``(K,)`` points at which the slope changes, increasing."""
    bends: FloatArray
    """``(K, n)`` changes of the slope there, one column per function."""


class Options(NamedTuple):
    """Actions of n joints, A each, the value functions of the team, and its goal."""

    goal: FloatArray
    """``(2,)`` goal of the tip [m]."""
    previous_distance: float
    """Distance of the tip from the goal before the decision [m]."""
    turns: FloatArray
    """``(n, A)`` angle by which each action turns the joint [rad]."""
    alike: IntArray
    """``(n, A)`` first action of the joint with the same effect."""
    speed_values: FloatArray
    """``(n, A)`` value of the speed that each action commands."""
    bearing: PiecewiseLinear
    """Value of the bearing of every joint."""
    distance: PiecewiseLinear
    """Value of the distance of the tip from the goal to all joints, one function."""
    approach: PiecewiseLinear
    """Value of the approach of the tip to all joints, one function."""


def piecewise_linear(knots: FloatArray, values: FloatArray) -> PiecewiseLinear:
    """Return the functions that take values ``(n, K)`` at knots and are constant beyond."""
    slopes = np.diff(values, axis=1) / np.diff(knots)
    return PiecewiseLinear(knots, np.diff(slopes, axis=1, prepend=0.0, append=0.0).T.copy())


@njit(cache=True, fastmath={"contract", "nsz", "reassoc"})
def _sum(functions: PiecewiseLinear, xs: FloatArray) -> float:
    """Return the sum of all functions, each at its own x ``(n,)``."""
    total = 0.0
    for k in range(len(functions.knots)):
        for i in range(len(xs)):
            beyond = xs[i] - functions.knots[k]
            total += functions.bends[k, i] * (beyond if beyond > 0.0 else 0.0)
    return total


@njit(cache=True, fastmath={"contract", "nsz"})
def _write_bearings(
    places: FloatArray,
    tip: tuple[float, float],
    goal: tuple[float, float],
    joints: tuple[int, int],
    out: FloatArray,
) -> None:
    """Write the angles from the tip to the goal at the joints from the first to the second."""
    first, last = joints
    for i in range(first, last):
        tip_x, tip_y = tip[0] - places[0, i], tip[1] - places[1, i]
        goal_x, goal_y = goal[0] - places[0, i], goal[1] - places[1, i]
        cross, dot = tip_x * goal_y - tip_y * goal_x, tip_x * goal_x + tip_y * goal_y
        out[i] = angle_of(dot, cross)


@njit(cache=True)
def _rotated(
    point: tuple[float, float], center: tuple[float, float], angle: float
) -> tuple[float, float]:
    """Return a point after a rotation about a center by an angle [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    dx, dy = point[0] - center[0], point[1] - center[1]
    return center[0] + cos * dx - sin * dy, center[1] + sin * dx + cos * dy


@njit(cache=True)
def _value_after(
    places: FloatArray, joint: int, turn: float, options: Options, xs: FloatArray
) -> float:
    """Return the summed value of all joints, except for speeds, after a joint turns [rad].

    `xs` is scratch ``(n,)``.
    """
    n = len(xs)
    pivot, tip = (places[0, joint], places[1, joint]), (places[0, n], places[1, n])
    target = (options.goal[0], options.goal[1])
    moved = _rotated(tip, pivot, turn)
    _write_bearings(places, moved, target, (0, joint + 1), xs)
    _write_bearings(places, tip, _rotated(target, pivot, -turn), (joint + 1, n), xs)
    value = _sum(options.bearing, xs)
    distance = np.hypot(target[0] - moved[0], target[1] - moved[1])
    xs[0] = distance
    value += _sum(options.distance, xs[:1])
    xs[0] = options.previous_distance - distance
    return value + _sum(options.approach, xs[:1])


@njit(cache=True)
def respond(
    places: FloatArray,
    plan: IntArray,
    order: IntArray,
    options: Options,
    exploring: Exploring,
    rng: np.random.Generator,
) -> IntArray:
    """Improve a plan by one sweep of best responses, then let every joint decide; return `plan`.

    Parameters
    ----------
    places
        ``(2, n + 1)`` positions of joints and tip under the plan [m]; modified.
    plan
        ``(n,)`` joint action; modified.
    order
        ``(n,)`` the order of decision.
    options
        Actions, value functions and goal.
    exploring
        How joints explore.
    rng
        Source of randomness.
    """
    n, n_actions = options.turns.shape
    values, xs = np.empty(n_actions), np.empty(n)
    for decides in (False, True):
        for joint in order:
            turns = options.turns[joint] - options.turns[joint, plan[joint]]
            for a in range(n_actions):
                same = options.alike[joint, a]
                if same == a:
                    value = _value_after(places, joint, turns[a], options, xs)
                    values[a] = (value + options.speed_values[joint, a]) / n
                else:
                    values[a] = values[same] if decides else -np.inf
            action = draw(values, rng)
            if decides:
                action = choose_action(joint, values, exploring, rng)
            plan[joint] = action
            pivot = places[0, joint], places[1, joint]
            for i in range(joint + 1, n + 1):
                place = places[0, i], places[1, i]
                places[0, i], places[1, i] = _rotated(place, pivot, turns[action])
    return plan
