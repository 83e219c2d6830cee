"""``Layout``: partitions and terms of a rule base as arrays, the way the kernels read them.

Within a term the own variables lead, so that its slice of theta is a matrix (own rules, shared
rules). Python hands a layout to a kernel *packed* into two arrays: passing one array to compiled
code costs a tenth of a microsecond, passing all of them more than many a kernel does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from ...numerics import FloatArray, IntArray, njit

if TYPE_CHECKING:
    from .fuzzy import Partition


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


def layout(partitions: Sequence[Partition], terms: Sequence[tuple[int, ...]], n_own: int) -> Packed:
    """Pack partitions and terms for the kernels."""
    d, t = len(partitions), len(terms)
    widest = (max(len(p.knots) for p in partitions) + 7) // 8 * 8  # whole vectors
    knots, bounds, slopes = np.zeros((d, widest)), np.zeros((d, widest)), np.zeros((d, widest))
    for j, p in enumerate(partitions):
        k = p.knots
        knots[j, : len(k)] = k
        bounds[j, : len(k) - 1] = 0.5 * (k[:-1] + k[1:])
        slopes[j, : len(k) - 1] = p.steepness / np.diff(k)
    counts = np.array([p.size for p in partitions])
    padded = np.full((t, d), -1)
    for i, term in enumerate(terms):
        padded[i, : len(term)] = term
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
        [len(p.knots) for p in partitions],
        [len(term) for term in terms],
        [len(o) for o in own],
        own_sizes,
        sizes // own_sizes,
        [len(row) for row in rows],
        [int(np.prod(counts[row])) for row in rows],
        [len(row) + len(part) for row, part in zip(rows, parts, strict=True)],
        [int(np.prod(counts[list(part)])) for part in parts],
        [0, *np.cumsum(sizes)],
        padded,
    ]
    real = [
        *(knots, bounds, slopes),
        [_series(p, widest) for p in partitions],
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
    d, t, k = whole[1], whole[2], whole[3]
    # By d, by t, and what comes after them.
    by_d, by_t, rest = 6, 6 + 2 * d, 6 + 2 * d + 8 * t
    row, tail = d * k, 4 * d * k
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


def _series(partition: Partition, width: int) -> FloatArray:
    """Return the exponentials of all sigmoids at one point, as multiples of the first's."""
    gaps, series = np.diff(partition.knots), np.zeros(width)
    even = np.allclose(gaps, gaps[0], rtol=1e-9, atol=0.0)
    if even and partition.steepness * len(gaps) <= MOST_GROWTH:
        series[: len(gaps)] = np.exp(partition.steepness * np.arange(len(gaps)))
    return series
