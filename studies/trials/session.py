"""Running a trial: build its scenario and team, train and evaluate the team, measure episodes.

The definition of a trial is in `nested_agents.studies.trials.trial`, so that commands that only
read results do not import learners.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from time import process_time
from typing import Any

import numpy as np

from ...core.agents.loop import StepRecord, control_loop, world_seed
from ...core.agents.many_environments import ManyEnvironmentsLoop
from ...core.agents.team import Team
from ...core.interface.abilities import Recorded
from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import checked_scenario
from ...core.interface.stacked import make_environments
from ...core.numerics import working_seconds
from ...core.plugins.words import expect
from ..spec.controls import LEARN_NOTHING
from ..store.database import EVALUATION, SAMPLED, STAGE
from ..store.durable import TEAM, Recording
from .arrangement import Arrangement, arrange, teach, transfer
from .checkpoints import Checkpoint
from .episodes import EpisodeMeter, EpisodeRow, join_measures
from .trial import Trial, TrialResult

EVALUATION_WORLDS = 10**6
"""Number of the first evaluation episode. It exceeds all training episodes and is always equal."""

CURRICULUM_WORLDS = 2 * 10**6
"""Number of the first episode of a curriculum."""

RECORDED = "recordings:"
"""Prefix of the groups of arrays in a checkpoint that hold recordings."""

Observer = Callable[[StepRecord], None]
"""Function that is called after every step of some episodes."""


class Session:
    """A running trial: its scenario, its team, and the measurements so far.

    Parameters
    ----------
    trial
        The trial. Its team is untrained at first.

    Attributes
    ----------
    world
        The scenario that the settings describe.
    scenario
        The same scenario as the team sees it.
    team
        The agents.
    decision_seconds, joint_actions
        Duration of each decision in training [s], and the number of joint actions tried in it.
    usage
        Resources that a study adds during the trial, by name.
    training_cpu_s
        Processor time of `train_until` so far [s].
    """

    def __init__(self, trial: Trial) -> None:
        expect("a trial", Trial, trial=trial)
        self.trial = trial
        self._own = arrange(trial.settings, trial.seed)
        self.world, self.scenario, self.team = self._own
        self._stages = trial.curriculum  # stages that are left
        self._rows: list[EpisodeRow] = []
        self._measures = self._own.measures
        self._recordings: dict[str, Recording] = {}
        self._tried = 0
        self._seconds = dict.fromkeys(("decision", "physics", "sensors", "learning"), 0.0)
        self._decisions = 0
        self.decision_seconds: list[float] = []
        self.joint_actions: list[int] = []
        self.usage: dict[str, float] = {}
        self.training_cpu_s = 0.0
        self._checkpoint: Checkpoint | None = None

    @classmethod
    def resumed(cls, trial: Trial) -> Session:
        """Return a session that writes checkpoints and resumes from one if there is one.

        It keeps the rows of the checkpoint. The caller trains only the episodes that are left.
        """
        session = cls(trial)
        checkpoint = Checkpoint(trial)
        state = checkpoint.read()
        if state is not None:
            try:
                session._load_state(*state)
            except Exception:  # a checkpoint of another team may fail anywhere
                session = cls(trial)
        session._checkpoint = checkpoint
        return session

    def _load_state(self, table: Mapping[str, Any], groups: Mapping[str, Recording]) -> None:
        self.team.load_state_dict(groups.get("team", {}))
        self._rows = [EpisodeRow(*row) for row in table["rows"]]
        self.training_cpu_s = table["training_cpu_s"]
        self._decisions = sum(row.steps for row in self._training_rows)
        self._recordings = {name: groups[f"{RECORDED}{name}"] for name in table["recordings"]}
        self._seconds.update(table["seconds"])
        self.decision_seconds = groups["decisions"]["seconds"].tolist()
        self.joint_actions = groups["decisions"]["joint_actions"].tolist()
        self.usage = table["usage"]
        self._stages = ()

    def save_checkpoint(self) -> None:
        """Write a checkpoint if it is due. Call it between episodes.

        A trial with several environments has none, because it trains in the middle of episodes.
        """
        is_parallel = self.trial.settings.learner.n_environments > 1
        if is_parallel or self._checkpoint is None or not self._checkpoint.is_due:
            return
        table = {
            "rows": self._rows,
            "training_cpu_s": self.training_cpu_s,
            "recordings": list(self._recordings),
            "seconds": self._seconds,
            "usage": self.usage,
        }
        groups = {f"{RECORDED}{name}": arrays for name, arrays in self._recordings.items()}
        groups["team"] = self.team.state_dict()
        groups["decisions"] = {
            "seconds": np.array(self.decision_seconds),
            "joint_actions": np.array(self.joint_actions, dtype=np.int64),
        }
        self._checkpoint.write(table, groups)

    @property
    def phases(self) -> set[str]:
        """Phases with at least one row."""
        return {row.phase for row in self._rows}

    @property
    def trained(self) -> int:
        """Number of training episodes so far."""
        return len(self._training_rows)

    @classmethod
    def restored(cls, trial: Trial, arrays: Recording) -> Session:
        """Return a session with the trained team that a trial stored.

        Raises
        ------
        ValueError
            If the trial cannot be built, or the arrays belong to another team.
        """
        session = cls(trial)
        session.team.load_state_dict(arrays)
        session._stages = ()
        return session

    def train(
        self, episodes: int, first: int = 0, *, phase: str = "training", team: Team | None = None
    ) -> None:
        """Train the team for some episodes, after the stages of the curriculum that are left.

        Parameters
        ----------
        episodes
            Number of episodes.
        first
            Number of the first episode.
        phase
            Phase of their rows.
        team
            Another team to train. Its durations are not counted, and it is not recorded.
        """
        self._train_curriculum()
        arrangement = self._own
        observers: list[Observer] = []
        if team is not None:
            arrangement = self._own._replace(team=team)
        else:
            observers.append(self._time)
            self._tried = self.team.counts.joint_actions
            is_recorded = isinstance(self.world, Recorded) and len(self.world.recorded) > 0
            if is_recorded and self.trial.recorded:
                observers.append(self._record)
        self._run(
            arrangement, phase, observers, episodes=episodes,
            steps=self.trial.steps, first_episode=first,
        )  # fmt: skip

    def train_until(self, decisions: int) -> int:
        """Train the team up to a total number of decisions and return the actual number.

        A learner with several environments trains in all of them in parallel. Rows are written in
        the order in which episodes end. Decisions of unfinished episodes count, too.
        """
        environments = self.trial.settings.learner.n_environments
        if self.trial.settings.learner.kind in LEARN_NOTHING:
            return decisions
        start = process_time() - self.training_cpu_s
        while environments == 1 and self._decisions < decisions:
            self.train(1, self.trained)
            self._decisions = sum(row.steps for row in self._training_rows)
            self.training_cpu_s = process_time() - start
        if environments > 1:
            self._train_in_parallel(decisions, start)
            self._decisions = self._parallel_loop.decisions
        return self._decisions

    @property
    def _training_rows(self) -> list[EpisodeRow]:
        return [row for row in self._rows if row.phase == "training"]

    @cached_property
    def _parallel_loop(self) -> ManyEnvironmentsLoop:
        settings = self.trial.settings
        count = settings.learner.n_environments
        environments = make_environments(lambda: arrange(settings, 0).scenario, count)
        return ManyEnvironmentsLoop(environments, self.team, self.trial.steps, self.trial.seed)

    def _train_in_parallel(self, decisions: int, start_cpu_s: float) -> None:
        start = working_seconds()
        rates = [m.name for m in self._measures if m.source == "terminated"]
        done = self.trained
        while self._parallel_loop.decisions < decisions:
            for steps, return_, terminated in self._parallel_loop.step():
                measured = dict.fromkeys(rates, terminated)
                row = EpisodeRow("training", done, steps, measured, return_)
                self._rows.append(row)
                done += 1
            self.training_cpu_s = process_time() - start_cpu_s
        self._seconds["learning"] += working_seconds() - start

    def _time(self, record: StepRecord) -> None:
        """Add the durations of a step."""
        seconds = {"decision": record.deciding, "learning": record.learning}
        seconds |= record.transition.info.get("seconds", {})
        for part in self._seconds:
            self._seconds[part] += seconds.get(part, 0.0)
        self.decision_seconds.append(record.deciding)
        tried = self.team.counts.joint_actions
        self.joint_actions.append(tried - self._tried)
        self._tried = tried

    def _record(self, record: StepRecord) -> None:
        """Record a step if `Trial.recorded` contains its episode."""
        name = self.trial.recorded.get(record.episode)
        if name is None:
            return
        if record.step == 0:  # no transition contains the initial state
            scenario = checked_scenario(self.trial.settings.scenario.build())
            scenario.reset(world_seed(self.trial.seed, record.episode), record.episode)
            assert isinstance(scenario, Recorded)
            self._recorder = EpisodeRecorder(scenario)
        self._recorder.add(record.transition)
        if record.last:
            recording = self._recorder.recording()
            if self.team.messages.failures:
                failing = self.team.messages.failing(record.episode, record.step + 2)
                recording["messages_fail"] = failing
            self._recordings[name] = recording

    def evaluate(self, observe: Observer | None = None, phase: str = "evaluation") -> None:
        """Evaluate the team greedily in new episodes and show every step to `observe`.

        With `keep_teams` the team is stored in its state before the last evaluation.
        """
        self._train_curriculum()
        self._store_team()
        self._evaluate(self._own, phase, observe)

    def evaluate_sampled(self, phase: str = SAMPLED) -> None:
        """Evaluate with sampled actions if the policy of the team is stochastic."""
        if self.team.is_stochastic:
            with self.team.drawing_apart():
                self._evaluate(self._own, phase, None, explore=True)

    def run_other_evaluations(self, observers: Mapping[str, Observer] | None = None) -> None:
        """Run each further evaluation of the trial, and one with sampled actions.

        See `transfer` for the team of an evaluation. The observer with the name of an evaluation,
        if any, is called after its steps.
        """
        self._train_curriculum()
        trial = self.trial
        self.evaluate_sampled()
        others = transfer(self._own, trial.settings, trial.evaluations, trial.seed)
        for name, arrangement in others:
            with self.team.drawing_apart():
                self._evaluate(arrangement, f"{EVALUATION}{name}", (observers or {}).get(name))

    def finish(
        self, numbers: Mapping[str, float] | None = None, usage: Mapping[str, float] | None = None
    ) -> TrialResult:
        """Run all evaluations and return the `result`."""
        self.evaluate()
        self.run_other_evaluations()
        return self.result(numbers, usage)

    def _store_team(self) -> None:
        if self.trial.keep_teams:
            arrays = self.team.state_dict()
            self._recordings[TEAM] = {name: array.copy() for name, array in arrays.items()}

    def _train_curriculum(self) -> None:
        """Train in the stages of the curriculum that are left; then the team has their weights."""
        trial = self.trial
        stages = self._stages
        self._stages = ()
        done = 0
        for stage, arrangement in teach(self._own, trial.settings, stages, trial.seed):
            self._run(
                arrangement, f"{STAGE}{stage.name}", counted_from=-done, episodes=stage.episodes,
                steps=trial.steps, first_world=CURRICULUM_WORLDS + done,
            )  # fmt: skip
            done += stage.episodes

    def _evaluate(
        self,
        arrangement: Arrangement,
        phase: str,
        observe: Observer | None,
        *,
        explore: bool = False,
    ) -> None:
        trial = self.trial
        self._run(
            arrangement,
            phase,
            [observe] if observe is not None else [],
            EVALUATION_WORLDS,
            episodes=trial.evaluation,
            steps=trial.evaluation_steps or trial.steps,
            first_episode=EVALUATION_WORLDS,
            learn=False,
            explore=explore,
        )

    def _run(
        self,
        arrangement: Arrangement,
        phase: str,
        observers: Sequence[Observer] = (),
        counted_from: int = 0,
        **loop: Any,
    ) -> None:
        """Run a `control_loop`, call observers after each step, and add a row for each episode.

        Episode numbers in rows start at `counted_from`.
        """
        scenario, team = arrangement.scenario, arrangement.team
        measures = arrangement.measures
        self._measures = join_measures((self._measures, measures))
        for record in control_loop(scenario, team, seed=self.trial.seed, **loop):
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - counted_from, measures)
            meter.add(record.transition, record.decision_costs)
            for observe in observers:
                observe(record)
            if record.last:
                self._rows.append(meter.row())
                if phase == "training" and team is self.team:
                    self.save_checkpoint()

    def result(
        self, numbers: Mapping[str, float] | None = None, usage: Mapping[str, float] | None = None
    ) -> TrialResult:
        """Return the measurements, with further numbers and resources of the study."""
        if TEAM not in self._recordings:  # the team has not been evaluated
            self._store_team()
        return TrialResult(
            tuple(self._rows), self._measures, self._recordings, self._seconds,
            numbers or {}, usage or {},
        )  # fmt: skip


def run_trial(trial: Trial) -> TrialResult:
    """Train an untrained team, evaluate it greedily, and return the measurements.

    Scenario and policy have separate random streams, so conditions with equal seeds have equal
    initial states.
    """
    session = Session.resumed(trial)
    session.train(trial.episodes - session.trained, session.trained)
    return session.finish()
