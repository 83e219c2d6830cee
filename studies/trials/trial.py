"""A trial: one condition, one seed, and what running it gives: a pure function of its content.

It gives what is measured of its episodes, and what is recorded of them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, isfinite
from operator import add
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.interface.measures import Measure
from ...core.interface.plain import as_scenario
from ...core.interface.scenario import Scenario, Transition
from ...core.plugins.sources import Sources, named
from ..errors import SpecError
from ..spec.conditions import ConditionSettings, Stage
from ..spec.outline import lengths
from ..store.database import AFTER, BEFORE, RESULTS_VERSION, Planned
from ..store.durable import Recording

if TYPE_CHECKING:
    from ..spec.spec import Spec


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

    def flat(self, names: Iterable[str]) -> tuple[Any, ...]:
        """Return it with the measures of these names in place of all; None where it has not one."""
        measured = (self.measures.get(name) for name in names)
        return (self.phase, self.episode, self.steps, *measured, self.return_)


GATHER: dict[str, Callable[[float, float], float]] = {
    "last": lambda _, value: value, "max": max, "sum": add, "mean": add,
}  # fmt: skip
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
        self._phase, self._episode, self._measures = phase, episode, measures
        self._values = {m.name: -inf if m.gathering == "max" else 0.0 for m in measures}
        self._steps, self._return = 0, 0.0

    def add(self, transition: Transition) -> None:
        """Take in one step.

        Raises
        ------
        ValueError
            If the transition does not hold what a measure is taken from.
        """
        self._steps += 1
        for measure in self._measures:
            value, before = _taken(measure, transition), self._values[measure.name]
            self._values[measure.name] = GATHER[measure.gathering](before, value)
        self._return += float(np.mean(transition.reward))

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


def _taken(measure: Measure, transition: Transition) -> float:
    """Return the value of a measure at one step."""
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


def joined(
    by_scenario: Iterable[Sequence[Measure]], taken: Iterable[str] = ()
) -> tuple[Measure, ...]:
    """Return the measures of several scenarios, each once, in the order in which they come.

    Parameters
    ----------
    by_scenario
        What each scenario declares.
    taken
        Names of further columns, which no measure may have.

    Raises
    ------
    SpecError
        If a name is reserved, or two scenarios mean different things by it.

    Examples
    --------
    >>> one, other = Measure("energy_j", "energy", "J"), Measure("spread_m", "spread", "m")
    >>> [measure.name for measure in joined([(one,), (other, one)])]
    ['energy_j', 'spread_m']
    """
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


AS_IN_SPEC = ("study", "episodes", "steps", "evaluation", "evaluation_steps", "keep_teams")
"""What all trials of a spec have in common, and any process can read as it is."""


@dataclass(frozen=True)
class Trial:
    """One run of a study."""

    study: str
    """Name of the study that measures it."""
    condition: str = field(compare=False)
    """Label of its condition; a name only, no part of its identity."""
    settings: ConditionSettings
    """What the condition consists of."""
    seed: int
    """As in `Spec`."""
    episodes: int
    """As in `Spec`."""
    steps: int
    """As in `Spec`."""
    evaluation: int
    """As in `Spec`."""
    evaluations: tuple[tuple[str, ConditionSettings], ...] = ()
    """Names and settings under which the trained team is evaluated beside its own."""
    curriculum: tuple[Stage, ...] = ()
    """Stages that the team is trained in before its own scenario."""
    evaluation_steps: int | None = None
    """As in `Spec`."""
    keep_teams: bool = False
    """As in `Spec`; changes nothing that is measured, and is no part of its identity."""
    sources: Sources = field(default_factory=Sources, compare=False)
    """The files of users that it names; what they mean is part of its identity."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Settings of a user's thing are of a class that only its file can make again.
        evaluations = [(name, other.model_dump()) for name, other in self.evaluations]
        curriculum = [(s.name, s.episodes, s.scenario.model_dump()) for s in self.curriculum]
        plain = {name: vars(self)[name] for name in ("condition", "seed", *AS_IN_SPEC)}
        return _revived, (self.sources, self.settings.model_dump(), evaluations, curriculum, plain)

    @cached_property
    def identity(self) -> str:
        """Hash of the canonical content and of the version of the code that matters."""
        content = json.dumps(
            {**self._content, "seed": self.seed},
            sort_keys=True, separators=(",", ":"), allow_nan=False,
        )  # fmt: skip
        return hashlib.sha256(content.encode()).hexdigest()[:32]

    @cached_property
    def _content(self) -> dict[str, Any]:
        """What is hashed, but for the seed."""
        content: dict[str, Any] = {
            "version": RESULTS_VERSION,
            "study": self.study,
            "settings": self.settings.model_dump(mode="json"),
            "episodes": self.episodes,
            "steps": self.steps,
            "evaluation": self.evaluation,
        }
        if self.evaluation_steps is not None:
            content["evaluation_steps"] = self.evaluation_steps
        if self.evaluations:
            own = self.settings
            content["evaluations"] = [
                [name, (other.scenario if other.acts_as(own) else other).model_dump(mode="json")]
                for name, other in self.evaluations
            ]
        if self.curriculum:
            content["curriculum"] = [stage.table() for stage in self.curriculum]
        if files := sorted(named([self.study, content])):
            content["sources"] = {name: self.sources.digest(name) for name in files}
        return content

    def with_seed(self, seed: int) -> Trial:
        """Return the trial with another seed; what both have in common is not written out again."""
        other = replace(self, seed=seed)
        vars(other)["_content"] = self._content
        return other

    def world(self) -> Scenario:
        """Return its scenario as the settings describe it, built anew."""
        with self.sources.active():
            return as_scenario(self.settings.scenario.build())

    @property
    def planned(self) -> Planned:
        """What a store notes of it."""
        return Planned(self.identity, self.condition, self.seed, self.recorded)

    @property
    def lengths(self) -> str:
        """Its episodes of training, stage by stage, in words."""
        return lengths([[stage.episodes for stage in self.curriculum]], self.episodes)

    @property
    def recorded(self) -> dict[int, str]:
        """Names of the training episodes that are recorded, by number.

        The first and the last; if something is scheduled to fail, also that one and the one before.
        """
        named = {}
        onset = self.settings.scenario.onset
        if onset is not None:
            named = {onset - 1: "before", onset: "after"}
        named |= {0: "first", self.episodes - 1: "last"}
        return {k: named[k] for k in sorted(named) if 0 <= k < self.episodes}


