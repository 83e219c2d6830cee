"""State variables of box pushing: gaps, bearings, distances, as one robot perceives them.

A state variable is one function of a `Situation` and a `Robot`. The decorator gives its unit, its
range and the centers of its membership functions; its name is the name of the function. Sensing and
prediction both call it, compiled by `kernel`. To add a variable, write one more function here:
nothing else needs to change.

A variable in a file of your own is written in the same way, as plain Python, and a spec names it
``"mine.py:nearness"``::

    from nested_agents import state_variable

    @state_variable("m", 0.0, 1.5)
    def nearness(situation, robot):
        return situation.distance + robot.gap

The *course* is the direction from the box to the goal.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np

from ....core.numerics import njit, wrap_one
from ....core.plugins.registry import Registry
from ...angles import angle_of
from ...state_variables import StateVariable, state_variable
from .situations import Robot, Situation, away_fraction

DRIFT_KEPT = 0.7
"""Fraction of its drift that a box keeps. With 1, large teams steer less than they could."""
MIN_DRIFT_M = 0.005
"""Displacement per decision period below which hardly any of it counts as drift [m]."""
MIN_DISTANCE_M = 0.1
"""Smallest distance from the goal over which the turn of the box is extrapolated [m]."""


@njit(cache=True, forceinline=True)
def _azimuth(situation: Situation, robot: Robot) -> float:
    """Return the direction from a robot to the box [rad]."""
    return angle_of(situation.box[0] - robot.x, situation.box[1] - robot.y)


@njit(cache=True, forceinline=True)
def _off_course(situation: Situation, pusher: tuple[float, float]) -> float:
    """Return the angle between a push from a point towards the box and the course [rad]."""
    x, y = pusher
    push = angle_of(situation.box[0] - x, situation.box[1] - y)
    return wrap_one(push - situation.course)


@njit(cache=True, forceinline=True)
def _miss(situation: Situation, bearing: float) -> float:
    """Return by how much a straight path misses the goal; beyond a right angle, the distance."""
    return situation.distance * np.sin(min(max(bearing, -0.5 * pi), 0.5 * pi))


@njit(cache=True, forceinline=True)
def _path(situation: Situation) -> float:
    """Return the bearing of the straight path that the box will take, off the course [rad].

    It is the sum of three angles: the direction into the face that is pushed; the fraction
    `DRIFT_KEPT` of the angle between the last motion and that direction; and half of the turn that
    the robots in contact cause on the way to the goal. The turn per meter is their lever over the
    square of the friction radius, as in `prediction.push`, and at most the angle at which they push
    the center of the box.
    """
    box, origin, (x, y) = situation.box, situation.origin, situation.contact
    inward = situation.inward
    cos, sin = np.cos(inward), np.sin(inward)
    push_x, push_y = box[0] - x, box[1] - y
    depth = push_x * cos + push_y * sin
    lever = push_y * cos - push_x * sin
    moved_x, moved_y = box[0] - origin[0], box[1] - origin[1]
    along = moved_x * cos + moved_y * sin
    across = moved_y * cos - moved_x * sin
    drift = angle_of(abs(along) + MIN_DRIFT_M * situation.periods, across)
    reach = 2.0 * situation.friction_radius**2 / max(situation.distance, MIN_DISTANCE_M)
    turn = angle_of(max(depth, reach), lever)
    return wrap_one(inward + DRIFT_KEPT * drift + turn - situation.course)


def _variable(
    unit: str, low: float, high: float, *, contact: bool = False, **options: Any
) -> Callable[[Callable[[Situation, Robot], float]], StateVariable]:
    """Return a decorator that compiles a function and describes it, see `state_variable`.

    With `contact` the function may read ``situation.contact`` and the directions ``inward``. They
    are computed only if a state space has such a variable.
    """
    describe = state_variable(unit, low, high, **options)

    def decorate(function: Callable[[Situation, Robot], float]) -> StateVariable:
        if contact:
            NEED_CONTACT.add(function.__name__)
        return describe(njit(cache=True, forceinline=True)(function))

    return decorate


def _angle(
    centers: tuple[float, ...],
    labels: tuple[str, ...] = ("far right", "right", "ahead", "left", "far left"),
    **options: bool,
) -> Callable[[Callable[[Situation, Robot], float]], StateVariable]:
    """Return the decorator of an angle, which changes its sign in the mirror image."""
    described: dict[str, Any] = {"periodic": True, "centers": centers, "labels": labels}
    return _variable("rad", -pi, pi, mirrored="opposite", **described, **options)


NEED_CONTACT: set[str] = set()
"""Names of variables that read ``situation.contact`` or a direction ``inward``."""
_SIDES = (-2.2, -0.5, 0.0, 0.5, 2.2)
_EVEN = tuple(float(c) for c in np.linspace(-pi, pi, 5, endpoint=False))
_gap = _variable(
    "m",
    0.0,
    0.5,
    centers=(0.0, 0.015, 0.06, 0.2, 0.5),
    labels=("touching", "close", "near", "away", "far"),
    mirrored="same",
)
_wide_error = _variable(
    "m",
    -1.0,
    1.0,
    centers=(-0.8, -0.3, -0.08, 0.0, 0.08, 0.3, 0.8),
    labels=("very far right", "far right", "right", "none", "left", "far left", "very far left"),
    contact=True,
    common=True,
    mirrored="opposite",
)


@_gap
def gap(situation: Situation, robot: Robot) -> float:
    """Gap between robot and box."""
    return robot.gap


@_angle(_EVEN, ())
def heading(situation: Situation, robot: Robot) -> float:
    """Heading of the robot in the world frame (Eq. 1)."""
    return wrap_one(robot.heading)


@_variable("m", 0.0, 0.5, centers=(0.05, 0.1, 0.15, 0.25, 0.5), mirrored="same")
def robot_box_distance(situation: Situation, robot: Robot) -> float:
    """Distance of the robot from the center of the box."""
    dx, dy = situation.box[0] - robot.x, situation.box[1] - robot.y
    return np.sqrt(dx * dx + dy * dy)


@_angle(_SIDES)
def box_bearing(situation: Situation, robot: Robot) -> float:
    """Bearing of the box in the frame of the robot."""
    return wrap_one(_azimuth(situation, robot) - robot.heading)


@_angle(_SIDES, ("far left", "left", "behind", "right", "far right"))
def side(situation: Situation, robot: Robot) -> float:
    """Side of the box on which the robot stands, seen along the course to the goal."""
    return wrap_one(_azimuth(situation, robot) - situation.course)


@_gap
def others_gap(situation: Situation, robot: Robot) -> float:
    """Largest gap of the other robots; of the robot itself if it is alone."""
    largest, second = situation.largest_gaps
    return second if robot.gap == largest else largest


@_angle(_SIDES, common=True)
def push_bearing(situation: Situation, robot: Robot) -> float:
    """Angle from the course to the direction of a push from the middle of the robots."""
    return _off_course(situation, situation.middle)


@_variable(
    "m",
    -0.4,
    0.4,
    centers=(-0.3, -0.06, 0.0, 0.06, 0.3),
    labels=("far right", "right", "none", "left", "far left"),
    common=True,
    mirrored="opposite",
)
def cross_track_error(situation: Situation, robot: Robot) -> float:
    """Distance by which that push misses the goal; beyond a right angle, the goal's distance."""
    return _miss(situation, _off_course(situation, situation.middle))


