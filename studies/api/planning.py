"""What a study will take and what it can find, before anything is spent on it.

Two episodes of every condition are trained, and one is evaluated, to see what a step takes, on a
seed that no study reports. Deciding and simulating take a time per step. Learning may take one per
step, too, and one per step kept so far: a regression over all of training grows with the square of
its length. A worker has to start, too, to load or compile what each condition needs, and to build
each trial: that is measured here once.
"""

import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from ...core.plugins.deferred import optimize
from ..errors import SpecError
from ..presentation.words import count, duration
from ..results.analysis import WIDTH, power_text
from ..results.power import SMALLEST, USUAL_DEVIATION
from ..spec.outline import StudyOutline
from ..spec.spec import Spec
from ..trials.session import Session, run_trial
from ..trials.trial import Trial, trials_of
from ..workers.worker import cores
from ..workers.workers import check_jobs
from .run_study import examine

SEED = 10_000
"""Of the trials that are tried out."""
EPISODES = 2
"""Tried of every condition; one that is cut short goes before them, in which code is compiled."""
QUICK = 0.25
"""Share of the steps tried that an episode takes if the goal is reached sooner by the trained."""
FASTER, SLOWER = 0.5, 2.5
"""By what a machine is faster or slower than when it was tried: others use it, caches are cold."""
WORKER = f"import {Session.__module__}, matplotlib.pyplot"
"""What is imported by a worker, and at the end for the figures."""


@dataclass(frozen=True)
class Pace:
    """What the trials of a condition take."""

    acting: float
    """Seconds of a step of evaluation."""
    learning: float
    """Seconds that a step of training takes more: for each of the episode that has ended."""
    regression: float
    """The same for every step that is kept by then."""
    bytes: tuple[float, float]
    """What the team holds [bytes], and how much more for every step of training."""
    building: float = 0.0
    """Seconds to build a trial's world and team."""
    loading: float = 0.0
    """Seconds to import, load and compile what the first step needs, once a process."""
    early: float = QUICK
    """Share of its steps that an episode takes if it ends early: `QUICK` of what was tried."""

    def seconds(self, steps: float, training: Sequence[int], evaluation: float) -> float:
        """Return the time of a trial whose episodes take so many steps.

        Parameters
        ----------
        steps
            Of an episode of training.
        training
            Episodes of training, stage by stage.
        evaluation
            Steps of all evaluations together.
        """
        acting = self.acting * (steps * sum(training) + evaluation)
        learning = sum(
            self.learning * steps * n + self.regression * steps**2 * n * (n + 1) / 2
            for n in training
        )
        return self.building + acting + learning


@dataclass(frozen=True)
class Plan:
    """What a study will take and what it can find."""

    outline: StudyOutline
    """What the study consists of."""
    trials: int
    """How many there are."""
    processes: int
    """How many run at a time."""
    seconds: tuple[float, float] | None
    """Time of the whole study [s], from and to: from `QUICK` of the steps of episodes tried on a
    machine that is `FASTER` to all that they may have on one that is `SLOWER`."""
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
    seconds = memory = None
    if timed:
        seconds, memory = _taken(made, trials, processes)
    return Plan(
        StudyOutline.of(made), len(trials), processes, seconds, memory, len(made.conditions()) - 1,
        deviation, smallest, made.warnings(),
    )  # fmt: skip


def _taken(
    spec: Spec, trials: Sequence[Trial], processes: int
) -> tuple[tuple[float, float], float]:
    """Return the time of a study [s], from and to, and its memory [bytes]."""
    quick = slow = longest = loaded = largest = 0.0
    # This process, a worker, and the figures.
    started = 3 * _seconds(lambda: subprocess.run([sys.executable, "-c", WORKER], check=True))
    with spec.sources.active():
        for trial in trials[: len(spec.conditions())]:
            training = [*(stage.episodes for stage in trial.curriculum), trial.episodes]
            evaluations = trial.evaluation * (1 + len(trial.evaluations))
            pace = paced(trial)
            evaluated = evaluations * (trial.evaluation_steps or trial.steps)
            most = pace.seconds(trial.steps, training, evaluated)
            quick += pace.seconds(pace.early * trial.steps, training, pace.early * evaluated)
            slow += most
            longest, loaded = max(longest, most), loaded + pace.loading
            held, more = pace.bytes
            largest = max(largest, held + more * trial.steps * sum(training))
    each = len(spec.seeds) / processes
    # Processes that have no trial left wait for the last one.
    seconds = started + quick * each, started + loaded + slow * each + longest
    return (FASTER * seconds[0], SLOWER * seconds[1]), processes * (_resident() + largest)


def paced(trial: Trial) -> Pace:
    """Return what a condition's trials take, by trying one of them out."""
    alone = replace(
        trial, seed=SEED, episodes=EPISODES, evaluation=1, curriculum=(), evaluations=()
    )
    brief = replace(alone, episodes=1, steps=2, evaluation_steps=None)
    loading, building = _seconds(partial(run_trial, brief)), _seconds(partial(Session, alone))
    session = Session(alone)
    held = _bytes(session)
    taken = [_seconds(partial(session.train, 1, k)) for k in range(EPISODES)]
    evaluated = _seconds(session.evaluate)
    *trained, evaluation = (float(row.steps) for row in session.result().rows)
    steps, acting = np.array(trained), evaluated / evaluation
    # An episode of T steps takes T (a + b N) to learn from, N being the steps kept by its end.
    (per_step, per_kept), _ = optimize.nnls(
        np.stack([steps, steps * np.cumsum(steps)], axis=1),
        np.maximum(np.array(taken) - acting * steps, 0.0),
    )
    more = max(_bytes(session) - held, 0.0) / steps.sum()
    early = QUICK * min(evaluation, float(steps.mean())) / trial.steps
    return Pace(
        acting, float(per_step), float(per_kept), (held, float(more)), building, loading, early
    )


def _seconds(call: Callable[[], object]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def _bytes(session: Session) -> float:
    return float(sum(array.nbytes for array in session.team.arrays().values()))


def _resident() -> float:
    """Return the most memory that this process, as large as a worker, has held [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak) * (1 if sys.platform == "darwin" else 1024)
