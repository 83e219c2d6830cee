"""A trial: one condition, one seed. Running it is a pure function of its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import topologies
from ...core.loop import control_loop, policy_seed, world_seed
from ...core.protocols import Scenario
from ...core.team import Team
from ...scenarios.box_pushing.config import BoxPushingSettings
from ..spec.conditions import ConditionSettings
from ..spec.errors import SpecError
from ..spec.spec import Spec
from .episodes import EpisodeMeter, EpisodeRecorder, EpisodeRow, Recording, Stopwatch

RESULTS_VERSION = 3
"""Raise it when the code changes so that the same trial gives other results."""

EVALUATION_WORLDS = 10**6
"""Number of the first evaluation episode's world: after any training, and the same for all."""


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
    """

    study: str
    condition: str = field(compare=False)
    settings: ConditionSettings
    seed: int
    episodes: int
    steps: int
    evaluation: int
    evaluations: tuple[tuple[str, BoxPushingSettings], ...] = ()

    @cached_property
    def identity(self) -> str:
        """Hash of the canonical content and of the version of the code that matters."""
        content = {
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
    recordings
        Training episodes by name, those of `Trial.recorded`. A function of the trial, too.
    seconds
        Time spent in each part of the control loop; differs from run to run.
    numbers
        Further measurements of the trial as a whole by name; a function of the trial.
    usage
        What it took beside time, by name; differs from run to run.
    """

    rows: tuple[EpisodeRow, ...]
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
    scenario, hierarchy = topologies.arrange(settings.topology, settings.scenario.build())
    return scenario, Team.build(settings.learner, scenario, hierarchy, policy_seed(seed))


def check(spec: Spec) -> None:
    """Raise `SpecError` if a condition cannot be built, before anything is run or written."""
    conditions = spec.conditions()
    for condition in conditions:
        where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
        scenario = _built(condition.settings, where)
        for name, elsewhere in condition.evaluations:
            settings = condition.settings.model_copy(update={"scenario": elsewhere})
            other = _built(settings, f" (evaluation {name!r}){where}")
            _check_alike(name, scenario, other, where)


def _built(settings: ConditionSettings, where: str) -> Scenario:
    try:
        scenario, _ = build(settings, 0)
    except ValueError as error:
        raise SpecError(f"{error}{where}") from None
    return scenario


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
    """

    def __init__(self, trial: Trial) -> None:
        self.trial = trial
        self.scenario, self.team = build(trial.settings, trial.seed)
        self.deciding: list[float] = []
        """Seconds of every decision in training."""
        self._rows: list[EpisodeRow] = []
        self._recordings: dict[str, Recording] = {}
        self._watch = Stopwatch()

    def train(
        self, episodes: int, first: int = 0, *, phase: str = "training", team: Team | None = None
    ) -> None:
        """Let the team (or another one, whose time is not counted) explore, learn, be measured.

        Recorded are, of the trial's own team, the episodes of `Trial.recorded`.
        """
        kept = self.trial.recorded if team is None else {}
        trained = self.team if team is None else team
        for record in control_loop(
            self.scenario, trained, episodes=episodes, steps=self.trial.steps,
            seed=self.trial.seed, first_episode=first,
        ):  # fmt: skip
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode)
                if record.episode in kept:
                    recorder = EpisodeRecorder(_opening(self.trial, record.episode))
            meter.add(record.transition)
            if record.episode in kept:
                recorder.add(record.transition)
            if team is None:
                self._watch.add(record)
                self.deciding.append(record.deciding)
            if record.last:
                self._rows.append(meter.row(record.transition))
                if record.episode in kept:
                    self._recordings[kept[record.episode]] = recorder.recording(
                        **self.trial.settings.scenario.drawn
                    )

    def evaluate(
        self, scenario: Scenario | None = None, *, phase: str = "evaluation"
    ) -> NDArray[np.float64]:
        """Let the team act greedily, in another scenario perhaps, on worlds of no training.

        Returns
        -------
        NDArray[np.float64]
            ``(n_episodes, M)`` for how much of the time in which any robot touches the box each of
            them does.
        """
        shares = []
        for record in control_loop(
            scenario or self.scenario, self.team, episodes=self.trial.evaluation,
            steps=self.trial.steps, seed=self.trial.seed, first_episode=EVALUATION_WORLDS,
            learn=False,
        ):  # fmt: skip
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - EVALUATION_WORLDS)
                touching = []
            meter.add(record.transition)
            touching.append(record.transition.info["contact_time"])
            if record.last:
                self._rows.append(meter.row(record.transition))
                pushing = max(float(np.max(touching, axis=1).sum()), 1e-12)
                shares.append(np.sum(touching, axis=0) / pushing)
        return np.array(shares)

    def evaluate_elsewhere(self) -> dict[str, NDArray[np.float64]]:
        """Evaluate in each of the trial's `evaluations`, whatever the others are.

        Returns what `evaluate` does, by name.
        """
        shares = {}
        state = self.team.rng.bit_generator.state
        for name, settings in self.trial.evaluations:
            self.team.rng.bit_generator.state = state
            elsewhere = self.trial.settings.model_copy(update={"scenario": settings})
            scenario, _ = build(elsewhere, self.trial.seed)
            shares[name] = self.evaluate(scenario, phase=f"evaluation:{name}")
        return shares

    def result(
        self,
        numbers: Mapping[str, float] | None = None,
        usage: Mapping[str, float] | None = None,
    ) -> TrialResult:
        """Return what has been measured, and what the measure adds to it."""
        rows, seconds = tuple(self._rows), self._watch.seconds
        return TrialResult(rows, self._recordings, seconds, numbers or {}, usage or {})


def run_trial(trial: Trial) -> TrialResult:
    """Train a team from scratch, evaluate it greedily, and return what was measured.

    World and policy draw from separate streams, so conditions of equal seed meet equal worlds.
    """
    session = Session(trial)
    session.train(trial.episodes)
    session.evaluate()
    session.evaluate_elsewhere()
    return session.result()


def _opening(trial: Trial, episode: int) -> Mapping[str, Any]:
    """Return the measurements before an episode's first step, which no step record holds."""
    scenario = trial.settings.scenario.build()
    scenario.reset(world_seed(trial.seed, episode), episode)
    return scenario.measure()
