"""What a study will take and what it can find, before anything is spent on it.

Two episodes of every condition are run to see what a step takes, on a seed that no study reports.
Deciding and simulating take a time per step. Learning may take one per step, too, and one per step
kept so far: a regression over all of training grows with the square of its length. A worker has to
start, too, and to load or compile what each condition needs: that is measured here once.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from ...core.plugins.deferred import optimize
from ..errors import SpecError
from ..presentation.words import count, duration
from ..results.power import SMALLEST, USUAL_DEVIATION, detectable, seeds_for
from ..results.verdicts import WIDTH, power_text
from ..spec.outline import StudyOutline
from ..spec.spec import Spec
from ..trials.session import Session
from ..trials.trial import Trial, trials_of
from ..workers.worker import cores
from ..workers.workers import check_jobs
from .run_study import examine

SEED = 10_000
"""Of the trials that are tried out."""
EPISODES = 2
"""Tried of every condition; one that is cut short goes before them, in which code is compiled."""
QUICK = 0.25
"""Share of its steps that an episode takes if the goal is reached early."""
FASTER, SLOWER = 0.5, 2.5
"""By what a machine is faster or slower than when it was tried: others use it, caches are cold."""
WORKER = f"import {Session.__module__}, matplotlib.pyplot"
"""What is imported by a worker, and at the end for the figures."""


@dataclass(frozen=True)
class Pace:
    """What the trials of a condition take."""

    acting: float
    """Seconds of a step but for learning."""
    learning: float
    """Seconds of learning for a step of the episode that has ended."""
    regression: float
    """The same for every step that is kept by then."""
    bytes: tuple[float, float]
    """What the team holds [bytes], and how much more for every step of training."""
    start: float = 0.0
    """Seconds before the first step: what is imported, loaded and compiled."""

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
        return acting + learning


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
    """Time of the whole study [s], from and to: from `QUICK` of the steps of its episodes on a
    machine that is `FASTER` to all of them on one that is `SLOWER`."""
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

    @property
    def detectable(self) -> float:
        """The least difference of success rates that is found with a power of .8."""
        return detectable(self.deviation, len(self.outline.seeds), max(self.comparisons, 1))

    @property
    def seeds_needed(self) -> int | None:
        """How many seeds it takes to find the smallest difference of interest with that power."""
        return seeds_for(self.smallest, self.deviation, max(self.comparisons, 1))

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
    spent = np.zeros(2)
    largest = 0.0
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", WORKER], check=True)
    started = 3 * (time.perf_counter() - begin)  # this process, a worker, and the figures
    loaded = 0.0
    with spec.sources.active():
        for trial in trials[: len(spec.conditions())]:
            training = [*(stage.episodes for stage in trial.curriculum), trial.episodes]
            evaluations = trial.evaluation * (1 + len(trial.evaluations))
            pace = paced(trial)
            evaluated = evaluations * (trial.evaluation_steps or trial.steps)
            for i, share in enumerate((QUICK, 1.0)):
                seconds = pace.seconds(share * trial.steps, training, share * evaluated)
                spent[i] += len(spec.seeds) * seconds
            loaded += pace.start
            held, more = pace.bytes
            largest = max(largest, held + more * trial.steps * sum(training))
    quick, slow = (float(seconds) for seconds in spent / processes)
    whole = FASTER * (started + quick), SLOWER * (started + loaded + slow)
    return whole, processes * (_resident() + largest)


def paced(trial: Trial) -> Pace:
    """Return what a condition's trials take, by trying one of them out."""
    alone = replace(trial, seed=SEED, curriculum=(), evaluations=(), evaluation_steps=None)
    begin = time.perf_counter()
    warming = Session(replace(alone, episodes=1, steps=2, evaluation=1))
    warming.train(1)
    warming.evaluate()
    start = time.perf_counter() - begin
    session = Session(replace(trial, seed=SEED, episodes=EPISODES, curriculum=()))
    held = _bytes(session)
    acting: list[float] = []
    learning: list[list[float]] = []

    def note(record: Any) -> None:
        if record.step == 0:
            learning.append([])
        learning[-1].append(record.learning)
        seconds = record.transition.info.get("seconds", {})
        acting.append(record.deciding + sum(seconds.values()))

    session.train(EPISODES, observe=note)
    steps = np.array([len(episode) for episode in learning], dtype=float)
    taken = np.array([sum(episode) for episode in learning])
    # An episode of T steps takes T (a + b N) to learn from, N being the steps kept by its end.
    (per_step, per_kept), _ = optimize.nnls(
        np.stack([steps, steps * np.cumsum(steps)], axis=1), taken
    )
    more = max(_bytes(session) - held, 0.0) / steps.sum()
    # The median: what else a machine does now and then is not the study's.
    return Pace(
        float(np.median(acting)), float(per_step), float(per_kept), (held, float(more)), start
    )


def _bytes(session: Session) -> float:
    return float(sum(array.nbytes for array in session.team.arrays().values()))


def _resident() -> float:
    """Return the most memory that this process, as large as a worker, has held [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak) * (1 if sys.platform == "darwin" else 1024)
