"""The table of a study: conditions against estimates, and its cells as text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.interface.scenario import SUCCESS
from .results import Results
from .statistics import Estimate, rate

EVALUATED = "evaluation success"
"""Title of the success of a trained team in the scenario of its condition."""
MANY = 1e6
"""From here on a number in a table has a power of ten."""


@dataclass(frozen=True)
class Summary:
    """A line of the table."""

    condition: str
    """Label of the condition."""
    seeds: int
    """Number of seeds that have finished."""
    estimates: dict[str, Estimate]
    """Estimates of no dimension by title."""


def evaluated(results: Results, condition: str) -> dict[str, Estimate]:
    """Return the success of a condition's trained teams by title, in its own scenario and others.

    Those of `[evaluations]` are called ``success, NAME``.
    """
    if not results.has(condition, "evaluation", SUCCESS.name):
        return {}
    others = results.other_evaluations(condition).items()
    phases = {EVALUATED: "evaluation", **{f"success, {name}": phase for name, phase in others}}
    return {title: rate(results.success(condition, phase)) for title, phase in phases.items()}


def two_figures(value: float) -> str:
    """Return a number in two figures and at most two decimals, without a leading zero.

    From a million on it has a power of ten.

    Examples
    --------
    >>> [two_figures(x) for x in (0.975, 0.998, -0.0312, 0.0021, 12.34, 240.0, 2.7e11)]
    ['.97', '1.0', '-.03', '0', '12', '240', '2.7e11']
    """
    if np.isnan(value):
        return "?"
    if abs(value) < 0.005:
        return "0"
    value = float(f"{value:.2g}")
    if abs(value) >= MANY:
        mantissa, power = f"{value:.1e}".split("e")
        return f"{mantissa}e{int(power)}"
    digits = min(2, max(0, 1 - int(np.floor(np.log10(abs(value))))))
    text = f"{value:.{digits}f}"
    return text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text


def between(low: str, high: str) -> str:
    """Return the two bounds of an interval as one text, in which no dash meets a minus sign."""
    return f"{low} to {high}" if "-" in (low[0], high[0]) else f"{low}–{high}"


UNKNOWN = "agent groups"
"""What bodies are called if their number is not swept."""


@dataclass(frozen=True)
class Sizes:
    """Numbers of bodies.

    Examples
    --------
    >>> joints = Sizes({"2": 2, "8": 8}, ("scenario.joints",))
    >>> joints.shown(1), joints.shown(8), Sizes({"chain": 3, "star": 5}).shown(3)
    ('1 joint', '8 joints', '3 agent groups')
    >>> Sizes({"chain": 3, "star": 3}).shown(3)
    ''
    """

    counts: Mapping[str, int]
    """By condition."""
    keys: Sequence[str] = ()
    """Swept keys that are this number, whatever the scenario calls it."""

    @classmethod
    def of(cls, results: Results, conditions: Iterable[str]) -> Sizes:
        """Return those of conditions whose trials have counted them."""
        counts = {c: int(results.numbers(c)["robots"][0]) for c in conditions}
        swept = {c: results.columns.get(c, {}) for c in counts}
        keys = dict.fromkeys(key for row in swept.values() for key in row)
        own = (k for k in keys if all(str(swept[c].get(k)) == str(n) for c, n in counts.items()))
        return cls(counts, tuple(own))

    @property
    def word(self) -> str:
        """What bodies are called, in the plural."""
        names = (k.removeprefix("scenario.") for k in self.keys if k.startswith("scenario."))
        return next(names, UNKNOWN)

    def shown(self, number: int) -> str:
        """Return a number in words; nothing if it is the same everywhere, and nobody named it."""
        if not self.keys and len(set(self.counts.values())) == 1:
            return ""
        return f"{number} {self.word.removesuffix('s') if number == 1 else self.word}"
