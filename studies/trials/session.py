"""Running a trial: a team is trained and evaluated, and what is measured of it kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from ...core.loop import StepRecord, control_loop, world_seed
from ...core.protocols import Measure, RecordedScenario, Scenario, measures_of
from ...core.team import Team
from .episodes import EpisodeMeter, EpisodeRecorder, EpisodeRow, Recording, Stopwatch
from .measures import joined
from .trial import Trial, TrialResult, arranged

EVALUATION_WORLDS = 10**6
"""Number of the first evaluation episode's world: after any training, and the same for all."""

Observer = Callable[[StepRecord], None]
"""Is shown every step of some episodes, as it is done."""


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
        self.scenario, self.team = arranged(trial.settings, self.world, trial.seed)
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
        steps = control_loop(
            self.scenario, self.team if team is None else team, episodes=episodes,
            steps=self.trial.steps, seed=self.trial.seed, first_episode=first,
        )  # fmt: skip
        for record in self._measured(steps, phase, measures_of(self.world), observe):
            if record.episode in kept:
                if record.step == 0:
                    recorder = EpisodeRecorder(_opened(self.trial, record.episode))
                recorder.add(record.transition)
                if record.last:
                    self._recordings[kept[record.episode]] = recorder.recording()
            if team is None:
                self._watch.add(record)
                self.deciding.append(record.deciding)

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
        steps = control_loop(
            scenario, self.team, episodes=self.trial.evaluation,
            steps=self.trial.steps, seed=self.trial.seed, first_episode=EVALUATION_WORLDS,
            learn=False,
        )  # fmt: skip
        for _ in self._measured(steps, phase, measures, observe, EVALUATION_WORLDS):
            pass

    def _measured(
        self,
        steps: Iterator[StepRecord],
        phase: str,
        measures: Sequence[Measure],
        observe: Observer | None,
        first: int = 0,
    ) -> Iterator[StepRecord]:
        """Yield the steps of episodes, show them to `observe`, and keep the row of each episode.

        Episodes are numbered in their rows from `first` on.
        """
        for record in steps:
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - first, measures)
            meter.add(record.transition)
            yield record
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


def _opened(trial: Trial, episode: int) -> RecordedScenario:
    """Return a like of a trial's scenario before an episode's first step, which no record holds."""
    scenario = trial.settings.scenario.build()
    scenario.reset(world_seed(trial.seed, episode), episode)
    return scenario
