"""Running a trial: its world and team are built, the team is trained, evaluated and measured.

A trial is known by its content alone, see `nested_agents.studies.trials.trial`, so that commands
that read results import nothing that learns.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ...core.agents.loop import StepRecord, control_loop, policy_seed, world_seed
from ...core.agents.team import Team, of_fuzzy_agents
from ...core.interface.measures import Measure, measures_of
from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import Actors, RecordedScenario, Scenario, carried_rows, lacking
from ...core.learners import LearnerSettings, TeamSettings, check_prediction
from ...core.numerics import IntArray
from ...core.plugins.sources import format_error, place
from ..errors import SpecError
from ..spec.conditions import Condition, ConditionSettings, Stage
from ..spec.spec import Spec
from ..store.database import EVALUATION, STAGE
from ..store.durable import TEAM, Recording
from .trial import EpisodeMeter, EpisodeRow, Trial, TrialResult, joined

Evaluations = Sequence[tuple[str, ConditionSettings]]
"""Names and settings under which a trained team is evaluated beside its own."""


class Arrangement(NamedTuple):
    """A world and those who act in it."""

    world: Scenario
    """As the settings describe it."""
    scenario: Scenario
    """The same as the agents see it, which may be as one agent."""
    team: Actors
    """The agents."""

    def continue_from(self, former: Arrangement, settings: TeamSettings) -> None:
        """Let the team begin where that of another world ended.

        Raises
        ------
        ValueError
            If it cannot, see `carried_rows` and `Team.continue_from`; one line.
        """
        rows = self.rows_from(former, settings)
        of_fuzzy_agents(self.team).continue_from(of_fuzzy_agents(former.team), rows)

    def rows_from(self, former: Arrangement, settings: TeamSettings) -> IntArray:
        """Return the row of weights that each of its rows goes on from, see `carried_rows`."""
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
    if problem := lacking(world):
        raise ValueError(f"scenario.kind: {problem}")
    scenario, hierarchy = settings.arrange(world)
    check_prediction(settings.learner, scenario)
    learner, source = settings.learner, policy_seed(seed)
    failures = settings.topology.failures
    if isinstance(learner, LearnerSettings):
        team: Actors = Team(learner, scenario, hierarchy, source, failures)
    elif learner.uses_hierarchy and failures:
        raise ValueError(
            f"topology.failures: messages of learner.kind = {learner.kind!r} cannot fail, "
            "those of agents with rule bases can"
        )
    else:
        hierarchies = (hierarchy,) if learner.uses_hierarchy else ()
        team = learner.build(scenario, source, *hierarchies)
    return Arrangement(world, scenario, team)


def teach(
    own: Arrangement, settings: ConditionSettings, curriculum: Sequence[Stage], seed: int
) -> Iterator[tuple[Stage, Arrangement]]:
    """Yield each stage with its arrangement, which is trained before the next is asked for.

    Its team continues from that of the stage before; after the last, the team of `own` continues.

    Raises
    ------
    ValueError
        If a stage cannot be built, or what is learned in one means nothing in the next.
    """
    reached: Arrangement | None = None
    for stage in curriculum:
        with _naming(f"curriculum.{stage.name}"):
            there = arrange(settings.model_copy(update={"scenario": stage.scenario}), seed)
            if reached is not None:
                there.continue_from(reached, settings.learner)
        yield stage, there
        reached = there
    if reached is not None:
        with _naming("curriculum"):
            own.continue_from(reached, settings.learner)


def transfer(
    own: Arrangement, settings: ConditionSettings, evaluations: Evaluations, seed: int
) -> Iterator[tuple[str, Arrangement]]:
    """Yield the name and the arrangement of each further evaluation: to be evaluated, not to learn.

    Its team is that of `own` itself if the same agents decide in the same way, else one that
    continues from it.

    Raises
    ------
    ValueError
        If a scenario or a team cannot be built, or what was learned means nothing there.
    """
    for name, other in evaluations:
        with _naming(f"evaluations.{name}"):
            there = arrange(other, seed)
            if other.acts_as(settings) and there.scenario.agents == own.scenario.agents:
                there.rows_from(own, settings.learner)
                there = there._replace(team=own.team)
            else:
                there.continue_from(own, settings.learner)
        yield name, there


@contextmanager
def _naming(key: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from error


def check(
    spec: Spec, chosen: Container[str] | None = None, *, may_fail: bool = False
) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, if all its conditions can be built.

    Parameters
    ----------
    spec
        The study.
    chosen
        Labels of the conditions that matter; None: all.
    may_fail
        Whether code of the user's may fail in some conditions: their trials will fail, others run.

    Raises
    ------
    SpecError
        If one cannot be, or their measures do not fit together; before anything is run or written.
    """
    failing: SpecError | None = None
    conditions = [c for c in spec.conditions() if chosen is None or c.label in chosen]
    measures: list[Sequence[Measure]] = []
    with spec.sources.active():
        for condition in conditions:
            where = f" (condition {condition.label!r})" if len(conditions) > 1 else ""
            try:
                measures += [
                    measures_of(there.world.measures) for there in _arrangements(condition)
                ]
                if spec.keep_teams:
                    _check_saved(condition.settings)
            except ValueError as error:
                refusal = SpecError(f"{error}{where}")
                if isinstance(error.__cause__, ValueError | None):
                    raise refusal from None
                failing = failing or refusal
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                if isinstance(error, Exception) and not place(error):
                    raise  # no code of the user's
                problem = f"the scenario or topology raises {format_error(error)}{place(error)}"
                failing = failing or SpecError(f"{problem}{where}")
    if failing and not (measures and may_fail):
        raise failing
    return joined(measures, conditions[0].columns)


