"""As many joint moves of the other bodies as a budget allows, spread evenly: Latin hypercubes.

What a body may do next is few distinct moves. The own body's are all tried; with each of them the
same joint moves of the other bodies: all there are if the budget allows, and then the values are
exact. Otherwise as many as it allows, drawn as a Latin hypercube (McKay, Beckman & Conover 1979):
for every body the chances of its moves are cut into as many equal strata as there are draws, and
each stratum is drawn once, in an order of its own. The mean over the draws is unbiased, and what is
a sum of effects of single bodies, given the own move, has hardly any sampling error. Where the
bodies are few the orders come from an orthogonal array (Tang 1993), so that sums of effects of two
bodies at a time have little too.

The budget is of moves of bodies predicted for a decision of the whole team, since these cost the
time: a decision takes no longer the more bodies there are, but its values rest on fewer draws. It
is dealt out evenly to the bodies; what one cannot use, for it has no more joint moves to try, goes
to the others.
"""

from __future__ import annotations

from math import isqrt
from typing import NamedTuple

import numpy as np

from ..arrays import FloatArray, IntArray
from ..hierarchy import Hierarchy
from ..protocols import MergingPrediction, Prediction
from ..rules.rule_base import RuleBase
from .evaluator import Gathering, Others, Rule
from .grouping import Grouping

LEAST = 4
"""Joint moves of the other bodies that are drawn at least."""
SPARED = 0.25
"""Share of the draws allowed that may be given up for an orthogonal array."""


class _Tried(NamedTuple):
    """What was tried last: for which group, expecting what of the others.

    All its `moves`, each with as many joint moves of the others as there are `chances`.
    """

    group: int
    shares: FloatArray
    moves: IntArray
    joint_actions: IntArray
    chances: FloatArray


