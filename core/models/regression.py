"""Models that learn by ridge regression on sums over all experience (Hoerl and Kennard 1970)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..numerics import FloatArray
from .adaptive import Adaptive, P

INTERVAL = 100
"""Number of decisions between regressions within an episode."""


class RegressionModel(Adaptive[P]):
    """A model that keeps sums over all experience, so that memory and time do not grow."""

    memory: dict[str, FloatArray]
    """Sums over all experience, and the weights computed from them."""

    def state_dict(self) -> dict[str, FloatArray]:
        """Return sums over all experience, and the weights computed from them."""
        return self.memory

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.memory = {name: np.array(state[name]) for name in self.memory}


def solve_ridge(gram: FloatArray, moment: FloatArray, ridge: float) -> FloatArray:
    """Return the weights ``(f, t)`` of a ridge regression.

    Parameters
    ----------
    gram, moment
        Sums over all samples: ``features.T @ features`` ``(f, f)`` and ``features.T @ targets``
        ``(f, t)``.
    ridge
        Penalty on squared weights, relative to squared errors.

    Examples
    --------
    >>> solve_ridge(np.array([[3.0]]), np.array([[2.0]]), 1.0).tolist()
    [[0.5]]
    """
    from scipy.linalg import cho_factor, cho_solve

    regular = gram + ridge * np.eye(len(gram))
    weights: FloatArray = cho_solve(
        cho_factor(regular, overwrite_a=True, check_finite=False), moment
    )
    return weights
