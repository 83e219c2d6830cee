"""State variables of the joints of an arm, and its kinematics.

A state variable is one function of a `ChainView` and of a joint, counted from 0. It serves sensing,
where the view holds one situation, and prediction, where it holds many. A spec names a function in
your file by ``"mine.py:height"``::

    from nested_agents import ChainView, state_variable

    @state_variable("m", -1.0, 1.0)
    def height(view: ChainView, joint: int):
        return view.places[joint, :, 1]

The arrays of a view have the joint as their first axis, so that the built-in functions also accept
a slice of joints and return the values of all of them in one call.

A posture is an array ``(n,)`` of joint angles [rad], each relative to the previous link; the first
is relative to the x axis. Joint i is at the beginning of link i, and joint 0 is the base at the
origin. The *tip* is the end of the last link.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray
from ...core.plugins.registry import Registry
from ..state_variables import (
    StateVariable,
    freeze,
    guard,
    state_variable,
)

Joints = int | slice
"""One joint, or several at once."""


@dataclass(frozen=True)
class ChainView:
    """The arm in ``m`` situations."""

    places: FloatArray
    """``(n + 1, m, 2)`` positions of the joints from the base on, and of the tip [m]."""
    angles: FloatArray
    """``(n, m)`` joint angles [rad]."""
    speeds: FloatArray
    """``(n, m)`` commanded speeds of the joints, as fractions of the maximum."""
    goal: FloatArray
    """``(2,)`` or ``(m, 2)`` goal of the tip [m]."""
    previous_distance: float | FloatArray
    """Distance of the tip from the goal before the last decision [m], ``(m,)`` if it differs."""

    @property
    def tip(self) -> FloatArray:
        """Position of the tip ``(m, 2)`` [m]."""
        return self.places[-1]

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of the tip from the goal ``(m,)`` [m]."""
        return freeze(_length(self.goal - self.tip))

    @property
    def approach(self) -> FloatArray:
        """Decrease of the distance in the last decision ``(m,)`` [m]."""
        return self.previous_distance - self.distance


def forward_kinematics(angles: FloatArray, link_length: float) -> FloatArray:
    """Return the positions of joints and tip ``(n + 1, ..., 2)`` for postures ``(n, ...)``."""
    headings = np.cumsum(angles, axis=0)
    links = link_length * np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    return np.concatenate([np.zeros_like(links[:1]), np.cumsum(links, axis=0)])


def jacobian(places: FloatArray) -> FloatArray:
    """Return the derivative of the tip's position by the joint angles ``(n, 2)`` [m/rad].

    A joint moves the tip at right angles to the line from the joint to the tip.

    Parameters
    ----------
    places
        ``(n + 1, 2)`` positions of joints and tip, see `forward_kinematics`.
    """
    x, y = (places[-1] - places[:-1]).T
    return np.stack([-y, x], axis=1)


BEARINGS = (-2.4, -1.2, -0.4, -0.1, 0.1, 0.4, 1.2, 2.4)
DISTANCES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.2, 2.0)
APPROACHES = (-0.2, -0.06, -0.01, 0.0, 0.01, 0.06, 0.2)


def _length(vectors: FloatArray) -> FloatArray:
    length: FloatArray = np.hypot(vectors[..., 0], vectors[..., 1])
    return length


@state_variable("rad", -pi, pi, periodic=True, centers=BEARINGS, mirrored="opposite")
def bearing(view: ChainView, joint: Joints) -> FloatArray:
    """Angle at the joint from the tip to the goal: the turn that would point the tip at it."""
    to_tip = view.tip - view.places[:-1][joint]
    to_goal = view.goal - view.places[:-1][joint]
    cross = to_tip[..., 0] * to_goal[..., 1] - to_tip[..., 1] * to_goal[..., 0]
    dot = to_tip[..., 0] * to_goal[..., 0] + to_tip[..., 1] * to_goal[..., 1]
    return np.arctan2(cross, dot)


@state_variable("m", 0.0, 2.0, centers=DISTANCES, common=True, mirrored="same")
def distance(view: ChainView, joint: Joints) -> FloatArray:
    """Distance of the tip from the goal."""
    return view.distance


@state_variable("m", -0.2, 0.2, centers=APPROACHES, common=True, mirrored="same")
def approach(view: ChainView, joint: Joints) -> FloatArray:
    """Decrease of the tip's distance from the goal in the last decision."""
    return view.approach


@state_variable("rad", -pi, pi, centers=(-2.5, -1.25, 0.0, 1.25, 2.5), mirrored="opposite")
def angle(view: ChainView, joint: Joints) -> FloatArray:
    """Angle of the joint within one turn."""
    return (view.angles[joint] + pi) % (2.0 * pi) - pi


@state_variable("m", 0.0, 1.0, mirrored="same")
def lever(view: ChainView, joint: Joints) -> FloatArray:
    """Distance of the tip from the joint."""
    return _length(view.tip - view.places[:-1][joint])


@state_variable("m", -1.0, 1.0, centers=(-0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5), mirrored="same")
def excess(view: ChainView, joint: Joints) -> FloatArray:
    """Distance of the goal from the joint minus that of the tip; positive if it must stretch."""
    return _length(view.goal - view.places[:-1][joint]) - lever.function(view, joint)


BUILT_IN = [name for name, thing in [*vars().items()] if isinstance(thing, StateVariable)]
CHAIN_VARIABLES = Registry("chain variable", {name: f"{__name__}:{name}" for name in BUILT_IN})
"""State variables by the name that specs use."""

SPEEDS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Centers of the joint's own speed, as a fraction of the maximum, for arms of any length."""
SPEED = Variable("speed", "1", -1.0, 1.0, centers=SPEEDS, mirrored="opposite")


def joint_states(
    view: ChainView, variables: Sequence[StateVariable], first: int, count: int
) -> FloatArray:
    """Return the states ``(count, m, d)`` of `count` joints from `first` on.

    They are the joint's own speed and the variables, in this order. Values of users' functions are
    checked.
    """
    joints = slice(first, first + count)
    m = view.places.shape[1]
    states = np.empty((count, m, 1 + len(variables)))
    states[:, :, 0] = view.speeds[joints]
    for column, variable in enumerate(variables, 1):
        if variable.trusted:
            states[:, :, column] = variable.function(view, joints)
        else:
            read_only = guard(view)
            for joint in range(count):
                values = variable.function(read_only, first + joint)
                states[joint, :, column] = variable.checked(values, m)
    return states