@dataclass(frozen=True)
class TrialResult:
    """What a trial measured."""

    rows: tuple[EpisodeRow, ...]
    """The episodes in order, training first. A function of the trial, bit by bit."""
    measures: tuple[Measure, ...]
    """What is measured of them; of some episodes a part, if scenarios of evaluations differ."""
    recordings: dict[str, Recording]
    """Training episodes by name, those of `Trial.recorded`; none if the scenario is no
    `RecordedScenario`. Under `TEAM` the arrays of the trained team, if it is to be kept. A function
    of the trial, too."""
    seconds: dict[str, float]
    """Time spent in each part of the control loop; differs from run to run."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Further measurements of the trial as a whole by name; a function of the trial."""
    usage: Mapping[str, float] = field(default_factory=dict)
    """What it took beside time, by name; differs from run to run."""


def trials_of(spec: Spec) -> tuple[Trial, ...]:
    """Return the trials of a spec: seed by seed, so that every condition advances alike."""
    first = [
        Trial(
            condition=condition.label,
            settings=condition.settings,
            seed=spec.seeds[0],
            evaluations=condition.evaluations,
            curriculum=condition.curriculum,
            sources=spec.sources,
            **{name: value for name, value in spec if name in AS_IN_SPEC},
        )
        for condition in spec.conditions()
    ]
    return tuple(trial.with_seed(seed) for seed in spec.seeds for trial in first)


def _revived(sources: Sources, own: Any, evaluations: Any, curriculum: Any, plain: Any) -> Trial:
    """Return a trial that was pickled, its settings made again by its files."""
    made = partial(ConditionSettings.model_validate, strict=True)
    with sources.active():
        stages = [(name, n, made({"scenario": table}).scenario) for name, n, table in curriculum]
        return Trial(
            settings=made(own),
            evaluations=tuple((name, made(table)) for name, table in evaluations),
            curriculum=tuple(Stage(*stage) for stage in stages),
            sources=sources,
            **plain,
        )
