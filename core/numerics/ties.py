"""The greatest of some values, where several may be equal."""

import numpy as np

from .arrays import FloatArray

SAME = 1e-12
"""Values that differ by less, times their size if that is above 1, are equal."""


def greatest(values: FloatArray, rng: np.random.Generator) -> int:
    """Return the index of the greatest value, ties (see `SAME`) broken at random.

    Raises
    ------
    ArithmeticError
        If the first value is not a number, or the greatest is infinite.
    """
    listed = values.tolist()  # four numbers: plain Python is faster
    top = max(listed)
    least = top - SAME * max(1.0, abs(top))
    best = [action for action, value in enumerate(listed) if value >= least]
    if not best:
        raise ArithmeticError(f"none of {len(listed)} actions is worth most: not all are numbers")
    return int(best[0] if len(best) == 1 else best[rng.integers(len(best))])
