"""Running a trial: its world and team are built, the team is trained, evaluated and measured.

A trial is known by its content alone, see `nested_agents.studies.trials.trial`, so that commands
that read results import nothing that learns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from time import perf_counter, process_time
from typing import Any

from ...core.agents.loop import (
    StepRecord,
    control_loop,
    world_seed,
)
from ...core.agents.many_environments import ManyEnvironmentsLoop
from ...core.agents.team import Team
from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import checked_scenario
from ...core.interface.stacked import LoopedEnvironments
from ...core.plugins.words import expect
from ..spec.controls import LEARN_NOTHING
from ..store.database import EVALUATION, STAGE
from ..store.durable import TEAM, Recording
from .arrangement import Arrangement, arrange, teach, transfer
from .checkpoints import Checkpoint, Reached
from .episodes import EpisodeMeter, EpisodeRow, join_measures
from .trial import Trial, TrialResult


class Stopwatch:
    """Sums the seconds that the parts of the control loop took, and keeps those of decisions."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(("decision", "physics", "sensors", "learning"), 0.0)
        self.decisions: list[float] = []

    def add(self, record: StepRecord) -> None:
        """Take in one step."""
        spent = {"decision": record.deciding, "learning": record.learning}
        spent |= record.transition.info.get("seconds", {})
        for part in self.seconds:
            self.seconds[part] += spent.get(part, 0.0)
        self.decisions.append(record.deciding)


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
        expect("a trial", Trial, trial=trial)
        self.trial = trial
        self._own = arrange(trial.settings, trial.seed)
        self.world, self.scenario, self.team = self._own
        self._stages = trial.curriculum  # those that the team has not gone through
        self._rows: list[EpisodeRow] = []
        self._measures = self._own.measures
        self._recordings: dict[str, Recording] = {}
        self._watch = Stopwatch()
        self._decided = 0
        self.deciding = self._watch.decisions
        """Seconds of every decision in training."""
        self.usage: dict[str, float] = {}
        """What a study notes on the way of what it took beside time."""
        self.spent = 0.0
        """Processor time of `train_until` so far [s]."""
        self._checkpoint: Checkpoint | None = None

    @classmethod
    def resumed(cls, trial: Trial) -> Session:
        """Return a session that goes on from the checkpoint of a trial, or begins; it writes more.

        Rows that there are already stay: who trains asks for what is left.
        """
        session = cls(trial)
        checkpoint = Checkpoint(trial)
        reached = checkpoint.read()
        if reached is not None:
            try:
                session._go_on_from(reached)
            except Exception:  # whatever may be wrong in a file
                session = cls(trial)
        session._checkpoint = checkpoint
        return session

    def _go_on_from(self, reached: Reached) -> None:
        self.team.load_state_dict(reached.team)
        if reached.environments:
            self._many.load_state_dict(reached.environments)
        self._rows = list(reached.rows)
        self.spent = reached.spent
        self._decided = sum(row.steps for row in self._rows_of_training)
        self._recordings = dict(reached.recordings)
        self._watch.seconds.update(reached.seconds)
        self.usage = dict(reached.usage)
        self._stages = ()

    def put_down(self) -> None:
        """Write a checkpoint if it is due: between episodes, or at a step of many environments."""
        if self._checkpoint is None or not self._checkpoint.is_due:
            return
        is_many = self.trial.settings.learner.n_environments > 1
        self._checkpoint.write(
            Reached(
                self._rows,
                self._watch.seconds,
                self.usage,
                self.spent,
                self._recordings,
                self.team.state_dict(),
                self._many.state_dict() if is_many else {},
            )
        )

    @property
    def phases(self) -> set[str]:
        """The phases of which there are rows."""
        return {row.phase for row in self._rows}

    @property
    def trained(self) -> int:
        """How many episodes of training there have been."""
        return len(self._rows_of_training)

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
        session.team.load_state_dict(arrays)
        session._stages = ()
        return session

    def train(
        self, episodes: int, first: int = 0, *, phase: str = "training", team: Team | None = None
    ) -> None:
        """Let the team (or another one, whose time is not counted) explore, learn, be measured.

        Before its first episode the team goes through the trial's curriculum. Recorded are, of the
        trial's own team, the episodes of `Trial.recorded`.
        """
        self._go_through_curriculum()
        is_recorded = team is None and len(self.world.recorded) > 0
        kept = self.trial.recorded if is_recorded else {}
        there = self._own if team is None else self._own._replace(team=team)
        time = self._watch.add if team is None else None
        record = self._record if kept else None
        self._run(
            there, phase, [time, record], episodes=episodes,
            steps=self.trial.steps, first_episode=first,
        )  # fmt: skip

    def train_until(self, decisions: int) -> int:
        """Train the team up to a total number of decisions; return how many there were.

        A learner of many environments trains in all of them at once. Rows are the episodes that
        ended, in this order; decisions in episodes that are still running at the end count, too.
        """
        environments = self.trial.settings.learner.n_environments
        if self.trial.settings.learner.kind in LEARN_NOTHING:
            return decisions
        begun = process_time() - self.spent
        while environments == 1 and self._decided < decisions:
            self.train(1, self.trained)
            self._decided = sum(row.steps for row in self._rows_of_training)
            self.spent = process_time() - begun
        if environments > 1:
            self._train_in_many(decisions, begun)
            self._decided = self._many.decisions
        return self._decided

    @property
    def _rows_of_training(self) -> list[EpisodeRow]:
        return [row for row in self._rows if row.phase == "training"]

    @cached_property
    def _many(self) -> ManyEnvironmentsLoop:
        settings = self.trial.settings
        count = settings.learner.n_environments
        first = arrange(settings, self.trial.seed)
        environments = first.scenario.environments(count) or LoopedEnvironments(
            [first.scenario, *(arrange(settings, 0).scenario for _ in range(count - 1))]
        )
        return ManyEnvironmentsLoop(
            environments, self.scenario, self.team, self.trial.steps, self.trial.seed
        )

    def _train_in_many(self, decisions: int, begun: float) -> None:
        begin = perf_counter()
        rates = [m.name for m in self._measures if m.source == "terminated"]
        done = self.trained
        while self._many.decisions < decisions:
            for ended in self._many.step():
                measured = dict.fromkeys(rates, ended.terminated)
                row = EpisodeRow("training", done, ended.steps, measured, ended.return_)
                self._rows.append(row)
                done += 1
            self.spent = process_time() - begun
            self.put_down()
        self._watch.seconds["learning"] += perf_counter() - begin

    def _record(self, record: StepRecord) -> None:
        """Record a step if it is of an episode of `Trial.recorded`."""
        name = self.trial.recorded.get(record.episode)
        if name is None:
            return
        if record.step == 0:  # no record holds what there was before
            scenario = checked_scenario(self.trial.settings.scenario.build())
            scenario.reset(world_seed(self.trial.seed, record.episode), record.episode)
            self._recorder = EpisodeRecorder(scenario)
        self._recorder.add(record.transition)
        if record.last:
            recording = self._recorder.recording()
            if self.team.messages.failures:
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

    def evaluate_sampled(self, phase: str = SAMPLED) -> None:
        """Evaluate by actions drawn from the policy, if the team has one of probabilities."""
        if self.team.is_stochastic:
            with self.team.drawing_apart():
                self._evaluate(self._own, phase, None, explore=True)

    def run_other_evaluations(self, observers: Mapping[str, Observer] | None = None) -> None:
        """Evaluate in each of the trial's `evaluations`, whatever the others are.

        The same agents are the same team; others take over what it has learned. The steps of each
        are shown to the observer of its name, if there is one. A team whose policy is one of
        probabilities, which says so by ``is_stochastic``, is evaluated by sampled actions as well.
        """
        self._go_through_curriculum()
        trial = self.trial
        self.evaluate_sampled()
        others = transfer(self._own, trial.settings, trial.evaluations, trial.seed)
        for name, there in others:
            with self.team.drawing_apart():
                self._evaluate(there, f"{EVALUATION}{name}", (observers or {}).get(name))

    def finish(
        self, numbers: Mapping[str, float] | None = None, usage: Mapping[str, float] | None = None
    ) -> TrialResult:
        """Evaluate the team, also in the trial's `evaluations`; return the `result`."""
        self.evaluate()
        self.run_other_evaluations()
        return self.result(numbers, usage)

    def _keep_team(self) -> None:
        if self.trial.keep_teams:
            arrays = self.team.state_dict()
            self._recordings[TEAM] = {name: array.copy() for name, array in arrays.items()}

    def _go_through_curriculum(self) -> None:
        """Train team after team in the stages that are left; the trial's own takes over at last."""
        trial, stages, self._stages = self.trial, self._stages, ()
        done = 0
        for stage, there in teach(self._own, trial.settings, stages, trial.seed):
            self._run(
                there, f"{STAGE}{stage.name}", counted_from=-done, episodes=stage.episodes,
                steps=trial.steps, first_world=CURRICULUM_WORLDS + done,
            )  # fmt: skip
            done += stage.episodes

    def _evaluate(
        self, there: Arrangement, phase: str, observe: Observer | None, *, explore: bool = False
    ) -> None:
        trial, first = self.trial, EVALUATION_WORLDS
        steps = trial.evaluation_steps or trial.steps
        self._run(
            there, phase, [observe], first, episodes=trial.evaluation,
            steps=steps, first_episode=first, learn=False, explore=explore,
        )  # fmt: skip

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
        measures = there.measures
        self._measures = join_measures((self._measures, measures))
        for record in control_loop(there.scenario, there.team, seed=self.trial.seed, **loop):
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - counted_from, measures)
            meter.add(record.transition, record.decision_costs)
            for observe in filter(None, observers):
                observe(record)
            if record.last:
                self._rows.append(meter.row())
                if phase == "training" and there.team is self.team:
                    self.put_down()

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
    session = Session.resumed(trial)
    session.train(trial.episodes - session.trained, session.trained)
    return session.finish()
