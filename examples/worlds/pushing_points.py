"""
One agent per robot: pushing points
===================================

Box pushing as it is learned with one agent per robot (Wang and de Silva 2006; Section X-B of the
paper), plugged into specs from outside: ``scenario.kind = "pushing_points.py:PushingPoints"``.

An agent is a robot, its actions are pushing points of the box. What it does is an option (Sutton,
Precup and Singh 1999) of fixed length: the robot drives to its point, around the box and clear of
the others, pushes straight on from there, and all robots choose again at the same time.

States are pairs of a situation and a choice: the bearing of the goal from the box, in the frame of
the box, when the robots chose, and the points that they chose. So their values are the action
values of Q-learning, and predictions need no model: the choice is all that an agent can tell
beforehand.

Where a robot may stand to push a box is computed from the outline of the box. This is how box
pushing is made easy by those who assign one agent to a robot: where to push is given, and what
remains to be learned is which point to push at. The points are numbered by where they are on the
outline. What is learned of a point is learned of its number, and means something else where the
outline is another.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import atan2, cos, pi, sin
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from shapely.geometry import Point, Polygon
from shapely.geometry.polygon import orient

import nested_agents as na
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.spaces import choice
from nested_agents.core.numerics import FloatArray, IntArray, wrap
from nested_agents.core.plugins.settings import Positive
from nested_agents.scenarios.box_pushing.config import BoxTaskSettings
from nested_agents.scenarios.box_pushing.driving import Drivers
from nested_agents.scenarios.box_pushing.measurements import MEASURES
from nested_agents.scenarios.box_pushing.world.boxes import BoxSpec
from nested_agents.scenarios.box_pushing.world.geometry import surface

ARC = 64
"""Corners of a quarter of a circle."""
WAITING_GAP = 0.015
"""Gap to the box at which a robot arrives at its point [m]."""
AHEAD = 0.04
"""How far ahead of its point a robot may be and still pushes [m]."""
BEHIND = 0.05
"""How far behind it [m]."""
ASIDE = 0.045
"""How far beside it [m]."""
TURN = 0.7
"""How far turned from where it points [rad]."""
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

    def __init__(self, world: na.BoxPushing, points: int) -> None:
        self.points = pushing_points(world.box, points, world.robot.radius + WAITING_GAP)
        self._drivers = Drivers(world)

    def act(self, measurements: Mapping[str, Any], chosen: IntArray) -> IntArray:
        """Return the actions of all wheels ``(n,)`` of robots on their way to points ``(M,)``.

        `measurements` are what `BoxPushing.measure` returns.
        """
        robots = measurements["robot_poses"]
        box = measurements["box_pose"]
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
    cos_ = cos(box[2])
    sin_ = sin(box[2])
    x = cos_ * point[0] - sin_ * point[1]
    y = sin_ * point[0] + cos_ * point[1]
    return np.array([box[0] + x, box[1] + y, box[2] + point[2]])


def _is_at(pose: FloatArray, target: FloatArray) -> bool:
    """Return whether a robot is near enough to its point to push."""
    dx, dy = pose[:2] - target[:2]
    cos_ = cos(target[2])
    sin_ = sin(target[2])
    along = cos_ * dx + sin_ * dy
    aside = cos_ * dy - sin_ * dx
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
        From the center of the body to the surface of the box [m].

    Examples
    --------
    Four points around a square of 20 cm lie off its corners, eight have two to a side:

    >>> from nested_agents.scenarios.box_pushing.world.boxes import BOXES
    >>> pushing_points(BOXES["square"], 8, 0.05).round(2)[1:3].tolist()
    [[0.07, 0.15, -1.57], [-0.07, 0.15, -1.57]]
    """
    solid = Point(0, 0).buffer(box.radius, ARC) if box.polygon is None else box.polygon
    around = orient(Polygon(Polygon(solid.exterior).buffer(gap, ARC).exterior)).exterior
    first = around.project(Point(4.0 * (box.reach + gap), 0.0))
    poses = np.empty((count, 3))
    for k in range(count):
        place = around.interpolate((first + (k + 0.5) / count * around.length) % around.length)
        _, nx, ny = surface(box.shape, place.x, place.y)
        poses[k] = place.x, place.y, atan2(-ny, -nx)
    return poses


CONTROLS = ("frozen", "random", "planner")
"""Presets that do not learn."""
MOST_VALUES = 10**6
"""The most action values of an agent, of a team that learns of joint choices."""


