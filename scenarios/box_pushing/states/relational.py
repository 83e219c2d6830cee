"""Relational variables: what matters for pushing, seen from one robot.

Where the robot stands (gap, bearing of the box, side of the box as seen along the course to the
goal), how far off the others are, where the robots' middle would push the box, how the box is
turned, how far it has to go and whether it gets there. A relational state space is a choice of
them, with the speed of the own wheel as its own block; a further variable is one line in
`VARIABLES` and one column of `shared_blocks`.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from ....core.arrays import FloatArray
from ....core.spaces import Variable
from .view import View, wrap


def angle(name: str, centres: tuple[float, ...], labels: tuple[str, ...]) -> Variable:
    """Return a variable over the whole circle [rad]."""
    return Variable(name, "rad", -pi, pi, True, centres, labels)


SIDES = (-2.2, -0.5, 0.0, 0.5, 2.2)
GAPS = (0.0, 0.015, 0.06, 0.2, 0.5)
NEARNESS = ("touching", "close", "near", "away", "far")
TURNS = ("far right", "right", "ahead", "left", "far left")


def _box_bearing(view: View, robot: int) -> FloatArray:
    return wrap(view.azimuth(robot) - view.robots[:, robot, 2])


def _side(view: View, robot: int) -> FloatArray:
    return wrap(view.azimuth(robot) - view.course)


def _others_gap(view: View, robot: int) -> FloatArray:
    others = [r for r in range(view.gaps.shape[1]) if r != robot] or [robot]
    gaps: FloatArray = view.gaps[:, others].max(axis=1)
    return gaps


def _push_bearing(view: View, robot: int) -> FloatArray:
    return wrap(view.push - view.course)


def _miss(view: View, robot: int) -> FloatArray:
    off = np.clip(_push_bearing(view, robot), -0.5 * pi, 0.5 * pi)
    missed: FloatArray = view.distance * np.sin(off)
    return missed


def _approach(view: View, robot: int) -> FloatArray:
    return view.approach


def _bend(view: View, robot: int) -> FloatArray:
    return wrap(view.turn - 2.0 * wrap(view.course - view.goal[2]))


_Described = tuple[Variable, Callable[[View, int], FloatArray]]
_DESCRIBED: tuple[_Described, ...] = (
    (
        Variable("gap", "m", 0.0, 0.5, centres=GAPS, labels=NEARNESS),
        lambda view, robot: view.gaps[:, robot],
    ),
    (angle("box_bearing", SIDES, TURNS), _box_bearing),
    (angle("side", SIDES, ("far left", "left", "behind", "right", "far right")), _side),
    # The greatest gap of the other robots; of the robot itself if it is alone.
    (Variable("others_gap", "m", 0.0, 0.5, centres=GAPS, labels=NEARNESS), _others_gap),
    # Where the robots' middle would push the box, off the course.
    (angle("push_bearing", SIDES, TURNS), _push_bearing),
    # By how much that push would miss the goal; beyond it the whole distance.
    (
        Variable(
            "miss", "m", -0.4, 0.4, False, (-0.3, -0.06, 0.0, 0.06, 0.3),
            ("far right", "right", "none", "left", "far left"),
        ),
        _miss,
    ),
    (
        Variable(
            "box_distance", "m", 0.0, 1.1, False, (0.0, 0.1, 0.3, 0.6, 1.1),
            ("there", "close", "near", "away", "far"),
        ),
        lambda view, robot: view.distance,
    ),
    # By how much the box came nearer to the goal per decision period: -Delta D of Conditions 1, 2.
    (
        Variable(
            "approach", "m", -0.05, 0.05, False, (-0.02, -0.005, 0.0, 0.01, 0.03),
            ("receding", "slipping", "none", "slow", "fast"),
        ),
        _approach,
    ),
    (angle("box_turn", (-0.8, -0.2, 0.0, 0.2, 0.8), TURNS), lambda view, robot: view.turn),
    # By how much the box is turned off the arc that ends in the goal pose.
    (angle("bend", (-0.8, -0.15, 0.0, 0.15, 0.8), TURNS), _bend),
)  # fmt: skip

VARIABLES: dict[str, _Described] = {variable.name: (variable, f) for variable, f in _DESCRIBED}
"""Relational variables by name, each with its function of a view and a robot: ``(m,)``.

In the order of the columns of `shared_blocks`.
"""
