"""Predictions of box pushing: what any joint action would lead to, computed when asked for.

The poses after a joint action come from the push predictor, at once for all robots. An agent's own
block is predicted as if its robot pushed alone, so that it takes few values; in state spaces whose
own block is the wheel speed that is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.arrays import FloatArray, IntArray
from ..core.protocols import Blocks
from ..core.spaces import ActionSet
from .config import RewardSettings
from .infrared import expected_reading
from .push import PushModel, push
from .reward import reward
from .state_spaces import BoxStateSpace, View, wrap
from .superposition import PushSuperposition


@dataclass(frozen=True)
class Situation:
    """The present, as far as prediction needs it.

    Attributes
    ----------
    robots, box, goal
        Poses ``(M, 3)``, ``(3,)``, ``(3,)``.
    speeds
        ``(n,)`` commanded wheel speeds [m/s].
    effects
        Per robot ``(3, w + 1)``: twist in its frame = effect @ [wheel speeds, 1].
    groups
        Agents of each robot.
    """

    robots: FloatArray
    box: FloatArray
    goal: FloatArray
    speeds: FloatArray
    effects: tuple[FloatArray, ...]
    groups: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class BoxPrediction:
    """Predicts from one situation; see `nested_agents.core.protocols.Prediction`.

    A decision stands for `hold` seconds; predictions look `seconds` ahead.
    """

    situation: Situation
    model: PushModel
    space: BoxStateSpace
    action_set: ActionSet
    rewards_of: RewardSettings
    hold: float
    seconds: float
    increment: float
    limits: FloatArray

    @cached_property
    def _drives(self) -> list[tuple[FloatArray, IntArray]]:
        """Per robot the distinct wheel speeds ``(K, w)``, and which of them each local code gives.

        Several actions often command one speed (a resting wheel is maintained or zeroed, one at
        its limit is maintained or increased), so that K is far below ``A ** w``.
        """
        everything = np.arange(len(self.action_set))
        per_robot: list[tuple[FloatArray, IntArray]] = []
        for group in self.situation.groups:
            drives, which = np.zeros((1, 0)), np.zeros(1, dtype=np.int64)
            for agent in group:
                wanted = self.action_set.apply(
                    self.situation.speeds[agent], everything,
                    self.increment * self.limits[agent], self.limits[agent],
                ).tolist()  # fmt: skip
                distinct = sorted(set(wanted))
                number = np.array([distinct.index(speed) for speed in wanted])
                column = np.tile(distinct, len(drives))[:, None]
                drives = np.hstack([np.repeat(drives, len(distinct), axis=0), column])
                which = (which[:, None] * len(distinct) + number).ravel()
            per_robot.append((drives, which))
        return per_robot

    @cached_property
    def _twists(self) -> FloatArray:
        """``(M, K, 3)`` twists of every drive, padded to the robot with most."""
        twists = np.zeros((len(self._drives), max(len(drives) for drives, _ in self._drives), 3))
        for r, ((drives, _), effect) in enumerate(
            zip(self._drives, self.situation.effects, strict=True)
        ):
            twists[r, : len(drives)] = drives @ effect[:, :-1].T + effect[:, -1]
        return twists

    @cached_property
    def _motions(self) -> list[tuple[IntArray, IntArray]]:
        """Per robot drives of distinct twists, and which of these twists each drive has.

        The wheels on one side of a skid-steer do the same to its motion: whichever of them is the
        faster, the robot moves alike.
        """
        per_robot = []
        for r, (drives, _) in enumerate(self._drives):
            found: dict[tuple[float, ...], int] = {}
            keys = np.rint(self._twists[r, : len(drives)] / SAME_TWIST).tolist()
            which = [found.setdefault(tuple(key), len(found)) for key in keys]
            first = np.array([which.index(motion) for motion in range(len(found))])
            per_robot.append((first, np.array(which)))
        return per_robot

    def _view(self, choices: IntArray) -> View:
        """Return where the robots' drives ``(m, M)`` lead."""
        return self._after(choices, self.seconds)

    def _after(self, choices: IntArray, seconds: float) -> View:
        robots, box, gaps = push(
            self.situation.robots, self.situation.box, self._twists, choices, seconds, self.model
        )
        return View(robots, box, gaps, self.situation.goal)

    def _choices(self, joint_actions: IntArray) -> IntArray:
        """Return the drive ``(m, M)`` of each robot in joint actions ``(m, n)``."""
        a = len(self.action_set)
        choices = np.empty((len(joint_actions), len(self.situation.groups)), dtype=np.int64)
        for r, group in enumerate(self.situation.groups):
            places = a ** np.arange(len(group) - 1, -1, -1)
            choices[:, r] = self._drives[r][1][joint_actions[:, list(group)] @ places]
        return choices

    @cached_property
    def _table(self) -> tuple[View, IntArray]:
        """Where all combinations of motions lead, and the row of every joint-action code."""
        shape = tuple(len(first) for first, _ in self._motions)
        motions = np.indices(shape).reshape(len(shape), -1)
        choices = np.empty((motions.shape[1], len(shape)), dtype=np.int64)
        row = np.zeros(1, dtype=np.int64)
        for r, (first, motion) in enumerate(self._motions):
            choices[:, r] = first[motions[r]]
            row = (row[:, None] * shape[r] + motion[self._drives[r][1]]).ravel()
        return self._view(choices), row

    @cached_property
    def _alone(self) -> list[FloatArray]:
        """Per robot ``(K, 3)``: its pose after every drive if it pushed alone."""
        poses = []
        for r, (drives, _) in enumerate(self._drives):
            model = self.model._replace(
                radii=self.model.radii[r : r + 1], compliance=self.model.compliance[r : r + 1]
            )
            robots, _, _ = push(
                self.situation.robots[r : r + 1], self.situation.box,
                self._twists[r : r + 1], np.arange(len(drives))[:, None], self.seconds, model,
            )  # fmt: skip
            poses.append(robots[:, 0])
        return poses

    @cached_property
    def _shared(self) -> dict[int, FloatArray]:
        return {}

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
        view, row = self._table
        if r not in self._shared:
            self._shared[r] = self.space.shared(view, r)
        own, which = self.own_block(agent)
        behind = sum(len(group) for group in self.situation.groups[r + 1 :])
        return Blocks(own, self._shared[r], len(self.action_set) ** behind, which, row)

    def own_block(self, agent: int) -> tuple[FloatArray, IntArray]:
        """Return the own variables by drive, as if alone, and the drive of every local code."""
        if agent not in self._own:
            r, wheel = self._places[agent]
            drives, which = self._drives[r]
            poses = self._alone[r] if self.space.own_needs_pose else np.zeros((len(drives), 3))
            own = self.space.own(poses, drives[:, wheel], self.situation.goal)
            self._own[agent] = own, which
        return self._own[agent]

    @cached_property
    def superposition(self) -> PushSuperposition:
        """The prediction to first order in what each robot does."""
        return PushSuperposition(self, self._twists, [which for _, which in self._drives])

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        r, wheel = self._places[agent]
        choices = self._choices(joint_actions)
        view = self._view(choices)
        speeds = self._drives[r][0][choices[:, r], wheel]
        own = self.space.own(view.robots[:, r], speeds, self.situation.goal)
        return np.concatenate([own, self.space.shared(view, r)], axis=1)

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
        return np.concatenate(
            [drives[c] for (drives, _), c in zip(self._drives, choices, strict=True)]
        )

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact is predicted to change the robots' twists, ``(M, 3)``.

        Over the decision period, to be held against what is measured in it.
        """
        choices = self._choices(joint_action[None])
        after = self._after(choices, self.hold).robots[0]
        free = self._twists[np.arange(len(after)), choices[0]]
        return mean_twists(self.situation.robots, after, self.hold) - free

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``."""
        return self._rewards(self._view(self._choices(joint_actions)))

    def reward_table(self) -> FloatArray:
        """Return the predicted rewards ``(A ** n,)`` of all joint actions."""
        view, row = self._table
        return self._rewards(view)[row]

    def _rewards(self, view: View) -> FloatArray:
        goal, before = self.situation.goal, self.situation.box
        distance = np.hypot(goal[0] - view.box[:, 0], goal[1] - view.box[:, 1])
        return reward(
            self.rewards_of,
            distance,
            distance - np.hypot(goal[0] - before[0], goal[1] - before[1]),
            wrap(view.box[:, 2] - goal[2]),
            view.gaps < CONTACT_GAP,
            expected_reading(view.gaps),
        )


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


SAME_TWIST = 1e-11
"""Twists [m/s, rad/s] that differ by less lead to the same place."""

CONTACT_GAP = 0.002
"""Predicted gap [m] below which a robot counts as touching."""
