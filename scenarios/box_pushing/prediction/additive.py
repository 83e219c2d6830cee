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

from collections.abc import Callable

import numpy as np

from ....core.numerics.arrays import BoolArray, FloatArray, IntArray
from ..world.geometry import gaps as gaps_of
from .push import PushModel, push
from .push_lanes import MARGIN
from .situation import Premises, Situation
from .wheel_commands import WheelCommands

TOUCH = 0.02
"""Gap [m] now or in the reference below which a robot is among those that may move the box."""


class PushSuperposition:
    """The prediction of box pushing to first order.

    The sum is the pose of the box relative to the reference; the robot of the deciding agent
    stands where its wheel command takes it, the others where theirs do in the mean.

    Parameters
    ----------
    situation, model, premises, commands, alike, own_block
        Of the `BoxPrediction` that is approximated.
    """

    def __init__(
        self,
        situation: Situation,
        model: PushModel,
        premises: Premises,
        commands: WheelCommands,
        alike: IntArray,
        own_block: Callable[[int], tuple[FloatArray, IntArray]],
    ) -> None:
        self._situation, self._model, self._premises = situation, model, premises
        self._own_block = own_block
        twists, which = commands.twists, commands.which
        n, n_commands = twists.shape[:2]
        n_indices = which.shape[1]
        self.contributions: FloatArray = np.zeros((n, n_indices, 3))
        self.alike = alike
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
        travel = self._premises.seconds * (speeds + speeds.max()) + 2.0 * MARGIN
        return self._present_gaps() <= travel

    def _present_gaps(self) -> FloatArray:
        situation, model = self._situation, self._model
        box = situation.box[None]
        return gaps_of(situation.robots, box, model.edges, model.rounding, model.radii)

    def _push(
        self, robots: IntArray, twists: FloatArray, choices: IntArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        situation, model = self._situation, self._model
        found: tuple[FloatArray, FloatArray, FloatArray] = push(
            situation.robots[robots], situation.box, twists[robots], choices,
            self._premises.seconds,
            model._replace(radii=model.radii[robots], compliance=model.compliance[robots]),
        )  # fmt: skip
        return found

    def states(
        self, agent: int, local: IntArray, sums: FloatArray, shares: FloatArray
    ) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent`, see above."""
        model, premises, m = self._model, self._premises, len(local)
        r = self._situation.places[agent][0]
        box = self._box + sums
        # In memory the situations stand next to each other, as kernels want them.
        robots, gaps = np.empty((len(shares), 3, m)), np.empty((len(shares), m))
        robots[:] = np.einsum("gl,glk->gk", shares, self._poses)[:, :, None]
        robots[r] = self._poses[r, local].T
        gaps[:] = np.einsum("gl,gl->g", shares, self._gaps)[:, None]
        gaps[r] = gaps_of(robots[r].T, box, model.edges, model.rounding, np.full(m, model.radii[r]))
        own, which = self._own_block(agent)
        view = premises.seen(
            self._situation, robots.transpose(2, 0, 1), box, gaps.T, premises.seconds
        )
        shared = premises.space.shared_of(view, [r])[0]
        return np.concatenate([own[which[local]], shared], axis=1)
