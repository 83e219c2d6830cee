"""Relational variables: what matters for pushing, seen from one robot.

Where the robot stands (gap, bearing of the box, side of the box as seen along the course to the
goal), how far off the others are, where the robots' middle would push the box, how the box is
turned, how far it has to go and whether it gets there. A further variable is one function here, and
to be fast one row of `relational_lanes` in prediction and one of `sensing` in the present.

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

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from math import pi

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit, wrap_each
from ....core.plugins.registry import Registry
from ...state_variables import Situations, StateFunction, StateVariable, freeze, state_variable
from ..world.geometry import Outline, surface

CLOSE = 0.02
"""Gap [m] over which the weight of a robot's contact falls to 1/e."""
LEAST = 0.001
"""Weight of a robot far away: where none is close, all count alike."""
KEPT = 0.7
"""How much of its drift a box is taken to keep; with 1 large teams steer less than they could."""
STILL = 0.005
"""Way per decision period [m] below which hardly any of it is taken for drift."""
ARRIVED = 0.1
"""Distance from the goal [m] below which a box is taken to turn no less on the way."""


@dataclass(frozen=True)
class View(Situations):
    """Situations to be described, ``m`` at once."""

    robots: FloatArray
    """``(m, M, 3)`` poses [m, m, rad]."""
    box: FloatArray
    """``(m, 3)`` poses of the box."""
    gaps: FloatArray
    """``(m, M)`` distances between robot and box surfaces [m]; slightly negative in contact."""
    goal: FloatArray
    """``(3,)`` goal pose of the box."""
    origin: FloatArray
    """``(3,)``, or in many worlds ``(m, 3)``: pose of the box before the motion that led here."""
    periods: float
    """How many decision periods that motion took."""
    outline: Outline
    """Of the box, in its own frame."""
    friction_radius: float
    """Lever with which ground friction resists turning of the box [m]."""

    @property
    def n_situations(self) -> int:
        """How many poses of the box there are."""
        return len(self.box)

    # What all robots share is computed once, and must stay as it is.

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the box from the goal [m]."""
        return freeze(np.hypot(*(self.goal[:2] - self.box[:, :2]).T))

    @cached_property
    def before(self) -> FloatArray:
        """Distance of the box from the goal before the motion that led here [m]."""
        x, y = self.origin.T[:2]
        return np.hypot(self.goal[0] - x, self.goal[1] - y)

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the box comes to the goal in a decision period [m]."""
        return (self.before - self.distance) / self.periods

    @cached_property
    def course(self) -> FloatArray:
        """Direction ``(m,)`` from the box to the goal [rad]."""
        return _direction(self.goal[:2] - self.box[:, :2])

    @cached_property
    def push(self) -> FloatArray:
        """Direction ``(m,)`` in which the robots' middle would push the box [rad]."""
        return _direction(
            self.box[:, :2] - np.add.reduce(self.robots[:, :, :2], axis=1) / self.robots.shape[1]
        )

    @cached_property
    def contact_push(self) -> FloatArray:
        """The same direction ``(m,)``, every robot weighing by how close it is to the box [rad].

        The weight of a robot is ``exp(-gap / CLOSE) + LEAST``: those that do not push do not count.
        """
        return _direction(self.box[:, :2] - self.contact)

    @cached_property
    def contact(self) -> FloatArray:
        """The middle ``(m, 2)`` of the robots in contact [m], see `contact_push`."""
        weights = (np.exp(np.maximum(self.gaps, 0.0) / -CLOSE) + LEAST)[:, :, None]
        middle = np.add.reduce(weights * self.robots[:, :, :2], axis=1)
        return freeze(middle / np.add.reduce(weights, axis=1))

    @cached_property
    def path(self) -> FloatArray:
        """Direction ``(m,)`` of the straight way to where the box is going [rad].

        It is the sum of three angles: the way straight into the face that is pushed; `KEPT` of the
        drift, which is the angle of the last motion off that way; and half of the turn that the
        robots in contact bring about on the way to the goal, by their lever over the square of the
        friction radius per metre, as in `prediction.push`. The last one is at most the angle at
        which they push the centre of the box, see `contact_push`.
        """
        inward = self._into_box(self.contact)
        x = np.cos(inward)
        y = np.sin(inward)
        push = self.box[:, :2] - self.contact
        depth = push[:, 0] * x + push[:, 1] * y
        lever = push[:, 1] * x - push[:, 0] * y
        way = self.box[:, :2] - self.origin[..., :2]
        along = way[:, 0] * x + way[:, 1] * y
        across = way[:, 1] * x - way[:, 0] * y
        drift = np.arctan2(across, np.abs(along) + STILL * self.periods)
        reach = 2.0 * self.friction_radius**2 / np.maximum(self.distance, ARRIVED)
        turn = np.arctan2(lever, np.maximum(depth, reach))
        return freeze(inward + KEPT * drift + turn)

    @cached_property
    def turn(self) -> FloatArray:
        """Turn ``(m,)`` of the box from the goal pose [rad]."""
        return freeze(wrap_each(self.box[:, 2] - self.goal[2]))

    @cached_property
    def others_away(self) -> FloatArray:
        """What share ``(m, M)`` of the robots beside each is away from the box, see the variable.

        They lie in order of situations, so that sums are rounded alike however many there are.
        """
        away = np.minimum(np.maximum(self.gaps / AWAY, 0.0), 1.0)
        of_others = np.take(away, others_of(away.shape[1]), axis=1)
        return freeze(np.add.reduce(of_others, axis=-1) / of_others.shape[-1])

    def azimuth(self, robot: int) -> FloatArray:
        """Direction ``(m,)`` from a robot to the box [rad]."""
        return _direction(self.box[:, :2] - self.robots[:, robot, :2])

    def heading(self, robot: int) -> FloatArray:
        """Heading ``(m,)`` of a robot [rad]."""
        return self.robots[:, robot, 2]

    def inward(self, robot: int) -> FloatArray:
        """Direction ``(m,)`` into the box at the point of its surface next to a robot [rad]."""
        return self._into_box(self.robots[:, robot])

    def _into_box(self, points: FloatArray) -> FloatArray:
        points = np.ascontiguousarray(points)
        boxes = np.ascontiguousarray(self.box)
        return _all_inward(points, boxes, self.outline.edges, self.outline.rounding)


