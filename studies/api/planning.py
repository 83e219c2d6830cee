"""Tells what a study will take and what it can find, before anything is spent on it.

Episodes of every condition are tried for a while, to see what a step takes and after how many they
end, on a seed that no study reports. Deciding and simulating take a time per step. Learning may
take one per step, too, and one per step kept so far: a regression over all of training grows with
the square of its length. A process has to start, too, to load or compile what each condition needs,
and to build each trial: that is measured once. All of this is processor time; the time of the clock
that it comes to depends on what else the machine does, which is seen while planning.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from textwrap import wrap
from typing import NamedTuple

import numpy as np

from ...core.interface.measures import Measure, main_measure
from ...core.numerics import FloatArray, IntArray, optimize, pd
from ..catalogue.experience import stops
from ..errors import WIDTH, SpecError
from ..presentation.progress import count, duration
from ..results.laws import FEWEST
from ..results.power import SMALLEST, USUAL_DEVIATION, exponent_text, planned_text
from ..results.scaling_law import size_key
from ..spec.controls import LEARN_NOTHING
from ..spec.outline import StudyOutline
from ..spec.spec import Spec
from ..spec.tables import label_but
from ..trials.session import Session, run_trial
from ..trials.trial import Trial, trials_of
from ..workers.runner import cores
from ..workers.workers import check_jobs
from .running import CHECKPOINT, examine
from .study import Place

SEED = 10_000
"""Of the trials that are tried out."""
TRIED = 1.0
"""Processor time [s] for which episodes of training are tried of every condition."""
TRIED_ACTIONS = "joint actions"
"""What is counted beside the costs of decisions."""
EPISODES = 2
"""That are tried at least, of training and of every evaluation."""
WHOLE = 10_000
"""Agents times steps up to which an episode is tried: of more agents its first steps only."""
QUICK = 0.25
"""Least steps of the other episodes, as a fraction of the mean of those tried last."""
LONG = 2.0
"""Most steps of the other episodes, as a multiple of the longest of those tried last."""
FASTER = 0.7
"""By what another process, and other seeds, may take less time than what was tried."""
SLOWER = 2.2
"""By what they may take more."""
KEEPING = np.array([0.02, 0.05, 0.15])
"""Seconds to hand out a trial and to keep it, from, likely and to: a disk takes longer than a
processor."""
STARTS = 5
"""Starts of a process that a run takes: the command's own, its workers', which start together, and
as much as three more for the store, the tables and the figures."""
START = f"import {Session.__module__}, matplotlib.pyplot"
"""What a process imports."""

Range = tuple[float, float]
"""From and to."""


class ConditionCost(NamedTuple):
    """What a condition takes, by one of its trials."""

    seconds: FloatArray
    """Processor time [s] of a trial, from, likely and to ``(3,)``."""
    loading: float
    """Processor time [s] to import, load and compile what the first step needs, once a process."""
    memory: float
    """What the team holds in the end [bytes]."""
    decision: Mapping[str, float]
    """What a decision costs of what functions count, by name; without functions nothing."""
    decisions: int
    """How many the trials of all seeds take at most."""


@dataclass(frozen=True)
class Plan:
    """What a study will take and what it can find."""

    outline: StudyOutline
    """What the study consists of."""
    trials: int
    """How many there are."""
    processes: int
    """How many run at a time."""
    seconds: Range | None
    """Time of the whole study [s], from and to: by how early episodes end that were not tried, and
    by what else this machine does."""
    likely: float | None
    """The same if episodes take as long as those that were tried last, and this machine stays as
    busy as it is."""
    memory: float | None
    """Of all processes together [bytes], about."""
    comparisons: int
    """With the first condition."""
    measure: Measure
    """By which conditions are compared: success, or the return where nothing is one."""
    deviation: float | None
    """Standard deviation of paired differences that is supposed; None: of returns nobody knows."""
    smallest: float | None
    """The smallest difference that is of interest; None: of returns nobody has named one."""
    warnings: tuple[str, ...] = ()
    """What looks wrong and is not refused, a line each."""
    costs: Mapping[str, ConditionCost] = field(default_factory=dict)
    """By label, what conditions take that were tried."""
    environments: int = 1
    """Number of environments in which a learner learns at once, the largest of all conditions."""

    def __str__(self) -> str:
        return "\n".join(self._lines())

    __repr__ = __str__

    def _lines(self) -> Iterator[str]:
        outline = self.outline
        n_seeds = len(outline.seeds)
        conditions = count(len(outline.columns), "condition")
        steps = count(outline.steps, "step")
        processes = count(self.processes, "process", "es")
        yield f"study    {outline.study}: {conditions} x {count(n_seeds, 'seed')}"
        yield f"trials   {self.trials}, each {outline.lengths} of up to {steps}"
        if self.environments > 1:
            yield f"learning in up to {self.environments} environments, whose decisions add up"
        if self.seconds is not None and self.likely is not None:
            quick, slow = map(duration, self.seconds)
            usual = duration(self.likely)
            yield f"time     about {usual} with {processes}, as episodes take that were tried;"
            yield f"         {quick} to {slow}, by how early they end and what else runs here"
        if self.memory is not None:
            yield f"memory   about {self.memory / 1e9:.1f} GB with {processes}"
        if any(cost.seconds[1] > CHECKPOINT for cost in self.costs.values()):
            most = max(cost.memory for cost in self.costs.values()) / 1e6
            yield f"killed   a trial goes on from its checkpoint, every {duration(CHECKPOINT)}, of"
            yield f"         about {most:.1f} MB, or starts anew where users' files learn"
        if any(cost.decision for cost in self.costs.values()):
            yield from self._decisions()
        if self.comparisons:
            yield ""
            supposed = self.deviation, self.smallest
            is_rate = self.measure.is_rate
            yield from planned_text(n_seeds, self.comparisons, *supposed, of_rates=is_rate)
        yield from self._exponents()
        for warning in self.warnings:
            yield from wrap(warning, WIDTH)

    def _exponents(self) -> Iterator[str]:
        """Yield which exponents of growth can be told apart, if sizes are swept."""
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

    def _decisions(self) -> Iterator[str]:
        """Yield what a decision costs under every condition, and the study at most."""
        costs = self.costs.values()
        names = list(dict.fromkeys(name for cost in costs for name in cost.decision))
        width = max(map(len, self.costs))
        yield ""
        yield " ".join([" " * width, *(f"{name:>{len(name)}}" for name in names)])
        for label, cost in self.costs.items():
            values = (f"{cost.decision.get(name, 0.0):>{len(name)}.4g}" for name in names)
            yield " ".join([f"{label:<{width}}", *values])
        most = (
            f"{sum(cost.decision.get(n, 0.0) * cost.decisions for cost in costs):,.0f} {n}"
            for n in names
            if n != TRIED_ACTIONS
        )
        yield from wrap(f"Means of a decision, as tried. The study: at most {', '.join(most)}.")


def plan(
    spec: Spec | Mapping[str, object] | Place,
    *,
    jobs: int | None = None,
    deviation: float | None = None,
    smallest: float | None = None,
    timed: bool = True,
) -> Plan:
    """Return what a study will take and what it can find; some seconds a condition are run.

    Parameters
    ----------
    spec
        A `Spec`, a table, or the path of a TOML file.
    jobs
        Trials at a time; by default one for every core.
    deviation
        Standard deviation that is supposed of the differences of single seeds; by default .25 of
        success rates, and unknown of returns.
    smallest
        The smallest difference that is of interest; by default .2 of success rates.
    timed
        Whether to try the conditions out.

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
            most = " and at most 1" if measure.is_rate else ""
            raise SpecError(f"--{name} {value:g}: must be above 0{most}")
    if measure.is_rate:
        deviation = deviation or USUAL_DEVIATION
        smallest = smallest or SMALLEST
    elif deviation is None and smallest is not None:
        raise SpecError(f"--smallest {smallest:g}: of returns it needs --deviation, too")
    trials = trials_of(spec)
    processes = max(1, min(jobs or cores(), len(trials)))
    estimate = _estimate(spec, trials, processes) if timed else (None, None, None, {})
    seconds, likely, memory, costs = estimate
    return Plan(
        outline=StudyOutline.of(spec),
        trials=len(trials),
        processes=processes,
        seconds=seconds,
        likely=likely,
        memory=memory,
        comparisons=len(spec.conditions()) - 1,
        measure=measure,
        deviation=deviation,
        smallest=smallest,
        warnings=spec.warnings(),
        costs=costs,
        environments=max(c.settings.learner.n_environments for c in spec.conditions()),
    )


