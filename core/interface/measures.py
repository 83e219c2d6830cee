"""Measures of an episode: the columns of results that a scenario declares."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal


@dataclass(frozen=True)
class Measure:
    """A number that describes an episode, a column of results."""

    __pydantic_config__: ClassVar = {"extra": "forbid", "allow_inf_nan": False}
    """Reading from a file: unknown keys and bounds that are no numbers are refused."""
    name: str
    """Name of the column. Scenarios are compared by ``success``."""
    title: str
    """Heading in tables and figures."""
    unit: str = "1"
    """SI unit, ``"1"`` for a pure number."""
    source: str = ""
    """Key of `Transition.info` with the value of a step, or ``terminated``; by default the name."""
    gathering: Literal["last", "mean", "sum", "max"] = "last"
    """Aggregation over the steps of an episode: ``last``, ``mean``, ``sum`` or ``max``."""
    better: Literal["higher", "lower"] | None = None
    """Whether higher or lower values are better; None if neither is."""
    is_rate: bool = False
    """Whether the values are 1 and 0, for yes and no."""
    least: float | None = None
    """Lower bound of possible values, at which intervals end."""
    greatest: float | None = None
    """Upper bound of possible values, at which intervals end."""

    def __post_init__(self) -> None:
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
        return self.title if (self.unit or "1") == "1" else f"{self.title} [{self.unit}]"


SUCCESS = Measure("success", "success", source="terminated", better="higher", is_rate=True)
"""Whether the task was solved; the measure of success of most scenarios."""
NO_SUCCESS = replace(SUCCESS, greatest=0.0)
"""Success in a task that cannot be solved: teams are compared by their returns."""
RETURN = Measure("return", "return", better="higher")
"""Return of an episode, a measure of every scenario."""


def measures_of(declared: Sequence[Measure]) -> tuple[Measure, ...]:
    """Return the measures of an episode, success first; by default this is `SUCCESS`.

    >>> [measure.name for measure in measures_of([Measure("spread", "spread", "m")])]
    ['success', 'spread']
    """
    own = [m for m in declared if m.name == SUCCESS.name] or [SUCCESS]
    return (*own, *(m for m in declared if m.name != SUCCESS.name))


def main_measure(measures: Sequence[Measure]) -> Measure:
    """Return the measure by which a task is judged: the first, or the return without success.

    >>> main_measure([SUCCESS]).name, main_measure([NO_SUCCESS]).name
    ('success', 'return')
    """
    first = next(iter(measures), RETURN)
    return RETURN if first.is_rate and first.greatest == 0.0 else first
