"""Runs a study: every trial that its store does not hold yet, on workers of any kind.

Nothing is printed here: who wants to see how it goes passes an `Observer`.

A plan tells what a study will take and what it can find, before anything is spent on it. Episodes
of every condition are tried for a while, to see what a step takes and after how many they end, on a
seed that no study reports. Deciding and simulating take a time per step. Learning may take one per
step, too, and one per step kept so far: a regression over all of training grows with the square of
its length. A process has to start, too, to load or compile what each condition needs, and to build
each trial: that is measured once. All of this is processor time; the time of the clock that it
comes to depends on what else the machine does, which is seen while planning.
"""

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np

from ...core.interface.measures import Measure
from ...core.numerics import FloatArray, IntArray, optimize, pd
from ...core.plugins.sources import is_reference
from ..catalogue.study import load_study, measure_by_name
from ..errors import WIDTH, SpecError
from ..presentation.progress import count, duration
from ..results.power import SMALLEST, USUAL_DEVIATION, power_text
from ..spec.outline import StudyOutline
from ..spec.spec import Spec
from ..store.store import Store
from ..trials.keeping import open_to_run, pending
from ..trials.session import Session, check, run_trial
from ..trials.trial import Trial, trials_of
from ..workers.runner import Backend, Observer, cores, run_trials
from ..workers.workers import check_jobs, start_workers


@contextmanager
def run_study(
    spec: Spec,
    directory: Path,
    *,
    jobs: int | None = None,
    backend: Backend = "loky",
    address: str | None = None,
    retry_failed: bool = False,
    accept_code: bool = False,
    observer: Observer | None = None,
    chosen: Sequence[Trial] = (),
) -> Iterator[Store]:
    """Run what is left of a study; then its store is open for as long as the context lasts.

    Parameters
    ----------
    spec
        The study.
    directory
        Where it is kept; made if it does not exist.
    jobs, backend, address
        Who runs the trials, see `start_workers`.
    retry_failed
        Whether failed trials are run again.
    accept_code
        Whether to go on with a study although the installed code has changed.
    observer
        Who is notified of progress; None: nobody.
    chosen
        Those of its trials that are run; none named: all.

    Yields
    ------
    Store
        With the results of every trial, or its traceback (`Store.failed`).

    Raises
    ------
    SpecError
        If the study cannot be run or continued; one line says why.
    KeyboardInterrupt
        If it is interrupted. What has finished is kept; the same call continues.
    """
    observer = observer or Observer()
    measures, trials = examine(spec, may_fail=True), chosen or trials_of(spec)
    with (
        start_workers(backend, jobs, address, len(trials)) as workers,
        open_to_run(directory, spec, trials, measures, accept_code=accept_code) as store,
    ):
        if retry_failed:
            store.forget_failed()
        left = pending(store, trials)
        # A user's study is made again in every worker, which knows its file.
        with spec.sources.active():
            is_own = is_reference(spec.study)
            run_one = measure_by_name if is_own else load_study(spec.study).measure
        for note in (*store.notes, *spec.warnings()):
            observer.note(note)
        if left:
            observer.announce(spec, directory, workers.processes)
        if left and not workers.processes:
            observer.note("there is no worker yet: waiting for one")
        try:
            with closing(run_trials(left, store, run_one, workers)) as outcomes:
                observer.follow(outcomes, len(trials), len(trials) - len(left))
        except KeyboardInterrupt:
            observer.note(
                f"interrupted: {store.counts()['done']} of {len(trials)} trials are kept in "
                f"{directory}; the same command continues"
            )
            raise
        yield store


