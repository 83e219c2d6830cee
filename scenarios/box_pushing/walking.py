"""Robots that walk around a box to another of its sides, a given skill.

They walk along a curve at a small distance around the box and keep their order. A robot searches
over sequences of `DEPTH` of its own actions. The robot at the front searches first; the robots
behind know its plan.
"""

from __future__ import annotations

from itertools import pairwise
from math import atan2, cos, hypot, sin
from typing import NamedTuple

import numpy as np
from shapely.geometry.polygon import orient

from ...core.numerics import FloatArray, IntArray, njit, wrap, wrap_one
from ..angles import rotate
from .prediction.twists import displacement
from .scenario import BoxPushing
from .world.boxes import BoxSpec
from .world.robots import nominal_effect, side_actions

Pose = tuple[float, float, float]
"""Position [m, m] and heading [rad]; also places and errors of robots, see `errors_of`."""
GAP_M = 0.04
"""Distance of walking robots from the box [m]."""
CLEARANCE_M = 0.012
"""Smallest distance that walking robots keep from each other and from the box [m]."""
DEPTH = 3
"""Number of decisions that a robot looks ahead."""
ARRIVAL_M = 0.1
"""Way to its place over which a robot turns from its course to the box [m]."""
STANDING = 0.1, 0.03, 0.6
"""Largest way [m], distance from the curve [m] and angle [rad] of a robot that stands."""


class HullSide(NamedTuple):
    """A side of the convex hull of a box, in the frame of the box."""

    direction: float
    """Direction straight into the side [rad]."""
    middle: tuple[float, float]
    """Middle of the side [m]."""
    half: float
    """Half its length [m]."""


class Path(NamedTuple):
    """Closed curve around a box, counterclockwise, in its frame."""

    points: FloatArray
    """``(P + 1, 2)`` corners [m]; the last is the first."""
    ways: FloatArray
    """``(P + 1,)`` distances from the first corner along the curve [m]."""
    directions: FloatArray
    """``(P, 2)`` unit vectors from each corner to the next."""
    courses: FloatArray
    """``(P,)`` angles of the directions [rad]."""


class Wheels(NamedTuple):
    """Commands that a robot's wheels may receive, see `ActionSet.apply`."""

    gains: FloatArray
    """``(k, w)`` factors on wheel speeds, by robot action."""
    increments: FloatArray
    """``(k, w)`` increments [m/s]."""
    limit: float
    """Maximum speed [m/s]."""
    effect: FloatArray
    """``(3, w + 1)`` twist in the robot's frame = effect @ [wheel speeds, 1]."""
    period: float
    """Decision period [s]."""
    radius: float
    """Radius of the robot [m]."""


def sides_of(box: BoxSpec) -> list[HullSide]:
    """Return the sides of the convex hull of a box, counterclockwise.

    Raises
    ------
    ValueError
        If the box has no sides.
    """
    if box.polygon is None:
        raise ValueError(f"scenario.leader: box {box.name!r} has no sides, use a polygon")
    corners = np.array(orient(box.polygon.convex_hull).exterior.coords)
    sides = []
    for a, b in pairwise(corners):
        along = b - a
        middle = (a + b) / 2
        direction = atan2(along[0], -along[1])
        sides.append(HullSide(direction, (middle[0], middle[1]), hypot(*along) / 2))
    return sides


def path_around(box: BoxSpec, margin: float) -> Path:
    """Return the curve at a distance [m] from the convex hull of a box."""
    assert box.polygon is not None
    around = orient(box.polygon.convex_hull.buffer(margin, quad_segs=4))
    points = np.ascontiguousarray(around.exterior.coords)
    edges = np.diff(points, axis=0)
    lengths = np.hypot(*edges.T)
    ways = np.append(0.0, np.cumsum(lengths))
    return Path(points, ways, edges / lengths[:, None], np.arctan2(edges[:, 1], edges[:, 0]))


def poses_in_box(scenario: BoxPushing) -> FloatArray:
    """Return the poses ``(M, 3)`` of all robots in the frame of the box."""
    box = scenario.world.box_pose
    robots = scenario.world.robot_poses
    x, y = rotate(cos(box[2]), -sin(box[2]), *(robots[:, :2] - box[:2]).T)
    return np.column_stack([x, y, wrap(robots[:, 2] - box[2])])


