"""A trial: one condition, one seed, and what running it gives: a pure function of its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from ...core.acting import Actors
from ...core.arrays import IntArray
from ...core.learners import LearnerSettings, TeamSettings
from ...core.loop import policy_seed
from ...core.peers.seen import SeenScenario
from ...core.protocols import Measure, Scenario, measures_of
from ...core.rows import carried_rows
from ...core.settings import ScenarioSettings
from ...core.sources import Sources, named
from ...core.team import Team, of_fuzzy_agents
from ..spec.conditions import Condition, ConditionSettings
from ..spec.curriculum import Stage, lengths
from ..spec.errors import SpecError
from ..spec.spec import Spec
from .episodes import EpisodeRow, Recording
from .measures import joined

RESULTS_VERSION = 4
"""Raise it when the code changes so that the same trial gives other results."""
PLAIN = ("study", "condition", "seed", "episodes", "steps", "evaluation", "evaluation_steps")
"""What of a trial any process can read as it is."""


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
    seed, episodes, steps, evaluation, evaluation_steps
        As in `Spec`.
    evaluations
        Names and scenarios in which the trained team is evaluated beside its own.
    curriculum
        Stages that the team is trained in before its own scenario.
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
    curriculum: tuple[Stage, ...] = ()
    evaluation_steps: int | None = None
    sources: Sources = field(default_factory=Sources, compare=False)

    def __reduce__(self) -> tuple[Any, ...]:
        # Settings of a user's thing are of a class that only its file can make again.
        content = {
            **{name: getattr(self, name) for name in PLAIN},
            "settings": self.settings.model_dump(),
            "evaluations": [(name, scenario.model_dump()) for name, scenario in self.evaluations],
            "curriculum": [(s.name, s.episodes, s.scenario.model_dump()) for s in self.curriculum],
        }
        return _revived, (self.sources, content)

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
        if self.evaluation_steps is not None:
            content["evaluation_steps"] = self.evaluation_steps
        if self.evaluations:
            content["evaluations"] = [
                [name, scenario.model_dump(mode="json")] for name, scenario in self.evaluations
            ]
        if self.curriculum:
            content["curriculum"] = [stage.table() for stage in self.curriculum]
        if files := sorted(named([self.study, content])):
            content["sources"] = {name: self.sources.digest(name) for name in files}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def world(self) -> Scenario:
        """Return its scenario as the settings describe it, built anew."""
        with self.sources.active():
            built: Scenario = self.settings.scenario.build()
        return built

    @property
    def lengths(self) -> str:
        """Its episodes of training, stage by stage, in words."""
        return lengths([[stage.episodes for stage in self.curriculum]], self.episodes)

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
            curriculum=condition.curriculum,
            evaluation_steps=spec.evaluation_steps,
            sources=spec.sources,
        )
        for seed in spec.seeds
        for condition in spec.conditions()
    )


class Arrangement(NamedTuple):
    """A world and those who act in it."""

    world: Scenario
    """As the settings describe it."""
    scenario: Scenario
    """The same as the agents see it, which may be as one agent."""
    team: Actors
    """The agents."""

    def take_over(self, former: Arrangement, settings: TeamSettings) -> None:
        """Let the team begin where that of another world ended.

        Raises
        ------
        ValueError
            If it cannot, see `carried_rows` and `Team.take_over`; one line.
        """
        rows = self._rows(former, settings)
        of_fuzzy_agents(self.team).take_over(of_fuzzy_agents(former.team), rows)

    def with_trained(self, former: Arrangement, settings: TeamSettings) -> Arrangement:
        """Return it with the team that was trained in another world: to be evaluated, not to learn.

        That is the former team itself if the agents are the same, else one that takes over.

        Raises
        ------
        ValueError
            As `take_over`.
        """
        rows = self._rows(former, settings)
        if self.scenario.agents == former.scenario.agents:
            return self._replace(team=former.team)
        of_fuzzy_agents(self.team).take_over(of_fuzzy_agents(former.team), rows)
        return self

    def _rows(self, former: Arrangement, settings: TeamSettings) -> IntArray:
        shared = isinstance(settings, LearnerSettings) and settings.weights == "role"
        return carried_rows(former.scenario, self.scenario, shared=shared)


def arrange(settings: ConditionSettings, seed: int) -> Arrangement:
    """Return the world of a condition and its untrained team.

    Raises
    ------
    ValueError
        If the settings do not fit together; one line.
    """
    world = settings.scenario.build()
    scenario, hierarchy = settings.topology.arrange(world)
    learner, source = settings.learner, policy_seed(seed)
    if isinstance(learner, LearnerSettings):
        team: Actors = Team.build(learner, scenario, hierarchy, source)
    else:
        scenario = SeenScenario(scenario)
        team = learner.build(scenario, source)
    return Arrangement(world, scenario, team)


def build(settings: ConditionSettings, seed: int) -> tuple[Scenario, Team]:
    """Return the scenario and the untrained team of fuzzy agents of a condition; see `arrange`."""
    found = arrange(settings, seed)
    return found.scenario, of_fuzzy_agents(found.team)


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
            found += [measures_of(world) for world in _worlds(condition, where)]
    return joined(found, conditions[0].columns)


def _worlds(condition: Condition, where: str) -> Iterator[Scenario]:
    """Yield a condition's own world and those of its stages and evaluations, if all can be built.

    Raises
    ------
    SpecError
        If one cannot be, or what is learned in one means nothing in the next.
    """
    settings = condition.settings
    own = _built(settings, where)
    yield own.world
    reached: Arrangement | None = None
    for stage in condition.curriculum:
        there = _built(_changed(settings, stage.scenario), f" (stage {stage.name!r}){where}")
        yield there.world
        if reached is not None:
            with _naming(f"curriculum.{stage.name}", where):
                there.take_over(reached, settings.learner)
        reached = there
    if reached is not None:
        with _naming("curriculum", where):
            own.take_over(reached, settings.learner)
    for name, scenario in condition.evaluations:
        there = _built(_changed(settings, scenario), f" (evaluation {name!r}){where}")
        yield there.world
        with _naming(f"evaluations.{name}", where):
            there.with_trained(own, settings.learner)


def _changed(settings: ConditionSettings, scenario: ScenarioSettings) -> ConditionSettings:
    return settings.model_copy(update={"scenario": scenario})


def _built(settings: ConditionSettings, where: str) -> Arrangement:
    try:
        found = arrange(settings, 0)
        learner = settings.learner
        if isinstance(learner, LearnerSettings) and learner.decision.rule != "value":
            found.scenario.reset(0)
            found.team.check(found.scenario.predict())
    except ValueError as error:
        raise SpecError(f"{error}{where}") from None
    return found


@contextmanager
def _naming(key: str, where: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise SpecError(f"{key}: {error}{where}") from None


def _revived(sources: Sources, content: dict[str, Any]) -> Trial:
    """Return a trial that was pickled, its settings made again by its files."""

    def scenario(table: dict[str, Any]) -> ScenarioSettings:
        return ConditionSettings.model_validate({"scenario": table}, strict=True).scenario

    with sources.active():
        made = {
            "settings": ConditionSettings.model_validate(content["settings"], strict=True),
            "evaluations": tuple((name, scenario(s)) for name, s in content["evaluations"]),
            "curriculum": tuple(
                Stage(name, episodes, scenario(s)) for name, episodes, s in content["curriculum"]
            ),
        }
    return Trial(**{**content, **made}, sources=sources)
