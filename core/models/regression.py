"""Ridge regression on sums over all experience (Hoerl and Kennard 1970)."""

import numpy as np

from ..numerics import FloatArray

INTERVAL = 100
"""Number of decisions between regressions within an episode."""


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