class LatinHypercube(Gathering):
    """Tries all own moves, each with the same evenly drawn joint moves of the other bodies.

    Agents of one body that expect the same of the other bodies try the same joint actions, which
    the prediction is asked for twice in a row and need predict only once.

    Parameters
    ----------
    groups
        Agents by body.
    budget
        Moves of bodies predicted for a decision of the whole team, about.
    rules
        The agents' rule base.
    hierarchy
        Who is below whom: only their moves are drawn.
    n_actions
        Actions A of every agent.
    rule, others
        By what a joint action is valued, and what the agents below are expected to do; see
        `nested_agents.core.settings.Decision`.
    discount
        Of the value, where it is added to the reward.
    """

    def __init__(
        self,
        groups: tuple[tuple[int, ...], ...],
        budget: int,
        rules: RuleBase,
        hierarchy: Hierarchy,
        n_actions: int,
        rule: Rule,
        others: Others,
        discount: float,
    ) -> None:
        super().__init__(rules, hierarchy, n_actions, rule, others, discount)
        self.budget = budget
        self._grouping = grouping = Grouping(groups, hierarchy, n_actions, others)
        # Of every group, the other groups that have agents below it.
        self._below = [
            sorted({grouping.of[b] for i in group for b in hierarchy.below(i)} - {g})
            for g, group in enumerate(groups)
        ]
        self._prediction: Prediction | None = None
        self._tried: _Tried | None = None

    def values(
        self,
        agent: int,
        joint_action: IntArray,
        theta: FloatArray,
        prediction: Prediction,
        frequencies: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent`, see `Evaluator.values`."""
        if prediction is not self._prediction:
            self._begin(prediction)
        a, mine = self.n_actions, self._grouping.of[agent]
        shares = self._grouping.shares(agent, joint_action, frequencies)
        weights = shares[mine].copy()  # of the partners' actions, given each own action
        local = np.flatnonzero(weights)
        moves, which = np.unique(self._alike[mine, local], return_inverse=True)
        shares[mine] = 0.0
        tried = self._try(mine, shares, moves, rng)
        m = len(tried.chances)
        self.count(len(moves) * m)
        if self.indifferent(theta):
            return np.zeros(a)
        wanted = (np.searchsorted(tried.moves, moves)[:, None] * m + np.arange(m)).ravel()
        rewards = values = None
        if self.rule != "value":
            rewards = prediction.rewards(tried.joint_actions)[wanted]
        if self.rule != "reward":
            states = prediction.states(agent, tried.joint_actions)
            values = self.rules.values(theta, states[wanted])
        found = self.combine(rewards, values).reshape(len(moves), m)
        valued = self.gather(found, tried.chances)[which]
        return self._grouping.by_action(agent, local, weights[local], valued)

    def _begin(self, prediction: Prediction) -> None:
        """Note what comes to the same, and deal out the budget."""
        self._prediction, self._tried = prediction, None
        codes: IntArray = np.arange(self._grouping.valid.shape[1])
        self._alike = self._elsewhere = np.tile(codes, (len(self._below), 1))
        if isinstance(prediction, MergingPrediction):
            self._alike, self._elsewhere = prediction.alike, prediction.alike_elsewhere
        own, others = (
            ((alike == codes) & self._grouping.valid).sum(axis=1, dtype=float)
            for alike in (self._alike, self._elsewhere)
        )
        needs = [k * others[below].prod() for k, below in zip(own, self._below, strict=True)]
        self._allowed = dealt(np.array(needs), self.budget / len(needs))

    def _try(
        self, mine: int, shares: FloatArray, moves: IntArray, rng: np.random.Generator
    ) -> _Tried:
        """Return what is tried with the own `moves`: what was, if that will do."""
        last = self._tried
        if (
            last is not None and last.group == mine and set(moves) <= set(last.moves)
            and np.array_equal(last.shares, shares)
        ):  # fmt: skip
            return last
        chances = np.zeros_like(shares)
        np.add.at(chances, (np.arange(len(shares))[:, None], self._elsewhere), shares)
        if self.others == "max":
            possible = chances > 0.0
            chances = possible / np.maximum(possible.sum(axis=1, keepdims=True), 1)
        most = max(LEAST, int(self._allowed[mine] / len(moves)))
        drawn, weights = joint_moves(chances, most, rng)
        joint = np.tile(self._grouping.joint_actions(drawn), (len(moves), 1))
        own = self._grouping.actions[mine][moves].repeat(len(drawn), axis=0)
        joint[:, self._grouping.groups[mine]] = own
        self._tried = _Tried(mine, shares, moves, joint, weights)
        return self._tried


def dealt(needs: FloatArray, budget: float) -> FloatArray:
    """Return how much of a budget each gets: an even share, but none more than it needs.

    Examples
    --------
    >>> dealt(np.array([100.0, 1.0, 9.0]), 20.0).tolist()
    [10.0, 1.0, 9.0]
    """
    shares = np.zeros(len(needs))
    for k, i in enumerate(np.argsort(needs, kind="stable")):
        shares[i] = min(needs[i], budget / (len(needs) - k))
        budget -= shares[i]
    return shares


def joint_moves(
    chances: FloatArray, most: int, rng: np.random.Generator
) -> tuple[IntArray, FloatArray]:
    """Return joint moves ``(m, G)`` and their chances: all if no more than `most`, else drawn.

    Parameters
    ----------
    chances
        ``(G, L)`` of the moves of every body; of a body with zeros only, move 0 is taken.
    most
        How many are drawn.
    rng
        Source of randomness.
    """
    possible = chances > 0.0
    counts = possible.sum(axis=1)
    free = np.flatnonzero(counts > 1)
    drawn = counts[free].prod(dtype=float) > most
    if drawn:
        places = latin_hypercube(most, len(free), rng)
        ladder = chances[free].cumsum(axis=1)
        ladder /= ladder[:, -1:]
        found = (places[:, :, None] >= ladder[:, None, :]).sum(axis=2).T
        weights = np.full(len(found), 1.0 / len(found))
    else:
        found, weights = np.zeros((1, 0), dtype=np.int64), np.ones(1)
        for g in free:
            moves = np.flatnonzero(possible[g])
            last = np.tile(moves, len(found))[:, None]
            found = np.hstack([found.repeat(len(moves), axis=0), last])
            weights = np.outer(weights, chances[g, moves]).ravel()
        weights /= weights.sum()
    codes = np.tile(possible.argmax(axis=1), (len(found), 1))
    codes[:, free] = found
    return codes, weights


def latin_hypercube(most: int, d: int, rng: np.random.Generator) -> FloatArray:
    """Return at most `most` points ``(d, m)`` of the unit cube, one in each m-th of every side.

    If the square of a prime p >= d - 1 is not much below `most`, it is taken for m, and any two
    sides cut into p span squares that hold one point each.
    """
    p = max((q for q in range(2, isqrt(most) + 1) if all(q % f for f in range(2, q))), default=1)
    m, levels = most, np.zeros((d, 1), dtype=np.int64)
    if p >= d - 1 and p * p >= (1.0 - SPARED) * most:
        m = p * p
        row, column = np.divmod(np.arange(m), p)
        slopes = np.arange(d)[:, None]
        lines = np.where(slopes < p, row + slopes * column, column) % p
        relabelled = rng.random((d, p)).argsort(axis=1)
        levels = np.take_along_axis(relabelled, lines, axis=1)
    ranks = (levels + rng.random((d, m))).argsort(axis=1).argsort(axis=1)
    places: FloatArray = (ranks + rng.random((d, m))) / m
    return places
