"""State variables by name: what a joint perceives beside its own speed.

A state variable is a function of a `ChainView` and the number of a joint from 0, see
`nested_agents.scenarios.state_variables`. One of your own is written as the built-in ones are, and
a spec names it ``"mine.py:height"``::

    from nested_agents import ChainView, state_variable

    @state_variable("m", -1.0, 1.0)
    def height(view: ChainView, joint: int):
        return view.places[:, joint, 1]

The built-in ones tell where the goal is, seen from a joint. Each is a function of a view and a
joint, in NumPy: the definition, and the test oracle of the compiled `columns`, which serve sensing
and prediction. They are computed from postures of the arm and the goal, many at once.

A posture is an array ``(n,)`` of joint angles [rad], each counted from the direction of the link
before; the first one from the x axis. Joint i stands where link i begins, so that joint 0 is the
base at the origin. The *tip* is the end of the last link.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray, IntArray, njit
from ...core.plugins.registry import Registry
from ..state_variables import (
    Situations,
    find_variable,
    freeze,
    sense,
    space_of,
    state_variable,
)


@dataclass(frozen=True)
class ChainView(Situations):
    """Situations to be described, ``m`` at once."""

    places: FloatArray
    """``(m, n + 1, 2)`` the joints from the base on, and the tip [m]."""
    angles: FloatArray
    """``(m, n)`` joint angles [rad]."""
    speeds: FloatArray
    """``(m, n)`` commanded speeds of the joints, as fractions of the greatest."""
    goal: FloatArray
    """``(2,)`` where the tip is to be [m]."""
    before: float
    """Distance of the tip from the goal before the decision that led here [m]."""

    @property
    def n_situations(self) -> int:
        """How many postures there are."""
        return len(self.places)

    @property
    def tip(self) -> FloatArray:
        """The tip ``(m, 2)`` [m]."""
        return self.places[:, -1]

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the tip from the goal [m]."""
        return freeze(np.hypot(*(self.goal - self.tip).T))

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the tip has come to the goal in the decision [m]."""
        return self.before - self.distance


@njit(cache=True)
def ends_of(angles: FloatArray, length: float) -> FloatArray:
    """Return all joints and the tip ``(n + 1, 2)`` of a posture ``(n,)``, links of `length`."""
    n = len(angles)
    places = np.zeros((n + 1, 2))
    heading = 0.0
    for i in range(n):
        heading += angles[i]
        places[i + 1, 0] = places[i, 0] + length * np.cos(heading)
        places[i + 1, 1] = places[i, 1] + length * np.sin(heading)
    return places


@njit(cache=True)
def postures_of(angles: FloatArray, length: float) -> FloatArray:
    """Return the joints and tips ``(m, n + 1, 2)`` of postures ``(m, n)``."""
    places = np.empty((len(angles), angles.shape[1] + 1, 2))
    for k in range(len(angles)):
        ends = ends_of(angles[k], length)
        for i in range(len(ends)):
            places[k, i, 0], places[k, i, 1] = ends[i, 0], ends[i, 1]
    return places


def jacobian_of(places: FloatArray) -> FloatArray:
    """Return how the tip moves ``(n, 2)`` as each joint turns, given `ends_of` a posture [m/rad].

    A joint turns all that is behind it: the tip moves at right angles to the line from the joint.
    """
    x, y = (places[-1] - places[:-1]).T
    return np.stack([-y, x], axis=1)


BEARINGS = (-2.4, -1.2, -0.4, -0.1, 0.1, 0.4, 1.2, 2.4)
DISTANCES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.2, 2.0)
APPROACHES = (-0.2, -0.06, -0.01, 0.0, 0.01, 0.06, 0.2)
COMPILED = ("bearing", "distance", "approach", "angle", "lever", "excess")
"""The built-in variables; a row of -1 is the joint's speed."""
BEARING, DISTANCE, APPROACH, ANGLE, LEVER, EXCESS = range(len(COMPILED))


@state_variable("rad", -pi, pi, periodic=True, centres=BEARINGS, mirrored="opposite")
def bearing(view: ChainView, joint: int) -> FloatArray:
    """Angle at the joint from the tip to the goal: by how much it would have to turn."""
    x, y = (view.tip - view.places[:, joint]).T
    ahead, aside = (view.goal - view.places[:, joint]).T
    return np.arctan2(x * aside - y * ahead, x * ahead + y * aside)


@state_variable("m", 0.0, 2.0, centres=DISTANCES, common=True, mirrored="same")
def distance(view: ChainView, joint: int) -> FloatArray:
    """Distance of the tip from the goal."""
    return view.distance


