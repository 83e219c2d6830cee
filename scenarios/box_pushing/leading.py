"""Options of a leader above the robots of box pushing: push straight, or from a second side.

Robots that push together from one side bring a box to goals ahead of this side. Any other
displacement is the sum of two pushes from adjacent sides. For the first push of the option ``second
side`` the leader communicates a waypoint, which replaces the goal in all state variables of the
agents below. Then the robots walk around the box to the next side, a given skill.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin

import numpy as np

from ...core.interface.options import LeaderOptions
from ...core.interface.spaces import ActionSet, StateSpace, Variable
from ...core.numerics import FloatArray, IntArray, wrap_one
from .config import BoxPushingSettings
from .measurements import OPTIONS
from .scenario import BoxPushing
from .walking import Walk, poses_in_box, sides_of

MAX_STRAIGHT_RAD = 0.35
"""Angle of the goal off the side pushed beyond which the rule pushes from a second side, about 20
degrees."""
MAX_PUSH_DECISIONS = 100
"""Number of decisions after which the first of two pushes is given up."""

SPACE = StateSpace(
    "leader",
    (
        Variable("goal_angle", "rad", 0.0, pi, centers=(0.0, 0.17, 0.35, 0.52, 0.79, 1.57, pi)),
        Variable("box_distance", "m", 0.0, 1.5, centers=(0.0, 0.2, 0.5, 1.0, 1.5)),
    ),
)
"""Variables of the leader: the absolute angle between the direction of the goal and the direction
of a straight push, both from the box, and the distance of the box from the goal."""
ACTIONS = ActionSet(("straight", "second side"), (1.0, 1.0), (0.0, 0.0), neutral=0)


class BoxOptions(LeaderOptions):
    """Options of a leader of box pushing.

    Parameters
    ----------
    scenario
        The scenario below the leader.

    Attributes
    ----------
    count
        Number of options so far in the episode.

    Raises
    ------
    ValueError
        If the box has no sides.
    """

    state_space = SPACE
    action_set = ACTIONS

    def __init__(self, scenario: BoxPushing) -> None:
        settings = scenario.settings.leader
        self.limit = settings.limit
        self.learner = settings.learner if settings.policy == "learned" else None
        self._quorum = settings.quorum
        self._scenario = scenario
        self._sides = sides_of(scenario.box)

    def reset(self) -> None:
        """Start an episode."""
        self.count = 0
        self._next_side: int | None = None
        self._walk: Walk | None = None

    def observe(self) -> FloatArray:
        """Return the variables ``(2,)`` of the leader, see `SPACE`."""
        return np.array([abs(self._angle(self._side())), self._scenario.distance])

    def rule(self) -> int:
        """Return the second side for a goal that is not straight ahead."""
        return int(abs(self._angle(self._side())) > MAX_STRAIGHT_RAD)

    def begin(self, option: int) -> FloatArray:
        """Begin an option and return the states ``(n, d)`` of the agents below."""
        self.count += 1
        self._decisions = 0
        self._next_side = None
        self._walk = None
        aim = self._scenario.goal
        if option:
            side = self._side()
            sense = 1 if self._angle(side) > 0.0 else -1
            self._next_side = (side + sense) % len(self._sides)
            way = self._way(side, self._next_side)
            if way < self._scenario.settings.tolerance:
                self._walk = Walk(self._scenario, self._sides[side], self._sides[self._next_side])
            else:
                x, y, turn = self._scenario.world.box_pose
                self._heading = turn + self._sides[side].direction
                waypoint = x + way * cos(self._heading), y + way * sin(self._heading)
                aim = np.array([*waypoint, aim[2]])
        self._scenario.aim = aim
        return self._scenario.states_at_rest()

    def advance(self) -> bool:
        """Return whether the option continues; begin to walk if the box is at the waypoint."""
        self._decisions += 1
        if self._next_side is None:
            return True
        if self._walk is not None:
            return self._walk.fraction_standing() < self._quorum
        if self._is_at_waypoint():
            side = self._sides[self._side()]
            self._walk = Walk(self._scenario, side, self._sides[self._next_side])
            return True
        return self._decisions < MAX_PUSH_DECISIONS

    def joint_action(self) -> IntArray | None:
        """Return the actions ``(n,)`` of walking robots; None while the agents below decide."""
        return None if self._walk is None else self._walk.joint_action()

    def _is_at_waypoint(self) -> bool:
        """Return whether the waypoint is no longer ahead of the box."""
        x, y, _ = self._scenario.aim - self._scenario.world.box_pose
        ahead = cos(self._heading) * x + sin(self._heading) * y
        return ahead < 0.5 * self._scenario.settings.tolerance

    def _side(self) -> int:
        """Return the side that most robots are nearest to."""
        poses = poses_in_box(self._scenario)
        middles = np.array([side.middle for side in self._sides])
        inward = np.array([(cos(side.direction), sin(side.direction)) for side in self._sides])
        depth = ((middles[:, None] - poses[None, :, :2]) * inward[:, None]).sum(axis=2)
        return int(np.bincount(depth.argmax(axis=0), minlength=len(self._sides)).argmax())

    def _angle(self, side: int) -> float:
        """Return the angle of the goal off a straight push of a side [rad]."""
        x, y, _ = self._scenario.goal - self._scenario.world.box_pose
        turn = self._scenario.world.box_pose[2]
        return wrap_one(atan2(y, x) - turn - self._sides[side].direction)

    def _way(self, side: int, other: int) -> float:
        """Return the length of the push after which the other side leads to the goal [m]."""
        between = wrap_one(self._sides[other].direction - self._sides[side].direction)
        return self._scenario.distance * sin(between - self._angle(side)) / sin(between)


class LedBoxPushing(BoxPushing):
    """Box pushing with a leader above all wheels."""

    has_leader = True

    def __init__(self, settings: BoxPushingSettings) -> None:
        super().__init__(settings)
        self.measures = (*self.measures, OPTIONS)
        self.options = BoxOptions(self)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode, see `BoxPushing.reset`."""
        self.options.reset()
        return super().reset(seed, episode)

    def environments(self, count: int) -> None:
        """Return None: a leader leads in one environment."""

    def _measured(self, distance: float, orientation: float) -> dict[str, object]:
        return super()._measured(distance, orientation) | {"options": self.options.count}


def built(settings: BoxPushingSettings) -> BoxPushing:
    """Return the scenario of the settings, with or without a leader."""
    kind = BoxPushing if settings.leader.policy == "none" else LedBoxPushing
    return kind(settings)
