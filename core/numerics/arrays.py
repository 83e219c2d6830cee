"""Arrays and small functions of numbers: types, equality, angles, quadrature."""

from functools import cache
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiler import njit

FloatArray = NDArray[np.floating[Any]]
"""Array of floating-point numbers of any precision."""
IntArray = NDArray[np.integer[Any]]
"""Array of integers of any precision."""
AnyArray = NDArray[Any]
"""Array of any data type."""
BoolArray = NDArray[np.bool_]
"""Array of Booleans."""

SAME = 1e-12
"""Tolerance below which values count as equal: absolute below 1, else relative."""


def greatest(values: FloatArray, rng: np.random.Generator) -> int:
    """Return the index of the greatest value; ties within `SAME` are broken at random.

    Raises
    ------
    ArithmeticError
        If the first value is not a number, or the greatest is infinite.
    """
    listed = values.tolist()  # faster than NumPy for a few values
    top = max(listed)
    least = top - SAME * max(1.0, abs(top))
    best = [action for action, value in enumerate(listed) if value >= least]
    if not best:
        raise ArithmeticError(f"{len(listed)} action values have no maximum: not all are finite")
    return int(best[0] if len(best) == 1 else best[rng.integers(len(best))])


_TURN = 2.0 * pi
_TURN_HIGH = 6.283185243606567
"""The leading 26 bits of 2 pi: products with up to a few thousand turns are exact."""
_TURN_LOW = _TURN - _TURN_HIGH


def wrap(angle: Any) -> Any:
    """Map angles [rad] to [-pi, pi): ``(angle + pi) % (2 pi) - pi`` to the last bit, but faster."""
    shifted = angle + pi
    turns = np.floor(shifted / _TURN)
    return shifted - turns * _TURN_HIGH - turns * _TURN_LOW - pi


wrap_one = njit(cache=True)(wrap)
"""Compiled `wrap`, with equal results."""


@cache
def quadrature(n: int) -> tuple[FloatArray, FloatArray]:
    """Return n nodes and weights of Gauss-Legendre quadrature on [-1, 1]; do not modify them."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    return nodes, weights
