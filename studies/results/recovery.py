"""Recovery from failures, seed by seed: how much success is lost, and how soon it is back.

The level of a seed is its mean over the last `BLOCK` episodes before the first failure. All
measures count from that failure on. A seed without any success before the failure has nothing to
lose or to recover, so that it has no measures.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import BoolArray, pd
from ..errors import SpecError
from .results import KEPT, STEPS, Results
from .statistics import Array

BLOCK = 5
"""Episodes over which a level is measured."""
REGAINED = 0.9
"""Share of the level, or of what a fault has cost, that counts as recovered."""
RECOVERED = Measure("recovered", "recovered", better="higher", is_rate=True)
LOSS = Measure("cumulative_loss", "cumulative loss", "episodes", better="lower")
TIME = Measure("recovery_time", "recovery time", "episodes", better="lower", least=0.0)
DECISIONS = Measure("recovery_decisions", "decisions to recovery", better="lower", least=0.0)
RECOVERY = {measure.name: measure for measure in (RECOVERED, LOSS, TIME, DECISIONS)}
"""Measures of a trial with a failure, by name."""
TIMES = (TIME.name, DECISIONS.name)
LOWER_BOUND = (
    "A seed that never recovers counts with all its episodes from the failure on, so that the mean "
    "time to recovery is a lower bound."
)
"""Remark on the means of `TIMES`."""


def is_over_episodes(measure: Measure) -> bool:
    """Return whether a measure is a share of a seed's episodes, not one outcome of a seed."""
    return measure.is_rate and measure.name not in RECOVERY


def recovery(shortfall: ArrayLike, allowed: ArrayLike, last_onset: int = 0) -> tuple[Array, Array]:
    """Return per seed whether it recovered from faults, and after how many episodes.

    A seed recovers at the first episode from which on `BLOCK` episodes fall short by no more than
    is allowed, in the mean, and all faults have begun. A seed that never recovers counts with all
    its episodes, which is a lower bound.

    Parameters
    ----------
    shortfall
        Loss of each episode from the first fault on ``(n_seeds, n_episodes)``.
    allowed
        Loss at which a seed counts as recovered: a number, or ``(n_seeds, 1)``.
    last_onset
        Number of episodes between the first fault and the last.
    """
    blocks = np.lib.stride_tricks.sliding_window_view(np.asarray(shortfall), BLOCK, axis=1)
    regained = blocks.mean(axis=2) <= np.asarray(allowed) + 1e-12
    regained[:, :last_onset] = False
    recovered = regained.any(axis=1)
    episodes = np.where(recovered, regained.argmax(axis=1), np.shape(shortfall)[1])
    return recovered.astype(float), episodes.astype(float)


class FailureCourse(NamedTuple):
    """Training of one condition through a failure."""

    onsets: tuple[int, ...]
    """Episodes in which failures begin, sorted."""
    success: Array
    """``(n_seeds, n_episodes)`` from the first episode of training on."""
    steps: Array
    """``(n_seeds, n_episodes)``"""
    seeds: tuple[int, ...]
    """Seeds of the rows."""

    @property
    def onset(self) -> int:
        """Episode in which the first failure begins."""
        return self.onsets[0]

    @property
    def had_success(self) -> BoolArray:
        """Whether each seed succeeded before the failure, ``(n_seeds,)``."""
        return np.asarray(self.before.any(axis=1))

    @property
    def before(self) -> Array:
        """Success ``(n_seeds, BLOCK)`` in the last episodes before the failure."""
        return self.success[:, self.onset - BLOCK : self.onset]

    @property
    def end(self) -> Array:
        """Success ``(n_seeds, BLOCK)`` in the last episodes."""
        return self.success[:, -BLOCK:]

    def from_episode(self, episode: int) -> Array:
        """Return the success ``(n_seeds, BLOCK)`` in the episodes from a given one on."""
        return self.success[:, episode : episode + BLOCK]

    @property
    def measured(self) -> dict[str, Array]:
        """Values ``(n_seeds,)`` of the measures `RECOVERY` by name; NaN without success before."""
        level = self.before.mean(axis=1, keepdims=True)
        shortfall = level - self.success[:, self.onset :]
        last_onset = self.onsets[-1] - self.onset
        recovered, episodes = recovery(shortfall, (1.0 - REGAINED) * level, last_onset)
        decisions = [
            run[self.onset : self.onset + int(count)].sum()
            for run, count in zip(self.steps, episodes, strict=True)
        ]
        values = (recovered, shortfall.sum(axis=1), episodes, np.array(decisions, dtype=float))
        known = (np.where(self.had_success, own, np.nan) for own in values)
        return dict(zip(RECOVERY, known, strict=True))


