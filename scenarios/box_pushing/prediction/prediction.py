"""Predictions of box pushing: what any joint action would lead to, computed when asked for.

The poses after a joint action come from the push predictor, at once for all robots. An agent's own
block is predicted as if its robot pushed alone, so that it takes few values; in state spaces whose
own block is the wheel speed that is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ....core.arrays import FloatArray, IntArray
from ....core.protocols import Blocks
from ....core.spaces import ActionSet
from ..reward import Task, reward
from ..states.state_spaces import BoxStateSpace
from ..states.view import View, wrap
from ..world.infrared import InfraredSpec, expected_reading
from .additive import PushSuperposition
from .belief import PushBelief, outcomes
from .push import PushModel, push
from .situation import Situation
from .wheel_commands import Drives, choices_of, drives_of, motion_table


@dataclass(frozen=True)
class BoxPrediction:
    """Predicts from one situation; see `nested_agents.core.protocols.Prediction`.

    A decision stands for `hold` seconds; predictions look `seconds` ahead.
    """

    situation: Situation
    model: PushModel
    belief: PushBelief
    space: BoxStateSpace
    action_set: ActionSet
    task: Task
    hold: float
    seconds: float
    increment: float
    limits: FloatArray
    infrared: InfraredSpec

    merges: ClassVar[bool] = True
    """Whether drives of one twist are taken to lead to the same place."""

    @cached_property
    def drives(self) -> Drives:
        """What the wheels may be told."""
        speeds, n_actions = self.situation.speeds, len(self.action_set)
        commands = self.action_set.apply(
            speeds[:, None], np.arange(n_actions),
            (self.increment * self.limits)[:, None], self.limits[:, None],
        ).reshape(len(self.situation.groups), -1, n_actions)  # fmt: skip
        return drives_of(commands, np.array(self.situation.effects), self.merges)

    def _view(self, choices: IntArray) -> View:
        """Return where the robots' drives ``(m, M)`` lead."""
        return self._after(choices, self.seconds)

    def _after(self, choices: IntArray, seconds: float) -> View:
        robots, box, gaps = push(
            self.situation.robots,
            self.situation.box,
            self.drives.twists,
            choices,
            seconds,
            self.model,
        )
        return self.seen(robots, box, gaps, seconds)

    def _view_again(self, choices: IntArray) -> View:
        """Return the view of `choices`: the last one, if they are the same."""
        last = self._last
        if not (last and np.array_equal(last[0][0], choices)):
            last[:] = [(choices, self._view(choices))]
        return last[0][1]

    @cached_property
    def _last(self) -> list[tuple[IntArray, View]]:
        return []

    def seen(self, robots: FloatArray, box: FloatArray, gaps: FloatArray, seconds: float) -> View:
        """Return a view of situations that the present leads to in `seconds`."""
        goal, now = self.situation.goal, self.situation.box
        before = float(np.hypot(goal[0] - now[0], goal[1] - now[1]))
        return View(robots, box, gaps, goal, before, seconds / self.hold)

    def _choices(self, joint_actions: IntArray) -> IntArray:
        """Return the drive ``(m, M)`` of each robot in joint actions ``(m, n)``."""
        return choices_of(joint_actions, self.drives.which, len(self.action_set))

    @cached_property
    def alike(self) -> IntArray:
        """The first local code of a robot ``(M, A ** w)`` that gives the same wheel speeds."""
        return first_alike(self.drives.which)

    @cached_property
    def alike_elsewhere(self) -> IntArray:
        """The first local code of a robot ``(M, A ** w)`` that gives the same motion."""
        drives = self.drives
        return first_alike(np.take_along_axis(drives.motions, drives.which, axis=1))

    @cached_property
    def _table(self) -> tuple[View, IntArray]:
        """Where all combinations of motions lead, and the row of every joint-action code."""
        choices, row = motion_table(self.drives)
        return self._view(choices), row

    @cached_property
    def _alone(self) -> list[FloatArray]:
        """Per robot ``(K, 3)``: its pose after every drive if it pushed alone."""
        poses = []
        for r, count in enumerate(self.drives.counts):
            model = self.model._replace(
                radii=self.model.radii[r : r + 1], compliance=self.model.compliance[r : r + 1]
            )
            robots, _, _ = push(
                self.situation.robots[r : r + 1], self.situation.box,
                self.drives.twists[r : r + 1], np.arange(count)[:, None], self.seconds, model,
            )  # fmt: skip
            poses.append(robots[:, 0])
        return poses

    @cached_property
    def _shared(self) -> list[FloatArray]:
        """The shared block ``(m, d - n_own)`` of every robot in the situations of the table."""
        return self.space.shared_of(self._table[0], range(len(self.situation.groups)))

    def robot_of(self, agent: int) -> int:
        """Return the robot of an agent."""
        return self._places[agent][0]

    @cached_property
    def _places(self) -> list[tuple[int, int]]:
        """Robot of every agent, and which of its wheels the agent drives."""
        groups = self.situation.groups
        return [(r, wheel) for r, group in enumerate(groups) for wheel in range(len(group))]

    @cached_property
    def _own(self) -> dict[int, tuple[FloatArray, IntArray]]:
        return {}

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of `agent` for all joint actions, own block as if alone."""
        r, _ = self._places[agent]
        row = self._table[1]
        own, which = self.own_block(agent)
        behind = sum(len(group) for group in self.situation.groups[r + 1 :])
        divisor, alone = len(self.action_set) ** behind, self.space.own_needs_pose
        return Blocks(own, self._shared[r], divisor, which, row, alone)

    def own_block(self, agent: int) -> tuple[FloatArray, IntArray]:
        """Return the own variables that occur, as if alone, and which each local code leads to."""
        if agent not in self._own:
            (r, wheel), drives, goal = self._places[agent], self.drives, self.situation.goal
            if self.space.own_needs_pose:
                speeds = drives.speeds[r, : drives.counts[r], wheel]
                self._own[agent] = self.space.own(self._alone[r], speeds, goal), drives.which[r]
            else:
                speeds = drives.levels[r, wheel, : drives.n_levels[r, wheel]]
                own = self.space.own(np.zeros((len(speeds), 3)), speeds, goal)
                self._own[agent] = own, drives.level[r, wheel]
        return self._own[agent]

    @cached_property
    def superposition(self) -> PushSuperposition:
        """The prediction to first order in what each robot does."""
        return PushSuperposition(self)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        r, wheel = self._places[agent]
        choices = self._choices(joint_actions)
        view = self._view_again(choices)
        speeds = self.drives.speeds[r, choices[:, r], wheel]
        own = self.space.own(view.robots[:, r], speeds, self.situation.goal)
        return np.concatenate([own, self.space.shared_of(view, [r])[0]], axis=1)

    def poses(self, joint_actions: IntArray) -> View:
        """Return the situations that joint actions ``(m, n)`` lead to in a decision period."""
        return self._after(self._choices(joint_actions), self.hold)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Agents by robot."""
        return self.situation.groups

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds ``(n,)`` that a joint action ``(n,)`` would command [m/s]."""
        choices = self._choices(joint_action[None])[0]
        return self.drives.speeds[np.arange(len(choices)), choices].ravel()

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact is predicted to change the robots' twists, ``(M, 3)``.

        Over the decision period, to be held against what is measured in it.
        """
        choices = self._choices(joint_action[None])
        after = self._after(choices, self.hold).robots[0]
        free = self.drives.twists[np.arange(len(after)), choices[0]]
        return mean_twists(self.situation.robots, after, self.hold) - free

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return mean twists ``(k, M + 1, 3)``, the box's first, under constants ``(k, 3)``.

        Over the decision period, to be held against what is measured in it.
        """
        choices = self._choices(joint_action[None])[0]
        twists = self.drives.twists[np.arange(len(choices)), choices]
        found: FloatArray = outcomes(
            self.situation.robots, self.situation.box, twists, self.hold, self.belief, constants
        )
        return found

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``."""
        return self._rewards(self._view_again(self._choices(joint_actions)))

    def reward_table(self) -> FloatArray:
        """Return the predicted rewards ``(A ** n,)`` of all joint actions."""
        view, row = self._table
        return self._rewards(view)[row]

    def _rewards(self, view: View) -> FloatArray:
        return reward(
            self.task,
            view.distance,
            -view.approach,
            view.turn,
            view.gaps < CONTACT_GAP,
            expected_reading(view.gaps, self.infrared),
        )


def first_alike(keys: IntArray) -> IntArray:
    """Return in every row of ``(M, L)`` the first column that holds the same."""
    return (keys[:, :, None] == keys[:, None, :]).argmax(axis=2)


def mean_twists(before: FloatArray, after: FloatArray, seconds: float) -> FloatArray:
    """Return the constant twists ``(M, 3)``, own frame, between poses ``(M, 3)``."""
    turn = wrap(after[:, 2] - before[:, 2])
    heading = before[:, 2] + 0.5 * turn
    # The chord of an arc is shorter than the arc by the sinc of half its angle.
    chord = (after[:, :2] - before[:, :2]) / np.sinc(0.5 * turn / np.pi)[:, None]
    cos, sin = np.cos(heading), np.sin(heading)
    ahead = cos * chord[:, 0] + sin * chord[:, 1]
    left = cos * chord[:, 1] - sin * chord[:, 0]
    return np.stack([ahead, left, turn], axis=1) / seconds


CONTACT_GAP = 0.002
"""Predicted gap [m] below which a robot counts as touching."""
