"""Fuzzy partitions: membership functions over one state variable that sum to one.

Two shapes are available, on a line or on a circle, with any number and spacing of centers:

- *sigmoid* (Eq. 6 and Fig. 2 of the paper). With boundaries b_k halfway between neighboring centers
  and S_k(x) = 1 / (1 + exp(-c_k (x - b_k))), membership function k is the difference
  S_{k-1}(x) - S_k(x). The differences telescope, so they sum to one. All functions are active
  everywhere.
- *triangular*. Each function is one at its own center and falls linearly to zero at the
  neighboring centers. At most two functions are active at a time.

On a circle the partition repeats with the period. Sigmoids are repeated over as many periods as
their tails need to fall below 1e-11.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, inf, isfinite
from typing import Literal, get_args

import numpy as np

from ..interface.spaces import Variable
from ..numerics import FloatArray, njit

Membership = Literal["triangular", "sigmoid"]

TAIL_EXPONENT = 26.0
"""Exponent beyond which a sigmoid is cut off on a circle: exp(-26) = 5e-12."""
MAX_COPIES = 32
"""Maximum number of copies of a circle on either side. A steepness of 1 stays below it."""
MAX_EXPONENT = 37.0
"""Sigmoids fall no further than to 1 / (1 + exp(37)) = 9e-17: nothing overflows or is denormal."""


@dataclass(frozen=True)
class Partition:
    """Membership functions over one variable.

    Raises
    ------
    ValueError
        If the shape is unknown, or a number is not finite or out of range.

    Examples
    --------
    >>> low_high = Partition((0.0, 1.0), "triangular")
    >>> low_high.strengths(np.array([-1.0, 0.25, 2.0])).tolist()
    [[1.0, 0.0], [0.75, 0.25], [0.0, 1.0]]
    """

    centers: tuple[float, ...]
    """``(m,)`` increasing centers, at least two."""
    membership: Membership
    """``"triangular"`` or ``"sigmoid"``."""
    period: float = 0.0
    """Period of a circular variable, 0 for a linear one."""
    steepness: float = 8.0
    """Sigmoid slope c_k times the distance of the two centers that it separates, above 0."""

    def __post_init__(self) -> None:
        if self.membership not in get_args(Membership):
            raise ValueError(
                f"partition: membership = {self.membership!r}, allowed: "
                f"{', '.join(get_args(Membership))}"
            )
        is_finite = all(map(isfinite, self.centers))
        if len(self.centers) < 2 or not (is_finite and np.all(np.diff(self.centers) > 0.0)):
            raise ValueError(
                f"partition: centers = {self.centers}, allowed: two or more finite numbers that "
                "increase"
            )
        if not 0.0 <= self.period < inf:
            raise ValueError(f"partition: period = {self.period}, allowed: 0 or a positive number")
        if not 0.0 < self.steepness < inf:
            raise ValueError(f"partition: steepness = {self.steepness}, must be above 0 and finite")
        if self.period and self.centers[-1] - self.centers[0] >= self.period:
            raise ValueError(
                f"partition: centers {self.centers} must lie within one period of {self.period}"
            )
        if self.copies > MAX_COPIES:
            raise ValueError(
                f"partition: steepness = {self.steepness} is too flat for a circle, use at least 1"
            )

    @classmethod
    def of(
        cls,
        variable: Variable,
        membership: Membership = "triangular",
        count: int | None = None,
        steepness: float = 8.0,
    ) -> Partition:
        """Return a partition of `variable`.

        With `count`, that many centers are spread evenly over the range of the variable. Without,
        the variable's own centers are used, or five evenly spread ones if it has none.
        """
        centers = variable.centers
        if count is not None or not centers:
            ends = not variable.periodic
            even = np.linspace(variable.low, variable.high, count or 5, endpoint=ends)
            centers = tuple(map(float, even))
        period = variable.high - variable.low if variable.periodic else 0.0
        return cls(centers, membership, period, steepness)

    @property
    def size(self) -> int:
        """Number m of membership functions."""
        return len(self.centers)

    @property
    def copies(self) -> int:
        """Number of copies of the circle on either side of it, 0 on a line."""
        if not self.period:
            return 0
        if self.membership == "triangular":
            return 1
        widest = max(np.diff([*self.centers, self.centers[0] + self.period]))
        return ceil(TAIL_EXPONENT * widest / (self.steepness * self.period))

    @cached_property
    def knots(self) -> FloatArray:
        """Centers ``((1 + 2 copies) m,)``, with the copies of a circle on either side."""
        turns = np.arange(-self.copies, self.copies + 1)
        return (turns[:, None] * self.period + np.asarray(self.centers)).ravel()

    @cached_property
    def _slopes(self) -> FloatArray:
        """Slopes between neighboring knots: of sigmoids, or of triangles."""
        steepness = self.steepness if self.membership == "sigmoid" else 1.0
        return steepness / np.diff(self.knots)

    @cached_property
    def low(self) -> float:
        """Lower end of the period that is centered on the centers."""
        return 0.5 * (self.centers[0] + self.centers[-1] - self.period)

    def strengths(self, x: FloatArray) -> FloatArray:
        """Return the membership degrees ``(..., m)`` of values ``(...)``; they sum to one."""
        x = np.asarray(x, dtype=float)
        is_sigmoid = self.membership == "sigmoid"
        degrees = _degrees(
            x.ravel(), self.knots, self._slopes, self.size, self.period, self.low, is_sigmoid
        )
        return degrees.reshape(*x.shape, self.size)


@njit(cache=True)
def _degrees(
    x: FloatArray,
    knots: FloatArray,
    slopes: FloatArray,
    size: int,
    period: float,
    low: float,
    is_sigmoid: bool,
) -> FloatArray:
    """Return the membership degrees ``(m, size)`` of values ``(m,)``.

    Every degree is the difference of two neighboring levels, which fall from one to zero.
    """
    degrees = np.zeros((len(x), size))
    for i in range(len(x)):
        value = x[i]
        if period > 0.0:
            value -= period * np.floor((value - low) / period)
        level = 1.0
        for k in range(len(slopes)):
            if is_sigmoid:
                exponent = slopes[k] * (0.5 * (knots[k] + knots[k + 1]) - value)
                next_level = 1.0 / (1.0 + np.exp(min(exponent, MAX_EXPONENT)))
            else:
                next_level = min(max(slopes[k] * (value - knots[k]), 0.0), 1.0)
            # Sigmoids of unequal slope cross in their far tails; degrees are never negative.
            next_level = min(next_level, level)
            degrees[i, k % size] += level - next_level
            level = next_level
        degrees[i, len(slopes) % size] += level
    return degrees
