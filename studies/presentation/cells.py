"""The cells of a table of estimates, as text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..results.statistics import Estimate
from ..results.summary import between, two_figures


@dataclass(frozen=True)
class Cell:
    """An estimate as text: its value, and the bounds of its interval, if they are known."""

    value: str
    bounds: tuple[str, str] | None

    @classmethod
    def of(cls, estimate: Estimate) -> Cell:
        """Return the cell of an estimate."""
        value, low, high = map(two_figures, ends(estimate))
        return cls(value, None if np.isnan(estimate.low) else (low, high))

    @property
    def interval(self) -> str:
        """The interval; nothing if it is not known."""
        return between(*self.bounds) if self.bounds else ""

    def bracketed(self, space: str) -> str:
        """Return the value and, if it is known, its interval in brackets."""
        return f"{self.value}{space}[{', '.join(self.bounds)}]" if self.bounds else self.value


Row = tuple[str, int, tuple[Cell | None, ...]]
"""Condition, number of seeds, and a cell per title; none where there is no estimate."""


def ends(estimate: Estimate) -> tuple[float, float, float]:
    """Return value and ends of the interval of an estimate of no dimension."""
    return float(estimate.value), float(estimate.low), float(estimate.high)
