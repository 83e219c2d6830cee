"""Value functions of rule bases: analysis of variance and words for rules.

The value function f of an agent is decomposed by the analysis of variance (Hoeffding 1948), with
all rules equally likely, into a constant, functions of one variable with mean zero, and
interactions::

    f(x) = c + sum_j g_j(x_j) + the rest

A rule base of order 1 has no rest. With a higher order, the functions of one variable are means
over the rules of all other variables. The *share* of a part is its share of the variance of f. All
rules count equally, whether they were ever visited or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import degrees

import numpy as np

from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray
from ...core.values.partitions import Partition
from ...core.values.rule_base import RuleBase

WORDS = {
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    5: ("very low", "low", "medium", "high", "very high"),
}
"""Words for the membership functions of variables without labels."""


@dataclass(frozen=True)
class Parts:
    """Decomposition of the value function f of one agent."""

    constant: float
    """Mean of all rules."""
    singles: tuple[FloatArray, ...]
    """``(m_j,)`` consequents of every variable j, of mean zero: g_j at the centers."""
    variance: float
    """Variance over all rules."""

    def share(self, consequents: FloatArray) -> float:
        """Return the share of the variance that consequents of mean zero have."""
        return float((consequents**2).mean()) / self.variance if self.variance > 0 else 0.0

    @property
    def rest(self) -> float:
        """Share of what several variables do together."""
        return max(0.0, 1.0 - sum(map(self.share, self.singles))) if self.variance > 0 else 0.0


def decompose(rules: RuleBase, theta: FloatArray) -> Parts:
    """Return the parts of f for one agent's consequent weights ``(n_rules,)``.

    Examples
    --------
    Two variables with LOW and HIGH: the rule HIGH, HIGH pays, no other.

    >>> base = RuleBase([Partition((0.0, 1.0), "triangular")] * 2, [(0, 1)])
    >>> parts = decompose(base, np.array([0.0, 0.0, 0.0, 4.0]))
    >>> parts.constant, parts.singles[0].tolist(), round(parts.rest, 2)
    (1.0, [-1.0, 1.0], 0.33)
    """
    sizes = [partition.size for partition in rules.partitions]
    weights = np.split(np.asarray(theta, dtype=float), np.cumsum(rules.sizes)[:-1])
    of_terms = zip(rules.terms, weights, strict=True)
    tensors = [(term, own.reshape([sizes[j] for j in term])) for term, own in of_terms]
    singles: list[FloatArray] = [np.zeros(size) for size in sizes]
    for term, tensor in tensors:
        for j in term:
            singles[j] += _mean_over_others(tensor, term, (j,)) - tensor.mean()
    constant = float(sum(tensor.mean() for _, tensor in tensors))
    return Parts(constant, tuple(singles), _variance(tensors))


def _mean_over_others(tensor: FloatArray, term: Sequence[int], kept: Sequence[int]) -> FloatArray:
    """Return the mean over all variables of a term but some."""
    return np.asarray(tensor.mean(axis=tuple(i for i, j in enumerate(term) if j not in kept)))


def _variance(tensors: Sequence[tuple[tuple[int, ...], FloatArray]]) -> float:
    """Return the variance of a sum of terms: terms covary in what their variables in common do."""
    total = 0.0
    for (term, tensor), (other, second) in combinations_with_replacement(tensors, 2):
        if common := [j for j in term if j in other]:
            first = _mean_over_others(tensor, term, common) - tensor.mean()
            covariance = (first * (_mean_over_others(second, other, common) - second.mean())).mean()
            total += float(covariance) * (1.0 if other == term else 2.0)
    return total


def labels(variable: Variable, partition: Partition) -> tuple[str, ...]:
    """Return words for the membership functions of a variable.

    Its own words if the partition is its own; else by rank, or by the center on a circle.

    Examples
    --------
    >>> gap = Variable("gap", "m", 0.0, 1.0)
    >>> labels(gap, Partition.of(gap))
    ('very low', 'low', 'medium', 'high', 'very high')
    """
    if variable.labels and variable.centers == partition.centers:
        return variable.labels
    if not variable.periodic and partition.size in WORDS:
        return WORDS[partition.size]
    return tuple(f"about {place(variable, center)}" for center in partition.centers)


def place(variable: Variable, value: float) -> str:
    """Return a value of a variable with its unit; angles in degrees.

    >>> place(Variable("turn", "rad", -3.2, 3.2), 0.5), place(Variable("gap", "m", 0, 1), 0.015)
    ('29°', '0.015 m')
    """
    if variable.unit == "rad":
        return f"{degrees(value):.0f}°"
    return f"{value:.3g}" + (f" {variable.unit}" if variable.unit != "1" else "")


def mean_shares(parts: Sequence[Parts]) -> dict[int, float]:
    """Return the share of each variable, mean over agents, in the order of these means."""
    shares = np.mean([list(map(p.share, p.singles)) for p in parts], axis=0)
    return {int(j): float(shares[j]) for j in np.argsort(-shares, kind="stable")}


def percent(share: float) -> str:
    """Return a share in whole percents.

    >>> percent(0.254), percent(0.0004), percent(0.0)
    ('25%', '<1%', '0%')
    """
    return "<1%" if 0 < share < 0.005 else f"{share:.0%}"