def _check_saved(settings: ConditionSettings) -> None:
    """Refuse a team that arrays cannot bring back."""
    team: Any = arrange(settings, 0).team
    try:
        arrays = {name: np.array(array) for name, array in team.arrays().items()}
        if objects := [name for name, array in arrays.items() if array.dtype.hasobject]:
            raise TypeError(f"its array {objects[0]!r} holds objects")
        team.restore(arrays)
    except Exception as error:  # a learner may be anybody's
        raise ValueError(
            f"keep_teams = true: a team of learner.kind = {settings.learner.kind!r} cannot be "
            f"saved, {error}; needs `arrays` of numbers, and `restore` that takes them"
        ) from None


def _arrangements(condition: Condition) -> Iterator[Arrangement]:
    """Yield a condition's own arrangement and those of its stages and evaluations."""
    settings, learner = condition.settings, condition.settings.learner
    own = arrange(settings, 0)
    stages = teach(own, settings, condition.curriculum, 0)
    evaluations = transfer(own, settings, condition.evaluations, 0)
    for there in (own, *(a for _, a in stages), *(a for _, a in evaluations)):
        if isinstance(learner, LearnerSettings) and learner.decision.rule != "value":
            team, states = of_fuzzy_agents(there.team), there.scenario.reset(0)
            team.check(team.predict(there.scenario, states))
        yield there


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
        self.trial = trial
        self._own = arrange(trial.settings, trial.seed)
        self.world, self.scenario, self.team = self._own
        self._stages = trial.curriculum  # those that the team has not gone through
        self._rows: list[EpisodeRow] = []
        self._measures = measures_of(self.world.measures)
        self._recordings: dict[str, Recording] = {}
        self._watch = Stopwatch()
        self.deciding = self._watch.decisions
        """Seconds of every decision in training."""

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
        self, episodes: int, first: int = 0, *, phase: str = "training", team: Actors | None = None
    ) -> None:
        """Let the team (or another one, whose time is not counted) explore, learn, be measured.

        Before its first episode the team goes through the trial's curriculum. Recorded are, of the
        trial's own team, the episodes of `Trial.recorded`.
        """
        self._go_through_curriculum()
        is_recorded = isinstance(self.world, RecordedScenario) and len(self.world.recorded) > 0
        kept = self.trial.recorded if team is None and is_recorded else {}
        there = self._own if team is None else self._own._replace(team=team)
        time = self._watch.add if team is None else None
        record = self._record if kept else None
        self._run(
            there, phase, [time, record], at_once=not kept, episodes=episodes,
            steps=self.trial.steps, first_episode=first,
        )  # fmt: skip

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
            if isinstance(self.team, Team) and self.team.messages.failures:
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
            there, phase, [observe], first, at_once=observe is None, episodes=trial.evaluation,
            steps=steps, first_episode=first, learn=False, explore=explore,
        )  # fmt: skip

    def _run(
        self,
        there: Arrangement,
        phase: str,
        observers: Sequence[Observer | None] = (),
        counted_from: int = 0,
        *,
        at_once: bool = False,
        **loop: Any,
    ) -> None:
        """Run a `control_loop`, show its steps to observers, and keep the row of each episode.

        The number of an episode in its row is counted from `counted_from`. If nobody needs to see
        the steps, whole episodes may be run `at_once`, compiled.
        """
        measures = measures_of(there.world.measures)
        self._measures = joined((self._measures, measures))
        if at_once and self._at_once(there, phase, counted_from, **loop):
            return
        for record in control_loop(there.scenario, there.team, seed=self.trial.seed, **loop):
            if record.step == 0:
                meter = EpisodeMeter(phase, record.episode - counted_from, measures)
            meter.add(record.transition)
            for observe in filter(None, observers):
                observe(record)
            if record.last:
                self._rows.append(meter.row())

    def _at_once(self, there: Arrangement, phase: str, counted_from: int, **loop: Any) -> bool:
        """Run whole episodes compiled and keep their rows, or return that it cannot be done."""
        scenario, first, learn = there.scenario, loop["first_episode"], loop.get("learn", True)
        if not hasattr(scenario, "run_episode") or not isinstance(there.team, Team):
            return False
        for episode in range(first, first + loop["episodes"]):
            begin = perf_counter()
            seed = world_seed(self.trial.seed, episode)
            summary = scenario.run_episode(there.team, seed, episode, loop["steps"], learn=learn)
            if summary is None:
                return False
            if learn and there.team is self.team:
                spent = perf_counter() - begin
                self._watch.seconds["decision"] += spent
                self.deciding += [spent / summary.steps] * summary.steps
            row = phase, episode - counted_from, summary.steps, summary.measures, summary.return_
            self._rows.append(EpisodeRow(*row))
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
