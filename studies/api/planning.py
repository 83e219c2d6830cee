"""Estimate the time of a study from pilot episodes, and the differences that it can detect.

One trial of every condition runs a few pilot episodes on a seed that no study reports. Their mean
time per step is extrapolated to all steps of the study, within a wide range: episodes become
shorter as teams learn, and learning from all kept steps takes longer the more steps are kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from textwrap import wrap
from time import perf_counter

import numpy as np

from ...core.interface.measures import Measure, main_measure
from ...core.numerics import working_seconds
from ..catalogue.experience import stops
from ..catalogue.study import load_study
from ..errors import WIDTH, SpecError
from ..presentation.progress import count, duration
from ..results.power import OUTCOME_DEVIATION, SMALLEST, USUAL_DEVIATION
from ..results.power_text import planned_text
from ..spec.outline import StudyOutline
from ..spec.spec import Spec
from ..trials.session import Session
from ..trials.trial import Trial, trials_of
from ..workers.runner import cores
from ..workers.workers import check_jobs
from .data import Place
from .running import examine

PILOT_SEED = 10_000
"""Seed of all pilot episodes."""
MAX_AGENT_STEPS = 10_000
"""Maximum product of agents and steps of a pilot episode; larger teams run the first steps only."""
TIME_RANGE = (0.3, 3.0)
"""Lower and upper end of the range of times, as fractions of the estimate."""
START_S = 3.0
"""Time in which a command and its workers start [s]."""


@dataclass(frozen=True)
class Plan:
    """Estimated time of a study, and the differences that it can detect."""

    outline: StudyOutline
    """Conditions, seeds and lengths of the study."""
    trials: int
    """Number of trials."""
    processes: int
    """Number of trials that run at a time."""
    seconds: float | None
    """Time of the whole study, extrapolated from pilot episodes [s]; None without a pilot."""
    comparisons: int
    """Number of comparisons of the study, over which p is adjusted."""
    measure: Measure
    """Measure by which conditions are compared: success, or the return where there is none."""
    deviation: float | None
    """Assumed standard deviation of paired differences; None: unknown."""
    smallest: float | None
    """Smallest difference of interest; None: unknown."""
    warnings: tuple[str, ...] = ()
    """Doubtful settings that are not refused, one line each."""

    @property
    def range(self) -> tuple[float, float] | None:
        """Lower and upper bound of the time of the study [s]; None without a pilot."""
        if self.seconds is None:
            return None
        lower, upper = TIME_RANGE
        return lower * self.seconds, upper * self.seconds

    def __str__(self) -> str:
        return "\n".join(self._lines())

    __repr__ = __str__

    def _lines(self) -> Iterator[str]:
        outline = self.outline
        n_seeds = len(outline.seeds)
        conditions = count(len(outline.columns), "condition")
        yield f"study    {outline.study}: {conditions} x {count(n_seeds, 'seed')}"
        yield (
            f"trials   {self.trials}, each {outline.lengths} of up to "
            f"{count(outline.steps, 'step')}"
        )
        if self.seconds is not None and self.range is not None:
            lower, upper = map(duration, self.range)
            processes = count(self.processes, "process", "es")
            yield f"time     about {duration(self.seconds)} with {processes} ({lower} to {upper}),"
            yield "         extrapolated from pilot episodes"
        if self.comparisons:
            yield ""
            yield from planned_text(
                n_seeds,
                self.comparisons,
                self.deviation,
                self.smallest,
                of_rates=self.measure.is_rate,
            )
        for warning in self.warnings:
            yield from wrap(warning, WIDTH)


def plan(
    spec: Spec | Mapping[str, object] | Place,
    *,
    jobs: int | None = None,
    deviation: float | None = None,
    smallest: float | None = None,
    timed: bool = True,
) -> Plan:
    """Estimate the time of a study and the differences that it can detect.

    Parameters
    ----------
    spec
        A `Spec`, a table, or the path of a TOML file.
    jobs
        Number of trials that run at a time; default: one per core.
    deviation
        Assumed standard deviation of the paired differences of single seeds; default: 0.25 for
        success rates, 0.5 in a study of recovery, unknown for returns.
    smallest
        Smallest difference of interest; default: 0.2 for success rates, none for returns.
    timed
        Whether to run pilot episodes, which take some seconds per condition.

    Raises
    ------
    SpecError
        If the study cannot be run, or a number is out of range.
    """
    spec = Spec.read(spec)
    if jobs is not None:
        check_jobs(jobs)
    measure = main_measure(examine(spec))
    with spec.sources.active():
        study = load_study(spec.study)
    for name, value in (("deviation", deviation), ("smallest", smallest)):
        if value is not None and not 0.0 < value <= (1.0 if measure.is_rate else np.inf):
            maximum = " and at most 1" if measure.is_rate else ""
            raise SpecError(f"--{name} {value:g}: must be above 0{maximum}")
    if measure.is_rate:
        is_of_recovery = "onset" in study.NUMBERS
        deviation = deviation or (OUTCOME_DEVIATION if is_of_recovery else USUAL_DEVIATION)
        smallest = smallest or SMALLEST
    elif deviation is None and smallest is not None:
        raise SpecError(f"--smallest {smallest:g}: for returns, give --deviation, too")
    trials = trials_of(spec)
    processes = max(1, min(jobs or cores(), len(trials)))
    n_conditions = len(spec.conditions())
    seconds = None
    with spec.sources.active():
        comparisons = study.comparisons(spec)
    if timed:
        with spec.sources.active():
            costs = [pilot(trial) for trial in trials[:n_conditions]]
        training = len(spec.seeds) * sum(trial for trial, _ in costs) / processes
        seconds = START_S + sum(startup for _, startup in costs) + training
    return Plan(
        outline=StudyOutline.of(spec),
        trials=len(trials),
        processes=processes,
        seconds=seconds,
        comparisons=comparisons,
        measure=measure,
        deviation=deviation,
        smallest=smallest,
        warnings=spec.warnings(),
    )


def pilot(trial: Trial) -> tuple[float, float]:
    """Run pilot episodes of a trial and extrapolate its cost.

    Returns
    -------
    tuple
        Time of the trial, and time to build and compile what the first step needs, once per
        process [s].
    """
    max_steps = max(2, MAX_AGENT_STEPS // len(trial.world().agents))
    longest = trial.evaluation_steps or trial.steps
    short = replace(
        trial,
        seed=PILOT_SEED,
        curriculum=(),
        evaluation=min(trial.evaluation, 1),
        steps=min(trial.steps, max_steps),
        evaluation_steps=min(longest, max_steps),
    )
    start = perf_counter()
    session = Session(short)
    warm_up = _train(session, 0)
    startup = perf_counter() - start
    compiled = working_seconds()  # what an update of weights compiles later is no time of training
    steps = _train(session, warm_up) - warm_up
    trained = working_seconds()
    rows = [row for row in session.finish().rows if row.phase != "training"]
    evaluated = working_seconds()
    if trial.decisions is None:
        n_episodes = sum(stage.episodes for stage in trial.curriculum) + trial.episodes
        training = n_episodes * (trial.steps if steps >= short.steps else steps)
        n_evaluations = trial.evaluation
    else:
        training = trial.decisions
        n_evaluations = trial.evaluation * (1 + len(stops(trial.decisions)))
    seconds = training * (trained - compiled) / max(steps, 1)
    if rows:
        share = longest / max(row.steps for row in rows) if longest > max_steps else 1.0
        seconds += n_evaluations * share * (evaluated - trained)
    return seconds, startup


def _train(session: Session, done: int) -> int:
    """Train for an episode, or an update of the policy, after `done` steps; return all steps."""
    if session.trial.decisions is None:
        session.train(1, session.trained)
        return done + session.result().rows[-1].steps
    learner = session.trial.settings.learner
    update = learner.n_environments * int(learner.model_dump().get("rollout", 1))
    return session.train_until(done + update)
