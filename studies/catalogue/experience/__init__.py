"""The experience study: what teams return after more and more decisions, on a logarithmic axis.

A trial trains for `decisions` joint decisions, and stops at 1,000, 3,000, 10,000 and so on for an
evaluation without exploration, on the same worlds every time. Policies of probabilities are also
evaluated by sampled actions. Learners in many environments count the decisions of all. Conditions
that learn nothing are evaluated without training. The first condition is compared with all others
at the end, paired by seed, by greedy actions.
"""

from collections.abc import Mapping, Sequence
from itertools import count
from typing import Any

import numpy as np

from ....core.interface.measures import RETURN, SUCCESS, Measure
from ...errors import SpecError
from ...results.analysis import (
    EVALUATED,
    Analysis,
    Figures,
    Summary,
    estimate_of,
    judged,
    left_out_lines,
)
from ...results.results import CPU, Results
from ...results.statistics import NOT_NEGATIVE, Array, Estimate, bootstrap, stack_estimates
from ...spec.spec import Spec
from ...store.database import EVALUATION, SAMPLED
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import check_evaluated

AFTER = "after "
"""Prefix of the phases of evaluations during training; the number of decisions follows."""
AFTER_LINE = "after N: evaluated when all environments together have made N joint decisions."
FIRST = 1000
"""Decisions before the first evaluation."""
DECISIONS = "decisions"
"""Name of the number of decisions that a trial was trained for."""
NUMBERS = (DECISIONS,)
BY_SAMPLING = f", {SAMPLED.removeprefix(EVALUATION)}"
"""Suffix of phases and lines of the table in which actions are sampled from the policy."""


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
        session.usage.setdefault(f"{CPU}{stop}", session.training_cpu_s)
        if stop < budget and f"{AFTER}{stop}" not in session.phases:
            with session.team.drawing_apart():
                session.evaluate(phase=f"{AFTER}{stop}")
            session.evaluate_sampled(f"{AFTER}{stop}{BY_SAMPLING}")
            session.save_checkpoint()
    return session.finish({DECISIONS: float(done)}, session.usage)


def evaluated_after(results: Results, condition: str, suffix: str = "") -> dict[int, str]:
    """Return the phases in which a condition was evaluated on its way, by how much came before."""
    phases = {
        int(count): phase
        for phase in results.phases
        if phase.startswith(AFTER)
        and (count := phase.removeprefix(AFTER).removesuffix(suffix)).isdigit()
        and results.has(condition, phase)
    }
    return dict(sorted(phases.items()))


ReturnCourse = tuple[str, int, bool, Array, Estimate]
"""Label and number of a condition; whether actions are sampled from the policy or greedy;
``(k,)`` decisions experienced until each evaluation; and ``(k,)`` results of the evaluations."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("evaluation")
    if not conditions:
        return Analysis(())
    measure = _measure_of(results, conditions)
    title = f"evaluation {measure.heading}"
    table = []
    courses: list[ReturnCourse] = []
    for index, condition in enumerate(conditions):
        for is_sampled in (False, True) if results.has(condition, SAMPLED) else (False,):
            values = _evaluations(results, condition, measure, BY_SAMPLING * is_sampled)
            *before, last = values
            estimates = {f"after {stop:,}": values[stop] for stop in before} | {title: values[last]}
            if not is_sampled:
                estimates |= _cpu_seconds(results.numbers(condition))
            label = condition + BY_SAMPLING * is_sampled
            table.append(Summary(label, len(results.seeds(condition)), estimates))
            stacked = stack_estimates([*values.values()])
            decisions = np.array([*values], float)
            courses.append((condition, index, is_sampled, decisions, stacked))
    means = [results.means(condition, "evaluation", measure.name) for condition in conditions]
    pairs = [(c, title, own, means[0]) for c, own in zip(conditions, means, strict=True)]
    compared, lines = judged({title: pairs[1:]}, conditions[0], measure)
    notes = [AFTER_LINE, *left_out_lines(results, "evaluation"), *lines]
    if any(is_sampled for _, _, is_sampled, *_ in courses):
        notes.insert(1, "Sampled actions are drawn from the policy; others are greedy.")
    return Analysis(tuple(table), tuple(notes), courses, compared)


def _measure_of(results: Results, conditions: Sequence[str]) -> Measure:
    """Return success if all conditions have it and some team ever succeeds, else the return."""
    phases = [("evaluation", c) for c in conditions]
    phases += [(SAMPLED, c) for c in conditions if results.has(c, SAMPLED)]
    is_rate = all(results.has(c, phase, SUCCESS.name) for phase, c in phases)
    measure = SUCCESS if is_rate and any(results.success(c, p).any() for p, c in phases) else RETURN
    unknown = next((c for p, c in phases if not results.has(c, p, measure.name)), None)
    if unknown is not None:  # published results keep no returns
        raise SpecError(f"study = 'experience': results of {unknown!r} have no {measure.name}")
    return measure


def _evaluations(
    results: Results, condition: str, measure: Measure, suffix: str
) -> dict[int, Estimate]:
    """Return the evaluations of a condition by the decisions before each, the last one last."""
    phases = evaluated_after(results, condition, suffix)
    decisions = int(results.numbers(condition)[DECISIONS].mean())
    phases[decisions] = SAMPLED if suffix else "evaluation"
    return {stop: estimate_of(results, condition, p, measure) for stop, p in phases.items()}


def _cpu_seconds(numbers: Mapping[str, Array]) -> dict[str, Estimate]:
    """Return the CPU time of training as a column of the table, if it is known."""
    counts = [int(name.removeprefix(CPU)) for name in numbers if name.startswith(CPU)]
    if not counts:
        return {}
    return {"CPU [s]": bootstrap(numbers[f"{CPU}{max(counts)}"], bounds=NOT_NEGATIVE)}


def draw(analysis: Analysis) -> Figures:
    """Return the figure: evaluations against decisions experienced, bands 95% intervals."""
    from matplotlib.ticker import LogLocator

    from ...presentation import figures as f  # matplotlib takes its time

    figure, panels = f.panels(1, 1, (5.4, 3.6))
    axes = panels[0, 0]
    courses: Sequence[ReturnCourse] = analysis.cases
    hollow: dict[str, Any] = {"marker": "o", "markersize": 5, "markerfacecolor": "white"}
    filled: dict[str, Any] = {"marker": "o", "markersize": 3.5}
    labels = []
    for label, place, is_sampled, decisions, values in courses:
        labels += [] if is_sampled else [label]
        f.draw_curve(axes, decisions, values, place, **(hollow if is_sampled else filled))
    f.log_axis(axes, "x")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axes.set_xlabel("joint decisions of training")
    (title,) = analysis.differences
    axes.set_ylabel(title)
    axes.grid(axis="y", alpha=0.25)
    if title == EVALUATED:
        f.as_rates(axes)
    handles = [f.handle(label, **f.look(i), lw=1.6, **filled) for i, label in enumerate(labels)]
    if len(labels) < len(courses):
        handles.append(f.handle("sampled actions", color="#444444", lw=0, **hollow))
    f.add_legend(figure, handles)
    return {"experience": figure}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
