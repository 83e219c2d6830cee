"""Predictions of box pushing: next states and rewards of joint actions, computed on request.

The poses after a joint action come from the push predictor, at once for all robots. An agent's own
block is predicted as if its robot pushed alone, so that it takes few values; in state spaces whose
own block is the wheel speed that is exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import ClassVar

import numpy as np

from ....core.interface.prediction import Blocks, EmbodiedPrediction, Tables
from ....core.interface.spaces import ActionSet
from ....core.numerics import FloatArray, IntArray
from ....core.search.best_response import RespondingPrediction, Responses, Search
from ....core.values.rule_base import RuleBase
from ..states.situations import SituationBatch
from ..states.state_spaces import BoxStateSpace
from ..states.variables import progress_of
from ..world.geometry import BoxShape
from ..world.reward import Task, reward
from ..world.settings import InfraredSettings
from .calibration import PushBelief, mean_twists, outcomes
from .push import PushModel, push
from .responses import Outlook, respond
from .wheel_commands import (
    WheelCommands,
    choices_of,
    first_actions,
    speeds_of,
    twist_table,
    wheel_commands_of,
)

CONTACT_GAP = 0.002
"""Predicted gap [m] below which a robot counts as touching."""


@dataclass(frozen=True)
class PresentState:
    """Current state of robots and box, from which predictions start."""

    robots: FloatArray
    """Poses ``(M, 3)``."""
    box: FloatArray
    """Pose ``(3,)``."""
    goal: FloatArray
    """Pose ``(3,)``."""
    speeds: FloatArray
    """``(n,)`` commanded wheel speeds [m/s]."""
    effects: tuple[FloatArray, ...]
    """Per robot ``(3, w + 1)``: twist in its frame = effect @ [wheel speeds, 1]."""
    groups: tuple[tuple[int, ...], ...]
    """Agents of each robot."""


@dataclass(frozen=True)
class Premises:
    """Settings that all predictions of a scenario share."""

    belief: PushBelief
    """Push models by constants, for `outcomes`."""
    space: BoxStateSpace
    """State space of the agents."""
    action_set: ActionSet
    """Actions of a wheel."""
    increment: float
    """Change of wheel speed by an action, as a fraction of `limits`."""
    limits: FloatArray
    """``(n,)`` maximum wheel speeds [m/s]."""
    task: Task
    """Task, which defines the reward."""
    infrared: InfraredSettings
    """Response of the sensors."""
    shape: BoxShape
    """Outline of the box."""
    hold: float
    """Decision period [s]."""
    seconds: float
    """Prediction horizon [s]."""


class BoxPrediction(EmbodiedPrediction, RespondingPrediction, Tables):
    """Predicts from one situation.

    Parameters
    ----------
    situation
        Current state.
    model
        Model of robots and box.
    premises
        Settings that all predictions of the scenario share.
    """

    merges: ClassVar[bool] = True
    """Whether wheel commands of one twist are taken to lead to the same place."""

    def __init__(self, situation: PresentState, model: PushModel, premises: Premises) -> None:
        self.situation = situation
        self.model = model
        self.premises = premises
        self.groups = situation.groups
        self._last: tuple[bytes, SituationBatch] | None = None  # the last request

    @cached_property
    def wheel_commands(self) -> WheelCommands:
        """All commands that the wheels may receive."""
        speeds = self.situation.speeds
        actions = self.premises.action_set
        limits = self.premises.limits[:, None]
        commands = actions.apply(
            speeds[:, None], np.arange(len(actions)), self.premises.increment * limits, limits
        ).reshape(len(self.groups), -1, len(actions))
        return wheel_commands_of(commands, np.array(self.situation.effects), self.merges)

    def _after(self, choices: IntArray, seconds: float) -> SituationBatch:
        now = self.situation
        twists = self.wheel_commands.twists
        by_robot = np.ascontiguousarray(choices.T)
        robots, box, gaps = push(now.robots, now.box, twists, by_robot, seconds, self.model)
        return self._batch(robots, box, gaps, seconds)

    def _batch(
        self, robots: FloatArray, box: FloatArray, gaps: FloatArray, seconds: float
    ) -> SituationBatch:
        """Return the situations that the present one leads to in `seconds`."""
        now = self.situation
        premises = self.premises
        periods = seconds / premises.hold
        return SituationBatch(
            robots, box, gaps, now.goal, now.box[:, None], periods, premises.shape
        )

    def _reached(self, joint_actions: IntArray) -> tuple[IntArray, SituationBatch]:
        """Return wheel commands ``(m, M)``, and the situations that they lead to."""
        choices = self._choices(joint_actions)
        key = choices.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._after(choices, self.premises.seconds)
        return choices, self._last[1]

    def _choices(self, joint_actions: IntArray) -> IntArray:
        """Return the wheel command ``(m, M)`` of each robot in joint actions ``(m, n)``."""
        return choices_of(joint_actions, self.wheel_commands.which, len(self.premises.action_set))

    @cached_property
    def alike(self) -> IntArray:
        """The first robot-action index ``(M, A ** w)`` that gives the same wheel speeds."""
        return first_actions(self.wheel_commands.which)

    def best_responses(self, rules: RuleBase) -> Responses | None:
        """Return best responses of all robots by one compiled call, see `responses`.

        None where a state variable, or a rule base of all rules, is not of what is compiled.
        """
        space = self.premises.space
        simple = space.is_built_in and not space.own_needs_pose and rules.is_triangular
        alone = len(self.situation.speeds) == 1
        if alone or not simple:
            return None
        return partial(self._respond, rules)

    def _respond(self, rules: RuleBase, search: Search) -> IntArray:
        now = self.situation
        premises = self.premises
        commands = self.wheel_commands
        wheels = len(self.groups[0])
        weights, agents, _, firsts = search.pooled
        outlook = Outlook(
            robots=now.robots,
            box=now.box,
            goal=now.goal,
            shape=premises.shape,
            seconds=premises.seconds,
            periods=premises.seconds / premises.hold,
            model=self.model,
            twists=commands.twists,
            speeds=commands.speeds,
            which=commands.which,
            alike=self.alike,
            every=np.arange(len(self.groups)),
            columns=premises.space.columns,
            weights=weights,
            agents=agents,
            firsts=firsts,
            terms=rules.terms_by_owner,
            variables=rules.layout[0],
        )
        order = search.order[::wheels] // wheels
        n_actions = len(premises.action_set)
        joint = respond(search.starts, order, n_actions, outlook, search.exploring, search.rng)
        if not len(joint):
            raise ArithmeticError(
                "no joint action has the greatest value: not all values are numbers"
            )
        return joint

    @cached_property
    def _table(self) -> tuple[SituationBatch, IntArray]:
        """Situations after all combinations of twists; the row of every joint-action index."""
        choices, row = twist_table(self.wheel_commands)
        return self._after(choices, self.premises.seconds), row

    @cached_property
    def _alone(self) -> list[FloatArray]:
        """Poses of each robot ``(K, 3)`` after every wheel command, if it pushed alone."""
        now = self.situation
        model = self.model
        commands = self.wheel_commands
        poses = []
        for r, count in enumerate(commands.counts):
            only = slice(r, r + 1)
            every = np.arange(count)[None]
            alone = model._replace(radii=model.radii[only], compliance=model.compliance[only])
            twists = commands.twists[only]
            seconds = self.premises.seconds
            poses.append(push(now.robots[only], now.box, twists, every, seconds, alone)[0][0].T)
        return poses

    @cached_property
    def _shared(self) -> FloatArray:
        """The shared blocks ``(M, m, d - n_own)`` in the situations of the table."""
        return self.premises.space.shared(self._table[0], range(len(self.groups)))

    def tables(self) -> Tables:
        """Return itself: it has tables of all joint actions."""
        return self

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of `agent` for all joint actions, own block as if alone.

        Own variables are those that occur, each with its row for every robot action.
        """
        commands = self.wheel_commands
        space = self.premises.space
        goal = self.situation.goal
        r, wheel = divmod(agent, len(self.groups[0]))
        if space.own_needs_pose:
            speeds = commands.speeds[r, : commands.counts[r], wheel]
            own = space.own(self._alone[r], speeds, goal)
            which = commands.which[r]
        else:
            speeds = commands.levels[r, wheel, : commands.n_levels[r, wheel]]
            own = space.own(np.zeros((len(speeds), 3)), speeds, goal)
            which = commands.level[r, wheel]
        behind = sum(len(group) for group in self.groups[r + 1 :])
        divisor = len(self.premises.action_set) ** behind
        return Blocks(own, self._shared[r], divisor, which, self._table[1], space.own_needs_pose)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        choices, batch = self._reached(joint_actions)
        r, wheel = divmod(agent, len(self.groups[0]))
        space = self.premises.space
        speeds = self.wheel_commands.speeds[r, choices[:, r], wheel]
        own = space.own(batch.robots[r].T, speeds, self.situation.goal)
        return np.concatenate([own, space.shared(batch, [r])[0]], axis=1)

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the next own variables of all agents and the shared ones of all robots.

        ``(n, m, n_own)`` and ``(M, m, d - n_own)``, for joint actions ``(m, n)``.
        """
        choices, batch = self._reached(joint_actions)
        space = self.premises.space
        by_robot = np.ascontiguousarray(choices.T)
        speeds = speeds_of(by_robot, self.wheel_commands.speeds)
        poses: FloatArray = np.zeros((0, 3))
        if space.own_needs_pose:
            of_robots = batch.robots.transpose(0, 2, 1)
            poses = np.repeat(of_robots, len(speeds) // len(of_robots), axis=0).reshape(-1, 3)
        own = space.own(poses, speeds.reshape(-1), self.situation.goal)
        return own.reshape(*speeds.shape, -1), space.shared(batch, range(choices.shape[1]))

    def poses(self, joint_actions: IntArray) -> SituationBatch:
        """Return the situations that joint actions ``(m, n)`` lead to in a decision period."""
        return self._after(self._choices(joint_actions), self.premises.hold)

    def after(self, joint_action: IntArray) -> BoxPrediction:
        """Return the prediction from where a joint action ``(n,)`` leads in a decision period."""
        batch = self.poses(joint_action[None])
        speeds = self.commands(joint_action)
        robots, box = batch.robots[:, :, 0].copy(), batch.boxes[:, 0].copy()
        reached = replace(self.situation, robots=robots, box=box, speeds=speeds)
        return BoxPrediction(reached, self.model, self.premises)

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds ``(n,)`` that a joint action ``(n,)`` would command [m/s]."""
        choices = self._choices(joint_action[None])[0]
        return self.wheel_commands.speeds[np.arange(len(choices)), choices].ravel()

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return the predicted change of the robots' twists by contact, ``(M, 3)``.

        They are means over the decision period, to be compared with measurements.
        """
        choices = self._choices(joint_action[None])
        after = self._after(choices, self.premises.hold).robots[:, :, 0]
        free = self.wheel_commands.twists[np.arange(len(after)), choices[0]]
        return mean_twists(self.situation.robots, after, self.premises.hold) - free

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return mean twists ``(k, M + 1, 3)``, the box's first, under constants ``(k, 3)``.

        They are means over the decision period, to be compared with measurements.
        """
        choices = self._choices(joint_action[None])[0]
        twists = self.wheel_commands.twists[np.arange(len(choices)), choices]
        now = self.situation
        premises = self.premises
        constants = np.ascontiguousarray(constants)
        return outcomes(now.robots, now.box, twists, premises.hold, premises.belief, constants)

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``, the robots' mean."""
        return self._rewards(self._reached(joint_actions)[1])

    def reward_table(self) -> FloatArray:
        """Return the predicted rewards ``(A ** n,)`` of all joint actions."""
        batch, row = self._table
        return self._rewards(batch)[row]

    def _rewards(self, batch: SituationBatch) -> FloatArray:
        gaps = np.ascontiguousarray(batch.gaps.T)
        contact = gaps < CONTACT_GAP
        readings = self.premises.infrared.reading(gaps)
        distance, approach, turn = progress_of(batch)
        gained = reward(self.premises.task, distance, approach, turn, contact, readings)
        return gained.mean(axis=1)