class Walk:
    """Robots on their way around a box.

    Parameters
    ----------
    scenario
        Robots and box.
    side, destination
        The side that the robots leave, and the side to which they walk.
    """

    def __init__(self, scenario: BoxPushing, side: HullSide, destination: HullSide) -> None:
        self._scenario = scenario
        robot = scenario.robot
        actions = scenario.action_set
        unit = scenario.settings.speed_increment * robot.max_speed
        self._choices = side_actions(robot, len(actions))
        self._wheels = Wheels(
            np.array(actions.gains)[self._choices],
            unit * np.array(actions.increments)[self._choices],
            robot.max_speed,
            nominal_effect(robot),
            scenario.settings.period,
            robot.radius,
        )
        self._path = path_around(scenario.box, robot.radius + GAP_M)
        self._middle = locate(self._path, *destination.middle)[0]
        n_robots = len(scenario.groups)
        room = destination.half - robot.radius - 0.01
        self._spread = np.linspace(room, -room, n_robots) if n_robots > 1 else np.zeros(1)
        self._sense = float(np.sign(wrap_one(destination.direction - side.direction)))
        self._places = np.zeros((n_robots, 3))
        self._places[:, 1:] = destination.direction, self._sense

    def joint_action(self) -> IntArray:
        """Return the actions ``(n,)`` of all wheels; the robot ahead has the farthest place."""
        poses = poses_in_box(self._scenario)
        length = self._path.ways[-1]
        ways = np.array([locate(self._path, x, y)[0] for x, y, _ in poses])
        left = np.mod(self._sense * (self._middle - ways) + 0.25 * length, length)
        order: IntArray = np.argsort(left)
        self._places[order, 0] = np.mod(self._middle + self._sense * self._spread, length)
        speeds = self._scenario.commanded_speeds.reshape(len(poses), -1)
        actions = walk(order, poses, speeds, self._places, self._path, self._wheels)
        return self._choices[actions].ravel()

    def fraction_standing(self) -> float:
        """Return the fraction of the robots that stand at their places and face the box."""
        return standing(poses_in_box(self._scenario), self._places, self._path)


@njit(cache=True)
def locate(path: Path, x: float, y: float) -> Pose:
    """Return way along the curve, signed distance from it, and its direction at a point.

    Ways and distances are in m, the direction in rad. Distances towards the box are positive.
    """
    nearest = np.inf
    edge = 0
    way = 0.0
    for i in range(len(path.courses)):
        ux, uy = path.directions[i, 0], path.directions[i, 1]
        dx, dy = x - path.points[i, 0], y - path.points[i, 1]
        length = path.ways[i + 1] - path.ways[i]
        along = min(max(ux * dx + uy * dy, 0.0), length)
        square = (dx - along * ux) ** 2 + (dy - along * uy) ** 2
        if square < nearest:
            nearest = square
            edge = i
            way = path.ways[i] + along
    ux, uy = path.directions[edge, 0], path.directions[edge, 1]
    side = ux * (y - path.points[edge, 1]) - uy * (x - path.points[edge, 0])
    return way, np.copysign(np.sqrt(nearest), side), path.courses[edge]


@njit(cache=True)
def errors_of(path: Path, pose: Pose, place: Pose) -> Pose:
    """Return the way to a place [m], the signed distance from the curve [m], and the angle [rad].

    Parameters
    ----------
    path
        The curve.
    pose
        Pose of a robot in the frame of the box.
    place
        Way of the place along the curve [m], heading there [rad], and 1 or -1: counterclockwise
        or clockwise.
    """
    way, off, course = locate(path, pose[0], pose[1])
    goal, heading, sense = place
    total = path.ways[-1]
    left = sense * (goal - way)
    left -= total * np.floor(left / total + 0.25)  # a robot may overshoot by a quarter turn
    if left > ARRIVAL_M:
        heading = course if sense > 0.0 else course + np.pi
    elif left < -ARRIVAL_M:
        heading = course if sense < 0.0 else course + np.pi
    return abs(left), off, abs(wrap_one(pose[2] - heading))


@njit(cache=True)
def _cost(path: Path, pose: Pose, place: Pose) -> float:
    left, off, turn = errors_of(path, pose, place)
    too_near = max(off - (GAP_M - CLEARANCE_M), 0.0)
    return left + 2.0 * abs(off) + 20.0 * too_near + 0.06 * turn


@njit(cache=True)
def _options(wheels: Wheels, speeds: FloatArray, actions: IntArray, after: FloatArray) -> int:
    """Write the actions that lead to different wheel speeds, and these speeds; return their number.

    Of actions with equal speeds the first is written.
    """
    count = 0
    for action in range(len(wheels.gains)):
        is_new = True
        for w in range(len(speeds)):
            wanted = wheels.gains[action, w] * speeds[w] + wheels.increments[action, w]
            after[count, w] = min(max(wanted, -wheels.limit), wheels.limit)
        for k in range(count):
            is_new &= not np.array_equal(after[k], after[count])
        if is_new:
            actions[count] = action
            count += 1
    return count


@njit(cache=True)
def _moved(wheels: Wheels, pose: FloatArray, speeds: FloatArray) -> Pose:
    """Return the pose after a decision period with wheel speeds."""
    ahead, left, turn = wheels.effect[0, -1], wheels.effect[1, -1], wheels.effect[2, -1]
    for w in range(len(speeds)):
        ahead += wheels.effect[0, w] * speeds[w]
        left += wheels.effect[1, w] * speeds[w]
        turn += wheels.effect[2, w] * speeds[w]
    dx, dy, turned = displacement(pose[2], (ahead, left, turn), wheels.period)
    return pose[0] + dx, pose[1] + dy, pose[2] + turned


