"""Box pushing as it is learned with one agent per robot (Wang and de Silva 2006; Section X-B).

An agent is a robot, its actions are pushing points of the box. What it does is an option (Sutton,
Precup and Singh 1999) of fixed length: the robot drives to its point, around the box and clear of
the others, pushes straight on from there, and all robots choose again at the same time.

States are pairs of a situation and a choice: the bearing of the goal from the box, in the frame of
the box, when the robots chose, and the points that they chose. So their values are the action
values of Q-learning, and predictions need no model: the choice is all that an agent can tell
beforehand.

Where a robot may stand to push a box is computed from the outline of the box. This is how box
pushing is made easy by those who assign one agent to a robot (Wang and de Silva 2006): where to
push is given, and what remains to be learned is which point to push at. The points are numbered by
where they are on the outline. What is learned of a point is learned of its number, and means
something else where the outline is another.

A robot gets to a place by a short search over sequences of its own actions, around the box and
clear of the other robots. A decision costs at most `LONGEST_SEARCH` sequences; those that come to
the same wheel speeds are followed once, and of the other robots only those within reach count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from math import atan2, cos, log, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import Point, Polygon
from shapely.geometry.polygon import orient

from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet, StateSpace, Variable, choice
from ...core.numerics import FloatArray, IntArray, njit, wrap
from .config import BoxPushingSettings, BoxTaskSettings, PushingPointsSettings
from .prediction.predictors import push_model
from .scenario import MEASURES, BoxPushing
from .world.boxes import BoxSpec
from .world.geometry import surface
from .world.robots import nominal_effect
from .world.settings import RobotSettings

CLEARANCE = 0.006
"""Least gap [m] to box and other robots on the way to a slot."""
LONGEST_SEARCH = 5000
"""Action sequences tried per robot and decision, those that come to the same included."""


class Drivers:
    """What each robot of a team can do by itself.

    Parameters
    ----------
    scenario
        What is in the world, and what robots can do in a decision period.

    Attributes
    ----------
    model
        What is believed of the world.
    seconds
        The decision period [s].
    choices
        ``(k, w)`` the robot actions, the same of every robot.
    wheels
        Per robot: where its wheels stand among those of all.
    """

    def __init__(self, scenario: BoxPushing) -> None:
        self.robot, self.box, self.actions = scenario.robot, scenario.box, scenario.action_set
        self.model = push_model("push", list(scenario.world.robots), self.box)
        self.increment = scenario.settings.speed_increment
        self.seconds = scenario.settings.period
        self.choices = _robot_actions(self.robot, len(self.actions))
        self.wheels = [slice(group[0], group[-1] + 1) for group in scenario.groups]
        self._effect = nominal_effect(self.robot)

    def next(self, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return wheel speeds ``(m, k, w)`` and twists ``(m, k, 3)`` after the k robot actions.

        `speeds` is ``(m, w)``.
        """
        limit = np.full(speeds.shape[-1], self.robot.max_speed)
        after = self.actions.apply(
            speeds[:, None], self.choices[None], self.increment * limit, limit
        )
        return after, after @ self._effect[:, :-1].T + self._effect[:, -1]

    def rest(self, robot: int, speeds: FloatArray) -> int:
        """Return the robot action after which a robot's wheels are slowest."""
        after, _ = self.next(speeds[self.wheels[robot]][None])
        return int(np.abs(after[0]).sum(axis=1).argmin())

    def drive(
        self,
        robot: int,
        robots: FloatArray,
        box: FloatArray,
        speeds: FloatArray,
        target: FloatArray,
    ) -> int:
        """Return the robot action that leads a robot towards a pose ``(3,)``.

        `robots` ``(M, 3)`` and `box` ``(3,)`` are present poses, `speeds` ``(n,)`` those of all
        wheels.
        """
        now = speeds[self.wheels[robot]][None]
        depth = int(log(LONGEST_SEARCH) / log(len(self.choices)))
        span = self.robot.radius + self.robot.radius + CLEARANCE
        within = span + depth * self.seconds * self.robot.max_speed
        near = np.hypot(*(robots[:, :2] - robots[robot, :2]).T) < within
        near[robot] = False
        others = robots[near, :2]
        poses, cost, first = robots[robot][None], np.zeros(1), np.zeros(1, dtype=np.int64)
        for level in range(depth):
            after, twists = self.next(now)
            row, option = np.nonzero(_distinct(after))
            poses, cost = poses[row], cost[row]
            first = first[row] if level else option
            now, twists = after[row, option], twists[row, option]
            for _ in range(2):
                poses = moved(poses, twists, self.seconds / 2)
                apart = np.hypot(*(poses[:, None, :2] - others).transpose(2, 0, 1))
                cost = cost + 10.0 * np.maximum(span - apart, 0.0).sum(axis=1)
                path = paths(
                    poses, target[:2], box, self.model.edges, self.model.rounding,
                    self.robot.radius + CLEARANCE, self.box.reach,
                )  # fmt: skip
                turn = np.abs(wrap(poses[:, 2] - target[2]))
                left = path + 0.06 * turn * np.exp(-path / 0.05)
                cost = cost + 0.1 * left
        return int(first[(cost + left).argmin()])