@cache
def others_of(number: int) -> IntArray:
    """Return the other robots of each one ``(number, number - 1)``, in order; of one alone it."""
    others = [[r for r in range(number) if r != one or number == 1] for one in range(number)]
    return np.array(others)


def _direction(ways: FloatArray) -> FloatArray:
    """Return the directions ``(m,)`` of ways ``(m, 2)`` [rad], read-only."""
    return freeze(np.arctan2(ways[:, 1], ways[:, 0]))


@njit(cache=True)
def inward(robot: FloatArray, box: FloatArray, edges: FloatArray, rounding: float) -> float:
    """Return the direction into a box at the point next to a robot [rad], see `View.inward`."""
    cos, sin = np.cos(box[2]), np.sin(box[2])
    dx, dy = robot[0] - box[0], robot[1] - box[1]
    near = surface(edges, rounding, cos * dx + sin * dy, cos * dy - sin * dx)
    return box[2] + np.arctan2(-near[2], -near[1])


@njit(cache=True)
def _all_inward(
    points: FloatArray, boxes: FloatArray, edges: FloatArray, rounding: float
) -> FloatArray:
    """Return the direction into a box ``(m,)`` at the point next to each one, world frame."""
    directions = np.empty(len(points))
    for c in range(len(points)):
        directions[c] = inward(points[c], boxes[c], edges, rounding)
    return directions


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
        "rad",
        -pi,
        pi,
        periodic=True,
        centres=centres,
        labels=labels,
        common=common,
        mirrored="opposite",
    )


def _missed(view: View, bearing: FloatArray) -> FloatArray:
    off = np.minimum(np.maximum(bearing, -0.5 * pi), 0.5 * pi)
    return view.distance * np.sin(off)


@state_variable("m", 0.0, 0.5, centres=GAPS, labels=NEARNESS, mirrored="same")
def gap(view: View, robot: int) -> FloatArray:
    """Gap between robot and box."""
    return view.gaps[:, robot]


