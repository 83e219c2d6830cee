"""A trial: one condition with one seed. Its result is a pure function of its content.

The result contains measurements and recordings of its episodes.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from ...core.interface.measures import Measure
from ...core.interface.scenario import Scenario, checked_scenario
from ...core.plugins.settings import Settings, changed_values
from ...core.plugins.sources import Sources, files_in
from ..spec.conditions import ConditionSettings, Stage
from ..spec.outline import lengths
from ..store.database import RESULTS_VERSION, Planned
from ..store.durable import Recording
from .episodes import EpisodeRow

if TYPE_CHECKING:
    from ..spec.spec import Spec

LENGTHS = ("episodes", "steps", "evaluation", "evaluation_steps", "decisions")
"""Lengths of a trial, which are a part of its identity."""


@dataclass(frozen=True)
class Trial:
    """One run of a study."""

    study: str
    """Name of its study."""
    condition: str = field(compare=False)
    """Label of its condition, which is not a part of its identity."""
    settings: ConditionSettings
    """Settings of the condition."""
    seed: int
    """Seed of all random numbers."""
    episodes: int
    """Number of training episodes."""
    steps: int
    """Maximum number of decisions in an episode."""
    evaluation: int
    """Number of evaluation episodes after training."""
    evaluations: tuple[tuple[str, ConditionSettings], ...] = ()
    """Names and settings of the further evaluations of the trained team."""
    curriculum: tuple[Stage, ...] = ()
    """Stages in which the team is trained before its own scenario."""
    evaluation_steps: int | None = None
    """Maximum number of decisions in an evaluation episode; None: as in training."""
    decisions: int | None = None
    """Number of decisions of training; None if the study counts episodes."""
    keep_teams: bool = False
    """Whether the trained team is kept. Not a part of the identity: measurements are the same."""
    sources: Sources = field(default_factory=Sources, compare=False)
    """User files that it names. Digests of those that it uses are a part of its identity."""

    def __reduce__(self) -> tuple[Any, ...]:
        # The class of settings of user code exists only after its file has been run.
        content = {one.name: vars(self)[one.name] for one in fields(self)}
        content |= {
            "settings": self.settings.model_dump(),
            "evaluations": [(name, other.model_dump()) for name, other in self.evaluations],
            "curriculum": [(*s[:2], s.scenario.model_dump()) for s in self.curriculum],
        }
        return unpickle, (content,)

    @cached_property
    def identity(self) -> str:
        """Hash of the seed, of all settings that differ from their defaults, and of the version."""
        content = {**self._content, "seed": self.seed}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    @cached_property
    def _content(self) -> dict[str, Any]:
        """Hashed content except the seed."""
        evaluations = {name: self._own_part(other) for name, other in self.evaluations}
        content: dict[str, Any] = {
            "version": RESULTS_VERSION,
            "study": self.study,
            "settings": changed_values(self.settings),
            **{name: vars(self)[name] for name in LENGTHS},
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
        """Return the scenario of an evaluation, or all settings if the team acts differently."""
        return other.scenario if other.acts_as(self.settings) else other

    def with_seed(self, seed: int) -> Trial:
        """Return the trial with another seed. Both share the content that is hashed."""
        other = replace(self, seed=seed)
        vars(other)["_content"] = self._content
        return other

    def world(self) -> Scenario:
        """Build the scenario that the settings describe."""
        with self.sources.active():
            return checked_scenario(self.settings.scenario.build())

    @property
    def planned(self) -> Planned:
        """Description of the trial in a store."""
        return Planned(self.identity, self.condition, self.seed, self.recorded)

    @property
    def lengths(self) -> str:
        """Number of training episodes in each stage, or of decisions, as text."""
        if self.decisions is not None:
            return f"{self.decisions} decisions"
        return lengths([[stage.episodes for stage in self.curriculum]], self.episodes)

    @property
    def max_steps(self) -> int:
        """Maximum number of steps of all its episodes."""
        episodes = self.episodes + sum(stage.episodes for stage in self.curriculum)
        evaluated = self.evaluation * (1 + len(self.evaluations))
        training = episodes * self.steps if self.decisions is None else self.decisions
        return training + evaluated * (self.evaluation_steps or self.steps)

    @cached_property
    def recorded(self) -> dict[int, str]:
        """Names of the recorded training episodes, by number.

        The first and the last episode are recorded, and those before and after a scheduled failure.
        """
        names = {}
        onset = self.settings.onset
        if onset is not None:
            names = {onset - 1: "before", onset: "after"}
        names |= {0: "first", self.episodes - 1: "last"}
        return {k: names[k] for k in sorted(names) if 0 <= k < self.episodes}


@dataclass(frozen=True)
class TrialResult:
    """Measurements and recordings of a trial."""

    rows: tuple[EpisodeRow, ...]
    """Episodes in the order in which they ran. They are a function of the trial, bit for bit."""
    measures: tuple[Measure, ...]
    """Measures of any episode. Scenarios of evaluations may lack some of them."""
    recordings: dict[str, Recording]
    """Training episodes of `Trial.recorded` by name, if the scenario is `Recorded`. With
    `keep_teams`, `TEAM` names the arrays of the trained team. They are a function of the trial."""
    seconds: dict[str, float]
    """Duration of each part of the control loop [s]; differs from run to run."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Further measurements of the whole trial by name. They are a function of the trial."""
    usage: Mapping[str, float] = field(default_factory=dict)
    """Further resources that the trial used, by name; differs from run to run."""


def trials_of(spec: Spec) -> tuple[Trial, ...]:
    """Return the trials of a spec, seed by seed, so that all conditions advance equally."""
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


def unpickle(content: dict[str, Any]) -> Trial:
    """Return a pickled trial; the classes in its files validate its settings."""
    build = partial(ConditionSettings.model_validate, strict=True)
    with content["sources"].active():
        content["settings"] = build(content["settings"])
        evaluations = ((name, build(table)) for name, table in content["evaluations"])
        content["evaluations"] = tuple(evaluations)
        content["curriculum"] = tuple(
            Stage(name, episodes, build({"scenario": table}).scenario)
            for name, episodes, table in content["curriculum"]
        )
        return Trial(**content)