@_variable(
    "m",
    0.0,
    1.1,
    centers=(0.0, 0.1, 0.3, 0.6, 1.1),
    labels=("at the goal", "close", "near", "away", "far"),
    common=True,
    mirrored="same",
)
def box_distance(situation: Situation, robot: Robot) -> float:
    """Distance of the box from the goal."""
    return situation.distance


@_variable(
    "m",
    -0.05,
    0.05,
    centers=(-0.02, -0.005, 0.0, 0.01, 0.03),
    labels=("receding", "slipping", "none", "slow", "fast"),
    common=True,
    mirrored="same",
)
def approach(situation: Situation, robot: Robot) -> float:
    """Decrease of the box's distance per decision period: -Delta D of Conditions 1 and 2."""
    dx = situation.goal[0] - situation.origin[0]
    dy = situation.goal[1] - situation.origin[1]
    return (np.sqrt(dx * dx + dy * dy) - situation.distance) / situation.periods


@_angle((-0.8, -0.2, 0.0, 0.2, 0.8), common=True)
def box_turn(situation: Situation, robot: Robot) -> float:
    """Angle of the box relative to the goal pose."""
    return wrap_one(situation.box[2] - situation.goal[2])


@_angle((-0.8, -0.15, 0.0, 0.15, 0.8), common=True)
def bend(situation: Situation, robot: Robot) -> float:
    """Angle of the box relative to the arc that ends in the goal pose."""
    turn = wrap_one(situation.box[2] - situation.goal[2])
    return wrap_one(turn - 2.0 * wrap_one(situation.course - situation.goal[2]))