def _estimate(
    spec: Spec, trials: Sequence[Trial], processes: int
) -> tuple[Range, float, float, dict[str, ConditionCost]]:
    """Return the time of a study [s], from and to, the likely one, its memory [bytes], and costs.

    These are what conditions take, by label.
    """
    begin = time.perf_counter()
    used = _used()
    # Ctrl-C is for this process, which then kills that one: it would print a traceback.
    subprocess.run([sys.executable, "-c", START], check=True, process_group=0)
    starting = STARTS * (_used() - used)
    with spec.sources.active():
        by_label = {
            trial.condition: try_out(trial, len(spec.seeds))
            for trial in trials[: len(spec.conditions())]
        }
    tried = list(by_label.values())
    loading = sum(each.loading for each in tried)  # less, if what was compiled here is kept
    each_seed = np.sum([one.seconds / processes + KEEPING for one in tried], axis=0)
    quick, usual, slow = len(spec.seeds) * each_seed
    # Processes that have no trial left wait for the last one.
    slow += (1 - 1 / processes) * max(each.seconds[-1] for each in tried)
    busy = max((time.perf_counter() - begin) / (_used() - used), 1.0)
    least = FASTER * busy**0.5  # other programs may stop
    most = SLOWER * busy  # or go on
    memory = _peak() + max(each.memory for each in tried)
    shortest = least * (starting + quick)
    longest = most * (starting + loading + slow)
    likely = busy * (starting + loading + usual)
    return (float(shortest), float(longest)), float(likely), processes * memory, by_label


