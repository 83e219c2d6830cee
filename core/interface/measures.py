"""What is measured of an episode: the columns of results that a scenario declares."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal


@dataclass(frozen=True)
class Measure:
    """A number that describes an episode: a column of results."""

    name: str
    """Of the column; ``success`` is the one by which scenarios are compared."""
    title: str
    """Its heading in tables and figures."""
    unit: str = "1"
    """In words of the SI, ``"1"`` for a pure number."""
    source: str = ""
    """Where it is taken from at every step: a key of `Transition.info`, or ``terminated``; empty:
    the key of its own name."""
    gathering: Literal["last", "mean", "sum", "max"] = "last"
    """How the steps of an episode make one number: their ``last``, ``mean``, ``sum`` or ``max``."""
    better: Literal["higher", "lower"] | None = None
    """Which way is better, if one is."""
    is_rate: bool = False
    """Whether an episode has it or has it not: 1 or 0."""
    least: float | None = None
    """What it cannot be below, if there is such; intervals end there."""
    greatest: float | None = None
    """What it cannot be above, if there is such; intervals end there."""

    def __post_init__(self) -> None:
        """Take it from the key of its own name, if no other is given."""
        object.__setattr__(self, "source", self.source or self.name)

    @property
    def bounds(self) -> tuple[float, float]:
        """Range of the measure: 0 to 1 for a rate, infinite where no end is known.

        >>> SUCCESS.bounds, RETURN.bounds
        ((0.0, 1.0), (-inf, inf))
        """
        if self.is_rate:
            return 0.0, 1.0
        least = -math.inf if self.least is None else self.least
        return least, math.inf if self.greatest is None else self.greatest

    @property
    def heading(self) -> str:
        """Title and unit.

        >>> Measure("final_distance_m", "distance", "m").heading
        'distance [m]'
        """
        return self.title if self.unit == "1" else f"{self.title} [{self.unit}]"


SUCCESS = Measure("success", "success", source="terminated", better="higher", is_rate=True)
"""Whether the episode ended with the task solved: success, unless a scenario says otherwise."""
NO_SUCCESS = replace(SUCCESS, greatest=0.0)
"""Success in a task in which nothing is one: teams are compared by their returns."""
RETURN = Measure("return", "return", better="higher")
"""The return of an episode, which every scenario has."""


def measures_of(declared: Sequence[Measure]) -> tuple[Measure, ...]:
    """Return what is measured of an episode, success first: `SUCCESS` unless another is declared.

    >>> [measure.name for measure in measures_of([Measure("spread", "spread", "m")])]
    ['success', 'spread']
    """
    own = [m for m in declared if m.name == SUCCESS.name] or [SUCCESS]
    return (*own, *(m for m in declared if m.name != SUCCESS.name))


def main_measure(measures: Sequence[Measure]) -> Measure:
    """Return by which of its measures a task is judged: the first, or the return if that is never.

    >>> main_measure([SUCCESS]).name, main_measure([NO_SUCCESS]).name
    ('success', 'return')
    """
    first = next(iter(measures), RETURN)
    return RETURN if first.is_rate and first.greatest == 0.0 else first
