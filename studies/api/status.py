"""Progress of a study: its trials by state, and the remaining time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from ..presentation.progress import count, duration
from ..spec.outline import StudyOutline, other_spec, outdated
from ..store.store import Store
from ..store.writer import read_running
from ..workers.runner import cores


@dataclass(frozen=True, repr=False)
class Status:
    """Progress of a study; printed like the command ``status``. Each trial is counted once."""

    outline: StudyOutline
    """Outline of the study."""
    total: int
    """Number of trials."""
    done: int
    """Number of trials that have finished."""
    failed: int
    """Number of trials that have failed."""
    left: int
    """Number of trials that have neither ended nor started."""
    running: tuple[tuple[str, int, float], ...]
    """Condition, seed, and seconds so far of the trials that are running."""
    processes: int
    """Number of trials that run at a time. If no run is active: the number of cores of this
    machine, or 0 if no trial can run."""
    seconds: float | None
    """Estimate of the remaining time [s]; None if no trial has finished."""
    remarks: tuple[str, ...]
    """A line for each problem: another spec in the folder, code that does not continue the study,
    and every finished trial with damaged results, which has to run again."""

    @classmethod
    def of(cls, directory: Path) -> Status:
        """Return the progress of the study in a directory; this does not disturb a run.

        Raises
        ------
        SpecError
            If the directory holds no readable study.
        """
        with Store.open(directory) as store:
            return progress(store)

    def __str__(self) -> str:
        return "\n".join(self.lines())

    __repr__ = __str__

    def lines(self) -> Iterator[str]:
        """Yield lines on the trials that are done, running, failed and left, and the remarks."""
        conditions = count(len(self.outline.columns), "condition")
        seeds = count(len(self.outline.seeds), "seed")
        yield f"study    {self.outline.study}: {conditions} x {seeds}"
        yield f"done     {self.done} of {self.total} trials"
        yield f"running  {len(self.running)}"
        for condition, seed, seconds in self.running:
            yield f"         {condition}, seed {seed}, for {duration(seconds)}"
        yield f"failed   {self.failed}"
        yield f"left     {self.left}"
        if self.seconds:
            using = "with" if self.running else "if continued with"
            processes = count(self.processes, "process", "es")
            yield f"time     about {duration(self.seconds)} {using} {processes}"
        for remark in self.remarks:
            yield f"\n{remark}"


def progress(store: Store) -> Status:
    """Return the progress of the study of an open store."""
    trials = store.planned()
    refusal = outdated(store)
    states = store.states()
    now = read_running(store.directory)
    seconds = {} if now is None else now[1]
    pending = [trial for trial in trials if trial.identity not in states]
    running = [
        (trial.condition, trial.seed, seconds[trial.identity])
        for trial in pending
        if trial.identity in seconds
    ]
    left = [trial.condition for trial in pending if trial.identity not in seconds]
    failed = [*states.values()].count("failed")
    usual = cores() if left and refusal is None else 0
    processes = usual if now is None else now[0]
    spent = [(condition, seconds) for condition, _, seconds in running]
    other = None if store.is_older else other_spec(store)
    remarks = list(filter(None, [other, refusal and f"nothing can be added: {refusal}"]))
    return Status(
        outline=StudyOutline.kept(store),
        total=len(trials),
        done=len(trials) - len(pending) - failed,
        failed=failed,
        left=len(left),
        running=tuple(running),
        processes=processes,
        seconds=_estimate(store.mean_seconds(), left, spent, processes),
        remarks=(*remarks, *store.notes),
    )


def _estimate(
    means: Mapping[str, float], left: list[str], running: list[tuple[str, float]], processes: int
) -> float | None:
    """Return the remaining time [s] from the mean durations of finished trials by condition.

    A condition without a finished trial gets the mean of the others.
    """
    if not (left or running):
        return 0.0
    if not means or not processes:
        return None
    overall = fmean(means.values())
    rest = [max(means.get(condition, overall) - spent, 0.0) for condition, spent in running]
    waiting = sum(means.get(condition, overall) for condition in left)
    return max((waiting + sum(rest)) / processes, max(rest, default=0.0))


def failures(failed: Iterable[tuple[str, int, str]]) -> Iterator[str]:
    r"""Yield the failed trials and their tracebacks; equal tracebacks are shown once.

    >>> print(*failures([("a", 0, "E\n"), ("a", 3, "E\n"), ("b", 1, "F")]), sep="\n")
    a, seeds 0, 3 failed:
    E
    b, seed 1 failed:
    F
    """
    by_error: dict[str, dict[str, list[str]]] = {}
    for condition, seed, error in failed:
        by_error.setdefault(error.rstrip(), {}).setdefault(condition, []).append(str(seed))
    for error, seeds in by_error.items():
        which = (f"{c}, seed{'s' * (len(own) > 1)} {', '.join(own)}" for c, own in seeds.items())
        yield f"{'; '.join(which)} failed:\n{error}"