def _peak() -> float:
    """Return the most memory that this process has had [bytes]; none where no system tells it."""
    if sys.platform == "win32":
        return 0.0
    import resource

    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak * (1 if sys.platform == "darwin" else 1024)


def try_out(trial: Trial, seeds: int = 1) -> ConditionCost:
    """Return what the trials of a condition take, all of its seeds where it says so."""
    if trial.decisions is not None:
        return try_out_decisions(trial, trial.decisions, seeds)
    alone = replace(trial, seed=SEED, curriculum=(), evaluation=min(trial.evaluation, EPISODES))
    brief = replace(alone, episodes=1, steps=2, evaluation_steps=None)
    loading = _seconds(partial(run_trial, brief))
    building = _seconds(partial(Session, alone))
    longest = trial.evaluation_steps or trial.steps
    cut = max(2, WHOLE // len(trial.world().agents))
    session = Session(
        replace(alone, steps=min(trial.steps, cut), evaluation_steps=min(longest, cut))
    )
    held = _bytes(session)
    training = _seconds_of_episodes(session, trial.episodes)
    in_own = _seconds(session.evaluate)
    in_others = _seconds(session.run_other_evaluations)
    rows = session.result().rows
    by_phase = pd.DataFrame(rows).groupby("phase")["steps"]
    lengths = {phase: steps.to_numpy(float) for phase, steps in by_phase}
    steps = lengths.pop("training")

    acting = in_own / sum(lengths.get("evaluation", [1.0]))
    per_step = (in_own + in_others) / max(sum(map(sum, lengths.values())), 1.0)
    mean_lengths = [_mean_length(tried, longest, cut) for tried in lengths.values()]
    evaluating = per_step * np.sum(mean_lengths, axis=0)

    episodes = np.array([*(stage.episodes for stage in trial.curriculum), trial.episodes])
    whole = steps[steps < cut]
    others = (episodes.sum() - len(whole)) * _mean_length(
        steps[len(training) // 2 :], trial.steps, cut
    )
    mean = (whole.sum() + others) / episodes.sum()
    beside = np.array(training) - acting * steps
    if len(whole):
        learning = learning_time(steps, beside, mean, episodes)
    else:  # beginnings do not tell how learning grows
        learning = mean * episodes.sum() * max(beside.sum(), 0.0) / steps.sum()
    seconds = building + acting * mean * episodes.sum() + learning
    growth = mean[-1] * episodes.sum() / steps.sum()
    memory = held + growth * max(_bytes(session) - held, 0.0)
    rounds = trial.evaluation * (1 + len(trial.evaluations))
    decisions = int(episodes.sum()) * trial.steps + rounds * longest
    whole_trial = seconds + trial.evaluation * evaluating
    return ConditionCost(whole_trial, loading, memory, _decision(session), seeds * decisions)


def try_out_decisions(trial: Trial, budget: int, seeds: int = 1) -> ConditionCost:
    """Return what the trials of a condition take that train for a budget of decisions.

    Rollouts of many environments, or episodes of one, are tried; then two episodes of
    evaluation, of which there are as many more as there are stops on the way.
    """
    begin = time.process_time()
    session = Session(replace(trial, seed=SEED, evaluation=min(trial.evaluation, EPISODES)))
    held = _bytes(session)
    environments = trial.settings.learner.n_environments
    piece = max(1, environments * trial.settings.learner.model_dump().get("rollout", 1))
    learns = trial.settings.learner.kind not in LEARN_NOTHING
    done = session.train_until(min(piece, budget)) if learns else 0
    loading = time.process_time() - begin
    taken = list[tuple[int, float]]()
    while learns and done < budget and sum(seconds for _, seconds in taken) < TRIED:
        spent = session.spent
        reached = session.train_until(min(done + piece, budget))
        taken.append((reached - done, session.spent - spent))
        done = reached
    training = np.zeros(3)
    if taken:
        counts, seconds = np.array(taken).T
        if environments > 1:  # what is kept between updates does not grow
            training += budget * seconds.sum() / counts.sum()
        else:
            rounds = np.array([budget / counts.mean()])
            training += learning_time(counts, seconds, np.array([counts.mean()]), rounds)
    elif learns:
        training += loading * budget / done
    held += max(_bytes(session) - held, 0.0) if environments > 1 else 0.0
    evaluating = _seconds(session.finish)
    rows = pd.DataFrame(session.result().rows)
    lengths = rows[rows["phase"] != "training"].groupby("phase")["steps"]
    longest = trial.evaluation_steps or trial.steps
    each = [_mean_length(steps.to_numpy(float), longest, longest + 1) for _, steps in lengths]
    per_step = evaluating / max(float(lengths.sum().sum()), 1.0)
    evaluations = trial.evaluation * per_step * (sum(each) + len(stops(budget)) * each[0])
    decisions = budget + trial.evaluation * longest * (len(each) + len(stops(budget)))
    return ConditionCost(
        training + evaluations, loading, held, _decision(session), seeds * decisions
    )


def _decision(session: Session) -> dict[str, float]:
    """Return what a decision has cost, and how many joint actions were tried, where it is told."""
    names = [measure.name for measure in session.team.costs]
    rows = [row for row in session.result().rows if row.measures.keys() >= set(names)]
    steps = sum(row.steps for row in rows)
    if not names or not steps:
        return {}
    costs = {name: sum(row.measures[name] for row in rows) / steps for name in names}
    return {**costs, TRIED_ACTIONS: session.team.counts.joint_actions / steps}


def _seconds_of_episodes(session: Session, episodes: int) -> list[float]:
    """Train for a while; return the processor time of each episode [s]."""
    seconds = list[float]()
    while len(seconds) < episodes and (len(seconds) < EPISODES or sum(seconds) < TRIED):
        seconds.append(_seconds(partial(session.train, 1, len(seconds))))
    return seconds


def learning_time(
    steps: FloatArray, seconds: FloatArray, mean: FloatArray, episodes: FloatArray | IntArray
) -> FloatArray:
    """Return the processor time [s] to learn from all episodes of a trial.

    An episode of T steps takes T (a + b N) to learn from, N being the steps kept by its end.

    Parameters
    ----------
    steps, seconds
        Of the episodes that were tried: their steps, and the time that was learned from them [s].
    mean
        Mean steps of an episode; several possible ones.
    episodes
        How many there are in every stage of training.
    """
    (per_step, per_kept), _ = optimize.nnls(
        np.stack([steps, steps * np.cumsum(steps)], axis=1), np.maximum(seconds, 0.0)
    )
    kept = mean * (episodes * (episodes + 1)).sum() / 2
    return np.asarray(mean * (per_step * episodes.sum() + per_kept * kept))


def _mean_length(tried: Sequence[float] | FloatArray, most: int, cut: int) -> FloatArray:
    """Return the mean steps of episodes that were not tried to their ends: from, likely and to."""
    longest = max(tried)
    mean = float(np.mean(tried))
    if longest >= cut:
        return np.array([mean, (mean + most) / 2.0, most])
    return np.array([QUICK * mean, mean, min(most, LONG * longest)])


def _used() -> float:
    """Return the processor time of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])


def _seconds(call: Callable[[], object]) -> float:
    begin = time.process_time()
    call()
    return time.process_time() - begin


def _bytes(session: Session) -> float:
    return float(sum(array.nbytes for array in session.team.arrays().values()))
