"""Relational variables: what matters for pushing, seen from one robot.

Where the robot stands (gap, bearing of the box, side of the box as seen along the course to the
goal), how far off the others are, where the robots' middle would push the box, how the box is
turned, how far it has to go and whether it gets there. A further variable is one function here, and
to be fast in prediction one column of `kernels`.

A state variable is a function of a `View` and a robot, see
`nested_agents.scenarios.state_variables`. One of your own is written as the built-in ones are, and
a spec names it ``"mine.py:face_bearing"``::

    from nested_agents import View, state_variable

    @state_variable("m", 0.0, 1.5)
    def nearness(view: View, robot: int):
        return view.distance + view.gaps[:, robot]

Built-in variables are compiled for prediction: with one of its seven shared variables written as
here, the decision of a team of two e-Pucks takes about a third longer.
"""

from collections.abc import Callable
from math import pi

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.plugins.registry import Registry
from ...state_variables import StateFunction, StateVariable, state_variable
from ..world.geometry import wrap
from .view import View

AWAY = 0.03
"""Gap [m] from which a robot counts as wholly away from the box."""
SIDES = (-2.2, -0.5, 0.0, 0.5, 2.2)
GAPS = (0.0, 0.015, 0.06, 0.2, 0.5)
NEARNESS = ("touching", "close", "near", "away", "far")
TURNS = ("far right", "right", "ahead", "left", "far left")


def _angle(
    centres: tuple[float, ...], labels: tuple[str, ...] = TURNS, *, common: bool = False
) -> Callable[[StateFunction], StateVariable]:
    return state_variable(
        "rad", -pi, pi, periodic=True, centres=centres, labels=labels, common=common,
        mirrored="opposite",
    )  # fmt: skip


def _missed(view: View, bearing: FloatArray) -> FloatArray:
    off = np.clip(bearing, -0.5 * pi, 0.5 * pi)
    return view.distance * np.sin(off)


@state_variable("m", 0.0, 0.5, centres=GAPS, labels=NEARNESS, mirrored="same")
def gap(view: View, robot: int) -> FloatArray:
    """Gap between robot and box."""
    return view.gaps[:, robot]


@_angle(SIDES)
def box_bearing(view: View, robot: int) -> FloatArray:
    """Bearing of the box in the frame of the robot."""
    return wrap(view.azimuth(robot) - view.robots[:, robot, 2])


@_angle(SIDES, ("far left", "left", "behind", "right", "far right"))
def side(view: View, robot: int) -> FloatArray:
    """Where round the box the robot stands, as seen along the course to the goal."""
    return wrap(view.azimuth(robot) - view.course)


@state_variable("m", 0.0, 0.5, centres=GAPS, labels=NEARNESS, mirrored="same")
def others_gap(view: View, robot: int) -> FloatArray:
    """Greatest gap of the other robots; of the robot itself if it is alone."""
    others = [r for r in range(view.gaps.shape[1]) if r != robot] or [robot]
    return view.gaps[:, others].max(axis=1)


@_angle(SIDES, common=True)
def push_bearing(view: View, robot: int) -> FloatArray:
    """Where the robots' middle would push the box, off the course."""
    return wrap(view.push - view.course)


@state_variable(
    "m", -0.4, 0.4, centres=(-0.3, -0.06, 0.0, 0.06, 0.3),
    labels=("far right", "right", "none", "left", "far left"), common=True, mirrored="opposite",
)  # fmt: skip
def cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that push would miss the goal; beyond it the whole distance."""
    return _missed(view, push_bearing(view, robot))


@state_variable(
    "m", 0.0, 1.1, centres=(0.0, 0.1, 0.3, 0.6, 1.1),
    labels=("there", "close", "near", "away", "far"), common=True, mirrored="same",
)  # fmt: skip
def box_distance(view: View, robot: int) -> FloatArray:
    """Distance of the box from the goal."""
    return view.distance


@state_variable(
    "m", -0.05, 0.05, centres=(-0.02, -0.005, 0.0, 0.01, 0.03),
    labels=("receding", "slipping", "none", "slow", "fast"), common=True, mirrored="same",
)  # fmt: skip
def approach(view: View, robot: int) -> FloatArray:
    """By how much the box came nearer per decision period: -Delta D of Conditions 1, 2."""
    return view.approach


@_angle((-0.8, -0.2, 0.0, 0.2, 0.8), common=True)
def box_turn(view: View, robot: int) -> FloatArray:
    """Turn of the box from the goal pose."""
    return view.turn


@_angle((-0.8, -0.15, 0.0, 0.15, 0.8), common=True)
def bend(view: View, robot: int) -> FloatArray:
    """By how much the box is turned off the arc that ends in the goal pose."""
    return wrap(view.turn - 2.0 * wrap(view.course - view.goal[2]))


@_angle(SIDES)
def face_bearing(view: View, robot: int) -> FloatArray:
    """Bearing, in the frame of the robot, of the way straight into the nearest face of the box."""
    return wrap(view.inward(robot) - view.robots[:, robot, 2])


@state_variable(
    "1", 0.0, 1.0, centres=(0.0, 0.25, 0.5, 0.75, 1.0),
    labels=("none", "some", "half", "most", "all"), mirrored="same",
)  # fmt: skip
def others_away(view: View, robot: int) -> FloatArray:
    """How many of the other robots are away from the box, as a share: gaps up to `AWAY` in part.

    Of a robot that is alone, its own.
    """
    others = [r for r in range(view.gaps.shape[1]) if r != robot] or [robot]
    return np.clip(view.gaps[:, others] / AWAY, 0.0, 1.0).mean(axis=1)


@_angle((-1.2, -0.4, 0.0, 0.4, 1.2), common=True)
def contact_push_bearing(view: View, robot: int) -> FloatArray:
    """Where the robots in contact push the box, off the course."""
    return wrap(view.contact_push - view.course)


_wide_error = state_variable(
    "m", -1.0, 1.0, centres=(-0.8, -0.3, -0.08, 0.0, 0.08, 0.3, 0.8),
    labels=("very far right", "far right", "right", "none", "left", "far left", "very far left"),
    common=True, mirrored="opposite",
)  # fmt: skip


@_wide_error
def contact_cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that push would miss the goal; beyond it the whole distance."""
    return _missed(view, contact_push_bearing(view, robot))


@_angle((-1.2, -0.4, 0.0, 0.4, 1.2), common=True)
def path_bearing(view: View, robot: int) -> FloatArray:
    """Where the box is going, off the course."""
    return wrap(view.path - view.course)


@_wide_error
def path_cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that path would miss the goal; beyond it the whole distance."""
    return _missed(view, path_bearing(view, robot))


STATE_VARIABLES = Registry(
    "state variable",
    {name: f"{__name__}:{name}" for name, v in [*vars().items()] if isinstance(v, StateVariable)},
)
"""State variables by the name that specs use."""