def _distinct(speeds: FloatArray) -> Any:
    """Return which of ``(m, k, w)`` wheel speeds no earlier option gives, ``(m, k)``."""
    by_wheel = np.ascontiguousarray(speeds.transpose(2, 0, 1))  # not to reduce along a short axis
    same = (by_wheel[..., None] == by_wheel[:, :, None]).all(axis=0)
    return same.argmax(axis=2) == np.arange(speeds.shape[1])


def _robot_actions(robot: RobotSettings, n_actions: int) -> IntArray:
    """Return the combinations ``(k, w)`` of actions to try: wheels of one side act alike."""
    sides = [int(np.sign(wheel.y)) for wheel in robot.wheels]
    groups = sorted(set(sides))
    rows = product(range(n_actions), repeat=len(groups))
    return np.array([[row[groups.index(side)] for side in sides] for row in rows])


def moved(poses: FloatArray, twists: FloatArray, seconds: float) -> FloatArray:
    """Return poses ``(m, 3)`` after moving with constant body twists ``(m, 3)``."""
    turn = twists[:, 2] * seconds
    middle = poses[:, 2] + turn / 2
    chord = seconds * np.sinc(turn / (2 * pi))
    cosine, sine = np.cos(middle), np.sin(middle)
    x = poses[:, 0] + chord * (cosine * twists[:, 0] - sine * twists[:, 1])
    y = poses[:, 1] + chord * (sine * twists[:, 0] + cosine * twists[:, 1])
    return np.stack([x, y, poses[:, 2] + turn], axis=1)


@njit(cache=True)
def paths(
    poses: FloatArray,
    target: FloatArray,
    box: FloatArray,
    edges: FloatArray,
    rounding: float,
    margin: float,
    reach: float,
) -> FloatArray:
    """Return about how far ``(m,)`` it is from poses to a target, around the box.

    Straight if all of the way keeps `margin` from the box, else along a circle around it. Standing
    too close to the box is penalised.
    """
    out = np.empty(len(poses))
    cos_, sin_ = np.cos(box[2]), np.sin(box[2])
    tx, ty = target[0] - box[0], target[1] - box[1]
    ring = reach + margin + 0.01
    for i in range(len(poses)):
        x, y = poses[i, 0] - box[0], poses[i, 1] - box[1]
        here = surface(edges, rounding, cos_ * x + sin_ * y, cos_ * y - sin_ * x)[0]
        near = max(margin - here, 0.0)
        blocked = False
        for k in range(1, 9):
            px, py = x + (tx - x) * k / 8, y + (ty - y) * k / 8
            gap = surface(edges, rounding, cos_ * px + sin_ * py, cos_ * py - sin_ * px)[0]
            if gap < min(margin, here):
                blocked = True
                break
        if blocked:
            rho = np.sqrt(x * x + y * y)
            turn = np.arctan2(x * ty - y * tx, x * tx + y * ty)
            out[i] = ring * abs(turn) + abs(rho - ring) + abs(np.sqrt(tx * tx + ty * ty) - ring)
        else:
            out[i] = np.sqrt((tx - x) ** 2 + (ty - y) ** 2)
        out[i] += 20.0 * near
    return out


ARC = 64
"""Corners of a quarter of a circle."""
WAITING_GAP = 0.015
"""Gap to the box at which a robot arrives at its point [m]."""
AHEAD, BEHIND, ASIDE, TURN = 0.04, 0.05, 0.045, 0.7
"""How far a robot may be off its point and still pushes [m, m, m, rad]."""
STRAIGHT = 0.1
"""How much a radian off the direction of pushing counts [m]."""


