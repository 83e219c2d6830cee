"""Additive (first-order) prediction: how far the box goes, as a sum of what each robot contributes.

Robots that push together do not add up from nothing: two that push a box side by side move it
hardly faster than one. So contributions are counted from a *reference* in which every robot moves
at the mean of its possible twists: a robot's contribution is by how much the box goes further when
it alone departs from the reference. Departures of several robots at once are taken to add up. That
needs one push per robot and wheel command, in place of one for every combination of them.

A superposition of ``G`` groups, of ``L`` robot-action indices at most, that share ``k`` components
has

- ``contributions`` ``(G, L, k)``: what each index of each group adds to the sum;
- ``alike`` ``(G, L)``: the first index of the group that comes to the same;
- ``states(agent, local, sums, shares)``: the next states ``(m, d)`` of an agent, given the indices
  ``(m,)`` of its own group, the contributions ``(m, k)`` of all groups added up, and the
  probabilities ``(G, L)`` of the indices of the other groups.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ....core.numerics.arrays import BoolArray, FloatArray, IntArray
from ....core.numerics.compiling import njit
from ..states.view import View
from ..world.geometry import surface
from .push import PushModel, push
from .push_lanes import MARGIN
from .situation import Premises, Situation
from .wheel_commands import WheelCommands

TOUCH = 0.02
"""Gap [m] now or in the reference below which a robot is among those that may move the box."""


class Predicted(Protocol):
    """What is taken of a `BoxPrediction`, whose members are described there."""

    @property
    def situation(self) -> Situation: ...  # noqa: D102

    @property
    def model(self) -> PushModel: ...  # noqa: D102

    @property
    def premises(self) -> Premises: ...  # noqa: D102

    @property
    def wheel_commands(self) -> WheelCommands: ...  # noqa: D102

    @property
    def alike(self) -> IntArray: ...  # noqa: D102

    def robot_of(self, agent: int) -> int: ...  # noqa: D102

    def own_block(self, agent: int) -> tuple[FloatArray, IntArray]: ...  # noqa: D102

    def seen(  # noqa: D102
        self, robots: FloatArray, box: FloatArray, gaps: FloatArray, seconds: float
    ) -> View: ...


class PushSuperposition:
    """The prediction of box pushing to first order.

    The sum is the pose of the box relative to the reference; the robot of the deciding agent
    stands where its wheel command takes it, the others where theirs do in the mean.

    Parameters
    ----------
    prediction
        What is approximated.
    """

    def __init__(self, prediction: Predicted) -> None:
        self._prediction = prediction
        commands = prediction.wheel_commands
        twists, which = commands.twists, commands.which
        n, n_commands = twists.shape[:2]
        n_indices = which.shape[1]
        self.contributions: FloatArray = np.zeros((n, n_indices, 3))
        self.alike: IntArray = prediction.alike
        self._poses: FloatArray = np.zeros((n, n_indices, 3))
        self._gaps: FloatArray = np.zeros((n, n_indices))
        every = np.arange(n)
        mean = twists[every[:, None], which].mean(axis=1)
        near = self._near(twists)
        far = np.flatnonzero(~near)
        twists = np.concatenate([twists, mean[:, None]], axis=1)
        robots, box, gaps = self._push(every, twists, np.full((1, n), n_commands))
        self._box = box[0]
        # A robot departs from the reference among those only that touch the box in it.
        touching = np.minimum(self._present_gaps(), gaps[0]) < TOUCH
        for r in np.flatnonzero(near).tolist():
            crowd = np.flatnonzero(touching | (every == r))
            column = int(np.searchsorted(crowd, r))
            choices = np.full((commands.counts[r], len(crowd)), n_commands)
            choices[:, column] = np.arange(len(choices))
            robots, box, gaps = self._push(crowd, twists, choices)
            self.contributions[r] = box[which[r]] - self._box
            self._poses[r] = robots[which[r], column]
            self._gaps[r] = gaps[which[r], column]
        # Robots that cannot reach the box do not depend on each other.
        every_command = np.tile(np.arange(n_commands)[:, None], len(far))
        robots, _, gaps = self._push(far, twists, every_command)
        for column, r in enumerate(far.tolist()):
            self._poses[r] = robots[which[r], column]
            self._gaps[r] = gaps[which[r], column]

    def _near(self, twists: FloatArray) -> BoolArray:
        """Return which robots ``(M,)`` might touch the box, were it to come as fast as they."""
        speeds = np.hypot(twists[:, :, 0], twists[:, :, 1]).max(axis=1)
        travel = self._prediction.premises.seconds * (speeds + speeds.max()) + 2.0 * MARGIN
        return self._present_gaps() <= travel

    def _present_gaps(self) -> FloatArray:
        situation, model = self._prediction.situation, self._prediction.model
        box = situation.box[None]
        return _gaps(situation.robots, box, model.edges, model.rounding, model.radii)

    def _push(
        self, robots: IntArray, twists: FloatArray, choices: IntArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        situation, model = self._prediction.situation, self._prediction.model
        found: tuple[FloatArray, FloatArray, FloatArray] = push(
            situation.robots[robots], situation.box, twists[robots], choices,
            self._prediction.premises.seconds,
            model._replace(radii=model.radii[robots], compliance=model.compliance[robots]),
        )  # fmt: skip
        return found

    def states(
        self, agent: int, local: IntArray, sums: FloatArray, shares: FloatArray
    ) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent`, see above."""
        prediction, m = self._prediction, len(local)
        r = prediction.robot_of(agent)
        box = self._box + sums
        # In memory the situations stand next to each other, as kernels want them.
        robots, gaps = np.empty((len(shares), 3, m)), np.empty((len(shares), m))
        robots[:] = np.einsum("gl,glk->gk", shares, self._poses)[:, :, None]
        robots[r] = self._poses[r, local].T
        gaps[:] = np.einsum("gl,gl->g", shares, self._gaps)[:, None]
        model = prediction.model
        gaps[r] = _gaps(robots[r].T, box, model.edges, model.rounding, np.full(m, model.radii[r]))
        own, which = prediction.own_block(agent)
        view = prediction.seen(robots.transpose(2, 0, 1), box, gaps.T, prediction.premises.seconds)
        shared = prediction.premises.space.shared_of(view, [r])[0]
        return np.concatenate([own[which[local]], shared], axis=1)


@njit(cache=True)
def _gaps(robots, boxes, edges, rounding, radii):  # type: ignore[no-untyped-def]
    """Return the gaps ``(m,)`` between poses of robots and of the box."""
    gaps = np.empty(len(robots))
    for c in range(len(robots)):
        box = boxes[c % len(boxes)]
        cos, sin = np.cos(box[2]), np.sin(box[2])
        dx, dy = robots[c, 0] - box[0], robots[c, 1] - box[1]
        near = surface(edges, rounding, cos * dx + sin * dy, cos * dy - sin * dx)
        gaps[c] = near[0] - radii[c]
    return gaps