def failure_course(results: Results, condition: str, phase: str = "training") -> FailureCourse:
    """Return the course of a condition; in the phase `KEPT` that of the copied team."""
    numbers = results.numbers(condition)
    onsets = sorted(int(numbers[name][0]) for name in numbers if name.startswith("onset"))
    success, steps = (
        results.values(condition, name).astype(float) for name in (SUCCESS.name, STEPS.name)
    )
    if phase != "training":
        success[:, onsets[0] :] = results.values(condition, SUCCESS.name, phase)
        steps[:, onsets[0] :] = results.values(condition, STEPS.name, phase)
    return FailureCourse(tuple(onsets), success, steps, results.seeds(condition))


def bounded(name: str, courses: Iterable[FailureCourse], longest: int | None) -> Measure:
    """Return the measure of `RECOVERY` of a name with the range that it has for some courses.

    `longest` is the longest episode that is allowed [decisions].
    """
    episodes = max((own.success.shape[1] - own.onset for own in courses), default=0)
    if name == LOSS.name:
        return replace(LOSS, least=-episodes, greatest=episodes)
    if name == TIME.name:
        return replace(TIME, greatest=episodes)
    if name == DECISIONS.name and longest is not None:
        return replace(DECISIONS, greatest=episodes * longest)
    return RECOVERY[name]


def within(results: Results, condition: str, measure: Measure) -> Measure:
    """Return a measure with the range that it has for a condition, which is that of its failure."""
    if measure.name not in RECOVERY:
        return measure
    course = failure_course(results, condition)
    own = bounded(measure.name, [course], results.step_limits[0])
    return replace(own, title=measure.title)


def never_recovered(results: Results, measure: Measure, phase: str | None) -> set[str]:
    """Return the conditions of which the mean is a lower bound, because a seed never recovers."""
    if measure.name not in TIMES:
        return set()
    _, recovered = recovery_by_seed(results, RECOVERED.name, phase or "training")
    return {condition for condition, own in recovered.items() if not own.all()}


def recovery_by_seed(
    results: Results, name: str, phase: str
) -> tuple[Measure, Mapping[str, pd.Series]]:
    """Return a measure of `RECOVERY` and its values by condition.

    Left out are conditions without failures, and seeds without success before them.

    Parameters
    ----------
    results
        Results of a study.
    name
        Name of the measure.
    phase
        ``training``, or `KEPT`.

    Raises
    ------
    SpecError
        If the phase is another one, or no seed had success before a failure.
    """
    if phase not in ("training", KEPT):
        raise SpecError(f"phase = {phase!r}: measure = {name!r} is of training or {KEPT!r}")
    courses = {
        condition: failure_course(results, condition, phase)
        for condition in results.of_phase(phase)
        if "onset" in results.numbers(condition)
    }
    measure = bounded(name, courses.values(), results.step_limits[0])
    if phase != "training":
        measure = replace(measure, title=f"{measure.title}, {phase}")
    values = {c: pd.Series(own.measured[name], own.seeds).dropna() for c, own in courses.items()}
    known = {condition: own for condition, own in values.items() if len(own)}
    if not known:
        raise SpecError(f"measure = {name!r}: no seed succeeded before a failure began")
    return measure, known
