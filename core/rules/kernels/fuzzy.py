"""Fuzzy partitions: membership functions over one state variable that sum to one everywhere.

Two shapes, on a line or on a circle, with any number of membership functions and any spacing:

- *sigmoid* (the paper's, Eq. 6 and Fig. 2): with boundaries b_k halfway between neighbouring
  centres and S_k(x) = 1 / (1 + exp(-c_k (x - b_k))), membership function k is the difference
  S_{k-1}(x) - S_k(x). The differences telescope, so their sum is one. Every function is active
  everywhere.
- *triangular*: one at its own centre, falling linearly to zero at the neighbouring centres. At
  most two functions are active at a time.

On a circle the partition repeats with the period; sigmoids reach as many periods to either side as
their tails need to fall below 1e-11. The NumPy code here is the readable definition;
`core.rules.kernels` computes the same, fast.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, isfinite
from typing import Literal, get_args

import numpy as np

from ...interface.spaces import Variable
from ...numerics import FloatArray

Membership = Literal["triangular", "sigmoid"]

TAIL = 26.0
"""Sigmoids are cut off on a circle where their exponent passes this: exp(-26) = 5e-12."""
MOST_COPIES = 32
"""Copies of the circle on either side, at most; a steepness of 1 never needs as many."""


@dataclass(frozen=True)
class Partition:
    """Membership functions over one variable.

    Raises
    ------
    ValueError
        If the shape is neither, or a number is not finite or not in its range.

    Examples
    --------
    >>> low_high = Partition((0.0, 1.0), "triangular")
    >>> low_high.strengths(np.array([-1.0, 0.25, 2.0])).tolist()
    [[1.0, 0.0], [0.75, 0.25], [0.0, 1.0]]
    """

    centres: tuple[float, ...]
    """``(m,)`` increasing centres; at least two."""
    membership: Membership
    """``"triangular"`` or ``"sigmoid"``."""
    period: float = 0.0
    """Period of a circular variable, 0 for a linear one."""
    steepness: float = 8.0
    """Sigmoid slope c_k times the distance of the two centres it separates, above 0."""

    def __post_init__(self) -> None:
        if self.membership not in get_args(Membership):
            raise ValueError(
                f"partition: membership = {self.membership!r}, allowed: "
                f"{', '.join(get_args(Membership))}"
            )
        if len(self.centres) < 2:
            raise ValueError(f"partition: centres = {self.centres}, at least two are needed")
        if not all(map(isfinite, self.centres)):
            raise ValueError(f"partition: centres = {self.centres}, all must be finite")
        if any(a >= b for a, b in zip(self.centres, self.centres[1:], strict=False)):
            raise ValueError(f"partition: centres {self.centres} must increase")
        if not 0.0 <= self.period < inf:
            raise ValueError(f"partition: period = {self.period}, allowed: 0 or a positive number")
        if not 0.0 < self.steepness < inf:
            raise ValueError(f"partition: steepness = {self.steepness}, must be above 0 and finite")
        if self.period and self.centres[-1] - self.centres[0] >= self.period:
            raise ValueError(
                f"partition: centres {self.centres} must lie within one period of {self.period}"
            )
        if self.copies > MOST_COPIES:
            raise ValueError(
                f"partition: steepness = {self.steepness} is too flat for a circle, 1 is not"
            )

    @classmethod
    def of(
        cls,
        variable: Variable,
        membership: Membership = "triangular",
        count: int | None = None,
        steepness: float = 8.0,
    ) -> Partition:
        """Lay a partition over `variable`.

        With `count` the centres are spread evenly, on a line from end to end; without, they are
        the variable's own, or five spread evenly if it has none.
        """
        period = variable.high - variable.low if variable.periodic else 0.0
        centres = variable.centres
        if count is not None or not centres:
            centres = tuple(
                float(c)
                for c in np.linspace(
                    variable.low, variable.high, count or 5, endpoint=not variable.periodic
                )
            )
        return cls(centres, membership, period, steepness)

    @property
    def size(self) -> int:
        """Number m of membership functions."""
        return len(self.centres)

    @property
    def copies(self) -> int:
        """Copies of the whole circle laid on either side of it, 0 on a line."""
        if not self.period:
            return 0
        if self.membership == "triangular":
            return 1
        widest = max(np.diff([*self.centres, self.centres[0] + self.period]))
        return ceil(TAIL * widest / (self.steepness * self.period))

    @property
    def knots(self) -> FloatArray:
        """The centres; on a circle with its copies on either side, ``((1 + 2 copies) m,)``."""
        turns = np.arange(-self.copies, self.copies + 1)
        return (turns[:, None] * self.period + np.asarray(self.centres)).ravel()

    def wrap(self, x: FloatArray) -> FloatArray:
        """Map values of a circular variable to the period that is centred on the centres."""
        if not self.period:
            return x
        low = 0.5 * (self.centres[0] + self.centres[-1] - self.period)
        return x - self.period * np.floor((x - low) / self.period)

    def strengths(self, x: FloatArray) -> FloatArray:
        """Return the firing strengths ``(..., m)`` of values ``(...)``; they sum to one."""
        x = self.wrap(np.asarray(x, dtype=float))[..., None]
        knots = self.knots
        if self.membership == "triangular":
            rising = np.clip((x - knots[:-1]) / np.diff(knots), 0.0, 1.0)
        else:
            # Past 37 S is 0 or 1 to the last bit of a strength. Left as they are, products of such
            # tails are denormal numbers, with which processors calculate many times slower.
            slope = self.steepness / np.diff(knots)
            exponent = np.clip(-slope * (x - 0.5 * (knots[:-1] + knots[1:])), -37.0, 37.0)
            rising = np.where(exponent < 37.0, 1.0 / (1.0 + np.exp(exponent)), 0.0)
            # Sigmoids of unequal slope cross in their far tails; a running minimum keeps every
            # difference non-negative without touching the sum.
            rising = np.minimum.accumulate(rising, axis=-1)
        edge = np.ones_like(x)
        levels = np.concatenate([edge, rising, 0.0 * edge], axis=-1)
        strengths = levels[..., :-1] - levels[..., 1:]
        if self.period:
            strengths = strengths.reshape(*strengths.shape[:-1], -1, self.size).sum(axis=-2)
        return strengths