class Pushing:
    """Drives robots to pushing points of a box, and straight on from there.

    Parameters
    ----------
    world
        The scenario whose wheels are driven.
    points
        How many points there are around the box.

    Attributes
    ----------
    points
        ``(points, 3)`` poses in the frame of the box.
    """

    def __init__(self, world: BoxPushing, points: int) -> None:
        self.points = pushing_points(world.box, points, world.robot.radius + WAITING_GAP)
        self._drivers = Drivers(world)

    def act(self, measurements: Mapping[str, Any], chosen: IntArray) -> IntArray:
        """Return the actions of all wheels ``(n,)`` of robots on their way to points ``(M,)``.

        `measurements` are what `BoxPushing.measure` returns.
        """
        robots, box = measurements["robot_poses"], measurements["box_pose"]
        speeds = measurements["wheel_speeds"]
        actions = []
        for robot, (pose, point) in enumerate(zip(robots, self.points[chosen], strict=True)):
            target = _in_world(box, point)
            if _is_at(pose, target):
                local = self._straight_on(robot, pose, speeds, target[2])
            else:
                local = self._drivers.drive(robot, robots, box, speeds, target)
            actions.append(self._drivers.choices[local])
        return np.concatenate(actions)

    def _straight_on(self, robot: int, pose: FloatArray, speeds: FloatArray, way: float) -> int:
        """Return the robot action that pushes fastest without turning away from `way` [rad]."""
        own = speeds[self._drivers.wheels[robot]][None]
        twists = self._drivers.next(own)[1][0]
        seconds = self._drivers.seconds
        turned = np.abs(wrap(pose[2] + seconds * twists[:, 2] - way))
        return int((STRAIGHT * turned - seconds * twists[:, 0]).argmin())


def _in_world(box: FloatArray, point: FloatArray) -> FloatArray:
    """Return a pose in the frame of the box as one in the world."""
    cos_, sin_ = cos(box[2]), sin(box[2])
    x, y = cos_ * point[0] - sin_ * point[1], sin_ * point[0] + cos_ * point[1]
    return np.array([box[0] + x, box[1] + y, box[2] + point[2]])


def _is_at(pose: FloatArray, target: FloatArray) -> bool:
    """Return whether a robot is near enough to its point to push."""
    dx, dy = pose[:2] - target[:2]
    cos_, sin_ = cos(target[2]), sin(target[2])
    along, aside = cos_ * dx + sin_ * dy, cos_ * dy - sin_ * dx
    turned = abs(wrap(pose[2] - target[2]))
    return bool(-BEHIND < along < AHEAD and abs(aside) < ASIDE and turned < TURN)


def pushing_points(box: BoxSpec, count: int, gap: float) -> FloatArray:
    """Return poses ``(count, 3)`` around a box from which it can be pushed, in its frame.

    They lie at equal distances on the curve that a round body follows on its way around the box,
    counter-clockwise. The first is half such a distance past the place straight ahead of the box.

    Parameters
    ----------
    box
        The box.
    count
        How many.
    gap
        From the centre of the body to the surface of the box [m].

    Examples
    --------
    Four points around a square of 20 cm lie off its corners, eight have two to a side:

    >>> from nested_agents.scenarios.box_pushing.world.boxes import BOXES
    >>> pushing_points(BOXES["square"], 8, 0.05).round(2)[1:3].tolist()
    [[0.07, 0.15, -1.57], [-0.07, 0.15, -1.57]]
    """
    radius = box.outline.rounding
    solid = Point(0, 0).buffer(radius, ARC) if box.polygon is None else box.polygon
    around = orient(Polygon(Polygon(solid.exterior).buffer(gap, ARC).exterior)).exterior
    first = around.project(Point(4.0 * (box.reach + gap), 0.0))
    poses = np.empty((count, 3))
    for k in range(count):
        place = around.interpolate((first + (k + 0.5) / count * around.length) % around.length)
        _, nx, ny, _, _ = surface(box.outline.edges, radius, place.x, place.y)
        poses[k] = place.x, place.y, atan2(-ny, -nx)
    return poses


MOST_VALUES = 10**6
"""The most action values of an agent, of a team that learns of joint choices."""


