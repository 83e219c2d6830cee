"""The mean value of several agents in the same situations, each thing that they share valued once.

A rule base is a sum of terms. What a term of common variables is worth to all agents is what it is
worth to one that has the sum of their consequent weights; likewise for the agents of one body and
the variables that they share. So the mean of many agents costs little more than the value of a few.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..interface.prediction import Prediction, states_by_group
from ..numerics.arrays import FloatArray, IntArray
from ..rules.rule_base import RuleBase


class Pooled(NamedTuple):
    """The consequent weights of k agents of b bodies, summed where they see the same."""

    weights: tuple[FloatArray, FloatArray, FloatArray]
    """Of the agents ``(k, n_rules)``, of their bodies ``(b, n_rules)``, of all ``(1, n_rules)``."""
    agents: IntArray
    """``(k,)`` which agents they are."""
    bodies: IntArray
    """``(b,)`` which bodies they are."""
    firsts: IntArray
    """``(b + 1,)`` the first agent of every body among them, and k."""


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
        self._rules, self._groups = rules, groups
        self._body_of = np.array([g for g, group in enumerate(groups) for _ in group])
        sharing = [rules.shared_by(term) for term in rules.terms]
        own, body, common = (
            np.array([t for t, by in enumerate(sharing) if by == kind], dtype=np.int64)
            for kind in ("agent", "body", "all")
        )
        self._kinds = own, body, common

    def pooled(self, weights: Sequence[FloatArray], agents: IntArray) -> Pooled:
        """Return the weights of some agents in agent order; `weights` are those of all agents."""
        theta = np.array([weights[i] for i in agents], dtype=float)
        bodies, firsts = np.unique(self._body_of[agents], return_index=True)
        summed = np.add.reduceat(theta, firsts, axis=0), theta.sum(axis=0)[None]
        return Pooled((theta, *summed), agents, bodies, np.append(firsts, len(agents)))

    def mean(self, pooled: Pooled, prediction: Prediction, joint_actions: IntArray) -> FloatArray:
        """Return the mean value ``(m,)`` of the pooled agents after joint actions ``(m, n)``."""
        own, shared = states_by_group(prediction, joint_actions, self._groups, self._rules.n_own)
        if len(pooled.bodies) < len(shared):
            shared = shared[pooled.bodies]
        total = self._rules.total(
            pooled.weights, pooled.agents, pooled.firsts, self._kinds, own, shared
        )
        return total / len(pooled.agents)
