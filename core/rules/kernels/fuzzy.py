"""Fuzzy partitions: membership functions over one state variable that sum to one everywhere.

Two shapes, on a line or on a circle, with any number of membership functions and any spacing:

- *sigmoid* (the paper's, Eq. 6 and Fig. 2): with boundaries b_k halfway between neighbouring
  centres and S_k(x) = 1 / (1 + exp(-c_k (x - b_k))), membership function k is the difference
  S_{k-1}(x) - S_k(x). The differences telescope, so their sum is one. Every function is active
  everywhere.
- *triangular*: one at its own centre, falling linearly to zero at the neighbouring centres. At
  most two functions are active at a time.

On a circle the partition repeats with the period; sigmoids reach as many periods to either side as
their tails need to fall below 1e-11. The NumPy code here is the readable definition, and the oracle
of the tests. `core.rules.kernels` computes the same: 256 values in a 13th of the time by rules over
single variables, in a 60th by 5^7 rules.

The kernels read the partitions and terms of a rule base from a `Layout` of arrays. Within a term
the own variables lead, so that its slice of theta is a matrix (own rules, shared rules). Python
hands a layout to a kernel *packed* into two arrays: passing one array to compiled code costs a
tenth of a microsecond, passing all of them more than many a kernel does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from ...interface.spaces import Variable
from ...numerics import FloatArray, IntArray, njit

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
        low = variable.low
        high = variable.high
        centres = variable.centres
        period = high - low if variable.periodic else 0.0
        if count is not None or not centres:
            even = np.linspace(low, high, count or 5, endpoint=not variable.periodic)
            centres = tuple(map(float, even))
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


class Layout(NamedTuple):
    """Partitions and terms of a rule base as arrays; ``t`` terms, ``d`` variables."""

    sigmoid: bool
    counts: IntArray  # (d,) membership functions
    knots: FloatArray  # (d, k) centres, on a circle with copies on either side
    n_knots: IntArray  # (d,)
    bounds: FloatArray  # (d, k) midpoints between knots
    slopes: FloatArray  # (d, k) sigmoid slopes
    series: FloatArray  # (d, k) exponentials at one point over the first, 0 if slopes are unequal
    periods: FloatArray  # (d,) 0 for linear variables
    lows: FloatArray  # (d,) lower end of the period in use
    terms: IntArray  # (t, d) variables of each term, padded with -1
    lengths: IntArray  # (t,) variables in each term
    own_lengths: IntArray  # (t,) own variables in each term
    own_sizes: IntArray  # (t,) own rules: rows of the term's matrix
    shared_sizes: IntArray  # (t,) shared rules: columns of the term's matrix
    row_lengths: IntArray  # (t,) leading variables that tell the rows of traces apart
    row_sizes: IntArray  # (t,) rows of traces
    part_lengths: IntArray  # (t,) leading variables that tell the parts of all rows apart
    part_sizes: IntArray  # (t,) parts of every row
    offsets: IntArray  # (t + 1,) start of each term in theta
    n_active: int  # active rules under compact support
    n_own: int  # own variables


Packed: TypeAlias = tuple[IntArray, FloatArray]
"""A layout in two arrays, see `unpack`; a plain tuple, for one with names takes longer to pass."""

BlockTables: TypeAlias = tuple[FloatArray, IntArray, FloatArray, IntArray, int]
"""Own blocks and their rows, shared blocks and theirs, and the divisor, as in `Blocks`."""


def layout(partitions: Sequence[Partition], terms: Sequence[tuple[int, ...]], n_own: int) -> Packed:
    """Pack partitions and terms for the kernels."""
    d = len(partitions)
    t = len(terms)
    knots = [p.knots for p in partitions]
    widest = (max(map(len, knots)) + 7) // 8 * 8  # whole vectors
    counts = np.array([p.size for p in partitions])
    own = [[j for j in term if j < n_own] for term in terms]
    own_sizes = np.array([int(np.prod(counts[o])) for o in own])
    sizes = np.array([int(np.prod(counts[list(term)])) for term in terms])
    # Rows of traces: long ones where all rules are active, by parts, else those of own variables.
    sigmoid = partitions[0].membership == "sigmoid"
    rows = [list(term[:-3]) if sigmoid else o for term, o in zip(terms, own, strict=True)]
    parts = [
        term[len(row) : max(len(row), len(term) - 2)] if sigmoid else ()
        for row, term in zip(rows, terms, strict=True)
    ]
    # In the order in which `unpack` takes them.
    whole = [
        [int(sigmoid), d, t, widest, sum(2 ** len(term) for term in terms), n_own],
        counts,
        [len(k) for k in knots],
        [len(term) for term in terms],
        [len(o) for o in own],
        own_sizes,
        sizes // own_sizes,
        [len(row) for row in rows],
        [int(np.prod(counts[row])) for row in rows],
        [len(row) + len(part) for row, part in zip(rows, parts, strict=True)],
        [int(np.prod(counts[list(part)])) for part in parts],
        [0, *np.cumsum(sizes)],
        _filled(terms, d, -1),
    ]
    real = [
        _filled(knots, widest),
        _filled([0.5 * (k[:-1] + k[1:]) for k in knots], widest),
        _filled([p.steepness / np.diff(p.knots) for p in partitions], widest),
        _filled([_series(p) for p in partitions], widest),
        [p.period for p in partitions],
        [0.5 * (p.centres[0] + p.centres[-1] - p.period) for p in partitions],
    ]
    return (
        np.concatenate([np.asarray(part).ravel() for part in whole]).astype(np.int64),
        np.concatenate([np.asarray(part, dtype=float).ravel() for part in real]),
    )


@njit(cache=True)
def unpack(packed: Packed) -> Layout:
    """Return views into the arrays of a packed layout."""
    whole, real = packed
    d = whole[1]
    t = whole[2]
    k = whole[3]
    # By d, by t, and what comes after them.
    by_d = 6
    by_t = 6 + 2 * d
    rest = 6 + 2 * d + 8 * t
    row = d * k
    tail = 4 * d * k
    return Layout(
        sigmoid=whole[0] > 0,
        counts=whole[by_d : by_d + d],
        knots=real[:row].reshape(d, k),
        n_knots=whole[by_d + d : by_t],
        bounds=real[row : 2 * row].reshape(d, k),
        slopes=real[2 * row : 3 * row].reshape(d, k),
        series=real[3 * row : tail].reshape(d, k),
        periods=real[tail : tail + d],
        lows=real[tail + d :],
        terms=whole[rest + t + 1 :].reshape(t, d),
        lengths=whole[by_t : by_t + t],
        own_lengths=whole[by_t + t : by_t + 2 * t],
        own_sizes=whole[by_t + 2 * t : by_t + 3 * t],
        shared_sizes=whole[by_t + 3 * t : by_t + 4 * t],
        row_lengths=whole[by_t + 4 * t : by_t + 5 * t],
        row_sizes=whole[by_t + 5 * t : by_t + 6 * t],
        part_lengths=whole[by_t + 6 * t : by_t + 7 * t],
        part_sizes=whole[by_t + 7 * t : rest],
        offsets=whole[rest : rest + t + 1],
        n_active=whole[4],
        n_own=whole[5],
    )


MOST_GROWTH = 400.0
"""Logarithm of the range that a series of exponentials may span: what was cut off stays so."""


def _series(partition: Partition) -> FloatArray:
    """Return the exponentials of all sigmoids at one point, as multiples of the first's, if any."""
    gaps = np.diff(partition.knots)
    even = np.allclose(gaps, gaps[0], rtol=1e-9, atol=0.0)
    few = partition.steepness * len(gaps) <= MOST_GROWTH
    return np.exp(partition.steepness * np.arange(len(gaps))) if even and few else np.zeros(0)


def _filled(rows: Sequence[Any], width: int, filling: float = 0.0) -> FloatArray:
    """Return rows of different lengths as an array of this width."""
    return np.array([[*row, *[filling] * (width - len(row))] for row in rows])
