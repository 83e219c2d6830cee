"""The experience study: what teams return after more and more decisions, on a logarithmic axis.

A trial trains for `decisions` joint decisions, and stops at 1,000, 3,000, 10,000 and so on for an
evaluation without exploration, on the same worlds every time. Learners in many environments
count the decisions of all. Conditions that learn nothing are evaluated without training. The
first condition is compared with all others at the end, paired by seed.
"""

from itertools import count
from typing import NamedTuple

import numpy as np

from ....core.interface.measures import RETURN, SUCCESS
from ...errors import SpecError
from ...results.analysis import EVALUATED, Analysis, Figures, Summary, differences, verdicts
from ...results.results import CPU, Results
from ...results.statistics import NOT_NEGATIVE, Array, Estimate, bootstrap, rate, stack_estimates
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import check_evaluated

AFTER = "after "
"""With what the phase of such an evaluation begins; how much came before follows."""
FIRST = 1000
"""Decisions before the first evaluation."""
DECISIONS = "decisions"
"""Name of the number of decisions that a trial was trained for."""
NUMBERS = (DECISIONS,)


def stops(decisions: int) -> list[int]:
    """Return after how many decisions there is an evaluation, the last one left out.

    >>> stops(400_000), stops(500)
    ([1000, 3000, 10000, 30000, 100000, 300000], [])
    """
    counts: list[int] = []
    for k in count():
        reached = FIRST * 10 ** (k // 2) * (3 if k % 2 else 1)
        if reached >= decisions:
            return counts
        counts.append(reached)
    return counts


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there is a budget, and every learner's holds a rollout."""
    check_evaluated(spec)
    if spec.decisions is None:
        raise SpecError("decisions: missing; experience needs a budget, as decisions = 1000000")
    for condition in spec.conditions():
        learner = condition.settings.learner
        rollout = learner.model_dump().get("rollout", 0) * learner.n_environments
        if spec.decisions < rollout:
            raise SpecError(
                f"decisions = {spec.decisions}: less than a rollout of {rollout} decisions in "
                f"{learner.n_environments} environments, nothing would be learned (condition "
                f"{condition.label!r})"
            )


def measure(trial: Trial) -> TrialResult:
    """Train, with evaluations on the way; imported by name in workers."""
    session = Session.resumed(trial)
    budget = trial.decisions or 0
    done = 0
    for stop in (*stops(budget), budget):
        done = session.train_until(stop)
        session.usage.setdefault(f"{CPU}{stop}", session.spent)
        if stop < budget and f"{AFTER}{stop}" not in session.phases:
            with session.team.drawing_apart():
                session.evaluate(phase=f"{AFTER}{stop}")
            session.put_down()
    return session.finish({DECISIONS: float(done)}, session.usage)


def evaluated_after(results: Results, condition: str) -> dict[int, str]:
    """Return the phases in which a condition was evaluated on its way, by how much came before."""
    phases = {
        int(phase.removeprefix(AFTER)): phase
        for phase in results.phases
        if phase.startswith(AFTER) and results.has(condition, phase)
    }
    return dict(sorted(phases.items()))


class ReturnCourse(NamedTuple):
    """How one condition fares with experience."""

    condition: str
    """Its label."""
    decisions: Array
    """``(k,)`` decisions experienced until each evaluation."""
    values: Estimate
    """What the evaluations come to ``(k,)``."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("evaluation")
    is_rate = all(results.has(condition, "evaluation", SUCCESS.name) for condition in conditions)
    is_rate = is_rate and any(results.success(c, "evaluation").any() for c in conditions)
    measure = SUCCESS if is_rate else RETURN
    name = measure.name
    title = EVALUATED if is_rate else "evaluation return"
    unknown = next((c for c in conditions if not results.has(c, "evaluation", name)), None)
    if unknown is not None:  # published results keep no returns
        raise SpecError(f"study = 'experience': results of {unknown!r} have no {name}")
    table = []
    courses = []
    for condition in conditions:
        phases = evaluated_after(results, condition)
        phases[int(results.numbers(condition)[DECISIONS].mean())] = "evaluation"
        values = {}
        for stop, phase in phases.items():
            own = results.values(condition, name, phase)
            values[stop] = rate(own) if is_rate else bootstrap(own.mean(axis=1))
        estimates = {f"after {stop:,}": values[stop] for stop in [*values][:-1]}
        estimates[title] = [*values.values()][-1]
        numbers = results.numbers(condition)
        seconds = [key for key in numbers if key.startswith(CPU)]
        if seconds:
            last = max(seconds, key=lambda key: int(key.removeprefix(CPU)))
            estimates["CPU [s]"] = bootstrap(numbers[last], bounds=NOT_NEGATIVE)
        table.append(Summary(condition, len(results.seeds(condition)), estimates))
        stacked = stack_estimates([*values.values()])
        courses.append(ReturnCourse(condition, np.array([*values], float), stacked))
    if not courses:
        return Analysis(())
    means = [results.means(condition, "evaluation", name) for condition in conditions]
    pairs = [(c, title, own, means[0]) for c, own in zip(conditions, means, strict=True)]
    compared = differences({title: pairs[1:]}, measure)
    heads = {f"{title}, less that of {conditions[0]}": compared[title]}
    notes = (
        "after N: when evaluated after N joint decisions of training, of all environments.",
        *verdicts(heads, measure),
    )
    return Analysis(tuple(table), notes, courses, compared)


def draw(analysis: Analysis) -> Figures:
    """Return the figure: evaluations against decisions experienced, bands 95% intervals."""
    from matplotlib.ticker import LogLocator

    from ...presentation import figures as f  # matplotlib takes its time

    figure, panels = f.panels(1, 1, (5.4, 3.6))
    axes = panels[0, 0]
    for i, course in enumerate(analysis.cases):
        f.draw_curve(axes, course.decisions, course.values, i, marker="o", markersize=3.5)
    f.log_axis(axes, "x")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axes.set_xlabel("joint decisions of training")
    is_rate = EVALUATED in analysis.differences
    axes.set_ylabel(EVALUATED if is_rate else "evaluation return")
    axes.grid(axis="y", alpha=0.25)
    if is_rate:
        f.as_rates(axes)
    f.name_curves(figure, [c.condition for c in analysis.cases], marker="o", markersize=3.5)
    return {"experience": figure}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
