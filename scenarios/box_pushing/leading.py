"""Options of a leader above the robots of box pushing: push straight, or from a second side.

Robots that push together from one side bring a box to goals that lie ahead of this side. Any other
displacement is the sum of two pushes from adjacent sides. For the first push of the option ``second
side`` the leader communicates a waypoint, which takes the place of the goal in all state variables
of the agents below. Then the robots go around the box to the next side, a given skill.
"""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from shapely.geometry.polygon import orient

from ...core.interface.options import Options
from ...core.interface.scenario import Transition
from ...core.interface.spaces import ActionSet, StateSpace, Variable
from ...core.numerics import FloatArray, IntArray, wrap, wrap_one
from ..angles import rotate
from .world.robots import nominal_effect
from .walking import GAP_M, Path, Wheels, locate, path_around, standing, walk

if TYPE_CHECKING:
    from .scenario import BoxPushing

LARGEST_STRAIGHT_RAD = 0.35
"""Angle of the goal off the side pushed beyond which the rule pushes from a second side (20
degrees)."""
LONGEST_PUSH = 100
"""Number of decisions after which the first of two pushes is given up."""
COST = 0.01
"""Cost of a decision before the goal is reached, for the leader."""

SPACE = StateSpace(
    "leader",
    (
        Variable("goal_angle", "rad", 0.0, pi, centers=(0.0, 0.17, 0.35, 0.52, 0.79, 1.57, pi)),
        Variable("box_distance", "m", 0.0, 1.5, centers=(0.0, 0.2, 0.5, 1.0, 1.5)),
    ),
)
"""Variables of the leader: absolute angle between the direction from the box to the goal and that
in which the robots push straight, and the distance of the box from the goal."""
ACTIONS = ActionSet(("straight", "second side"), (1.0, 1.0), (0.0, 0.0), neutral=0)


class Side(NamedTuple):
    """A side of the convex hull of a box, in the frame of the box."""

    direction: float
    """Direction straight into the side [rad]."""
    middle: tuple[float, float]
    """Middle of the side [m]."""
    half: float
    """Half its length [m]."""


