"""Individual errors of agents, which cause disagreement.

Errors are drawn once, from the seed of the trial, and stay constant::

    theta_i = theta + s * std(theta) * E_i

The standard deviation is over the consequent weights of one agent or role. E_i are standard normal
numbers of agent i.
"""

from __future__ import annotations

import numpy as np

from ..numerics import FloatArray, IntArray, stream_of
from ..plugins.settings import NonNegative, Settings

STREAM = 2**32 - 5
"""Spawn key of the random stream of errors, below the seed of the team."""


class ErrorSettings(Settings):
    """Individual errors of agents: the ``[learner.decision.errors]`` table of a spec."""

    weights: NonNegative = 0.0
    """Standard deviation of errors of weights, relative to that of the agent's weights."""


class Errors:
    """Constant errors of every agent.

    Parameters
    ----------
    settings
        Standard deviations.
    concerned
        By agent, ``(k,)`` the agents whose values it averages.
    rows
        By agent, the row of its weights; None if unknown.
    n_rules
        Number of rules of the rule base.
    seed
        Seed of the team.

    Examples
    --------
    >>> seed = np.random.SeedSequence(1)
    >>> errors = Errors(ErrorSettings(weights=0.5), [np.array([0])], [0], 2, seed)
    >>> theta = np.array([[1.0, 3.0]])
    >>> drawn = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(STREAM, 0)))
    >>> expected = theta + 0.5 * 1.0 * drawn.standard_normal((1, 2))
    >>> bool(np.array_equal(errors.weights(0, theta), expected))
    True
    """

    def __init__(
        self,
        settings: ErrorSettings,
        concerned: list[IntArray],
        rows: list[int | None],
        n_rules: int,
        seed: np.random.SeedSequence,
    ) -> None:
        self._settings = settings
        self._rows: list[IntArray] = []
        self._weights: list[FloatArray] = []
        for agent, averaged in enumerate(concerned):
            rng = stream_of(seed, STREAM, agent)
            known = {row for other in averaged.tolist() if (row := rows[other]) is not None}
            self._rows.append(np.array(sorted(known), dtype=np.int64))
            size = len(known) if settings.weights else 0
            self._weights.append(rng.standard_normal((size, n_rules)))

    def weights(self, agent: int, theta: FloatArray) -> FloatArray:
        """Return the weights `theta` ``(n_rows, n_rules)`` with the errors of an agent."""
        if not self._settings.weights:
            return theta
        rows = self._rows[agent]
        scale = self._settings.weights * theta[rows].std(axis=1, keepdims=True)
        taken = theta.copy()
        taken[rows] += scale * self._weights[agent]
        return taken
