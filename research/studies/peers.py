"""The peers study: how fuzzy agents compare with learners of other libraries, and with planners.

Training stops at some shares of its episodes, `CHECKPOINTS`, for an evaluation without exploration,
on the same worlds every time. Success stands against the decisions experienced until then. The CPU
seconds that training took, physics included, evaluations not, are a column. The first condition is
compared with all others at the end, paired by seed.
"""

from time import process_time
from typing import NamedTuple

import numpy as np

from nested_agents import Analysis, Session, Study, Summary, bootstrap
from nested_agents.analysis import (
    AFTER,
    CPU,
    EVALUATED,
    NOT_NEGATIVE,
    Array,
    Estimate,
    Figures,
    Results,
    estimate_of,
    evaluated,
    evaluated_after,
    judged,
    stack_estimates,
)
from nested_agents.study import Trial, TrialResult
from nested_agents.study import check_evaluated as check

CHECKPOINTS = (0.01, 0.03, 0.1, 0.3)
"""Shares of the episodes after which training stops for an evaluation, before the last one."""


def stops(episodes: int) -> list[int]:
    """Return after how many episodes there is an evaluation, the last one left out.

    >>> stops(200), stops(20)
    ([2, 6, 20, 60], [1, 2, 6])
    """
    counts = {max(1, round(share * episodes)) for share in CHECKPOINTS}
    return sorted(count for count in counts if count < episodes)


def measure(trial: Trial) -> TrialResult:
    """Train, with evaluations on the way; imported by name in workers."""
    session = Session(trial)
    done = 0
    seconds = 0.0
    usage = {}
    for count in (*stops(trial.episodes), trial.episodes):
        begin = process_time()
        session.train(count - done, done)
        seconds += process_time() - begin
        done = count
        usage[f"{CPU}{count}"] = seconds
        if count < trial.episodes:
            with session.team.drawing_apart():
                session.evaluate(phase=f"{AFTER}{count}")
    return session.finish(usage=usage)


class LearningCourse(NamedTuple):
    """How one condition fares with experience."""

    condition: str
    """Its label."""
    decisions: Array
    """``(k,)`` decisions experienced until each evaluation, means over seeds."""
    values: Estimate
    """What the evaluations come to, by `Results.main` ``(k,)``."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("evaluation")
    main = results.main
    title = f"evaluation {main.heading}"
    table = []
    courses = []
    for condition in conditions:
        steps = results.values(condition, "steps").astype(float)
        numbers = results.numbers(condition)
        episodes = steps.shape[1]
        stopped = evaluated_after(results, condition)
        values = {n: estimate_of(results, condition, phase, main) for n, phase in stopped.items()}
        estimates = {f"{main.heading}, {count}": estimate for count, estimate in values.items()}
        estimates |= evaluated(results, condition)
        estimates["decisions"] = bootstrap(steps.sum(axis=1), bounds=NOT_NEGATIVE)
        if f"{CPU}{episodes}" in numbers:
            estimates["CPU [s]"] = bootstrap(numbers[f"{CPU}{episodes}"], bounds=NOT_NEGATIVE)
        table.append(Summary(condition, len(steps), estimates))
        values[episodes] = estimates[title]
        decisions = [steps[:, :count].sum(axis=1).mean() for count in values]
        courses.append(
            LearningCourse(
                condition,
                np.array(decisions),
                stack_estimates([*values.values()]),
            )
        )
    if not courses:
        return Analysis(())
    means = [results.means(condition, "evaluation", main.name) for condition in conditions]
    pairs = [(c, title, own, means[0]) for c, own in zip(conditions, means, strict=True)]
    compared, lines = judged({title: pairs[1:]}, conditions[0], main)
    notes = (f"{main.heading}, N: when evaluated after N episodes of training.", *lines)
    return Analysis(tuple(table), notes, courses, compared)


def draw(analysis: Analysis) -> Figures:
    """Return the figure: evaluations against experience, a panel for each condition.

    The condition's line has a color, and a band for its 95% intervals; those of the others are
    gray.
    """
    from matplotlib.ticker import LogLocator

    from nested_agents import figures as f

    courses = analysis.cases
    (title,) = analysis.differences
    figure, panels = f.grid(len(courses), 4, (2.3, 1.5), (0.2, 0.6), sharex=True, sharey=True)
    for axes, own in zip(panels.flat, courses, strict=False):
        for other in courses:
            axes.plot(other.decisions, other.values.value, color="#c9ccd2", lw=0.8)
        f.draw_curve(axes, own.decisions, own.values, 0, alpha=0.15, marker="o", markersize=3.5)
        axes.set_title(own.condition, loc="left", fontsize=8)
        f.log_axis(axes, "x")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        if title == EVALUATED:
            f.as_rates(axes)
        axes.grid(axis="y", alpha=0.25)
    for axes in panels.flat[len(courses) - panels.shape[1] : len(courses)]:
        axes.tick_params(labelbottom=True)
    figure.supxlabel("decisions of training", fontsize=9)
    figure.supylabel(title, fontsize=9)
    return {"peers": figure}


class PeersStudy(Study):
    """Compares learners after the same experience."""

    check = staticmethod(check)
    measure = staticmethod(measure)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
