"""Measurements of episodes, and the names of their columns.

Scenarios declare the measures, see `nested_agents.core.interface.measures`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf
from operator import add
from typing import NamedTuple

import numpy as np

from ...core.interface.measures import Measure
from ...core.interface.scenario import Transition
from ..errors import SpecError
from ..store.database import AFTER, BEFORE

MAX_NUMBER = 1e100
"""Largest magnitude of a measured number, so that no variance overflows."""
NO_COSTS: Mapping[str, float] = {}
"""Costs of a decision of agents that report none."""


class EpisodeRow(NamedTuple):
    """The measurements of one episode."""

    phase: str
    """``training``, ``evaluation``, or a phase that begins with `STAGE` or `EVALUATION`."""
    episode: int
    """Number from 0 within its phase, or within all stages of a curriculum."""
    steps: int
    measures: Mapping[str, float]
    """Values of the scenario's measures by name, in their order. A rate has a Boolean value."""
    return_: float
    """Undiscounted sum of the rewards. If each agent has its own reward, their mean is summed."""

    def flat(self, names: Iterable[str]) -> tuple[object, ...]:
        """Return the values in the order of `columns`. A measure that is missing is None."""
        measured = (self.measures.get(name) for name in names)
        return (self.phase, self.episode, self.steps, *measured, self.return_)


ACCUMULATE: dict[str, Callable[[float, float], float]] = {
    "last": lambda _, value: value,
    "max": max,
    "sum": add,
    "mean": add,
}
"""Update of a measure by the value of a step. A mean is divided at the end of the episode."""


class EpisodeMeter:
    """Computes the measures of one episode from its transitions.

    Parameters
    ----------
    phase, episode
        Phase and number of the episode.
    measures
        Measures to compute.

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

    def add(self, transition: Transition, costs: Mapping[str, float] = NO_COSTS) -> None:
        """Add one step and the costs of its decision.

        Raises
        ------
        ValueError
            If the transition lacks the source of a measure.
        """
        self._steps += 1
        for measure in self._measures:
            source = measure.source
            value = costs[source] if source in costs else value_at(measure, transition)
            before = self._values[measure.name]
            self._values[measure.name] = ACCUMULATE[measure.gathering](before, value)
        reward = transition.reward
        self._return += reward if isinstance(reward, float) else float(np.mean(reward))

    def row(self) -> EpisodeRow:
        """Return the measurements at the end of the episode.

        Raises
        ------
        FloatingPointError
            If a measurement is not finite, or larger than `MAX_NUMBER`.
        """
        means = [m.name for m in self._measures if m.gathering == "mean"]
        measured = self._values | {name: self._values[name] / self._steps for name in means}
        for name, value in {**measured, "return": self._return}.items():
            if not abs(value) <= MAX_NUMBER:
                where = f"{self._phase} episode {self._episode}"
                raise FloatingPointError(f"{name} = {value} in {where}, allowed: at most 1e100")
        measured |= {m.name: bool(measured[m.name]) for m in self._measures if m.is_rate}
        return EpisodeRow(self._phase, self._episode, self._steps, measured, self._return)


def value_at(measure: Measure, transition: Transition) -> float:
    """Return the value of a measure at one step.

    Raises
    ------
    ValueError
        If the step lacks the source of the measure.
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
"""Names of other columns of results, which no measure may have."""


def join_measures(
    by_scenario: Iterable[Sequence[Measure]], taken: Iterable[str] = ()
) -> tuple[Measure, ...]:
    """Return the distinct measures of several scenarios in order of appearance.

    Parameters
    ----------
    by_scenario
        Measures of each scenario.
    taken
        Names of the columns of swept keys, which no measure may have.

    Raises
    ------
    SpecError
        If a name is reserved, two scenarios declare a name differently, or two names differ only
        in case.

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
                f"sweep: {other!r} and {name!r} differ only in case, but columns of results must "
                "differ by more; rename one of these settings"
            )
    reserved = {name.lower() for name in (*RESERVED, *taken)}
    by_name: dict[str, Measure] = {}
    for measures in by_scenario:
        for measure in measures:
            if measure.name.lower() in reserved:
                raise SpecError(f"measure {measure.name!r}: is the name of another column")
            known = by_name.setdefault(measure.name.lower(), measure)
            if column_of(known) != column_of(measure):
                raise SpecError(
                    f"measure {measure.name!r}: is declared as {_describe(known)}, and by another "
                    f"scenario of this study as {_describe(measure)}"
                )
    return tuple(by_name.values())


def column_of(measure: Measure) -> tuple[str, str, str, bool]:
    """Return name, unit, gathering and rate flag of a measure, which define its column."""
    return measure.name, measure.unit, measure.gathering, measure.is_rate


def _describe(measure: Measure) -> str:
    kind = "rate" if measure.is_rate else "number"
    return f"{measure.name!r}, {measure.gathering} {kind} in {measure.unit!r}"
