"""Power of comparisons: which differences a number of seeds detects.

Power is the probability that one difference of a given size is significant among several
comparisons. As in the first step of Holm's method, p times their number must be below `LEVEL`. The
power of paired runs assumes that the differences of single seeds are independent and normal. The
power of independent runs is that of the two-sample t test.
"""

import math
import sys
from bisect import bisect_left
from collections.abc import Sequence
from functools import cache
from itertools import combinations
from numbers import Integral, Real

import numpy as np
from numpy.typing import ArrayLike

from ...core.numerics import optimize, quadrature, special
from ...core.plugins.words import expect, expect_within
from .permutation_tests import EXACT, LEVEL
from .statistics import OPEN_UNIT

WANTED = 0.8
"""The power that studies are planned for (Cohen 1988)."""
SMALLEST = 0.2
"""The smallest difference of success rates that is of interest by default."""
USUAL_DEVIATION = 0.25
"""Standard deviation of the paired differences of success rates that is supposed before any are
known. In the published studies of 20 and 30 seeds nine conditions in ten have less."""
OUTCOME_DEVIATION = 0.5
"""The same of outcomes of whole seeds, 0 or 1: whether a seed recovers."""
SUPPOSED = 4.0
"""Number of seeds of `USUAL_DEVIATION` that are added, because a few equal seeds say little."""
RATES = 1.07
"""Factor on the deviation of success rates, because their ties and bounds reduce the power. Without
it studies of ten episodes detect up to 0.04 less than is said, with it up to 0.03, see
`research.power`."""
ROUNDING = 1e-12
"""Relative deviation that counts as rounding: values that deviate by less are equal."""
FEW_PATTERNS = 32
"""If fewer patterns of signs are extreme enough to be significant, the power is simulated."""
SIMULATED = 4000
"""Studies that are simulated then; the power is off by 0.008 at most (one standard error)."""
MOST_SEEDS = 10_000
MAX_COUNT = 1_000_000
_COUNT = f"a whole number from 1 to {MAX_COUNT:,}", Integral, 1, MAX_COUNT
ALLOWED: dict[str, tuple[str, type, float, float]] = {
    "effect": ("a finite number", Real, -sys.float_info.max, sys.float_info.max),
    "deviation": ("a finite number above 0", Real, sys.float_info.min, sys.float_info.max),
    "seeds": _COUNT,
    "comparisons": _COUNT,
    "wanted": ("a number above 0 and below 1", Real, *OPEN_UNIT),
}
"""Range of each argument of the public functions: in words, its type, minimum and maximum."""
NODES = 64
"""Points of Gauss-Legendre quadrature."""
WIDEST = 10.0
"""Standard deviations of the estimated deviation beyond which nothing counts."""


def seeds_needed(comparisons: int = 1) -> int:
    """Return the fewest seeds of which an adjusted p can stay below `LEVEL`.

    Examples
    --------
    >>> seeds_needed(1), seeds_needed(2), seeds_needed(63)
    (6, 7, 12)
    """
    return math.floor(1.0 + math.log2(comparisons / LEVEL)) + 1


def power(effect: float, deviation: float, seeds: int, comparisons: int = 1) -> float:
    """Return the probability that a difference is found significant.

    By the noncentral t distribution; where `FEW_PATTERNS` or fewer patterns of signs are extreme
    enough, by simulating the test itself.

    Parameters
    ----------
    effect
        The true mean difference.
    deviation
        Standard deviation of the differences of single seeds, above 0, in the unit of `effect`.
    seeds
        How many seeds both conditions have.
    comparisons
        Over how many comparisons p is adjusted.

    Raises
    ------
    ValueError
        If an argument is not finite or out of range.

    Examples
    --------
    >>> power(0.2, 0.25, 5), round(power(0.2, 0.25, 15), 2)
    (0.0, 0.82)
    """
    _check(effect=effect, deviation=deviation, seeds=seeds, comparisons=comparisons)
    if seeds < seeds_needed(comparisons):
        return 0.0
    level = LEVEL / comparisons
    standardized = min(abs(effect) / deviation, float(MAX_COUNT))  # beyond, power is 1
    if 2**seeds <= EXACT:
        # So many of the 2 ** (seeds - 1) patterns, up to sign, are significant at most.
        extreme = math.ceil(level * 2.0 ** (seeds - 1)) - 1
        if extreme <= FEW_PATTERNS:
            return _simulated(standardized, seeds, extreme)
        level = extreme * 2.0 ** (1 - seeds)
    shift = standardized * math.sqrt(seeds)
    freedom = seeds - 1
    return power_of_t(freedom, shift, float(special.stdtrit(freedom, 1.0 - level / 2.0)))


