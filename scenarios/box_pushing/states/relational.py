"""Relational variables: what matters for pushing, seen from one robot.

Where the robot stands (gap, bearing of the box, side of the box as seen along the course to the
goal), how far off the others are, where the robots' middle would push the box, how the box is
turned, how far it has to go and whether it gets there. A further variable is one function here, one
name in `variables.STATE_VARIABLES`, and, to be fast in prediction, one column of `kernels`.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from ....core.arrays import FloatArray
from .variables import StateFunction, StateVariable, state_variable
from .view import View, wrap

SIDES = (-2.2, -0.5, 0.0, 0.5, 2.2)
GAPS = (0.0, 0.015, 0.06, 0.2, 0.5)
NEARNESS = ("touching", "close", "near", "away", "far")
TURNS = ("far right", "right", "ahead", "left", "far left")


def _angle(
    centres: tuple[float, ...], labels: tuple[str, ...] = TURNS
) -> Callable[[StateFunction], StateVariable]:
    return state_variable("rad", -pi, pi, periodic=True, centres=centres, labels=labels)


@state_variable("m", 0.0, 0.5, centres=GAPS, labels=NEARNESS)
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


@state_variable("m", 0.0, 0.5, centres=GAPS, labels=NEARNESS)
def others_gap(view: View, robot: int) -> FloatArray:
    """Greatest gap of the other robots; of the robot itself if it is alone."""
    others = [r for r in range(view.gaps.shape[1]) if r != robot] or [robot]
    gaps: FloatArray = view.gaps[:, others].max(axis=1)
    return gaps


@_angle(SIDES)
def push_bearing(view: View, robot: int) -> FloatArray:
    """Where the robots' middle would push the box, off the course."""
    return wrap(view.push - view.course)


@state_variable(
    "m", -0.4, 0.4, centres=(-0.3, -0.06, 0.0, 0.06, 0.3),
    labels=("far right", "right", "none", "left", "far left"),
)  # fmt: skip
def cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that push would miss the goal; beyond it the whole distance."""
    off = np.clip(push_bearing(view, robot), -0.5 * pi, 0.5 * pi)
    missed: FloatArray = view.distance * np.sin(off)
    return missed


@state_variable(
    "m", 0.0, 1.1, centres=(0.0, 0.1, 0.3, 0.6, 1.1),
    labels=("there", "close", "near", "away", "far"),
)  # fmt: skip
def box_distance(view: View, robot: int) -> FloatArray:
    """Distance of the box from the goal."""
    return view.distance


@state_variable(
    "m", -0.05, 0.05, centres=(-0.02, -0.005, 0.0, 0.01, 0.03),
    labels=("receding", "slipping", "none", "slow", "fast"),
)  # fmt: skip
def approach(view: View, robot: int) -> FloatArray:
    """By how much the box came nearer per decision period: -Delta D of Conditions 1, 2."""
    return view.approach


@_angle((-0.8, -0.2, 0.0, 0.2, 0.8))
def box_turn(view: View, robot: int) -> FloatArray:
    """Turn of the box from the goal pose."""
    return view.turn


@_angle((-0.8, -0.15, 0.0, 0.15, 0.8))
def bend(view: View, robot: int) -> FloatArray:
    """By how much the box is turned off the arc that ends in the goal pose."""
    return wrap(view.turn - 2.0 * wrap(view.course - view.goal[2]))