class BoxOptions(Options):
    """Options of a leader of box pushing, see the module."""

    state_space = SPACE
    action_set = ACTIONS

    def __init__(self, scenario: BoxPushing) -> None:
        settings = scenario.settings.leader
        self.limit = settings.limit
        self.learner = settings.learner if settings.decides == "learner" else None
        self._enough = settings.standing
        self._scenario = scenario
        self._sides = _sides(scenario)
        robot = scenario.robot
        self._path: Path = path_around(scenario.box, robot.radius + GAP_M)
        choices = np.stack(np.meshgrid(*[np.arange(4)] * len(robot.wheels), indexing="ij"), -1)
        self._choices: IntArray = choices.reshape(-1, len(robot.wheels))
        actions = scenario.action_set
        unit = scenario.settings.speed_increment * robot.max_speed
        self._wheels = Wheels(
            np.array(actions.gains)[self._choices],
            unit * np.array(actions.increments)[self._choices],
            robot.max_speed,
            nominal_effect(robot),
            scenario.settings.period,
            robot.radius,
        )

    def reset(self) -> None:
        """Forget the last option."""
        self.count = 0
        self._next: int | None = None
        self._places: FloatArray | None = None
        self._decisions = 0
        self._heading = 0.0

    def observe(self) -> FloatArray:
        """Return the variables of the leader ``(2,)``, see `SPACE`."""
        return np.array([abs(self._angle(self._side())), self._scenario.distance])

    def rule(self) -> int:
        """Return the option of a leader by rule: a second side for goals far off."""
        return int(self.observe()[0] > LARGEST_STRAIGHT_RAD)

    def reward(self, transition: Transition) -> float:
        """Return the reward of a decision, which is negative before the goal."""
        return 0.0 if transition.terminated else -COST

    def begin(self, option: int) -> FloatArray:
        """Begin an option; return the states ``(n, d)`` of the agents below."""
        self.count += 1
        self._decisions = 0
        self._next = self._places = None
        goal = self._scenario.goal
        if option:
            side = self._side()
            self._next = self._adjacent(side)
            waypoint = self._waypoint(side, self._next)
            if waypoint is None:
                self._walk()
            else:
                goal = np.array([*waypoint, goal[2]])
        return self._scenario.aim_at(goal)

    def joint_action(self) -> IntArray | None:
        """Return the actions ``(n,)`` of walking robots; None while the agents below decide."""
        self._decisions += 1
        if self._places is None:
            return None
        poses = self._in_box(self._scenario.world.robot_poses, self._scenario.world.box_pose)
        order = self._assign(poses)
        actions = walk(
            order, poses, self._scenario.wheel_speeds, self._places, self._path, self._wheels
        )
        return self._choices[actions].ravel()

    def has_ended(self) -> bool:
        """Return whether the robots stand at the second side, or their push is given up."""
        if self._next is None:
            return False
        if self._places is None:
            if self._is_at_waypoint():
                self._walk()
            return self._decisions >= LONGEST_PUSH
        box = self._scenario.world.box_pose
        poses = self._in_box(self._scenario.world.robot_poses, box)
        return standing(poses, self._places, self._path) >= self._enough

    def _is_at_waypoint(self) -> bool:
        """Return whether the waypoint is no longer ahead of the box."""
        box, aim = self._scenario.world.box_pose, self._scenario.aim
        along = cos(self._heading) * (aim[0] - box[0]) + sin(self._heading) * (aim[1] - box[1])
        return along < 0.5 * self._scenario.settings.tolerance

    def _side(self) -> int:
        """Return the side that most robots are near to."""
        poses = self._in_box(self._scenario.world.robot_poses, self._scenario.world.box_pose)
        middles = np.array([side.middle for side in self._sides])
        inward = np.array([(cos(side.direction), sin(side.direction)) for side in self._sides])
        depth = ((middles[:, None] - poses[None, :, :2]) * inward[:, None]).sum(axis=2)
        behind = depth.argmax(axis=0)
        return int(np.bincount(behind, minlength=len(self._sides)).argmax())

    def _angle(self, side: int) -> float:
        """Return the angle of the goal off a side [rad]."""
        box = self._scenario.world.box_pose
        ahead = self._scenario.goal - box
        return wrap_one(atan2(ahead[1], ahead[0]) - box[2] - self._sides[side].direction)

    def _adjacent(self, side: int) -> int:
        """Return the next side in the direction of the goal."""
        sense = 1 if self._angle(side) > 0.0 else -1
        return (side + sense) % len(self._sides)

    def _waypoint(self, side: int, other: int) -> tuple[float, float] | None:
        """Return where a push from the other side leads to the goal; None if it is not ahead."""
        box = self._scenario.world.box_pose
        angle = self._angle(side)
        between = wrap_one(self._sides[other].direction - self._sides[side].direction)
        way = self._scenario.distance * sin(between - angle) / sin(between)
        if way < self._scenario.settings.tolerance:
            return None
        self._heading = box[2] + self._sides[side].direction
        return box[0] + way * cos(self._heading), box[1] + way * sin(self._heading)

    def _walk(self) -> None:
        """Begin to go around the box."""
        assert self._next is not None
        direction = self._sides[self._next].direction
        self._sense = float(np.sign(wrap_one(direction - self._sides[self._side()].direction)))
        self._places = np.zeros((len(self._scenario.groups), 3))
        self._places[:, 1:] = direction, self._sense

    def _assign(self, poses: FloatArray) -> IntArray:
        """Assign places at the next side in the order along the curve; return this order.

        `poses` are ``(M, 3)``, in the frame of the box.
        """
        assert self._next is not None
        assert self._places is not None
        side = self._sides[self._next]
        total = self._path.ways[-1]
        middle = locate(self._path, *side.middle)[0]
        ways = np.array([locate(self._path, x, y)[0] for x, y, _ in poses])
        order: IntArray = np.argsort(np.mod(self._sense * (middle - ways) + 0.25 * total, total))
        room = side.half - self._wheels.radius - 0.01
        spread = np.linspace(room, -room, len(poses)) if len(poses) > 1 else np.zeros(1)
        self._places[order, 0] = np.mod(middle + self._sense * spread, total)
        return order

    @staticmethod
    def _in_box(poses: FloatArray, box: FloatArray) -> FloatArray:
        """Return poses ``(M, 3)`` in the frame of the box."""
        x, y = rotate(cos(box[2]), -sin(box[2]), *(poses[:, :2] - box[:2]).T)
        return np.column_stack([x, y, wrap(poses[:, 2] - box[2])])


def _sides(scenario: BoxPushing) -> list[Side]:
    """Return the sides of the convex hull of a box, counterclockwise.

    Raises
    ------
    ValueError
        If the box has no sides.
    """
    polygon = scenario.box.polygon
    if polygon is None:
        raise ValueError("scenario.leader.decides: a disc has no sides, use another scenario.box")
    points = np.array(orient(polygon.convex_hull).exterior.coords)
    sides = []
    for a, b in zip(points, points[1:], strict=False):
        along = b - a
        middle = (a + b) / 2
        direction = atan2(along[0], -along[1])
        sides.append(Side(direction, (middle[0], middle[1]), hypot(*along) / 2))
    return sides
