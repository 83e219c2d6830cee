"""Estimate the time of a study from pilot episodes, and its statistical power.

One trial of every condition runs a few pilot episodes on a seed that no study reports. The time per
step is extrapolated to the whole study. Learning by regression over all experience also takes a
time that grows with the steps kept, so both parts are fitted to the pilot episodes.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from textwrap import wrap
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core.interface.measures import Measure, main_measure
from ...core.isolation import python_command
from ...core.numerics import FloatArray, optimize, pd
from ..catalogue.experience import stops
from ..errors import WIDTH, SpecError
from ..presentation.progress import count, duration
from ..results.laws import FEWEST
from ..results.notation import format_number
from ..results.power import SMALLEST, USUAL_DEVIATION
from ..results.power_text import exponent_text, planned_text
from ..results.scaling_law import size_key
from ..spec.controls import LEARN_NOTHING
from ..spec.outline import StudyOutline
from ..spec.spec import Spec
from ..spec.tables import label_but
from ..trials.session import Session, run_trial
from ..trials.trial import Trial, trials_of
from ..workers.runner import cores
from ..workers.workers import check_jobs
from .running import examine
from .study import Place

PILOT_SEED = 10_000
"""Seed of all pilot episodes."""
PILOT_S = 1.0
"""Time after which no further pilot episode of training starts [s]."""
MIN_PILOT_EPISODES = 2
"""Minimum number of pilot episodes, of training and of each evaluation."""
MAX_AGENT_STEPS = 10_000
"""Maximum product of agents and steps of a pilot episode; larger teams run the first steps only."""
FASTER = 0.4
"""Lower end of the range of times, as a fraction: other programs may stop."""
SLOWER = 2.5
"""Upper end of the range of times, as a fraction."""
LONGEST = 2.0
"""Maximum mean steps of all episodes, as a multiple of the longest pilot episode."""
STORING_S = 0.05
"""Time to hand out a trial and to store its results [s]."""
PROCESS_STARTS = 5
"""Starts of a process in a run: the command, its workers, and the store, tables and figures."""
START = f"import {Session.__module__}, matplotlib.pyplot"
"""Program that imports what every process of a run imports."""
JOINT_ACTIONS = "joint actions"
"""Name of the number of joint actions tried, among the costs of a decision."""


class PilotCost(NamedTuple):
    """Cost of one condition, extrapolated from its pilot episodes."""

    seconds: FloatArray
    """Time of one trial [s]: lower, mean, upper ``(3,)``."""
    startup: float
    """Time to import, compile and build what the first step needs, once per process [s]."""
    decision: Mapping[str, float]
    """Mean costs that agents report of one decision, by name; empty if they report none."""
    decisions: int
    """Maximum number of decisions of one trial."""


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
    range: tuple[float, float] | None
    """Lower and upper bound of this time [s]; None without a pilot."""
    memory: float | None
    """Approximate memory of all processes [bytes]; None: no pilot, or unknown on this system."""
    comparisons: int
    """Number of conditions that are compared with the first."""
    measure: Measure
    """Measure by which conditions are compared: success, or the return where there is none."""
    deviation: float | None
    """Assumed standard deviation of paired differences; None: unknown."""
    smallest: float | None
    """Smallest difference of interest; None: unknown."""
    warnings: tuple[str, ...] = ()
    """Doubtful settings that are not refused, one line each."""
    costs: Mapping[str, PilotCost] = field(default_factory=dict)
    """Cost of each condition by label."""

    def __str__(self) -> str:
        return "\n".join(self._lines())

    __repr__ = __str__

    def _lines(self) -> Iterator[str]:
        outline = self.outline
        n_seeds = len(outline.seeds)
        conditions = count(len(outline.columns), "condition")
        processes = count(self.processes, "process", "es")
        yield f"study    {outline.study}: {conditions} x {count(n_seeds, 'seed')}"
        yield (
            f"trials   {self.trials}, each {outline.lengths} of up to "
            f"{count(outline.steps, 'step')}"
        )
        if self.seconds is not None and self.range is not None:
            lower, upper = map(duration, self.range)
            yield f"time     about {duration(self.seconds)} with {processes} ({lower} to {upper}),"
            yield "         extrapolated from pilot episodes"
        if self.memory:
            yield f"memory   about {format_number(self.memory / 1e9)} GB with {processes}"
        if any(cost.decision for cost in self.costs.values()):
            yield from self._decision_costs()
        if self.comparisons:
            yield ""
            yield from planned_text(
                n_seeds,
                self.comparisons,
                self.deviation,
                self.smallest,
                of_rates=self.measure.is_rate,
            )
        yield from self._exponents()
        for warning in self.warnings:
            yield from wrap(warning, WIDTH)

    def _exponents(self) -> Iterator[str]:
        """Yield which differences of scaling exponents the study can detect, if it sweeps sizes."""
        columns = self.outline.columns
        with suppress(SpecError):
            key = size_key(columns)
            groups: dict[str, list[float]] = {}
            for own in columns.values():
                groups.setdefault(label_but(own, [key]), []).append(float(own[key]))
            _, fewest = min((len(own), sorted(own)) for own in groups.values())
            if len(fewest) >= FEWEST and fewest[0] > 0.0:
                yield ""
                yield from exponent_text(fewest, len(self.outline.seeds), max(1, len(groups) - 1))

    def _decision_costs(self) -> Iterator[str]:
        """Yield the costs of a decision by condition, and their maximum over the study."""
        costs = self.costs.values()
        names = list(dict.fromkeys(name for cost in costs for name in cost.decision))
        frame = pd.DataFrame({label: cost.decision for label, cost in self.costs.items()}).T
        yield ""
        yield from frame[names].to_string(float_format="{:.4g}".format).splitlines()
        n_seeds = len(self.outline.seeds)
        maxima = (
            f"{n_seeds * sum(c.decision.get(n, 0.0) * c.decisions for c in costs):,.0f} {n}"
            for n in names
            if n != JOINT_ACTIONS
        )
        yield from wrap(f"Means of a pilot decision. The study: at most {', '.join(maxima)}.")


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
        success rates, unknown for returns.
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
    for name, value in (("deviation", deviation), ("smallest", smallest)):
        if value is not None and not 0.0 < value <= (1.0 if measure.is_rate else np.inf):
            maximum = " and at most 1" if measure.is_rate else ""
            raise SpecError(f"--{name} {value:g}: must be above 0{maximum}")
    if measure.is_rate:
        deviation = deviation or USUAL_DEVIATION
        smallest = smallest or SMALLEST
    elif deviation is None and smallest is not None:
        raise SpecError(f"--smallest {smallest:g}: for returns, give --deviation, too")
    trials = trials_of(spec)
    processes = max(1, min(jobs or cores(), len(trials)))
    conditions = len(spec.conditions())
    costs: dict[str, PilotCost] = {}
    seconds = memory = None
    if timed:
        starting = PROCESS_STARTS * _time_of_start()
        with spec.sources.active():
            costs = {trial.condition: pilot(trial) for trial in trials[:conditions]}
        seconds = starting + _elapsed(costs, len(spec.seeds), processes)
        memory = processes * _peak_memory()
    return Plan(
        outline=StudyOutline.of(spec),
        trials=len(trials),
        processes=processes,
        seconds=None if seconds is None else float(seconds[1]),
        range=None if seconds is None else (FASTER * seconds[0], SLOWER * seconds[2]),
        memory=memory,
        comparisons=conditions - 1,
        measure=measure,
        deviation=deviation,
        smallest=smallest,
        warnings=spec.warnings(),
        costs=costs,
    )


def pilot(trial: Trial) -> PilotCost:
    """Run pilot episodes of a trial and return its extrapolated cost."""
    max_steps = max(2, MAX_AGENT_STEPS // len(trial.world().agents))
    longest = trial.evaluation_steps or trial.steps
    begin = perf_counter()
    session = Session(
        replace(
            trial,
            seed=PILOT_SEED,
            curriculum=(),
            evaluation=min(trial.evaluation, MIN_PILOT_EPISODES),
            steps=min(trial.steps, max_steps),
            evaluation_steps=min(longest, max_steps),
        )
    )
    building = perf_counter() - begin
    if trial.decisions is None:
        run_trial(replace(session.trial, episodes=1, steps=2, evaluation_steps=2))  # compiles
        startup = perf_counter() - begin
        steps, seconds = _pilot_episodes(session, trial.episodes)
        n_episodes = np.array([*(stage.episodes for stage in trial.curriculum), trial.episodes])
        totals = np.outer(_mean_steps(steps, trial.steps, max_steps), n_episodes)
        decisions = int(n_episodes.sum()) * trial.steps
        rounds = 1
    else:
        _train_for(session, 1)  # compiles
        startup = perf_counter() - begin
        steps, seconds = _pilot_rollouts(session, trial.decisions)
        totals = np.full((3, 1), float(trial.decisions))
        decisions = trial.decisions
        rounds = 1 + len(stops(trial.decisions))
    is_regression = (
        trial.settings.learner.n_environments == 1 and steps.max(initial=0.0) < max_steps
    )
    training = extrapolate(steps, seconds, totals, grows=is_regression)
    evaluating, lengths = _pilot_evaluations(session, longest, max_steps)
    n_evaluations = trial.evaluation * (rounds - 1 + len(lengths))
    mean_lengths = np.mean(lengths, axis=0) if lengths else np.zeros(3)
    return PilotCost(
        building + training + evaluating * n_evaluations * mean_lengths,
        startup,
        _decision_costs(session),
        decisions + n_evaluations * longest,
    )


def extrapolate(
    steps: FloatArray, seconds: FloatArray, totals: FloatArray, *, grows: bool
) -> FloatArray:
    """Return the time to train for more steps than the pilot did [s].

    An episode of T steps takes ``T (a + b N)``, where N is the number of steps kept at its end; a
    and b are fitted to the pilot episodes.

    Parameters
    ----------
    steps, seconds
        Steps and time [s] of each pilot episode ``(n,)``.
    totals
        Steps of each stage of training ``(..., n_stages)``; every stage starts with none kept.
    grows
        Whether the time of a step may grow with the steps kept; if not, b is 0.
    """
    if not len(steps):
        return np.zeros(totals.shape[:-1])
    terms = [steps, steps * np.cumsum(steps)][: 1 + grows]
    per_step, *per_kept = optimize.nnls(np.stack(terms, axis=1), np.maximum(seconds, 0.0))[0]
    growing = per_kept[0] * (totals**2).sum(axis=-1) / 2 if per_kept else 0.0
    return np.asarray(per_step * totals.sum(axis=-1) + growing)


def _pilot_episodes(session: Session, n_episodes: int) -> tuple[FloatArray, FloatArray]:
    """Train some episodes; return their steps and times [s], ``(n,)`` each."""
    seconds = list[float]()
    while len(seconds) < n_episodes and (
        len(seconds) < MIN_PILOT_EPISODES or sum(seconds) < PILOT_S
    ):
        begin = perf_counter()
        session.train(1, len(seconds))
        seconds.append(perf_counter() - begin)
    rows = session.result().rows
    steps = [float(row.steps) for row in rows if row.phase == "training"]
    return np.array(steps), np.array(seconds)


def _pilot_rollouts(session: Session, budget: int) -> tuple[FloatArray, FloatArray]:
    """Train for a part of a budget of decisions; return decisions and times [s], ``(n,)`` each."""
    steps, seconds = list[float](), list[float]()
    if session.trial.settings.learner.kind in LEARN_NOTHING:
        return np.array(steps), np.array(seconds)
    done = session.train_until(1)
    while not steps or (done < budget and sum(seconds) < PILOT_S):
        begin = perf_counter()
        reached = _train_for(session, done + 1)
        seconds.append(perf_counter() - begin)
        steps.append(float(reached - done))
        done = reached
    return np.array(steps), np.array(seconds)


def _train_for(session: Session, decisions: int) -> int:
    """Train until a number of decisions is reached, one whole update at least; return how many."""
    learner = session.trial.settings.learner
    update = learner.n_environments * int(learner.model_dump().get("rollout", 1))
    return session.train_until(decisions - 1 + update)


def _pilot_evaluations(
    session: Session, longest: int, max_steps: int
) -> tuple[float, list[FloatArray]]:
    """Evaluate; return the time of a step [s] and the mean steps of each kind of evaluation."""
    begin = perf_counter()
    rows = session.finish().rows
    seconds = perf_counter() - begin
    lengths: dict[str, list[int]] = {}
    for row in rows:
        if row.phase != "training":
            lengths.setdefault(row.phase, []).append(row.steps)
    total = sum(map(sum, lengths.values()))
    means = [_mean_steps(np.array(own, float), longest, max_steps) for own in lengths.values()]
    return seconds / max(total, 1), means


def _mean_steps(pilot: FloatArray, maximum: int, cut: int) -> FloatArray:
    """Return the mean steps of all episodes: lower, mean, upper ``(3,)``.

    Episodes of `cut` steps did not run to their end; they may have up to `maximum`.
    """
    mean = float(pilot.mean())
    if pilot.max() >= cut:
        return np.array([mean, (mean + maximum) / 2.0, maximum])
    return np.array([mean / 2.0, mean, min(maximum, LONGEST * pilot.max())])


def _decision_costs(session: Session) -> dict[str, float]:
    """Return the mean costs of a pilot decision that agents report, and joint actions tried."""
    names = [measure.name for measure in session.team.costs]
    rows = [row for row in session.result().rows if row.measures.keys() >= set(names)]
    steps = sum(row.steps for row in rows)
    if not names or not steps:
        return {}
    costs = {name: sum(row.measures[name] for row in rows) / steps for name in names}
    return {**costs, JOINT_ACTIONS: session.team.counts.joint_actions / steps}


def _elapsed(costs: Mapping[str, PilotCost], n_seeds: int, processes: int) -> FloatArray:
    """Return the time of all trials [s]: lower, mean, upper ``(3,)``."""
    trials = np.array([cost.seconds for cost in costs.values()])
    elapsed = n_seeds * (trials / processes + STORING_S).sum(axis=0)
    elapsed[1:] += sum(cost.startup for cost in costs.values())
    # At the end, idle processes wait for the last trial.
    elapsed[2] += (1 - 1 / processes) * trials[:, 2].max()
    return elapsed


def _time_of_start() -> float:
    """Return the time in which a process starts and imports the toolkit [s]."""
    begin = perf_counter()
    # Own process group: Ctrl-C reaches this process alone, which then ends the child.
    subprocess.run(python_command(START), check=True, process_group=0)
    return perf_counter() - begin


def _peak_memory() -> float:
    """Return the peak memory of this process [bytes]; 0 if the system does not report it."""
    if sys.platform == "win32":
        return 0.0
    import resource

    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak * (1 if sys.platform == "darwin" else 1024)
