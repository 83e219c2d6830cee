"""The mean value of several agents in the same situations, each thing that they share valued once.

A rule base is a sum of terms. What a term of common variables is worth to all agents is what it is
worth to one that has the sum of their consequent weights; likewise for the agents of one body and
the variables that they share. So the mean of many agents costs little more than the value of a few.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from ..rules.rule_base import RuleBase


class _Part(NamedTuple):
    """Terms whose variables the same agents share."""

    rules: RuleBase
    columns: IntArray
    """Which of the state variables these terms are of."""
    places: IntArray
    """Where their consequents stand in theta."""


class Pooled(NamedTuple):
    """The consequent weights of several agents, summed where they see the same; see `Pooling`."""

    own: FloatArray
    bodies: FloatArray
    common: FloatArray
    agents: IntArray
    firsts: IntArray


class Pooling:
    """Means of the values of agents.

    Parameters
    ----------
    rules
        The agents' rule base.
    groups
        Agents by body: their shared variables are the same.
    """

    def __init__(self, rules: RuleBase, groups: tuple[tuple[int, ...], ...]) -> None:
        self._body_of = np.array([g for g, group in enumerate(groups) for _ in group])
        kinds = [rules.shared_by(term) for term in rules.terms]
        self._own, self._bodies, self._common = (
            self._part(rules, [t for t, of in enumerate(kinds) if of == kind])
            for kind in ("agent", "body", "all")
        )

    @staticmethod
    def _part(rules: RuleBase, which: list[int]) -> _Part | None:
        from ..rules.rule_base import RuleBase

        if not which:
            return None
        begins = np.concatenate([[0], np.cumsum(rules.sizes)])
        places = np.concatenate([np.arange(begins[t], begins[t + 1]) for t in which])
        columns = sorted({j for t in which for j in rules.terms[t]})
        terms = [tuple(columns.index(j) for j in rules.terms[t]) for t in which]
        part = RuleBase([rules.partitions[j] for j in columns], terms)
        return _Part(part, np.array(columns), places)

    def pooled(self, weights: Sequence[FloatArray], agents: IntArray) -> Pooled:
        """Return the weights of some agents, summed; `weights` are those of all agents."""
        theta = np.array([weights[i] for i in agents], dtype=float)
        bodies, firsts = np.unique(self._body_of[agents], return_index=True)
        moves = (self._body_of[agents] == bodies[:, None]).astype(float)
        none = np.zeros((0, 0))
        return Pooled(
            none if self._own is None else np.ascontiguousarray(theta[:, self._own.places]),
            none if self._bodies is None else moves @ theta[:, self._bodies.places],
            none if self._common is None else theta[:, self._common.places].sum(axis=0)[None],
            agents,
            agents[firsts],
        )

    def mean(self, pooled: Pooled, states: FloatArray) -> FloatArray:
        """Return the mean value ``(m,)`` of the pooled agents in states ``(n, m, d)`` of all."""
        total = np.zeros(states.shape[1])
        for part, theta, agents in (
            (self._own, pooled.own, pooled.agents),
            (self._bodies, pooled.bodies, pooled.firsts),
            (self._common, pooled.common, pooled.firsts[:1]),
        ):
            if part is not None:
                total += part.rules.total(theta, states, agents, part.columns)
        return total / len(pooled.agents)
