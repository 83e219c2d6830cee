"""A trial: one condition, one seed. Running it is a pure function of its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ...core.loop import StepRecord, control_loop, policy_seed, world_seed
from ...core.protocols import Measure, RecordedScenario, Scenario, measures_of
from ...core.settings import ScenarioSettings
from ...core.sources import Sources, named
from ...core.team import Team
from ..spec.conditions import ConditionSettings
from ..spec.errors import SpecError
from ..spec.spec import Spec
from .episodes import EpisodeMeter, EpisodeRecorder, EpisodeRow, Recording, Stopwatch
from .measures import joined

RESULTS_VERSION = 4
"""Raise it when the code changes so that the same trial gives other results."""

EVALUATION_WORLDS = 10**6
"""Number of the first evaluation episode's world: after any training, and the same for all."""

Observer = Callable[[StepRecord], None]
"""Is shown every step of some episodes, as it is done."""


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
    return _arranged(settings, settings.scenario.build(), seed)


def _arranged(settings: ConditionSettings, world: Scenario, seed: int) -> tuple[Scenario, Team]:
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


def measures_of_spec(spec: Spec) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, as `check` does, but build scenarios only.

    Raises
    ------
    SpecError
        If the measures of its scenarios do not fit together.
    ValueError
        If one cannot be built.
    """
    conditions = spec.conditions()
    settings = [
        scenario
        for c in conditions
        for scenario in (c.settings.scenario, *(elsewhere for _, elsewhere in c.evaluations))
    ]
    with spec.sources.active():
        return joined([measures_of(s.build()) for s in settings], conditions[0].columns)


def _built(settings: ConditionSettings, where: str) -> tuple[Scenario, Scenario]:
    """Return a condition's world, and the same as its agents see it."""
    try:
        world = settings.scenario.build()
        scenario, team = _arranged(settings, world, 0)
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


class Session:
    """A trial under way: its scenario, its team, and what has been measured so far.

    Parameters
    ----------
    trial
        The trial; its team is untrained to begin with.

    Attributes
    ----------
    world
        The scenario as the settings describe it.
    scenario
        The same as the agents see it.
    team
        The agents.
    """

    def __init__(self, trial: Trial) -> None:
        self.trial = trial
        self.world = trial.settings.scenario.build()
        self.scenario, self.team = _arranged(trial.settings, self.world, trial.seed)
        self.deciding: list[float] = []
        """Seconds of every decision in training."""
        self._rows: list[EpisodeRow] = []
        self._measures = measures_of(self.world)
        self._recordings: dict[str, Recording] = {}
        self._watch = Stopwatch()

    def train(
        self,
        episodes: int,
        first: int = 0,
        *,
        phase: str = "training",
        team: Team | None = None,
        observe: Observer | None = None,
    ) -> None:
        """Let the team (or another one, whose time is not counted) explore, learn, be measured.

        Recorded are, of the trial's own team, the episodes of `Trial.recorded`. Every step is shown
        to `observe`.
        """
        is_recorded = (
            team is None
            and isinstance(self.world, RecordedScenario)
            and len(self.world.recorded) > 0
        )
        kept = self.trial.recorded if is_recorded else {}
        trained = self.team if team is None else team
        measures = measures_of(self.world)
        for record in control_loop(
            self.scenario, trained, episodes=episodes, steps=self.trial.steps,
            seed=self.trial.seed, first_episode=first,
        ):  # fmt: skip
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode, measures)
                if record.episode in kept:
                    recorder = EpisodeRecorder(_opened(self.trial, record.episode))
            meter.add(record.transition)
            if record.episode in kept:
                recorder.add(record.transition)
            if team is None:
                self._watch.add(record)
                self.deciding.append(record.deciding)
            if observe is not None:
                observe(record)
            if record.last:
                self._rows.append(meter.row())
                if record.episode in kept:
                    self._recordings[kept[record.episode]] = recorder.recording()

    def evaluate(self, observe: Observer | None = None) -> None:
        """Let the team act greedily on worlds of no training, and show every step to `observe`."""
        self._evaluate(self.scenario, measures_of(self.world), "evaluation", observe)

    def evaluate_elsewhere(self, observers: Mapping[str, Observer] | None = None) -> None:
        """Evaluate in each of the trial's `evaluations`, whatever the others are.

        The steps of each are shown to the observer of its name, if there is one.
        """
        state = self.team.rng.bit_generator.state
        for name, settings in self.trial.evaluations:
            self.team.rng.bit_generator.state = state
            world = settings.build()
            scenario, _ = self.trial.settings.topology.arrange(world)
            measures = measures_of(world)
            self._measures = joined((self._measures, measures))
            observe = (observers or {}).get(name)
            self._evaluate(scenario, measures, f"evaluation:{name}", observe)

    def _evaluate(
        self,
        scenario: Scenario,
        measures: Sequence[Measure],
        phase: str,
        observe: Observer | None,
    ) -> None:
        for record in control_loop(
            scenario, self.team, episodes=self.trial.evaluation,
            steps=self.trial.steps, seed=self.trial.seed, first_episode=EVALUATION_WORLDS,
            learn=False,
        ):  # fmt: skip
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - EVALUATION_WORLDS, measures)
            meter.add(record.transition)
            if observe is not None:
                observe(record)
            if record.last:
                self._rows.append(meter.row())

    def result(
        self,
        numbers: Mapping[str, float] | None = None,
        usage: Mapping[str, float] | None = None,
    ) -> TrialResult:
        """Return what has been measured, and what the measure adds to it."""
        return TrialResult(
            tuple(self._rows), self._measures, self._recordings, self._watch.seconds,
            numbers or {}, usage or {},
        )  # fmt: skip


def run_trial(trial: Trial) -> TrialResult:
    """Train a team from scratch, evaluate it greedily, and return what was measured.

    World and policy draw from separate streams, so conditions of equal seed meet equal worlds.
    """
    session = Session(trial)
    session.train(trial.episodes)
    session.evaluate()
    session.evaluate_elsewhere()
    return session.result()


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


def _opened(trial: Trial, episode: int) -> RecordedScenario:
    """Return a like of a trial's scenario before an episode's first step, which no record holds."""
    scenario = trial.settings.scenario.build()
    scenario.reset(world_seed(trial.seed, episode), episode)
    return scenario
