"""Box pushing as it is learned with one agent per robot (Wang and de Silva 2006; Section X-B).

An agent is a robot, its actions are pushing points of the box. What it does is an option (Sutton,
Precup and Singh 1999) of fixed length: the robot drives to its point, around the box and clear of
the others, pushes straight on from there, and all robots choose again at the same time.

States are pairs of a situation and a choice: the bearing of the goal from the box, in the frame of
the box, when the robots chose, and the points that they chose. So their values are the action
values of Q-learning, and predictions need no model: the choice is all that an agent can tell
beforehand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import atan2, pi
from pathlib import Path
from typing import Any

import numpy as np

from ....core.interface.scenario import Transition
from ....core.interface.spaces import ActionSet, StateSpace, Variable, choice
from ....core.numerics import FloatArray, IntArray
from ..config import BoxPushingSettings, BoxTaskSettings
from ..scenario import MEASURES, BoxPushing
from ..world.geometry import wrap
from .config import PushingPointsSettings
from .pushing import Pushing

MOST_VALUES = 10**6
"""The most action values of an agent, of a team that learns of joint choices."""


class PushingPoints:
    """A box, a goal, and robots as agents that choose where to push.

    Fulfils `Scenario`; its episodes can be recorded and drawn.

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

    def predict(self) -> PushingPointsPrediction:
        """Return what can be predicted before robots choose: what they choose."""
        return PushingPointsPrediction(self)

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


class PushingPointsPrediction:
    """The situation as it is, with what would be chosen; `Prediction`.

    Parameters
    ----------
    scenario
        Valid until its next step.
    """

    def __init__(self, scenario: PushingPoints) -> None:
        self._scenario = scenario

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the states ``(m, d)`` of a robot after joint choices ``(m, M)``."""
        return self._scenario.states_after(joint_actions)[agent]


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