class PushingPoints(na.Scenario, Prediction):
    """A box, a goal, and robots as agents that choose where to push.

    Its episodes can be recorded and drawn. It is its own prediction.

    Raises
    ------
    ValueError
        As `BoxPushing`; or if a team has too many joint choices.

    Examples
    --------
    >>> scenario = PushingPoints()
    >>> scenario.agents, len(scenario.action_set), scenario.reset(0).shape
    (('robot1', 'robot2'), 8, (2, 2))
    """

    class Settings(BoxTaskSettings):
        """The ``[scenario]`` table of a spec: where and how long to push, beside the task."""

        points: Annotated[int, Field(ge=2, le=26)] = 8
        """Pushing points, spread evenly around the outline of the box."""
        option_length: Annotated[int, Field(ge=1, le=1000)] = 8
        """Decision periods for which a robot keeps to the point that it has chosen."""
        longest: Annotated[int, Field(ge=1, le=1_000_000)] = 450
        """Decision periods after which an episode is broken off."""
        bearings: Annotated[int, Field(ge=3, le=360)] = 12
        """Membership functions of the bearing of the goal."""
        observed: Literal["own", "joint"] = "own"
        """Whether the value that an agent learns is of its own pushing point (each robot by
        itself), or of those of all robots (as a team)."""
        goal_reward: Positive = 1.0
        """Reward of all robots for reaching the goal; any other option pays by how much nearer the
        box came [m]."""

        @property
        def period(self) -> float:
            """Seconds for which a decision is held: those of an option."""
            return self.option_length * super().period

        def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
            """Return Q-learning over pushing points, of each robot alone or the joint choice."""
            topology = "independent" if self.observed == "own" else "chain"
            learner: dict[str, Any] = {"rule_base": {"order": "full"}}
            if preset not in CONTROLS:
                learner |= {
                    "kind": "q-learning",
                    "discount": 0.8,
                    "weights": "own",
                    "exploration": {
                        "kind": "burst",
                        "rate": 0.6,
                        "decay": 0.85,
                        "floor": 0.0,
                        "length": 1.0,
                        "team_limit": 1.0,
                    },
                    "decision": {"value_of": "own"},
                }
            return {"topology": {"kind": topology}, "learner": learner}

    measures = MEASURES
    recorded = na.BoxPushing.recorded

    def __init__(self, settings: Settings = Settings()) -> None:  # noqa: B008 - frozen
        self.settings = settings
        self.agents = tuple(f"robot{r + 1}" for r in range(settings.robots))
        self.roles = ("robot",) * settings.robots
        names = tuple(f"point{k + 1}" for k in range(settings.points))
        zeros = (0.0,) * len(names)
        self.action_set = na.ActionSet(names, zeros, zeros, neutral=0)
        self.state_space = _state_space(settings, self.agents, names)
        task = {name: value for name, value in settings if name in BoxTaskSettings.model_fields}
        self.world = na.BoxPushingSettings(**task | {"kind": "box-pushing"}).build()
        self._pushing = Pushing(self.world, settings.points)
        self._bearing = 0.0
        self._periods = 0

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode as box pushing does; nothing has been chosen yet, which counts as 0."""
        self.world.reset(seed, episode)
        self._periods = 0
        self._look()
        return self.states_after(np.zeros((1, len(self.agents)), dtype=np.int64))[:, 0]

    def step(self, joint_action: IntArray) -> na.Transition:
        """Let every robot go to the point that it has chosen, and push for the rest of the option.

        All are paid for the way that the box has come towards the goal, as by Wang and de Silva:
        the reward of Eq. 15-17 asks robots to keep in touch with the box, who must leave it here to
        get to another point.
        """
        states = self.states_after(np.asarray(joint_action)[None])[:, 0]
        before = self.world.measure()["distance_m"]
        contact = []
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
        return {**self.world.constants_of_episode(), **self.settings.drawing}

    def animate(self, recording: Mapping[str, FloatArray], path: Path) -> None:
        """Draw a recorded episode as an animation, GIF or MP4 by the suffix of `path`."""
        self.world.animate(recording, path)

    def _look(self) -> None:
        """Note the bearing of the goal from the box, in its frame [rad]."""
        measurements = self.world.measure()
        box = measurements["box_pose"]
        goal = measurements["goal_pose"]
        course = atan2(goal[1] - box[1], goal[0] - box[0])
        self._bearing = float(wrap(course - box[2]))


def _state_space(
    settings: PushingPoints.Settings, agents: tuple[str, ...], points: tuple[str, ...]
) -> na.StateSpace:
    count = len(points) ** (1 if settings.observed == "own" else len(agents))
    if settings.bearings * count > MOST_VALUES:
        raise ValueError(
            f"scenario.observed = 'joint': {settings.bearings} bearings x {len(points)} ** "
            f"{len(agents)} joint choices, allowed: {MOST_VALUES:,} action values; use own"
        )
    turns = np.arange(settings.bearings) * 2.0 * pi / settings.bearings - pi
    bearing = na.Variable(
        "goal_bearing", "rad", -pi, pi, periodic=True, centers=tuple(turns.tolist())
    )
    if settings.observed == "own":
        own = choice("own_point", points)
        return na.StateSpace("own pushing point", (own, bearing), 1, (bearing.name,), (own.name,))
    names = tuple(f"point_of_{agent}" for agent in agents)
    variables = (bearing, *(choice(name, points) for name in names))
    return na.StateSpace("pushing points", variables, 0, (bearing.name, *names), names)
