"""Predictions that search for the best responses of all agents themselves, in compiled code."""

from abc import abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..interface.prediction import Exploring, Prediction
from ..numerics import FloatArray, IntArray, greatest
from ..values.rule_base import PooledWeights, RuleBase


class Search(NamedTuple):
    """Input of one search for agents that all receive each other's actions."""

    pooled: PooledWeights
    """Weights of all agents."""
    starts: IntArray
    """``(m, n)`` joint actions; the search improves the best of them."""
    value: Callable[[IntArray], FloatArray]
    """Returns the values ``(m,)`` of joint actions ``(m, n)``."""
    order: IntArray
    """``(n,)`` agents in the order of decision."""
    exploring: Exploring
    """State and probabilities of exploration."""
    rng: np.random.Generator
    """Source of randomness."""

    def initial_joint_action(self) -> IntArray:
        """Return the best ``(n,)`` of the joint actions to start from."""
        return self.starts[greatest(self.value(self.starts), self.rng)]


Responses = Callable[[Search], IntArray]
"""Returns the joint action ``(n,)`` that a search finds."""


class RespondingPrediction(Prediction):
    """A prediction with a fast search of its own for the best responses of all agents."""

    @abstractmethod
    def best_responses(self, rules: RuleBase) -> Responses | None:
        """Return a search with the same result as `BestResponse`, or None.

        It is used if all agents receive all decisions and decide body by body by the value of the
        team. It must consume the same random numbers.
        """

    def prepare_responses(self, rules: RuleBase, search: Search) -> None:
        """Begin to compile what this search calls, if that takes long; by default nothing."""
        return None
