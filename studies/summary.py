"""The table of a study: conditions against estimates, and its cells as text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .statistics import Estimate


@dataclass(frozen=True)
class Summary:
    """A line of the table.

    Attributes
    ----------
    condition
        Label of the condition.
    seeds
        Number of seeds that have finished.
    estimates
        Estimates of no dimension by title.
    """

    condition: str
    seeds: int
    estimates: dict[str, Estimate]


def number(value: float) -> str:
    """Return a number in two or three figures, without the zero before the point.

    Examples
    --------
    >>> [number(x) for x in (0.975, 1.0, -0.0312, 0.00021, 12.34, 240.0, 0.0)]
    ['.97', '1.0', '-.031', '.00021', '12', '240', '0']
    """
    if np.isnan(value):
        return "?"
    if value == 0.0:
        return "0"
    digits = max(0, 1 - int(np.floor(np.log10(abs(value)))))
    text = f"{value:.{digits}f}"
    return text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text


def interval(estimate: Estimate) -> str:
    """Return the interval of an estimate as text; a dash if it is not known."""
    if np.isnan(estimate.low):
        return "–"
    return f"{number(float(estimate.low))}–{number(float(estimate.high))}"