@_angle(_SIDES, contact=True)
def face_bearing(situation: Situation, robot: Robot) -> float:
    """Bearing, in the frame of the robot, of the direction straight into the nearest face."""
    return wrap_one(robot.inward - robot.heading)


@_variable(
    "1",
    0.0,
    1.0,
    centers=(0.0, 0.25, 0.5, 0.75, 1.0),
    labels=("none", "some", "half", "most", "all"),
    mirrored="same",
)
def others_away(situation: Situation, robot: Robot) -> float:
    """Fraction of the other robots that are away from the box; of the robot itself if alone."""
    count = situation.n_robots
    own = away_fraction(robot.gap)
    return own if count == 1 else (situation.n_away - own) / (count - 1)


@_angle((-1.2, -0.4, 0.0, 0.4, 1.2), contact=True, common=True)
def contact_push_bearing(situation: Situation, robot: Robot) -> float:
    """Angle from the course to the direction in which the robots in contact push the box."""
    return _off_course(situation, situation.contact)


@_wide_error
def contact_cross_track_error(situation: Situation, robot: Robot) -> float:
    """Distance by which that push misses the goal; beyond a right angle, the goal's distance."""
    return _miss(situation, _off_course(situation, situation.contact))


@_angle((-1.2, -0.4, 0.0, 0.4, 1.2), contact=True, common=True)
def path_bearing(situation: Situation, robot: Robot) -> float:
    """Angle from the course to the path that the box will take."""
    return _path(situation)


@_wide_error
def path_cross_track_error(situation: Situation, robot: Robot) -> float:
    """Distance by which that path misses the goal; beyond a right angle, the goal's distance."""
    return _miss(situation, _path(situation))


@_angle((), ())
def goal_bearing(situation: Situation, robot: Robot) -> float:
    """Bearing of the goal in the frame of the robot (Eq. 1)."""
    goal = situation.goal
    return wrap_one(angle_of(goal[0] - robot.x, goal[1] - robot.y) - robot.heading)


@_variable("m", 0.0, 1.5, mirrored="same")
def goal_distance(situation: Situation, robot: Robot) -> float:
    """Distance of the robot from the goal (Eq. 1)."""
    return np.hypot(situation.goal[0] - robot.x, situation.goal[1] - robot.y)


@_angle(_EVEN, (), common=True)
def box_orientation(situation: Situation, robot: Robot) -> float:
    """Angle of the box in the world frame (Eq. 1)."""
    return wrap_one(situation.box[2])


@_angle(_EVEN, (), common=True)
def box_goal_bearing(situation: Situation, robot: Robot) -> float:
    """Bearing of the goal in the frame of the box (Eq. 1)."""
    return wrap_one(situation.course - situation.box[2])


BUILT_IN = {name: thing for name, thing in [*vars().items()] if isinstance(thing, StateVariable)}
"""State variables by name, with their compiled functions."""
STATE_VARIABLES = Registry("state variable", {name: f"{__name__}:{name}" for name in BUILT_IN})
"""State variables by the name that specs use."""
