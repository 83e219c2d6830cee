"""What is measured of an episode, step by step, and what columns of results are called.

Measures are those that scenarios declare, see `nested_agents.core.interface.measures`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf, isfinite
from operator import add
from typing import NamedTuple

import numpy as np

from ...core.interface.measures import Measure
from ...core.interface.scenario import Transition
from ..errors import SpecError
from ..store.database import AFTER, BEFORE

NOTHING: Mapping[str, float] = {}
"""What decisions cost that ask no function."""


class EpisodeRow(NamedTuple):
    """The measurements of one episode."""

    phase: str
    """``training`` or ``evaluation``; or one that begins with `STAGE` or `EVALUATION`."""
    episode: int
    """Counted from 0 within its phase, or through all stages of a curriculum."""
    steps: int
    measures: Mapping[str, float]
    """Values of the scenario's measures by name, in their order; of a rate, whether it is so."""
    return_: float
    """Sum of the rewards, not discounted; of rewards of each agent, of their mean."""

    def flat(self, names: Iterable[str]) -> tuple[object, ...]:
        """Return it with the measures of these names in place of all; None where it has not one."""
        measured = (self.measures.get(name) for name in names)
        return (self.phase, self.episode, self.steps, *measured, self.return_)


GATHER: dict[str, Callable[[float, float], float]] = {
    "last": lambda _, value: value,
    "max": max,
    "sum": add,
    "mean": add,
}
"""What is gathered of two values, one after the other; a mean is divided at the end."""


class EpisodeMeter:
    """Takes in the transitions of one episode and sums them up.

    Parameters
    ----------
    phase, episode
        Where the episode stands.
    measures
        What is measured of it.

    Examples
    --------
    >>> meter = EpisodeMeter("training", 0, [Measure("energy_j", "energy", "J", "joules", "sum")])
    >>> for joules in (1.0, 2.5):
    ...     meter.add(Transition(np.zeros((1, 1)), 0.5, False, False, {"joules": joules}))
    >>> meter.row()
    EpisodeRow(phase='training', episode=0, steps=2, measures={'energy_j': 3.5}, return_=1.0)
    """

    def __init__(self, phase: str, episode: int, measures: Sequence[Measure]) -> None:
        self._phase = phase
        self._episode = episode
        self._measures = measures
        self._values = {m.name: -inf if m.gathering == "max" else 0.0 for m in measures}
        self._steps = 0
        self._return = 0.0

    def add(self, transition: Transition, spent: Mapping[str, float] = NOTHING) -> None:
        """Take in one step, and what the decision cost that led to it.

        Raises
        ------
        ValueError
            If the transition does not hold what a measure is taken from.
        """
        self._steps += 1
        for measure in self._measures:
            source = measure.source
            value = spent[source] if source in spent else value_at(measure, transition)
            before = self._values[measure.name]
            self._values[measure.name] = GATHER[measure.gathering](before, value)
        reward = transition.reward
        self._return += reward if isinstance(reward, float) else float(np.mean(reward))

    def row(self) -> EpisodeRow:
        """Return the measurements of the episode, which has ended.

        Raises
        ------
        FloatingPointError
            If one of them is not finite: the trial has come to nothing, and says so.
        """
        means = [m.name for m in self._measures if m.gathering == "mean"]
        measured = self._values | {name: self._values[name] / self._steps for name in means}
        for name, value in {**measured, "return": self._return}.items():
            if not isfinite(value):
                where = f"{self._phase} episode {self._episode}"
                raise FloatingPointError(f"{name} = {value} in {where}")
        measured |= {m.name: bool(measured[m.name]) for m in self._measures if m.is_rate}
        return EpisodeRow(self._phase, self._episode, self._steps, measured, self._return)


def value_at(measure: Measure, transition: Transition) -> float:
    """Return the value of a measure at one step.

    Raises
    ------
    ValueError
        If the step does not hold what the measure is taken from.
    """
    if measure.source == "terminated":
        return float(transition.terminated)
    if measure.source not in transition.info:
        known = ", ".join(sorted(transition.info)) or "nothing"
        raise ValueError(
            f"measure {measure.name!r}: its source {measure.source!r} is not in the info of a "
            f"step, which holds {known}"
        )
    try:
        return float(transition.info[measure.source])
    except (TypeError, ValueError):
        raise ValueError(
            f"measure {measure.name!r}: its source {measure.source!r} must be one number at every "
            f"step, received {type(transition.info[measure.source]).__name__}"
        ) from None


RESERVED = ("identity", "condition", "seed", "position", *BEFORE, *AFTER)
"""What no measure may be called, as columns of results are called so."""


def join_measures(
    by_scenario: Iterable[Sequence[Measure]], taken: Iterable[str] = ()
) -> tuple[Measure, ...]:
    """Return the measures of several scenarios, each once, in the order in which they come.

    Parameters
    ----------
    by_scenario
        What each scenario declares.
    taken
        Names of the columns that tell conditions apart, which no measure may have.

    Raises
    ------
    SpecError
        If a name is reserved, two scenarios mean different things by it, or two columns differ
        only in case.

    Examples
    --------
    >>> one, other = Measure("energy_j", "energy", "J"), Measure("spread_m", "spread", "m")
    >>> [measure.name for measure in join_measures([(one,), (other, one)])]
    ['energy_j', 'spread_m']
    """
    columns: dict[str, str] = {}
    for name in taken:
        if (other := columns.setdefault(name.lower(), name)) != name:
            raise SpecError(
                f"sweep: {other!r} and {name!r} differ only in case, and columns of results do "
                "not; rename one of these settings"
            )
    reserved = {name.lower() for name in (*RESERVED, *taken)}
    by_name: dict[str, Measure] = {}
    for measures in by_scenario:
        for measure in measures:
            if measure.name.lower() in reserved:
                raise SpecError(f"measure {measure.name!r}: a column of results is called so")
            known = by_name.setdefault(measure.name.lower(), measure)
            if column_of(known) != column_of(measure):
                raise SpecError(
                    f"measure {measure.name!r}: is declared as {_describe(known)}, and by another "
                    f"scenario of this study as {_describe(measure)}"
                )
    return tuple(by_name.values())


def column_of(measure: Measure) -> tuple[str, str, str, bool]:
    """Return what equal columns have in common: name, unit, gathering, whether it is a rate."""
    return measure.name, measure.unit, measure.gathering, measure.is_rate


def _describe(measure: Measure) -> str:
    kind = "rate" if measure.is_rate else "number"
    return f"{measure.name!r}, {measure.gathering} {kind} in {measure.unit!r}"
