"""A trial: one condition, one seed, and what running it gives: a pure function of its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ...core.interface.scenario import Measure, Scenario
from ...core.plugins.sources import Sources, named
from ..spec.conditions import ConditionSettings, Stage
from ..spec.labels import lengths
from ..store.durable import Recording
from ..store.schema import RESULTS_VERSION, Planned
from .episodes import EpisodeRow

if TYPE_CHECKING:
    from ..spec.spec import Spec

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
        content = {
            **{name: getattr(self, name) for name in ("condition", "seed", *AS_IN_SPEC)},
            "settings": self.settings.model_dump(),
            "evaluations": [(name, other.model_dump()) for name, other in self.evaluations],
            "curriculum": [(s.name, s.episodes, s.scenario.model_dump()) for s in self.curriculum],
        }
        return _revived, (self.sources, content)

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
            built: Scenario = self.settings.scenario.build()
        return built

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
            **{name: getattr(spec, name) for name in AS_IN_SPEC},
        )
        for condition in spec.conditions()
    ]
    return tuple(trial.with_seed(seed) for seed in spec.seeds for trial in first)


def _revived(sources: Sources, content: dict[str, Any]) -> Trial:
    """Return a trial that was pickled, its settings made again by its files."""

    def settings(table: dict[str, Any]) -> ConditionSettings:
        return ConditionSettings.model_validate(table, strict=True)

    with sources.active():
        made = {
            "settings": settings(content["settings"]),
            "evaluations": tuple((name, settings(s)) for name, s in content["evaluations"]),
            "curriculum": tuple(
                Stage(name, episodes, settings({"scenario": s}).scenario)
                for name, episodes, s in content["curriculum"]
            ),
        }
    return Trial(**{**content, **made}, sources=sources)