def examine(spec: Spec, *, may_fail: bool = False) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, if it can be run; see `check`.

    Raises
    ------
    SpecError
        If a condition cannot be built, or the study has not what it needs; before anything is run
        or written.
    """
    measures = check(spec, may_fail=may_fail)
    with spec.sources.active():
        load_study(spec.study).check(spec)
    return measures


SEED = 10_000
"""Of the trials that are tried out."""
TRIED = 1.0
"""Processor time [s] for which episodes of training are tried of every condition."""
EPISODES = 2
"""That are tried at least, of training and of every evaluation."""
WHOLE = 10_000
"""Agents times steps up to which an episode is tried: of more agents its first steps only."""
QUICK, LONG = 0.25, 2.0
"""Steps of the other episodes, from and to, as a fraction of the mean and of the longest tried
last."""
FASTER, SLOWER = 0.7, 2.2
"""By what the time of another process, and other seeds, differ from what was tried."""
KEEPING = np.array([0.02, 0.15])
"""Seconds to hand out a trial and to keep it, from and to: a disk takes longer than a processor."""
STARTS = 5
"""Starts of a process that a run takes: the command's own, its workers', which start together, and
as much as three more for the store, the tables and the figures."""
START = f"import {Session.__module__}, matplotlib.pyplot"
"""What a process imports."""

Range = tuple[float, float]
"""From and to."""


class Tried(NamedTuple):
    """What a condition takes, by one of its trials."""

    seconds: FloatArray
    """Processor time [s] of a trial, from and to."""
    loading: float
    """Processor time [s] to import, load and compile what the first step needs, once a process."""
    memory: float
    """What the team holds in the end [bytes]."""


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
    memory: float | None
    """Of all processes together [bytes], about."""
    comparisons: int
    """With the first condition."""
    deviation: float
    """Standard deviation of paired differences that is supposed."""
    smallest: float
    """The smallest difference of success rates that is of interest."""
    warnings: tuple[str, ...] = ()
    """What looks wrong and is not refused, a line each."""

    def __str__(self) -> str:
        return "\n".join(self._lines())

    __repr__ = __str__

    def _lines(self) -> Iterator[str]:
        o = self.outline
        seeds = count(len(o.seeds), "seed")
        yield f"study    {o.study}: {count(len(o.columns), 'condition')} x {seeds}"
        yield f"trials   {self.trials}, each {o.lengths} of up to {count(o.steps, 'step')}"
        with_ = f"with {count(self.processes, 'process', 'es')}"
        if self.seconds is not None:
            quick, slow = map(duration, self.seconds)
            yield f"time     {quick} to {slow} {with_}, the start of workers included:"
            yield "         by how early episodes end, and by what else this machine does"
        if self.memory is not None:
            yield f"memory   about {self.memory / 1e9:.1f} GB {with_}"
        if self.comparisons:
            lines = power_text(len(o.seeds), self.comparisons, self.deviation, self.smallest)
            yield from ("", *lines)
            text = (
                f"Differences of success rates, every condition with the first, p adjusted; "
                f"differences of single seeds are taken to deviate by {self.deviation:g}."
            )
            yield from wrap(text, WIDTH)
        yield from self.warnings


def plan(
    spec: Spec | Mapping[str, Any] | str | Path,
    *,
    jobs: int | None = None,
    deviation: float = USUAL_DEVIATION,
    smallest: float = SMALLEST,
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
        Standard deviation that is supposed of the differences of single seeds.
    smallest
        The smallest difference of success rates that is of interest.
    timed
        Whether to try the conditions out.

    Raises
    ------
    SpecError
        If the study cannot be run, or a number is out of range.
    """
    made = Spec.read(spec)
    for name, value in (("deviation", deviation), ("smallest", smallest)):
        if not 0.0 < value <= 1.0:
            raise SpecError(f"--{name} {value:g}: must be above 0 and at most 1")
    if jobs is not None:
        check_jobs(jobs)
    examine(made)
    trials = trials_of(made)
    processes = max(1, min(jobs or cores(), len(trials)))
    seconds, memory = _taken(made, trials, processes) if timed else (None, None)
    return Plan(
        StudyOutline.of(made), len(trials), processes, seconds, memory, len(made.conditions()) - 1,
        deviation, smallest, made.warnings(),
    )  # fmt: skip


def _taken(spec: Spec, trials: Sequence[Trial], processes: int) -> tuple[Range, float]:
    """Return the time of a study [s], from and to, and its memory [bytes]."""
    begin, used = time.perf_counter(), _used()
    # Ctrl-C is for this process, which then kills that one: it would print a traceback.
    subprocess.run([sys.executable, "-c", START], check=True, process_group=0)
    started = STARTS * (_used() - used)
    with spec.sources.active():
        tried = [try_out(trial) for trial in trials[: len(spec.conditions())]]
    loading = sum(each.loading for each in tried)  # less, if what was compiled here is kept
    each_seed = np.sum([one.seconds / processes + KEEPING for one in tried], axis=0)
    quick, slow = len(spec.seeds) * each_seed
    # Processes that have no trial left wait for the last one.
    slow += (1 - 1 / processes) * max(each.seconds[1] for each in tried)
    busy = max((time.perf_counter() - begin) / (_used() - used), 1.0)
    least, most = FASTER * busy**0.5, SLOWER * busy  # others may stop, or not
    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    peak *= 1 if sys.platform == "darwin" else 1024
    memory = peak + max(each.memory for each in tried)
    seconds = least * (started + quick), most * (started + loading + slow)
    return (float(seconds[0]), float(seconds[1])), processes * memory