def detectable(deviation: float, seeds: int, comparisons: int = 1, wanted: float = WANTED) -> float:
    """Return the smallest true difference that is detected with the wanted power.

    It is infinite if no difference can be significant with so few seeds.

    Raises
    ------
    ValueError
        If an argument is not finite or out of range.

    Examples
    --------
    >>> round(detectable(0.25, 15), 2), detectable(0.25, 5)
    (0.19, inf)
    """
    _check(deviation=deviation, seeds=seeds, comparisons=comparisons, wanted=wanted)
    if seeds < seeds_needed(comparisons):
        return math.inf
    low = 0.0
    high = 1.0
    while power(high, 1.0, seeds, comparisons) < wanted:
        low = high
        high = 2.0 * high
    while high - low > 0.002 * high:
        middle = (low + high) / 2.0
        is_enough = power(middle, 1.0, seeds, comparisons) >= wanted
        low, high = (low, middle) if is_enough else (middle, high)
    return deviation * high


def seeds_for(
    effect: float, deviation: float, comparisons: int = 1, wanted: float = WANTED
) -> int | None:
    """Return how many seeds detect a difference with the wanted power.

    None if it takes more than `MOST_SEEDS`.

    Raises
    ------
    ValueError
        If an argument is not finite or out of range.

    Examples
    --------
    >>> seeds_for(0.2, 0.25), seeds_for(0.2, 0.25, comparisons=10)
    (15, 25)
    """
    _check(effect=effect, deviation=deviation, comparisons=comparisons, wanted=wanted)
    low = seeds_needed(comparisons)
    high = low
    while power(effect, deviation, high, comparisons) < wanted:
        low = high + 1
        high = 2 * high
        if high > 2 * MOST_SEEDS:
            return None
    seeds = range(low, high)
    enough = bisect_left(seeds, wanted, key=lambda n: power(effect, deviation, n, comparisons))
    return low + enough if low + enough <= MOST_SEEDS else None


def _check(**arguments: float) -> None:
    """Refuse arguments of the public functions that are not finite or out of range."""
    for name, value in arguments.items():
        allowed, kind, low, high = ALLOWED[name]
        expect(allowed, kind, **{name: value})
        expect_within(allowed, low, high, **{name: value})


def deviation_of(samples: Sequence[ArrayLike], *, of_rates: bool) -> float | None:
    """Return the standard deviation of the differences of single seeds, pooled over comparisons.

    For rates, `SUPPOSED` seeds of `USUAL_DEVIATION` are added to each comparison, and it
    is `RATES` times as large. None if it cannot be known.

    Parameters
    ----------
    samples
        Of every comparison its differences ``(n_seeds,)``.
    of_rates
        Whether they are differences of success rates.

    Examples
    --------
    >>> round(deviation_of([[1.0] * 5], of_rates=True), 2)
    0.19
    >>> deviation_of([[2.0] * 5], of_rates=False)
    """
    arrays = [np.asarray(sample, dtype=float) for sample in samples if np.size(sample) > 1]
    largest = max((float(abs(array).max()) for array in arrays), default=0.0)
    squares = sum(float(((array - array.mean()) ** 2).sum()) for array in arrays)
    freedom = float(sum(len(array) - 1 for array in arrays))
    if squares <= freedom * (ROUNDING * largest) ** 2:
        squares = 0.0
    if of_rates:
        squares += SUPPOSED * len(arrays) * USUAL_DEVIATION**2
        freedom += SUPPOSED * len(arrays)
    factor = RATES if of_rates else 1.0
    return factor * math.sqrt(squares / freedom) if squares > 0.0 else None


