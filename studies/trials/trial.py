"""A trial: one condition, one seed, and what running it gives: a pure function of its content.

It gives what is measured of its episodes, and what is recorded of them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from ...core.interface.measures import Measure
from ...core.interface.scenario import Scenario, checked_scenario
from ...core.plugins.settings import Settings, changed_values
from ...core.plugins.sources import Sources, files_in
from ..spec.conditions import ConditionSettings, Stage
from ..spec.outline import lengths
from ..spec.tables import SpecTable
from ..store.database import RESULTS_VERSION, Planned
from ..store.durable import Recording
from .episodes import EpisodeRow

if TYPE_CHECKING:
    from ..spec.spec import Spec


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
    decisions: int | None = None
    """As in `Spec`."""
    keep_teams: bool = False
    """As in `Spec`; changes nothing that is measured, and is no part of its identity."""
    sources: Sources = field(default_factory=Sources, compare=False)
    """The files of users that it names; what they mean is part of its identity."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Settings of a user's thing are of a class that only its file can make again.
        evaluations = [(name, other.model_dump()) for name, other in self.evaluations]
        curriculum = [(s.name, s.episodes, s.scenario.model_dump()) for s in self.curriculum]
        plain = {
            "study": self.study,
            "condition": self.condition,
            "seed": self.seed,
            "episodes": self.episodes,
            "steps": self.steps,
            "evaluation": self.evaluation,
            "evaluation_steps": self.evaluation_steps,
            "decisions": self.decisions,
            "keep_teams": self.keep_teams,
        }
        return revive, (self.sources, self.settings.model_dump(), evaluations, curriculum, plain)

    @cached_property
    def identity(self) -> str:
        """Hash of the seed, of all settings that differ from their defaults, and of the version."""
        content = {**self._content, "seed": self.seed}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    @cached_property
    def _content(self) -> dict[str, Any]:
        """What is hashed, except the seed."""
        evaluations = {name: self._own_part(other) for name, other in self.evaluations}
        content: dict[str, Any] = {
            "version": RESULTS_VERSION,
            "study": self.study,
            "settings": changed_values(self.settings),
            "episodes": self.episodes,
            "steps": self.steps,
            "evaluation": self.evaluation,
            "evaluation_steps": self.evaluation_steps,
            "decisions": self.decisions,
            "evaluations": [[name, changed_values(own)] for name, own in evaluations.items()],
            "curriculum": [
                [stage.name, stage.episodes, changed_values(stage.scenario)]
                for stage in self.curriculum
            ],
        }
        everything = [self.settings, *evaluations.values(), *(s.scenario for s in self.curriculum)]
        files = sorted(files_in([self.study, *(own.model_dump() for own in everything)]))
        return content | {"sources": {name: self.sources.digest(name) for name in files}}

    def _own_part(self, other: ConditionSettings) -> Settings:
        """Return what settings of an evaluation have that the trial's own have not."""
        return other.scenario if other.acts_as(self.settings) else other

    def with_seed(self, seed: int) -> Trial:
        """Return the trial with another seed; what both have in common is not written out again."""
        other = replace(self, seed=seed)
        vars(other)["_content"] = self._content
        return other

    def world(self) -> Scenario:
        """Return its scenario as the settings describe it, built anew."""
        with self.sources.active():
            return checked_scenario(self.settings.scenario.build())

    @property
    def planned(self) -> Planned:
        """What a store notes of it."""
        return Planned(self.identity, self.condition, self.seed, self.recorded)

    @property
    def lengths(self) -> str:
        """Its episodes of training, stage by stage, or its decisions, in words."""
        if self.decisions is not None:
            return f"{self.decisions} decisions"
        return lengths([[stage.episodes for stage in self.curriculum]], self.episodes)

    @cached_property
    def recorded(self) -> dict[int, str]:
        """Names of the training episodes that are recorded, by number.

        The first and the last; if something is scheduled to fail, also that one and the one before.
        """
        names = {}
        onset = self.settings.onset
        if onset is not None:
            names = {onset - 1: "before", onset: "after"}
        names |= {0: "first", self.episodes - 1: "last"}
        return {k: names[k] for k in sorted(names) if 0 <= k < self.episodes}


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
            study=spec.study,
            episodes=spec.episodes,
            steps=spec.steps,
            evaluation=spec.evaluation,
            evaluation_steps=spec.evaluation_steps,
            decisions=spec.decisions,
            keep_teams=spec.keep_teams,
        )
        for condition in spec.conditions()
    ]
    return tuple(trial.with_seed(seed) for seed in spec.seeds for trial in first)


"""Settings, as plain values."""


def revive(
    sources: Sources,
    settings: SpecTable,
    evaluations: Sequence[tuple[str, SpecTable]],
    curriculum: Sequence[tuple[str, int, SpecTable]],
    plain: SpecTable,
) -> Trial:
    """Return a trial that was pickled, its settings made again by its files."""
    build = partial(ConditionSettings.model_validate, strict=True)
    with sources.active():
        stages = [Stage(n, k, build({"scenario": table}).scenario) for n, k, table in curriculum]
        return Trial(
            settings=build(settings),
            evaluations=tuple((name, build(table)) for name, table in evaluations),
            curriculum=tuple(stages),
            sources=sources,
            **plain,
        )