@state_variable("m", -0.2, 0.2, centres=APPROACHES, common=True, mirrored="same")
def approach(view: ChainView, joint: int) -> FloatArray:
    """How much nearer the tip has come in the decision."""
    return view.approach


@state_variable("rad", -pi, pi, centres=(-2.5, -1.25, 0.0, 1.25, 2.5), mirrored="opposite")
def angle(view: ChainView, joint: int) -> FloatArray:
    """Angle of the joint, which matters where joints have limits; of the base within a turn."""
    return (view.angles[:, joint] + pi) % (2.0 * pi) - pi


@state_variable("m", 0.0, 1.0, mirrored="same")
def lever(view: ChainView, joint: int) -> FloatArray:
    """Distance of the tip from the joint."""
    return np.hypot(*(view.tip - view.places[:, joint]).T)


@state_variable("m", -1.0, 1.0, centres=(-0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5), mirrored="same")
def excess(view: ChainView, joint: int) -> FloatArray:
    """By how much the goal is farther from the joint than the tip: whether to stretch or fold."""
    return np.hypot(*(view.goal - view.places[:, joint]).T) - lever(view, joint)


@njit(cache=True)
def columns(
    places: FloatArray,
    angles: FloatArray,
    speeds: FloatArray,
    goal: FloatArray,
    before: float,
    first: int,
    count: int,
    rows: IntArray,
) -> FloatArray:
    """Return the variables ``(count, m, len(rows))`` of joints from `first` on.

    Parameters are those of a `ChainView`; `rows` are indices of `COMPILED`. Columns of others stay
    zero.
    """
    m, tip = len(places), places.shape[1] - 1
    states = np.zeros((count, m, len(rows)))
    for k in range(m):
        tx, ty = places[k, tip, 0], places[k, tip, 1]
        away = np.hypot(goal[0] - tx, goal[1] - ty)
        for i in range(count):
            joint = first + i
            x, y = tx - places[k, joint, 0], ty - places[k, joint, 1]
            ahead, aside = goal[0] - places[k, joint, 0], goal[1] - places[k, joint, 1]
            for column in range(len(rows)):
                row = rows[column]
                if row == -1:
                    states[i, k, column] = speeds[k, joint]
                elif row == BEARING:
                    cross, along = x * aside - y * ahead, x * ahead + y * aside
                    states[i, k, column] = np.arctan2(cross, along)
                elif row == DISTANCE:
                    states[i, k, column] = away
                elif row == APPROACH:
                    states[i, k, column] = before - away
                elif row == ANGLE:
                    turned = angles[k, joint] + pi
                    states[i, k, column] = turned - 2.0 * pi * np.floor(turned / (2.0 * pi)) - pi
                elif row == LEVER:
                    states[i, k, column] = np.hypot(x, y)
                elif row == EXCESS:
                    states[i, k, column] = np.hypot(ahead, aside) - np.hypot(x, y)
    return states


CHAIN_VARIABLES = Registry("chain variable", {name: f"{__name__}:{name}" for name in COMPILED})
"""State variables by the name that specs use."""

SPEEDS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Centres of the own speed, as a fraction of the greatest: arms of any length share it."""
SPEED = Variable("speed", "1", -1.0, 1.0, centres=SPEEDS, mirrored="opposite")


class ChainStates:
    """The states of joints: the own speed, and variables in the order in which they are listed.

    Parameters
    ----------
    names
        Of the variables, see `CHAIN_VARIABLES`. The compiled ones are trusted; what functions of
        users return is checked.

    Raises
    ------
    ValueError
        If one is unknown or named twice, or there is none; one line.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._things = [find_variable(CHAIN_VARIABLES, name) for name in names]
        self.space = space_of("+".join(names), SPEED, self._things)
        # Beyond the last of the compiled columns: the column is none of these.
        rows = [COMPILED.index(name) if name in COMPILED else len(COMPILED) for name in names]
        self.rows = np.array([-1, *rows])

    @property
    def is_compiled(self) -> bool:
        """Whether all variables are built in."""
        return all(thing.trusted for thing in self._things)

    def of_joints(self, view: ChainView, first: int, count: int) -> FloatArray:
        """Return the states ``(count, m, d)`` of joints from `first` on, compiled if possible."""
        states = columns(
            view.places, view.angles, view.speeds, view.goal, view.before, first, count, self.rows
        )
        sense(self._things, view, range(first, first + count), states[:, :, 1:])
        return states
