"""Predictions of box pushing: next states and rewards of joint actions, computed on request.

The poses after a joint action come from the push predictor, at once for all robots.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ....core.interface.prediction import Assumptions, EmbodiedPrediction, Exploring
from ....core.interface.spaces import ActionSet
from ....core.numerics import FloatArray, IntArray, compile_ahead
from ....core.search.responding import RespondingPrediction, Responses, Search
from ....core.values.rule_base import RuleBase
from ..states.kernel import progress_of
from ..states.situations import SituationBatch
from ..states.state_spaces import BoxStateSpace
from ..world.reward import Task, reward
from ..world.settings import InfraredSettings
from .calibration import PushBelief, model_of, outcomes
from .models import LearnedPush, PushModel
from .poses import samples_of
from .push import push
from .responses import Outlook, respond
from .twists import mean_twists
from .wheel_commands import WheelCommands, robot_actions, speeds_of, wheel_commands_of

CONTACT_GAP_M = 0.002
"""Predicted gap below which a robot counts as touching."""


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


@dataclass(frozen=True)
class PredictionSettings:
    """Settings that all predictions of a scenario share."""

    groups: tuple[tuple[int, ...], ...]
    """Agents of each robot."""
    belief: PushBelief
    """Push models by constants."""
    space: BoxStateSpace
    """State space of the agents."""
    action_set: ActionSet
    """Actions of a wheel."""
    increments: FloatArray
    """``(n,)`` change of wheel speed by an action [m/s]."""
    limits: FloatArray
    """``(n,)`` maximum wheel speeds [m/s]."""
    task: Task
    """Task, which defines the reward."""
    infrared: InfraredSettings
    """Response of the sensors."""
    period: float
    """Decision period [s]."""
    horizon: float
    """Prediction horizon [s]."""


class BoxPrediction(EmbodiedPrediction, RespondingPrediction):
    """Prediction from one situation.

    Parameters
    ----------
    situation
        Current state.
    model
        Model of robots and box.
    settings
        Settings that all predictions of the scenario share.
    """

    def __init__(
        self, situation: PresentState, model: PushModel, settings: PredictionSettings
    ) -> None:
        self.situation = situation
        self.model = model
        self.settings = settings
        self.groups = settings.groups
        self._last: tuple[bytes, SituationBatch] | None = None  # the last request

    def assuming(self, assumptions: Assumptions) -> BoxPrediction:
        """Return the prediction for other effects, constants of the push or learned pushing."""
        situation = self.situation
        model = self.model
        settings = self.settings
        if assumptions.effects is not None:
            situation = replace(situation, effects=tuple(assumptions.effects))
        if assumptions.constants is not None:
            model = model_of(settings.belief, assumptions.constants)
        if assumptions.regressions is not None:
            learned = LearnedPush(settings.period, *assumptions.regressions)
            model = model._replace(learned=learned)
            settings = replace(settings, horizon=assumptions.decisions * settings.period)
        return BoxPrediction(situation, model, settings)

    @cached_property
    def wheel_commands(self) -> WheelCommands:
        """All commands that the wheels may receive."""
        settings = self.settings
        commands = settings.action_set.apply(
            self.situation.speeds[:, None],
            np.arange(len(settings.action_set)),
            settings.increments[:, None],
            settings.limits[:, None],
        )
        by_robot = commands.reshape(len(self.groups), -1, commands.shape[1])
        return wheel_commands_of(by_robot, np.array(self.situation.effects))

    def _after(self, actions: IntArray, seconds: float) -> SituationBatch:
        """Return the situations after robot actions ``(M, m)``."""
        now = self.situation
        twists = self.wheel_commands.twists
        robots, box, gaps = push(now.robots, now.box, twists, actions, seconds, self.model)
        return self._batch(robots, box, gaps, seconds)

    def _batch(
        self, robots: FloatArray, box: FloatArray, gaps: FloatArray, seconds: float
    ) -> SituationBatch:
        """Return the situations that the present one leads to in `seconds`."""
        now = self.situation
        periods = seconds / self.settings.period
        shape = self.model.shape
        return SituationBatch(robots, box, gaps, now.goal, now.box[:, None], periods, shape)

    def _at_horizon(self, joint_actions: IntArray) -> tuple[IntArray, SituationBatch]:
        """Return the robot actions ``(M, m)`` and the situations that they lead to."""
        actions = self._robot_actions(joint_actions)
        key = actions.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._after(actions, self.settings.horizon)
        return actions, self._last[1]

    def _robot_actions(self, joint_actions: IntArray) -> IntArray:
        return robot_actions(joint_actions, len(self.groups), len(self.settings.action_set))

    @cached_property
    def alike(self) -> IntArray:
        """The first robot action ``(M, A ** w)`` that commands the same wheel speeds."""
        return self.wheel_commands.alike

    def best_responses(self, rules: RuleBase) -> Responses | None:
        """Return best responses of all robots by one compiled call, see `responses`.

        None if a state variable or the rule base is not compiled, or there is one agent only.
        """
        space = self.settings.space
        is_compiled = space.is_built_in and rules.is_triangular
        if len(self.situation.speeds) == 1 or not is_compiled:
            return None
        return partial(self._respond, rules)

    def prepare_kernels(self) -> None:
        """Begin to compile `push`, if it is not cached."""
        now, twists = self.situation, self.wheel_commands.twists
        actions = np.zeros((len(self.groups), 1), np.int64)
        compile_ahead(push, now.robots, now.box, twists, actions, 1.0, self.model)

    def prepare_responses(self, rules: RuleBase, search: Search) -> None:
        """Begin to compile `respond`, if it is not cached."""
        if self.best_responses(rules) is not None:
            compile_ahead(respond, *self._arguments(rules, search))

    def _respond(self, rules: RuleBase, search: Search) -> IntArray:
        joint = respond(*self._arguments(rules, search))
        if not len(joint):
            raise ArithmeticError(
                "no joint action has the greatest value: not all values are numbers"
            )
        return joint

    def _arguments(
        self, rules: RuleBase, search: Search
    ) -> tuple[IntArray, IntArray, int, Outlook, Exploring, np.random.Generator]:
        """Return the arguments of `respond`."""
        now = self.situation
        settings = self.settings
        weights, agents, _, firsts = search.pooled
        outlook = Outlook(
            robots=now.robots,
            box=now.box,
            goal=now.goal,
            seconds=settings.horizon,
            periods=settings.horizon / settings.period,
            model=self.model,
            commands=self.wheel_commands,
            columns=settings.space.columns,
            values=(weights, agents, firsts, rules.terms_by_owner, rules.layout[0]),
        )
        wheels = len(self.groups[0])
        order = search.order[::wheels] // wheels
        n_actions = len(settings.action_set)
        return search.starts, order, n_actions, outlook, search.exploring, search.rng

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        actions, batch = self._at_horizon(joint_actions)
        r, wheel = divmod(agent, len(self.groups[0]))
        speeds = self.wheel_commands.speeds[r, actions[r], wheel]
        shared = self.settings.space.shared(batch, [r])[0]
        return np.concatenate([speeds[:, None], shared], axis=1)

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the next wheel speeds of all agents and the shared variables of all robots.

        ``(n, m, 1)`` and ``(M, m, d - 1)``, for joint actions ``(m, n)``.
        """
        actions, batch = self._at_horizon(joint_actions)
        speeds = speeds_of(actions, self.wheel_commands.speeds)
        return speeds[:, :, None], self.settings.space.shared(batch, range(len(actions)))

    def poses(self, joint_actions: IntArray) -> SituationBatch:
        """Return the situations that joint actions ``(m, n)`` lead to in a decision period."""
        return self._after(self._robot_actions(joint_actions), self.settings.period)

    def after(self, joint_action: IntArray) -> BoxPrediction:
        """Return the prediction from the situation after a joint action ``(n,)``."""
        batch = self.poses(joint_action[None])
        reached = replace(
            self.situation,
            robots=batch.robots[:, :, 0].copy(),
            box=batch.boxes[:, 0].copy(),
            speeds=self.commands(joint_action),
        )
        return BoxPrediction(reached, self.model, self.settings)

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds ``(n,)`` that a joint action ``(n,)`` would command [m/s]."""
        actions = self._robot_actions(joint_action[None])
        return speeds_of(actions, self.wheel_commands.speeds)[:, 0]

    def _twists(self, joint_action: IntArray) -> FloatArray:
        """Return the commanded twists ``(M, 3)`` of a joint action ``(n,)``."""
        actions = self._robot_actions(joint_action[None])[:, 0]
        return self.wheel_commands.twists[np.arange(len(actions)), actions]

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return the predicted change of the robots' mean twists by contact, ``(M, 3)``."""
        after = self.poses(joint_action[None]).robots[:, :, 0]
        moved = mean_twists(self.situation.robots, after, self.settings.period)
        return moved - self._twists(joint_action)

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return mean twists ``(k, M + 1, 3)``, the box's first, under constants ``(k, 3)``."""
        now = self.situation
        period = self.settings.period
        twists = self._twists(joint_action)
        constants = np.ascontiguousarray(constants)
        return outcomes(now.robots, now.box, twists, period, self.settings.belief, constants)

    def pose_samples(
        self, joint_action: IntArray, info: Mapping[str, FloatArray]
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return features and targets of the box's twist and of the robots' deflections."""
        before = np.vstack([self.situation.box, self.situation.robots])
        after = np.vstack([info["box_pose"], info["robot_poses"]])
        commands = self._twists(joint_action)
        return samples_of(before, after, commands, self.settings.period, self.model)

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``, the robots' mean."""
        batch = self._at_horizon(joint_actions)[1]
        gaps = np.ascontiguousarray(batch.gaps.T)
        readings = self.settings.infrared.reading(gaps)
        distance, approach, turn = progress_of(batch)
        contact = gaps < CONTACT_GAP_M
        gained = reward(self.settings.task, distance, approach, turn, contact, readings)
        return gained.mean(axis=1)