class PushingPoints(Scenario, Prediction):
    """A box, a goal, and robots as agents that choose where to push.

    Fulfils `Scenario` and `Prediction`; its episodes can be recorded and drawn.

    Parameters
    ----------
    settings
        See `PushingPointsSettings`.

    Raises
    ------
    ValueError
        As `BoxPushing`; or if a team has too many joint choices.

    Examples
    --------
    >>> scenario = PushingPointsSettings().build()
    >>> scenario.agents, len(scenario.action_set), scenario.reset(0).shape
    (('robot1', 'robot2'), 8, (2, 2))
    """

    measures = MEASURES
    recorded = BoxPushing.recorded

    def __init__(self, settings: PushingPointsSettings) -> None:
        self.settings = settings
        self.agents = tuple(f"robot{r + 1}" for r in range(settings.robots))
        self.roles = ("robot",) * settings.robots
        names = tuple(f"point{k + 1}" for k in range(settings.points))
        zeros = (0.0,) * len(names)
        self.action_set = ActionSet(names, zeros, zeros, neutral=0)
        self.state_space = _state_space(settings, self.agents, names)
        shared = {name: getattr(settings, name) for name in BoxTaskSettings.model_fields}
        shared["kind"] = "box-pushing"
        self.world = BoxPushing(BoxPushingSettings(**shared))
        self._pushing = Pushing(self.world, settings.points)
        self._bearing, self._periods = 0.0, 0

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode as box pushing does; nothing has been chosen yet, which counts as 0."""
        self.world.reset(seed, episode)
        self._periods = 0
        self._look()
        return self.states_after(np.zeros((1, len(self.agents)), dtype=np.int64))[:, 0]

    def step(self, joint_action: IntArray) -> Transition:
        """Let every robot go to the point that it has chosen, and push for the rest of the option.

        All are paid for the way that the box has come towards the goal, as by Wang and de Silva:
        the reward of Eq. 15-17 asks robots to keep in touch with the box, who must leave it here to
        get to another point.
        """
        states = self.states_after(np.asarray(joint_action)[None])[:, 0]
        before, contact = self.world.measure()["distance_m"], []
        for _ in range(self.settings.option_length):
            wheels = self._pushing.act(self.world.measure(), np.asarray(joint_action))
            there = self.world.step(wheels)
            contact.append(there.info["contact_fraction"])
            self._periods += 1
            late = self._periods >= self.settings.longest
            if there.terminated or there.truncated or late:
                break
        self._look()
        nearer = float(before - there.info["distance_m"])
        return replace(
            there,
            states=states,
            reward=self.settings.goal_reward if there.terminated else nearer,
            truncated=not there.terminated and (there.truncated or late),
            info={**there.info, "contact_fraction": float(np.mean(contact))},
        )

    def predict(self) -> PushingPoints:
        """Return this scenario: before robots choose, only what they choose can be predicted."""
        return self

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the states ``(m, d)`` of a robot after joint choices ``(m, M)``."""
        return self.states_after(joint_actions)[agent]

    def with_exact_prediction(self) -> PushingPoints:
        """Return this scenario: what an agent chooses is what comes."""
        return self

    def states_after(self, joint_actions: IntArray) -> FloatArray:
        """Return the states ``(M, m, d)`` of all robots that joint actions ``(m, M)`` lead to."""
        chosen = joint_actions.T[:, :, None].astype(float)
        bearing = np.full((*chosen.shape[:2], 1), self._bearing)
        if self.settings.observed == "own":
            return np.concatenate([chosen, bearing], axis=2)
        every = np.repeat(joint_actions[None].astype(float), len(self.agents), axis=0)
        return np.concatenate([bearing, every], axis=2)

    def measure(self) -> Mapping[str, Any]:
        """Return what `BoxPushing.measure` does."""
        return self.world.measure()

    def constants_of_episode(self) -> dict[str, Any]:
        """Return those of `BoxPushing`; a frame is an option."""
        return {**self.world.constants_of_episode(), **self.settings.drawn}

    def animate(self, recording: Mapping[str, FloatArray], path: Path) -> None:
        """Draw a recorded episode as an animation, GIF or MP4 by the suffix of `path`."""
        self.world.animate(recording, path)

    def _look(self) -> None:
        """Note the bearing of the goal from the box, in its frame [rad]."""
        seen = self.world.measure()
        box, goal = seen["box_pose"], seen["goal_pose"]
        course = atan2(goal[1] - box[1], goal[0] - box[0])
        self._bearing = float(wrap(course - box[2]))


def _state_space(
    settings: PushingPointsSettings, agents: tuple[str, ...], points: tuple[str, ...]
) -> StateSpace:
    count = len(points) ** (1 if settings.observed == "own" else len(agents))
    if settings.bearings * count > MOST_VALUES:
        raise ValueError(
            f"scenario.observed = 'joint': {settings.bearings} bearings x {len(points)} ** "
            f"{len(agents)} joint choices, allowed: {MOST_VALUES:,} action values; use own"
        )
    turns = np.arange(settings.bearings) * 2.0 * pi / settings.bearings - pi
    bearing = Variable("goal_bearing", "rad", -pi, pi, periodic=True, centres=tuple(turns.tolist()))

    if settings.observed == "own":
        own = choice("own_point", points)
        return StateSpace("own pushing point", (own, bearing), 1, (bearing.name,), (own.name,))
    names = tuple(f"point_of_{agent}" for agent in agents)
    variables = (bearing, *(choice(name, points) for name in names))
    return StateSpace("pushing points", variables, 0, (bearing.name, *names), names)
