"""Coordinates of states under a kernel, by a dictionary of those that differ from all before.

The kernel sums over all sets of variables, see `nested_agents.core.learners.anova`::

    k(s, t) = (prod_j (1 + rho w_j(s)'w_j(t)) - 1) / rho

A state enters the dictionary if the states in it leave more than a tolerated share of its variance
k(s, s) unexplained (Engel, Mannor and Meir 2004, Eq. 2.7). The coordinates z of all states are the
rows of a Cholesky factorisation that stops at the dictionary: z(s)'z(t) = k(s, t) wherever s or t
is in it. Coordinates do not change when the dictionary grows, they only become more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..numerics.compiling import njit


class Dictionary:
    """Coordinates of all states that were added, in their order.

    States are taken in one by one: the same states have the same coordinates, to the last bit,
    however they are divided among calls.

    Parameters
    ----------
    sizes
        Membership functions of each variable.
    rho
        What one more variable in an interaction costs.
    tolerance
        Share of its variance that may be left unexplained of a state outside the dictionary.
    most
        States in the dictionary at most.

    Examples
    --------
    One variable with LOW and HIGH: the third state lies between the other two.

    >>> held = Dictionary([2], 0.1, 0.01, 10)
    >>> held.add(np.array([[1.0, 0.0], [0.0, 1.0], [0.25, 0.75]]))
    >>> held.members.tolist(), held.coordinates.round(12).tolist()
    ([0, 1], [[1.0, 0.0], [0.0, 1.0], [0.25, 0.75]])
    """

    def __init__(self, sizes: Sequence[int], rho: float, tolerance: float, most: int) -> None:
        self.rho, self.tolerance, self.most = rho, tolerance, most
        self.n_states = 0
        self._bounds = np.concatenate([[0], np.cumsum(sizes)])
        self._size = 0
        self._members = np.zeros(most, np.int64)
        self._degrees: FloatArray = np.zeros((0, int(self._bounds[-1])))
        self._coordinates: FloatArray = np.zeros((0, 0))

    @property
    def members(self) -> IntArray:
        """Which of the states ``(m,)`` are in the dictionary."""
        return self._members[: self._size]

    @property
    def coordinates(self) -> FloatArray:
        """The coordinates z ``(N, m)`` of all states."""
        return self._coordinates[: self.n_states, : self._size]

    @property
    def factor(self) -> FloatArray:
        """Lower triangular L ``(m, m)``, LL' being the kernel matrix of the dictionary."""
        return self._coordinates[self.members, : self._size]

    def add(self, degrees: FloatArray) -> None:
        """Take in states by their membership degrees ``(n, sum of sizes)``."""
        for at in range(len(degrees)):
            self._make_room()
            self._degrees[self.n_states] = degrees[at]
            self._size = _add(
                self._degrees, self._coordinates, self._members, self.n_states, self._size,
                self.rho, self.tolerance, self._bounds,
            )  # fmt: skip
            self.n_states += 1

    def _make_room(self) -> None:
        """Double the rows, or the columns, if they are full."""
        rows, columns = self._coordinates.shape
        if self.n_states == rows or (self._size == columns < self.most):
            rows = max(64, 2 * rows) if self.n_states == rows else rows
            columns = min(self.most, max(64, 2 * columns)) if self._size == columns else columns
            self._coordinates = _enlarged(self._coordinates, rows, columns)
            self._degrees = _enlarged(self._degrees, rows, self._degrees.shape[1])


def _enlarged(array: FloatArray, rows: int, columns: int) -> FloatArray:
    larger = np.zeros((rows, columns))
    larger[: array.shape[0], : array.shape[1]] = array
    return larger


@njit(cache=True)
def kernel(a: FloatArray, b: FloatArray, rho: float, bounds: IntArray) -> float:
    """Return k of two states by their membership degrees ``(sum of sizes,)``."""
    product = 1.0
    for j in range(len(bounds) - 1):
        alike = 0.0
        for c in range(bounds[j], bounds[j + 1]):
            alike += a[c] * b[c]
        product *= 1.0 + rho * alike
    return (product - 1.0) / rho


@njit(cache=True, fastmath={"contract", "reassoc"})
def _dot(a: FloatArray, b: FloatArray) -> float:
    total = 0.0
    for c in range(len(a)):
        total += a[c] * b[c]
    return total


@njit(cache=True)
def _add(  # type: ignore[no-untyped-def]
    degrees, z, members, s: int, size: int, rho: float, tolerance: float, bounds: IntArray
) -> int:
    """Find z of state s; enter it if need be, which gives all before it one coordinate more."""
    variance = kernel(degrees[s], degrees[s], rho, bounds)
    rest = variance
    for m in range(size):
        t = members[m]
        value = kernel(degrees[s], degrees[t], rho, bounds) - _dot(z[s, :m], z[t, :m])
        z[s, m] = value / z[t, m]
        rest -= z[s, m] * z[s, m]
    if size == len(members) or rest <= tolerance * variance:
        return size
    z[s, size] = np.sqrt(rest)
    for r in range(s):
        value = kernel(degrees[r], degrees[s], rho, bounds) - _dot(z[r, :size], z[s, :size])
        z[r, size] = value / z[s, size]
    for m in range(size):
        z[members[m], size] = 0.0  # by construction, but for rounding
    members[size] = s
    return size + 1
