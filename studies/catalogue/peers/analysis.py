"""The peers study: how ours compares with learners of other libraries, and with planners.

Training stops at some shares of its episodes, `CHECKPOINTS`, for an evaluation without exploration,
on the same worlds every time. Success stands against the decisions experienced until then, and
against the CPU seconds that training took, physics included, evaluations not. The first condition
is compared with all others at the end, paired by seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np

from ...results.comparison import Array, Difference, differences
from ...results.results import Results
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate
from ...results.summary import EVALUATED, Summary, evaluated
from ...results.verdicts import power_lines
from ...spec.errors import SpecError
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult

CHECKPOINTS = (0.01, 0.03, 0.1, 0.3)
"""Shares of the episodes after which training stops for an evaluation, before the last one."""
AFTER = "after "
"""With what the phase of such an evaluation begins; the number of episodes follows."""
CPU = "cpu."
"""With what the name of the CPU seconds until then begins; the number of episodes follows."""


def stops(episodes: int) -> list[int]:
    """Return after how many episodes there is an evaluation, the last one left out.

    >>> stops(200), stops(20)
    ([2, 6, 20, 60], [1, 2, 6])
    """
    found = {max(1, round(share * episodes)) for share in CHECKPOINTS}
    return sorted(count for count in found if count < episodes)


def check(spec: Spec) -> None:
    """Raise `SpecError` if there is no evaluation to compare."""
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: peers compares evaluation success, needs 1 or more")


def measure(trial: Trial) -> TrialResult:
    """Train, with evaluations on the way; imported by name in workers."""
    session = Session.compiled(trial)
    generator = session.team.rng.bit_generator
    done, seconds, usage = 0, 0.0, {}
    for count in (*stops(trial.episodes), trial.episodes):
        begin = process_time()
        session.train(count - done, done)
        seconds += process_time() - begin
        done, usage[f"{CPU}{count}"] = count, seconds
        if count < trial.episodes:
            state = generator.state
            session.evaluate(phase=f"{AFTER}{count}")
            generator.state = state
    session.evaluate()
    session.evaluate_elsewhere()
    return session.result(usage=usage)


@dataclass(frozen=True)
class Course:
    """How one condition fares with experience.

    Attributes
    ----------
    condition
        Its label.
    decisions, seconds
        ``(k,)`` decisions experienced and CPU seconds spent until each evaluation, means over
        seeds.
    success
        The evaluations' success rates.
    """

    condition: str
    decisions: Array
    seconds: Array
    success: tuple[Estimate, ...]


@dataclass(frozen=True)
class Peers:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    courses
        The same evaluation by evaluation, for the figure.
    differences
        Evaluation success of every other condition over that of the first; p adjusted.
    notes
        Those, for printing.
    """

    table: tuple[Summary, ...]
    courses: tuple[Course, ...]
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]
    headline = EVALUATED


def analyse(results: Results) -> Peers:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    table, courses = [], []
    for condition in results.evaluation:
        steps = results.training[condition]["steps"].astype(float)
        usage = results.usage.get(condition, {})
        earlier = {
            int(phase.removeprefix(AFTER)): arrays[condition]["success"]
            for phase, arrays in results.phases.items()
            if phase.startswith(AFTER) and condition in arrays
        }
        before = dict(sorted(earlier.items()))
        last = results.evaluation[condition]["success"]
        every = {**before, steps.shape[1]: last}
        cpu = {count: usage.get(f"{CPU}{count}") for count in every}
        estimates = {f"success, {count}": rate(s) for count, s in before.items()}
        estimates |= evaluated(results, condition)
        estimates["decisions"] = bootstrap(steps.sum(axis=1), bounds=NOT_NEGATIVE)
        spent = cpu[steps.shape[1]]
        if spent is not None:
            estimates["CPU [s]"] = bootstrap(spent, bounds=NOT_NEGATIVE)
        table.append(Summary(condition, len(steps), estimates))
        courses.append(
            Course(
                condition,
                np.array([steps[:, :count].sum(axis=1).mean() for count in every]),
                np.array([np.nan if s is None else float(np.mean(s)) for s in cpu.values()]),
                tuple(rate(success) for success in every.values()),
            )
        )
    first, *others = results.evaluation or [""]
    found = differences(results, first, others, {EVALUATED: _success})
    notes = ["success, N: when evaluated after N episodes of training."] if courses else []
    if found:
        notes.append(f"\nsuccess against that of {first} (p adjusted):")
    notes += [f"  {other.condition}: {other.shown}" for other in found]
    notes += power_lines(found)
    return Peers(tuple(table), tuple(courses), found, tuple(notes))


def _success(results: Results, condition: str) -> Array:
    """Return the evaluation success of each seed."""
    return np.asarray(results.evaluation[condition]["success"].mean(axis=1))