def power_of_t(freedom: int, shift: float, beyond: float) -> float:
    """Return the probability that a noncentral t variable is more than `beyond` from 0.

    The variable is ``(z + shift) / s``, z standard normal, s the root of a chi square over its
    degrees of freedom. It is integrated over s: SciPy's noncentral t is not a number for a power
    near 1, and where p is adjusted over many comparisons already for a power of 0.5.

    Parameters
    ----------
    freedom
        Degrees of freedom, 4 or more.
    shift
        The noncentrality.
    beyond
        At least 0.

    Examples
    --------
    >>> round(power_of_t(9, 0.0, 2.262), 3), round(power_of_t(9, 3.0, 2.262), 3)
    (0.05, 0.761)
    """
    nodes, weights = quadrature(NODES)
    reach = WIDEST / math.sqrt(2.0 * freedom)
    low = max(0.0, 1.0 - reach)
    s = low + 0.5 * (1.0 + reach - low) * (1.0 + nodes)
    density = weights * np.exp((freedom - 1) * np.log(s) - 0.5 * freedom * (s**2 - 1.0))
    outside = special.ndtr(shift - beyond * s) + special.ndtr(-shift - beyond * s)
    return float(density @ outside / density.sum())


@cache
def _simulated(effect: float, seeds: int, extreme: int) -> float:
    """Return the share of simulated studies with observed signs among the most extreme.

    A pattern of signs is at least as extreme as the observed one if the sizes that it takes for
    negative sum up to no more than those that are. There are never more than `extreme` such
    patterns but among sets of few sizes: any set is beyond all of its subsets.
    """
    differences = np.random.default_rng(0).normal(size=(SIMULATED, seeds)) + effect
    sizes = abs(differences)
    negative = np.where(differences < 0.0, sizes, 0.0).sum(axis=1)
    negative = np.minimum(negative, sizes.sum(axis=1) - negative)
    largest = int(math.log2(extreme + 1)) + 1
    sets = [s for k in range(largest + 1) for s in combinations(range(seeds), k)]
    members = np.array([[seed in chosen for chosen in sets] for seed in range(seeds)], dtype=float)
    reached = ((sizes @ members) <= negative[:, None] + 1e-12).sum(axis=1)
    return float((reached <= extreme).mean())


def detectable_independent(
    deviation: float, counts: tuple[int, int], comparisons: int = 1, wanted: float = WANTED
) -> float:
    """Return the smallest difference that independent runs detect with the wanted power.

    It is infinite if no permutation of labels can be significant with so few runs.

    Parameters
    ----------
    deviation
        Standard deviation of single runs, in the unit of the difference.
    counts
        Numbers of runs of the two conditions, 2 or more each.
    comparisons
        Number of comparisons over which p is adjusted.
    wanted
        The power.

    Examples
    --------
    >>> round(detectable_independent(1.0, (20, 20)), 2), detectable_independent(1.0, (3, 3))
    (0.91, inf)
    """
    first, second = counts
    level = LEVEL / comparisons
    # `independent_permutation` doubles the smaller tail, of one permutation or more.
    if 2 / math.comb(first + second, first) >= level:
        return math.inf
    freedom = first + second - 2
    beyond = float(special.stdtrit(freedom, 1.0 - level / 2.0))
    scale = math.sqrt(1.0 / first + 1.0 / second)
    reach = optimize.brentq(lambda d: power_of_t(freedom, d, beyond) - wanted, 0.0, beyond + 10.0)
    return deviation * scale * float(reach)