def try_out(trial: Trial) -> Tried:
    """Return what the trials of a condition take."""
    alone = replace(trial, seed=SEED, curriculum=(), evaluation=min(trial.evaluation, EPISODES))
    brief = replace(alone, episodes=1, steps=2, evaluation_steps=None)
    loading, building = _seconds(partial(run_trial, brief)), _seconds(partial(Session, alone))
    most, cut = trial.evaluation_steps or trial.steps, max(2, WHOLE // len(trial.world().agents))
    first = replace(alone, steps=min(trial.steps, cut), evaluation_steps=min(most, cut))
    session = Session(first)
    held, taken = _bytes(session), list[float]()
    while (k := len(taken)) < trial.episodes and (k < EPISODES or sum(taken) < TRIED):
        taken.append(_seconds(partial(session.train, 1, k)))
    own, others = _seconds(session.evaluate), _seconds(session.run_other_evaluations)
    by_phase = pd.DataFrame(session.result().rows).groupby("phase")["steps"]
    lengths = {phase: own.to_numpy(float) for phase, own in by_phase}
    steps = lengths.pop("training")
    acting = own / sum(lengths.get("evaluation", [1.0]))
    evaluated = (own + others) / max(sum(map(sum, lengths.values())), 1.0)
    evaluating = evaluated * np.sum([_others(own, most, cut) for own in lengths.values()], axis=0)
    episodes = np.array([*(stage.episodes for stage in trial.curriculum), trial.episodes])
    whole = steps[steps < cut]
    left = episodes.sum() - len(whole)
    mean = (whole.sum() + left * _others(steps[k // 2 :], trial.steps, cut)) / episodes.sum()
    beside = np.array(taken) - acting * steps
    learning = learned(steps, beside, mean, episodes)
    if not len(whole):  # beginnings do not tell how learning grows
        learning = mean * episodes.sum() * max(beside.sum(), 0.0) / steps.sum()
    seconds = building + acting * mean * episodes.sum() + learning
    kept = mean[1] * episodes.sum() / steps.sum()
    memory = held + kept * max(_bytes(session) - held, 0.0)
    return Tried(seconds + trial.evaluation * evaluating, loading, memory)


def learned(
    steps: FloatArray, taken: FloatArray, mean: FloatArray, episodes: IntArray
) -> FloatArray:
    """Return the processor time [s] to learn from all episodes of a trial.

    An episode of T steps takes T (a + b N) to learn from, N being the steps kept by its end.

    Parameters
    ----------
    steps, taken
        Of the episodes that were tried: their steps, and the time that was learned from them [s].
    mean
        Mean steps of an episode; several possible ones.
    episodes
        How many there are in every stage of training.
    """
    (per_step, per_kept), _ = optimize.nnls(
        np.stack([steps, steps * np.cumsum(steps)], axis=1), np.maximum(taken, 0.0)
    )
    kept = mean * (episodes * (episodes + 1)).sum() / 2
    return np.asarray(mean * (per_step * episodes.sum() + per_kept * kept))


def _others(tried: Sequence[float] | FloatArray, most: int, cut: int) -> FloatArray:
    """Return the mean steps of episodes that were not tried to their ends, from and to."""
    longest = max(tried)
    if longest >= cut:
        return np.array([np.mean(tried), most])
    return np.array([QUICK * np.mean(tried), min(most, LONG * longest)])


def _used() -> float:
    """Return the processor time of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])


def _seconds(call: Callable[[], object]) -> float:
    begin = time.process_time()
    call()
    return time.process_time() - begin


def _bytes(session: Session) -> float:
    return float(sum(array.nbytes for array in session.team.arrays().values()))
