"""A trial: one condition, one seed. Running it is a pure function of its content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from .. import scenarios, topologies
from ..core.loop import control_loop, policy_seed, world_seed
from ..core.protocols import Scenario
from ..core.team import Team
from ..scenarios.config import label
from .conditions import ConditionSettings
from .episodes import EpisodeMeter, EpisodeRecorder, EpisodeRow, Recording, Stopwatch
from .spec import Spec
from .spec_errors import SpecError

RESULTS_VERSION = 1
"""Raise it when the code changes so that the same trial gives other results."""

EVALUATION_WORLDS = 10**6
"""Number of the first evaluation episode's world: after any training, and the same for all."""

CONTROL_PERIOD = 0.064
"""The paper's time step, Webots' default [s]."""


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
    """

    study: str
    condition: str = field(compare=False)
    settings: ConditionSettings
    seed: int
    episodes: int
    steps: int
    evaluation: int

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
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()[:32]


@dataclass(frozen=True)
class TrialResult:
    """What a trial measured.

    Attributes
    ----------
    rows
        The episodes in order, training first. A function of the trial, bit by bit.
    recordings
        The ``first`` and the ``last`` training episode, ``last`` alone if there is one only. A
        function of the trial, too.
    seconds
        Time spent in each part of the control loop; differs from run to run.
    """

    rows: tuple[EpisodeRow, ...]
    recordings: dict[str, Recording]
    seconds: dict[str, float]


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
    scenario, hierarchy = topologies.arrange(settings.topology, scenarios.build(settings.scenario))
    return scenario, Team.build(settings.learner, scenario, hierarchy, policy_seed(seed))


def check(spec: Spec) -> None:
    """Raise `SpecError` if a condition cannot be built, before anything is run or written."""
    conditions = spec.conditions()
    for condition in conditions:
        try:
            build(condition.settings, 0)
        except ValueError as error:
            where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
            raise SpecError(f"{error}{where}") from None


def run_trial(trial: Trial) -> TrialResult:
    """Train a team from scratch, evaluate it greedily, and return what was measured.

    World and policy draw from separate streams, so conditions of equal seed meet equal worlds.
    """
    settings = trial.settings
    scenario, team = build(settings, trial.seed)
    rows: list[EpisodeRow] = []
    recordings: dict[str, Recording] = {}
    watch = Stopwatch()
    constants: dict[str, float | str] = {
        "dt": settings.scenario.hold * CONTROL_PERIOD,
        "robot": label(settings.scenario.robot),
        "box": label(settings.scenario.box),
    }
    phases = (("training", trial.episodes, 0), ("evaluation", trial.evaluation, EVALUATION_WORLDS))
    for phase, episodes, first in phases:
        learn = phase == "training"
        kept = {0: "first", episodes - 1: "last"} if learn else {}
        for record in control_loop(
            scenario, team, episodes=episodes, steps=trial.steps, seed=trial.seed,
            first_episode=first, learn=learn,
        ):  # fmt: skip
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - first)
            if record.step == 0 and record.episode in kept:
                recorder = EpisodeRecorder(_opening(trial, record.episode))
            meter.add(record.transition)
            if record.episode in kept:
                recorder.add(record.transition)
            if learn:
                watch.add(record)
            if record.last:
                rows.append(meter.row(record.transition))
                if record.episode in kept:
                    recordings[kept[record.episode]] = recorder.recording(**constants)
    return TrialResult(tuple(rows), recordings, watch.seconds)


def _opening(trial: Trial, episode: int) -> Mapping[str, Any]:
    """Return the measurements before an episode's first step, which no step record holds."""
    scenario = scenarios.build(trial.settings.scenario)
    scenario.reset(world_seed(trial.seed, episode), episode)
    return scenario.measure()