@_angle(SIDES)
def box_bearing(view: View, robot: int) -> FloatArray:
    """Bearing of the box in the frame of the robot."""
    return wrap_each(view.azimuth(robot) - view.heading(robot))


@_angle(SIDES, ("far left", "left", "behind", "right", "far right"))
def side(view: View, robot: int) -> FloatArray:
    """Where round the box the robot stands, as seen along the course to the goal."""
    return wrap_each(view.azimuth(robot) - view.course)


@state_variable("m", 0.0, 0.5, centres=GAPS, labels=NEARNESS, mirrored="same")
def others_gap(view: View, robot: int) -> FloatArray:
    """Greatest gap of the other robots; of the robot itself if it is alone."""
    others = others_of(view.gaps.shape[1])[robot]
    return np.maximum.reduce(np.take(view.gaps, others, axis=1), axis=-1)


@_angle(SIDES, common=True)
def push_bearing(view: View, robot: int) -> FloatArray:
    """Where the robots' middle would push the box, off the course."""
    return wrap_each(view.push - view.course)


@state_variable(
    "m",
    -0.4,
    0.4,
    centres=(-0.3, -0.06, 0.0, 0.06, 0.3),
    labels=("far right", "right", "none", "left", "far left"),
    common=True,
    mirrored="opposite",
)
def cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that push would miss the goal; beyond it the whole distance."""
    return _missed(view, push_bearing(view, robot))


@state_variable(
    "m",
    0.0,
    1.1,
    centres=(0.0, 0.1, 0.3, 0.6, 1.1),
    labels=("there", "close", "near", "away", "far"),
    common=True,
    mirrored="same",
)
def box_distance(view: View, robot: int) -> FloatArray:
    """Distance of the box from the goal."""
    return view.distance


@state_variable(
    "m",
    -0.05,
    0.05,
    centres=(-0.02, -0.005, 0.0, 0.01, 0.03),
    labels=("receding", "slipping", "none", "slow", "fast"),
    common=True,
    mirrored="same",
)
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
    return wrap_each(view.turn - 2.0 * wrap_each(view.course - view.goal[2]))


@_angle(SIDES)
def face_bearing(view: View, robot: int) -> FloatArray:
    """Bearing, in the frame of the robot, of the way straight into the nearest face of the box."""
    return wrap_each(view.inward(robot) - view.heading(robot))


@state_variable(
    "1",
    0.0,
    1.0,
    centres=(0.0, 0.25, 0.5, 0.75, 1.0),
    labels=("none", "some", "half", "most", "all"),
    mirrored="same",
)
def others_away(view: View, robot: int) -> FloatArray:
    """How many of the other robots are away from the box, as a share: gaps up to `AWAY` in part.

    Of a robot that is alone, its own.
    """
    return view.others_away[:, robot]


@_angle((-1.2, -0.4, 0.0, 0.4, 1.2), common=True)
def contact_push_bearing(view: View, robot: int) -> FloatArray:
    """Where the robots in contact push the box, off the course."""
    return wrap_each(view.contact_push - view.course)


_wide_error = state_variable(
    "m",
    -1.0,
    1.0,
    centres=(-0.8, -0.3, -0.08, 0.0, 0.08, 0.3, 0.8),
    labels=("very far right", "far right", "right", "none", "left", "far left", "very far left"),
    common=True,
    mirrored="opposite",
)


@_wide_error
def contact_cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that push would miss the goal; beyond it the whole distance."""
    return _missed(view, contact_push_bearing(view, robot))


@_angle((-1.2, -0.4, 0.0, 0.4, 1.2), common=True)
def path_bearing(view: View, robot: int) -> FloatArray:
    """Where the box is going, off the course."""
    return wrap_each(view.path - view.course)


@_wide_error
def path_cross_track_error(view: View, robot: int) -> FloatArray:
    """By how much that path would miss the goal; beyond it the whole distance."""
    return _missed(view, path_bearing(view, robot))


STATE_VARIABLES = Registry(
    "state variable",
    {name: f"{__name__}:{name}" for name, v in [*vars().items()] if isinstance(v, StateVariable)},
)
"""State variables by the name that specs use."""
