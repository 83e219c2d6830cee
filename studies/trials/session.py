"""Running a trial: a team is trained and evaluated, and what is measured of it kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

from ...core.agents.loop import StepRecord, control_loop, world_seed
from ...core.agents.team import Team
from ...core.interface.scenario import Actors, EpisodeRecorder, RecordedScenario, measures_of
from ..store.durable import TEAM, Recording
from ..store.schema import EVALUATION, STAGE
from .arrangement import Arrangement, arrange, teach, transfer
from .episodes import EpisodeMeter, EpisodeRow, Stopwatch, joined
from .trial import Trial, TrialResult

EVALUATION_WORLDS = 10**6
"""Number of the first evaluation episode's world: after any training, and the same for all."""

CURRICULUM_WORLDS = 2 * 10**6
"""The same of the first episode of a curriculum."""

SAMPLED = f"{EVALUATION}sampled actions"
"""Phase of the evaluation by actions drawn from a policy, not by the most probable ones."""

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
        self._own = arrange(trial.settings, trial.seed)
        self.world, self.scenario, self.team = self._own
        self._stages = trial.curriculum  # those that the team has not gone through
        self.deciding: list[float] = []
        """Seconds of every decision in training."""
        self._rows: list[EpisodeRow] = []
        self._measures = measures_of(self.world)
        self._recordings: dict[str, Recording] = {}
        self._watch = Stopwatch()

    @classmethod
    def compiled(cls, trial: Trial) -> Session:
        """Return a session whose times hold no compilation, which is done once a process."""
        cls(replace(trial, episodes=1, steps=3, curriculum=())).train(1)
        return cls(trial)

    @classmethod
    def restored(cls, trial: Trial, arrays: Recording) -> Session:
        """Return a session whose team is trained: it is one that a trial of the same kept.

        Raises
        ------
        ValueError
            If the trial cannot be built, or the arrays are of another team.
        """
        session = cls(trial)
        team: Any = session.team
        team.restore(arrays)
        session._stages = ()
        return session

    def train(
        self,
        episodes: int,
        first: int = 0,
        *,
        phase: str = "training",
        team: Actors | None = None,
        observe: Observer | None = None,
    ) -> None:
        """Let the team (or another one, whose time is not counted) explore, learn, be measured.

        Before its first episode the team goes through the trial's curriculum. Recorded are, of the
        trial's own team, the episodes of `Trial.recorded`. Every step is shown to `observe`.
        """
        self._go_through_curriculum()
        is_recorded = isinstance(self.world, RecordedScenario) and len(self.world.recorded) > 0
        kept = self.trial.recorded if team is None and is_recorded else {}
        there = self._own if team is None else self._own._replace(team=team)
        loop: dict[str, Any] = {
            "episodes": episodes,
            "steps": self.trial.steps,
            "first_episode": first,
        }
        if observe is None and not kept and self._at_once(there, phase, **loop):
            return
        own: list[Observer] = [self._time] if team is None else []
        own += [self._record] if kept else []
        self._run(there, phase, [*own, observe], **loop)

    def _time(self, record: StepRecord) -> None:
        """Sum up what the parts of a step took."""
        self._watch.add(record)
        self.deciding.append(record.deciding)

    def _record(self, record: StepRecord) -> None:
        """Record a step if it is of an episode of `Trial.recorded`."""
        name = self.trial.recorded.get(record.episode)
        if name is None:
            return
        if record.step == 0:  # no record holds what there was before
            scenario = self.trial.settings.scenario.build()
            scenario.reset(world_seed(self.trial.seed, record.episode), record.episode)
            self._recorder = EpisodeRecorder(scenario)
        self._recorder.add(record.transition)
        if record.last:
            recording = self._recorder.recording()
            if isinstance(self.team, Team) and self.team.messages.fail:
                failing = self.team.messages.failing(record.episode, record.step + 2)
                recording["messages_fail"] = failing
            self._recordings[name] = recording

    def evaluate(self, observe: Observer | None = None, phase: str = "evaluation") -> None:
        """Let the team act greedily on worlds of no training, and show every step to `observe`.

        A team is kept, if the trial is to keep it, as it begins the last of these.
        """
        self._go_through_curriculum()
        self._keep_team()
        self._evaluate(self._own, phase, observe)

    def run_other_evaluations(self, observers: Mapping[str, Observer] | None = None) -> None:
        """Evaluate in each of the trial's `evaluations`, whatever the others are.

        The same agents are the same team; others take over what it has learned. The steps of each
        are shown to the observer of its name, if there is one. A team whose policy is one of
        probabilities, which says so by ``is_sampled``, is evaluated by sampled actions as well.
        """
        self._go_through_curriculum()
        trial, rng = self.trial, self.team.rng.bit_generator
        state = rng.state
        if getattr(self.team, "is_sampled", False):
            self._evaluate(self._own, SAMPLED, None, explore=True)
            rng.state = state
        for name, there in transfer(self._own, trial.settings, trial.evaluations, trial.seed):
            self._note_measures(there)
            self._evaluate(there, f"{EVALUATION}{name}", (observers or {}).get(name))
            rng.state = state

    def finish(
        self, numbers: Mapping[str, float] | None = None, usage: Mapping[str, float] | None = None
    ) -> TrialResult:
        """Evaluate the team, also in the trial's `evaluations`; return the `result`."""
        self.evaluate()
        self.run_other_evaluations()
        return self.result(numbers, usage)

    def _keep_team(self) -> None:
        if self.trial.keep_teams:
            arrays = self.team.arrays()
            self._recordings[TEAM] = {name: array.copy() for name, array in arrays.items()}

    def _note_measures(self, there: Arrangement) -> None:
        self._measures = joined((self._measures, measures_of(there.world)))

    def _go_through_curriculum(self) -> None:
        """Train team after team in the stages that are left; the trial's own takes over at last."""
        trial, stages, self._stages = self.trial, self._stages, ()
        done = 0
        for stage, there in teach(self._own, trial.settings, stages, trial.seed):
            self._note_measures(there)
            self._run(
                there, f"{STAGE}{stage.name}", counted_from=-done, episodes=stage.episodes,
                steps=trial.steps, first_world=CURRICULUM_WORLDS + done,
            )  # fmt: skip
            done += stage.episodes

    def _evaluate(
        self, there: Arrangement, phase: str, observe: Observer | None, *, explore: bool = False
    ) -> None:
        loop: dict[str, Any] = {
            "episodes": self.trial.evaluation,
            "first_episode": EVALUATION_WORLDS,
        }
        loop["steps"] = self.trial.evaluation_steps or self.trial.steps
        if observe is None and self._at_once(there, phase, **loop, learn=False):
            return
        self._run(there, phase, [observe], EVALUATION_WORLDS, **loop, learn=False, explore=explore)

    def _run(
        self,
        there: Arrangement,
        phase: str,
        observers: Sequence[Observer | None] = (),
        counted_from: int = 0,
        **loop: Any,
    ) -> None:
        """Run a `control_loop`, show its steps to observers, and keep the row of each episode.

        The number of an episode in its row is counted from `counted_from`.
        """
        measures = measures_of(there.world)
        for record in control_loop(there.scenario, there.team, seed=self.trial.seed, **loop):
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - counted_from, measures)
            meter.add(record.transition)
            for observe in filter(None, observers):
                observe(record)
            if record.last:
                self._rows.append(meter.row())

    def _at_once(
        self,
        there: Arrangement,
        phase: str,
        *,
        episodes: int,
        steps: int,
        first_episode: int,
        learn: bool = True,
    ) -> bool:
        """Run whole episodes compiled and keep their rows, or return that it cannot be done."""
        scenario = there.scenario
        if not hasattr(scenario, "run_episode") or not isinstance(there.team, Team):
            return False
        for episode in range(first_episode, first_episode + episodes):
            begin = perf_counter()
            seed = world_seed(self.trial.seed, episode)
            summary = scenario.run_episode(there.team, seed, episode, steps, learn=learn)
            if summary is None:
                return False
            if learn and there.team is self.team:
                spent = perf_counter() - begin
                self._watch.seconds["decision"] += spent
                self.deciding += [spent / summary.steps] * summary.steps
            number = episode if learn else episode - first_episode
            row = EpisodeRow(phase, number, summary.steps, summary.measures, summary.return_)
            self._rows.append(row)
        return True

    def result(
        self, numbers: Mapping[str, float] | None = None, usage: Mapping[str, float] | None = None
    ) -> TrialResult:
        """Return what has been measured, and what the measure adds to it."""
        if TEAM not in self._recordings:  # was never evaluated
            self._keep_team()
        return TrialResult(
            tuple(self._rows), self._measures, self._recordings, self._watch.seconds,
            numbers or {}, usage or {},
        )  # fmt: skip


def run_trial(trial: Trial) -> TrialResult:
    """Train a team from nothing, evaluate it greedily, and return what was measured.

    World and policy draw from separate streams, so conditions of equal seed meet equal worlds.
    """
    session = Session(trial)
    session.train(trial.episodes)
    return session.finish()