@njit(cache=True)
def _crowding(x: float, y: float, others: FloatArray, span: float) -> float:
    """Return by how much a robot comes too close to others ``(k, 2)``, in all [m]."""
    total = 0.0
    for k in range(len(others)):
        dx, dy = x - others[k, 0], y - others[k, 1]
        square = dx * dx + dy * dy
        if square < span * span:
            total += span - np.sqrt(square)
    return total


@njit(cache=True)
def _search(
    pose: FloatArray,
    speeds: FloatArray,
    place: Pose,
    plans: FloatArray,
    path: Path,
    wheels: Wheels,
) -> tuple[int, FloatArray]:
    """Return the first action of the best sequence, and the poses ``(DEPTH, 3)`` after each action.

    The search goes depth first; it leaves a sequence as soon as it costs more than the best one.
    `plans` are the positions ``(DEPTH, k, 2)`` of the robots nearby after their planned actions.
    """
    span = 2.0 * wheels.radius + CLEARANCE_M
    n_actions = len(wheels.gains)
    trail = np.empty((DEPTH + 1, 3))
    costs = np.zeros(DEPTH + 1)
    actions = np.empty((DEPTH, n_actions), np.int64)
    after = np.empty((DEPTH, n_actions, len(speeds)))
    counts = np.empty(DEPTH, np.int64)
    tried = np.zeros(DEPTH, np.int64)
    trail[0] = pose
    counts[0] = _options(wheels, speeds, actions[0], after[0])
    best = np.inf
    best_action = 0
    best_trail = trail[1:]
    level = 0
    while level >= 0:
        if tried[level] == counts[level]:
            level -= 1
            continue
        reached = after[level, tried[level]]
        tried[level] += 1
        x, y, heading = _moved(wheels, trail[level], reached)
        cost = costs[level] + 10.0 * _crowding(x, y, plans[level], span)
        if cost >= best:
            continue
        is_last = level == DEPTH - 1
        cost += (1.1 if is_last else 0.1) * _cost(path, (x, y, heading), place)
        trail[level + 1, 0], trail[level + 1, 1], trail[level + 1, 2] = x, y, heading
        if not is_last:
            level += 1
            costs[level] = cost
            tried[level] = 0
            counts[level] = _options(wheels, reached, actions[level], after[level])
        elif cost < best:
            best = cost
            best_action = actions[0, tried[0] - 1]
            best_trail = trail[1:].copy()
    return best_action, best_trail


@njit(cache=True)
def walk(
    order: IntArray,
    poses: FloatArray,
    speeds: FloatArray,
    places: FloatArray,
    path: Path,
    wheels: Wheels,
) -> IntArray:
    """Return the robot actions ``(M,)`` with which robots walk to their places.

    Parameters
    ----------
    order
        ``(M,)`` robots, the one at the front first.
    poses
        ``(M, 3)`` poses in the frame of the box.
    speeds
        ``(M, w)`` wheel speeds [m/s].
    places
        ``(M, 3)`` places, see `errors_of`.
    path, wheels
        The curve around the box, and the commands of a robot.
    """
    n_robots = len(speeds)
    way = 2.0 * (DEPTH + 1) * wheels.period * wheels.limit
    reach = 2.0 * wheels.radius + CLEARANCE_M + way
    plans = np.empty((DEPTH, n_robots, 2))
    for level in range(DEPTH):
        plans[level] = poses[:, :2]
    chosen = np.zeros(n_robots, np.int64)
    for r in order:
        apart = np.sqrt((poses[:, 0] - poses[r, 0]) ** 2 + (poses[:, 1] - poses[r, 1]) ** 2)
        apart[r] = np.inf
        near = plans[:, np.nonzero(apart < reach)[0]]
        place = (places[r, 0], places[r, 1], places[r, 2])
        chosen[r], trail = _search(poses[r], speeds[r], place, near, path, wheels)
        for level in range(DEPTH):
            plans[level, r, 0], plans[level, r, 1] = trail[level, 0], trail[level, 1]
    return chosen


@njit(cache=True)
def standing(poses: FloatArray, places: FloatArray, path: Path) -> float:
    """Return the fraction of the robots that stand at their places, facing the box."""
    largest_left, largest_off, largest_turn = STANDING
    count = 0
    for r in range(len(poses)):
        pose = (poses[r, 0], poses[r, 1], poses[r, 2])
        place = (places[r, 0], places[r, 1], places[r, 2])
        left, off, turn = errors_of(path, pose, place)
        count += left < largest_left and abs(off) < largest_off and turn < largest_turn
    return count / len(poses)
