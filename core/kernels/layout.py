"""``Layout``: partitions and terms of a rule base as arrays, the way the kernels read them.

Within a term the own variables lead, so that its slice of theta is a matrix (own rules, shared
rules).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from ..fuzzy import Partition


class Layout(NamedTuple):
    """Partitions and terms of a rule base as arrays; ``t`` terms, ``d`` variables."""

    sigmoid: bool
    counts: IntArray  # (d,) membership functions
    knots: FloatArray  # (d, k) centres, on a circle with copies on either side
    n_knots: IntArray  # (d,)
    bounds: FloatArray  # (d, k - 1) midpoints between knots
    slopes: FloatArray  # (d, k - 1) sigmoid slopes
    growths: FloatArray  # (d,) ratio of neighbouring exponentials, 0 if slopes are unequal
    periods: FloatArray  # (d,) 0 for linear variables
    lows: FloatArray  # (d,) lower end of the period in use
    terms: IntArray  # (t, d) variables of each term, padded with -1
    lengths: IntArray  # (t,) variables in each term
    own_lengths: IntArray  # (t,) own variables in each term
    own_sizes: IntArray  # (t,) own rules: rows of the term's matrix
    shared_sizes: IntArray  # (t,) shared rules: columns of the term's matrix
    row_lengths: IntArray  # (t,) leading variables that tell the rows of traces apart
    row_sizes: IntArray  # (t,) rows of traces
    offsets: IntArray  # (t + 1,) start of each term in theta
    shared_offsets: IntArray  # (t + 1,) start of each term among shared features
    n_active: int  # active rules under compact support
    n_own: int  # own variables


def layout(partitions: Sequence[Partition], terms: Sequence[tuple[int, ...]], n_own: int) -> Layout:
    """Pack partitions and terms for the kernels."""
    d, t = len(partitions), len(terms)
    widest = max(len(p.knots) for p in partitions)
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
    shared_sizes = sizes // own_sizes
    # Rows of traces: long ones where all rules are active, else those of the own variables.
    sigmoid = partitions[0].membership == "sigmoid"
    rows = [o[:-1] if sigmoid else o for o in own]
    return Layout(
        sigmoid=sigmoid,
        counts=counts,
        knots=knots,
        n_knots=np.array([len(p.knots) for p in partitions]),
        bounds=bounds,
        slopes=slopes,
        growths=np.array([_growth(p) for p in partitions]),
        periods=np.array([p.period for p in partitions]),
        lows=np.array([0.5 * (p.centres[0] + p.centres[-1] - p.period) for p in partitions]),
        terms=padded,
        lengths=np.array([len(term) for term in terms]),
        own_lengths=np.array([len(o) for o in own]),
        own_sizes=own_sizes,
        shared_sizes=shared_sizes,
        row_lengths=np.array([len(row) for row in rows]),
        row_sizes=np.array([int(np.prod(counts[row])) for row in rows]),
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        shared_offsets=np.concatenate([[0], np.cumsum(shared_sizes)]),
        n_active=int(sum(2 ** len(term) for term in terms)),
        n_own=n_own,
    )


def _growth(partition: Partition) -> float:
    gaps = np.diff(partition.knots)
    even = np.allclose(gaps, gaps[0], rtol=1e-9, atol=0.0)
    return float(np.exp(partition.steepness)) if even else 0.0
