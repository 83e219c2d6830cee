"""A trial: one condition, one seed, and what running it gives: a pure function of its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ...core.loop import policy_seed
from ...core.protocols import Measure, Scenario, measures_of
from ...core.settings import ScenarioSettings
from ...core.sources import Sources, named
from ...core.team import Team
from ..spec.conditions import ConditionSettings
from ..spec.errors import SpecError
from ..spec.spec import Spec
from .episodes import EpisodeRow, Recording
from .measures import joined

RESULTS_VERSION = 4
"""Raise it when the code changes so that the same trial gives other results."""


@dataclass(frozen=True)
class Trial:
    """One run of a study.

    Attributes
    ----------
    study
        Name of the study that measures it.
    condition
        Label of its condition; a name only, no part of its identity.
    settings
        What the condition consists of.
    seed, episodes, steps, evaluation
        As in `Spec`.
    evaluations
        Names and scenarios in which the trained team is evaluated beside its own.
    sources
        The files of users that it names; what they mean is part of its identity.
    """

    study: str
    condition: str = field(compare=False)
    settings: ConditionSettings
    seed: int
    episodes: int
    steps: int
    evaluation: int
    evaluations: tuple[tuple[str, ScenarioSettings], ...] = ()
    sources: Sources = field(default_factory=Sources, compare=False)

    def __reduce__(self) -> tuple[Any, ...]:
        # Settings of a user's thing are of a class that only its file can make again.
        elsewhere = [(name, scenario.model_dump()) for name, scenario in self.evaluations]
        content = (self.study, self.condition, self.settings.model_dump(), self.seed)
        length = (self.episodes, self.steps, self.evaluation)
        return _revived, (self.sources, *content, *length, elsewhere)

    @cached_property
    def identity(self) -> str:
        """Hash of the canonical content and of the version of the code that matters."""
        content: dict[str, Any] = {
            "version": RESULTS_VERSION,
            "study": self.study,
            "settings": json.loads(self.settings.canonical()),
            "seed": self.seed,
            "episodes": self.episodes,
            "steps": self.steps,
            "evaluation": self.evaluation,
        }
        if self.evaluations:
            content["evaluations"] = [
                [name, scenario.model_dump(mode="json")] for name, scenario in self.evaluations
            ]
        if files := sorted(named([self.study, content])):
            content["sources"] = {name: self.sources.digest(name) for name in files}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    @property
    def recorded(self) -> dict[int, str]:
        """Names of the training episodes that are recorded, by number.

        The first and the last; if a wheel fails, also the one before, and the one in which it does.
        """
        named = {}
        onset = self.settings.scenario.onset
        if onset is not None:
            named = {onset - 1: "before", onset: "after"}
        named |= {0: "first", self.episodes - 1: "last"}
        return {k: named[k] for k in sorted(named) if 0 <= k < self.episodes}


@dataclass(frozen=True)
class TrialResult:
    """What a trial measured.

    Attributes
    ----------
    rows
        The episodes in order, training first. A function of the trial, bit by bit.
    measures
        What is measured of them; of some episodes a part, if scenarios of evaluations differ.
    recordings
        Training episodes by name, those of `Trial.recorded`; none if the scenario is no
        `RecordedScenario`. A function of the trial, too.
    seconds
        Time spent in each part of the control loop; differs from run to run.
    numbers
        Further measurements of the trial as a whole by name; a function of the trial.
    usage
        What it took beside time, by name; differs from run to run.
    """

    rows: tuple[EpisodeRow, ...]
    measures: tuple[Measure, ...]
    recordings: dict[str, Recording]
    seconds: dict[str, float]
    numbers: Mapping[str, float] = field(default_factory=dict)
    usage: Mapping[str, float] = field(default_factory=dict)


def trials_of(spec: Spec) -> tuple[Trial, ...]:
    """Return the trials of a spec: seed by seed, so that every condition advances alike."""
    return tuple(
        Trial(
            study=spec.study,
            condition=condition.label,
            settings=condition.settings,
            seed=seed,
            episodes=spec.episodes,
            steps=spec.steps,
            evaluation=spec.evaluation,
            evaluations=condition.evaluations,
            sources=spec.sources,
        )
        for seed in spec.seeds
        for condition in spec.conditions()
    )


def build(settings: ConditionSettings, seed: int) -> tuple[Scenario, Team]:
    """Return the scenario and the untrained team of a condition.

    Raises
    ------
    ValueError
        If the settings do not fit together; one line.
    """
    return arranged(settings, settings.scenario.build(), seed)


def arranged(settings: ConditionSettings, world: Scenario, seed: int) -> tuple[Scenario, Team]:
    """Return a world as its agents see it, which may be as one agent, and their untrained team."""
    scenario, hierarchy = settings.topology.arrange(world)
    return scenario, Team.build(settings.learner, scenario, hierarchy, policy_seed(seed))


def check(spec: Spec) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, if all its conditions can be built.

    Raises
    ------
    SpecError
        If one cannot be, or their measures do not fit together; before anything is run or written.
    """
    conditions = spec.conditions()
    found = []
    with spec.sources.active():
        for condition in conditions:
            where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
            world, scenario = _built(condition.settings, where)
            found.append(measures_of(world))
            for name, elsewhere in condition.evaluations:
                settings = condition.settings.model_copy(update={"scenario": elsewhere})
                world, other = _built(settings, f" (evaluation {name!r}){where}")
                _check_alike(name, scenario, other, where)
                found.append(measures_of(world))
    return joined(found, conditions[0].columns)


def _built(settings: ConditionSettings, where: str) -> tuple[Scenario, Scenario]:
    """Return a condition's world, and the same as its agents see it."""
    try:
        world = settings.scenario.build()
        scenario, team = arranged(settings, world, 0)
        if settings.learner.decision.rule != "value":
            scenario.reset(0)
            team.check(scenario.predict())
    except ValueError as error:
        raise SpecError(f"{error}{where}") from None
    return world, scenario


def _check_alike(name: str, scenario: Scenario, other: Scenario, where: str) -> None:
    if (other.agents, other.state_space) != (scenario.agents, scenario.state_space):
        raise SpecError(
            f"evaluations.{name}: a team trained with {len(scenario.agents)} agents over "
            f"{scenario.state_space.name!r} cannot act with {len(other.agents)} over "
            f"{other.state_space.name!r}{where}"
        )


def _revived(
    sources: Sources,
    study: str,
    condition: str,
    settings: dict[str, Any],
    seed: int,
    episodes: int,
    steps: int,
    evaluation: int,
    elsewhere: list[tuple[str, dict[str, Any]]],
) -> Trial:
    """Return a trial that was pickled, its settings made again by its files."""
    with sources.active():
        own = ConditionSettings.model_validate(settings, strict=True)
        evaluations = tuple(
            (name, ConditionSettings.model_validate({"scenario": s}, strict=True).scenario)
            for name, s in elsewhere
        )
    return Trial(study, condition, own, seed, episodes, steps, evaluation, evaluations, sources)
