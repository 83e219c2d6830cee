"""A rule base taken apart: what each state variable adds to an agent's f.

For every way of standing in the membership functions alike, f falls uniquely into a constant,
functions of one variable, each of mean zero, and what several variables do together beyond them
(the analysis of variance, Hoeffding 1948)::

    f(x) = c + sum_j g_j(x_j) + the rest

A rule base of order 1 has no rest. Of one of order d the functions of one variable are marginals:
the mean over the rules of all other variables. The *share* of a part is its share of the variance
of f, all rules being equally likely; which rules were ever visited it does not know.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray, pd
from ...core.rules.kernels.fuzzy import Partition
from ...core.rules.rule_base import RuleBase
from ..errors import WIDTH

WORDS = {
    2: ("low", "high"),
    3: ("low", "medium", "high"),
    5: ("very low", "low", "medium", "high", "very high"),
}
"""Of membership functions on a line that have none of their own."""


@dataclass(frozen=True)
class Parts:
    """What the f of one agent consists of."""

    constant: float
    """Mean of all rules."""
    singles: tuple[FloatArray, ...]
    """``(m_j,)`` consequents of every variable j, of mean zero: g_j at the centres."""
    variance: float
    """Of all rules."""

    def share(self, consequents: FloatArray) -> float:
        """Return the share of the variance that consequents of mean zero have."""
        return float((consequents**2).mean()) / self.variance if self.variance > 0 else 0.0

    @property
    def rest(self) -> float:
        """Share of what several variables do together."""
        return max(0.0, 1.0 - sum(map(self.share, self.singles))) if self.variance > 0 else 0.0


def take_apart(rules: RuleBase, theta: FloatArray) -> Parts:
    """Return the parts of f for one agent's consequent weights ``(n_rules,)``.

    Examples
    --------
    Two variables with LOW and HIGH: the rule HIGH, HIGH pays, no other.

    >>> base = RuleBase([Partition((0.0, 1.0), "triangular")] * 2, [(0, 1)])
    >>> parts = take_apart(base, np.array([0.0, 0.0, 0.0, 4.0]))
    >>> parts.constant, parts.singles[0].tolist(), round(parts.rest, 2)
    (1.0, [-1.0, 1.0], 0.33)
    """
    sizes = [partition.size for partition in rules.partitions]
    tensors = []
    begin = 0
    for term, size in zip(rules.terms, rules.sizes, strict=True):
        weights = np.asarray(theta[begin : begin + size], dtype=float)
        tensors.append((term, weights.reshape([sizes[j] for j in term])))
        begin += size
    singles: list[FloatArray] = [np.zeros(size) for size in sizes]
    for term, tensor in tensors:
        for j in term:
            singles[j] += _onto(tensor, term, (j,)) - tensor.mean()
    constant = float(sum(tensor.mean() for _, tensor in tensors))
    return Parts(constant, tuple(singles), _variance(tensors))


def _onto(tensor: FloatArray, term: Sequence[int], kept: Sequence[int]) -> FloatArray:
    """Return the mean over all variables of a term but some."""
    return np.asarray(tensor.mean(axis=tuple(i for i, j in enumerate(term) if j not in kept)))


def _variance(tensors: Sequence[tuple[tuple[int, ...], FloatArray]]) -> float:
    """Return the variance of a sum of terms: terms covary in what their variables in common do."""
    total = 0.0
    for i, (term, tensor) in enumerate(tensors):
        for other, second in tensors[i:]:
            common = [j for j in term if j in other]
            if common:
                first = _onto(tensor, term, common) - tensor.mean()
                covariance = (first * (_onto(second, other, common) - second.mean())).mean()
                total += float(covariance) * (1.0 if other == term else 2.0)
    return total


def labels(variable: Variable, partition: Partition) -> tuple[str, ...]:
    """Return words for the membership functions of a variable.

    Its own words if the partition is its own; else by rank, or by the centre on a circle.

    Examples
    --------
    >>> gap = Variable("gap", "m", 0.0, 1.0)
    >>> labels(gap, Partition.of(gap))
    ('very low', 'low', 'medium', 'high', 'very high')
    """
    if variable.labels and variable.centres == partition.centres:
        return variable.labels
    if not variable.periodic and partition.size in WORDS:
        return WORDS[partition.size]
    return tuple(f"about {place(variable, centre)}" for centre in partition.centres)


def place(variable: Variable, value: float) -> str:
    """Return a value of a variable with its unit; angles in degrees.

    >>> place(Variable("turn", "rad", -3.2, 3.2), 0.5), place(Variable("gap", "m", 0, 1), 0.015)
    ('29°', '0.015 m')
    """
    if variable.unit == "rad":
        return f"{degrees(value):.0f}°"
    return f"{value:.3g}" + (f" {variable.unit}" if variable.unit != "1" else "")


def table(
    rules: RuleBase, variables: Sequence[Variable], agents: Sequence[str], parts: Sequence[Parts]
) -> str:
    """Return the rules of some agents in words, a column of consequents for each agent.

    Variables come in the order of their mean share.
    """
    power, lines = exponent(parts), []
    for j in by_share(parts):
        variable, partition = variables[j], rules.partitions[j]
        shares = [percent(p.share(p.singles[j])) for p in parts]
        lines.append((f"{variable.name}, share of the variance", *shares))
        words = zip(labels(variable, partition), partition.centres, strict=True)
        for k, (word, centre) in enumerate(words):
            consequents = (f"{p.singles[j][k] * 10**power:+.2f}" for p in parts)
            rule = f"IF {variable.name} is {word}, {place(variable, centre)}:"
            lines.append((rule, *consequents))
        lines.append(("", *[""] * len(parts)))
    names, *columns = zip(*lines, strict=True)
    heads = pd.MultiIndex.from_tuples([name.rpartition(".")[::2] for name in agents])
    frame = pd.DataFrame(list(zip(*columns, strict=True)), index=names, columns=heads)
    return frame.to_string(line_width=WIDTH, sparsify=False)


def by_share(parts: Sequence[Parts]) -> list[int]:
    """Return the variables in the order of their mean share."""
    shares = np.mean([list(map(p.share, p.singles)) for p in parts], axis=0)
    return [int(j) for j in np.argsort(-shares, kind="stable")]


def percent(share: float) -> str:
    """Return a share in whole percents.

    >>> percent(0.254), percent(0.0004), percent(0.0)
    ('25 %', '<1 %', '0 %')
    """
    return "<1 %" if 0 < share < 0.005 else f"{100 * share:.0f} %"


def exponent(parts: Sequence[Parts]) -> int:
    """Return the power of ten by which consequents are multiplied to be read in two decimals.

    The greatest then lies between 1 and 10.
    """
    greatest = max((float(np.abs(g).max()) for p in parts for g in p.singles), default=0.0)
    return -int(np.floor(np.log10(greatest))) if greatest > 0 else 0
