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
"""Array of whole numbers of any precision."""
AnyArray = NDArray[Any]
"""Array of anything."""
BoolArray = NDArray[np.bool_]
"""Mask."""

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


_TURN = 2.0 * pi
_TURN_HIGH = 6.283185243606567
"""The leading 26 bits of a turn: products with a few thousand turns are exact."""
_TURN_LOW = _TURN - _TURN_HIGH


def wrap(angle: Any) -> Any:
    """Map angles [rad] to [-pi, pi): ``(angle + pi) % (2 pi) - pi`` to the last bit, but faster."""
    shifted = angle + pi
    turns = np.floor(shifted / _TURN)
    return shifted - turns * _TURN_HIGH - turns * _TURN_LOW - pi


wrap_one = njit(cache=True)(wrap)
"""The same for kernels, in the same bits."""


@njit(cache=True)
def wrap_each(angles: FloatArray) -> FloatArray:
    """Return `wrap` of angles ``(k,)`` in the same bits, of few in a fifth of the time."""
    out = np.empty(len(angles))
    for k in range(len(angles)):
        out[k] = wrap_one(angles[k])
    return out


@cache
def quadrature(n: int) -> tuple[FloatArray, FloatArray]:
    """Return the n nodes and weights of Gauss and Legendre on [-1, 1]; not to be modified."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    return nodes, weights
