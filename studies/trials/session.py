"""Running a trial: its world and team are built, the team is trained, evaluated and measured.

A trial is known by its content alone, see `nested_agents.studies.trials.trial`, so that commands
that read results import nothing that learns.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...core.agents.loop import (
    EpisodeSummary,
    StepRecord,
    control_loop,
    policy_seed,
    world_seed,
)
from ...core.agents.team import Team
from ...core.interface.experience import Observation
from ...core.interface.measures import Measure, measures_of
from ...core.interface.plain import as_scenario
from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import Scenario
from ...core.plugins.sources import format_error, place
from ..errors import SpecError
from ..spec.conditions import Condition, ConditionSettings, Stage
from ..spec.spec import Spec
from ..store.database import EVALUATION, STAGE
from ..store.durable import TEAM, Recording
from .episodes import EpisodeMeter, EpisodeRow, join_measures
from .trial import Trial, TrialResult

Evaluations = Sequence[tuple[str, ConditionSettings]]
"""Names and settings under which a trained team is evaluated beside its own."""


class Arrangement(NamedTuple):
    """A world and those who act in it."""

    world: Scenario
    """As the settings describe it."""
    scenario: Scenario
    """The same as the agents see it, which may be as one agent."""
    team: Team
    """The agents."""


def arrange(settings: ConditionSettings, seed: int) -> Arrangement:
    """Return the world of a condition and its untrained team.

    Raises
    ------
    ValueError
        If the settings do not fit together; one line.
    """
    world = as_scenario(settings.scenario.build())
    scenario, hierarchy = settings.arrange(world)
    failures = settings.topology.failures
    team = Team(settings.learner, scenario, hierarchy, policy_seed(seed), failures)
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
                there.team.continue_from(reached.team)
        yield stage, there
        reached = there
    if reached is not None:
        with _naming("curriculum"):
            own.team.continue_from(reached.team)


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
                own.team.check_world(there.scenario)
                there = there._replace(team=own.team)
            else:
                there.team.continue_from(own.team)
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
    return join_measures(measures, conditions[0].columns)


def _check_saved(settings: ConditionSettings) -> None:
    """Refuse a team that arrays cannot bring back."""
    team = arrange(settings, 0).team
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
    settings = condition.settings
    own = arrange(settings, 0)
    stages = teach(own, settings, condition.curriculum, 0)
    evaluations = transfer(own, settings, condition.evaluations, 0)
    for there in (own, *(a for _, a in stages), *(a for _, a in evaluations)):
        if settings.learner.needs_rewards:
            there.team.check(Observation(there.scenario.reset(0), there.scenario))
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


class WholeEpisode(Protocol):
    """Runs whole episodes of teams that it knows in one call each, as `control_loop` would."""

    def __call__(
        self,
        scenario: Scenario,
        team: Team,
        seed: np.random.SeedSequence,
        episode: int,
        steps: int,
        *,
        learn: bool,
    ) -> EpisodeSummary | None:
        """Leave scenario and team as the loop would; or return None and change nothing."""


class Session:
    """A trial under way: its scenario, its team, and what has been measured so far.

    Parameters
    ----------
    trial
        The trial; its team is untrained to begin with.
    whole_episode
        Runs episodes that nobody needs to see step by step, if it can; none: the loop runs all.

    Attributes
    ----------
    world
        The scenario as the settings describe it.
    scenario
        The same as the agents see it.
    team
        The agents.
    """

    def __init__(self, trial: Trial, whole_episode: WholeEpisode | None = None) -> None:
        self.trial = trial
        self._whole_episode = whole_episode
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
        session.team.restore(arrays)
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
            there, phase, [time, record], at_once=not kept, episodes=episodes,
            steps=self.trial.steps, first_episode=first,
        )  # fmt: skip

    def _record(self, record: StepRecord) -> None:
        """Record a step if it is of an episode of `Trial.recorded`."""
        name = self.trial.recorded.get(record.episode)
        if name is None:
            return
        if record.step == 0:  # no record holds what there was before
            scenario = as_scenario(self.trial.settings.scenario.build())
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

    def run_other_evaluations(self, observers: Mapping[str, Observer] | None = None) -> None:
        """Evaluate in each of the trial's `evaluations`, whatever the others are.

        The same agents are the same team; others take over what it has learned. The steps of each
        are shown to the observer of its name, if there is one. A team whose policy is one of
        probabilities, which says so by ``is_sampled``, is evaluated by sampled actions as well.
        """
        self._go_through_curriculum()
        trial = self.trial
        if self.team.is_sampled:
            with self.team.drawing_apart():
                self._evaluate(self._own, SAMPLED, None, explore=True)
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
        self._measures = join_measures((self._measures, measures))
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
        """Run whole episodes in one call each and keep their rows, or return that none can be."""
        if self._whole_episode is None:
            return False
        first = loop["first_episode"]
        learn = loop.get("learn", True)
        for episode in range(first, first + loop["episodes"]):
            begin = perf_counter()
            seed = world_seed(self.trial.seed, episode)
            summary = self._whole_episode(
                there.scenario, there.team, seed, episode, loop["steps"], learn=learn
            )
            if summary is None:
                return False
            if learn and there.team is self.team:
                spent = perf_counter() - begin
                self._watch.seconds["decision"] += spent
                self.deciding += [spent / summary.steps] * summary.steps
            row = EpisodeRow(
                phase, episode - counted_from, summary.steps, summary.measures, summary.return_
            )
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
