"""Wheel-failure study: performance loss and recovery after the failure of a wheel.

Agents that leave (``kind = "left"`` of ``topology.failures``) also count as a failure.

Training continues through the failure. At its onset the team is copied, and the copy continues with
fixed weights under the same initial states and exploration. A sweep over
``learner.self_model.enabled`` gives four cases of adaptation: nothing, the weights, the self-model,
which corrects predictions, or both. Without that sweep the team that learns is compared with the
copy, and the share of seeds that recover in training with that of the first condition.

Levels are success rates over `BLOCK` episodes: before the failure, just after its onset, after its
end if it ends, and at the end of training. Recovery and loss are relative to the level of each
seed, see `nested_agents.studies.results.recovery`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from ....core.agents.team import Team
from ....core.learners.learner import LearnerSettings
from ....core.learners.td import FrozenSettings
from ....core.numerics import pd
from ....core.plugins.settings import FailureSpan
from ...errors import SpecError
from ...results.analysis import (
    Analysis,
    Figures,
    Summary,
    has_lower_bounds,
    judged,
    mean_estimate,
)
from ...results.differences import Pair
from ...results.notation import wrapped
from ...results.recovery import (
    BLOCK,
    LOWER_BOUND,
    RECOVERED,
    TIMES,
    FailureCourse,
    bounded,
    failure_course,
)
from ...results.results import KEPT, Results
from ...results.statistics import Array, Estimate, censored, exactly, rate, stack_estimates
from ...spec.spec import Spec
from ...spec.tables import SpecTable, label_but
from ...trials.arrangement import arrange
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import check_rule_bases, distinct

if TYPE_CHECKING:
    from matplotlib.artist import Artist

NUMBERS = ("onset",)
"""Numbers of whole trials that the analysis needs."""
PUBLISHED = ("success",)
"""Measures in published results."""
AT_END = "success at the end"
"""Title of the compared measure, the main result."""
SWEPT = "learner.self_model.enabled"
"""Key that is swept to run each condition with and without a self-model."""
ADAPTS = {
    ("false", KEPT): "nothing",
    ("false", "training"): "weights",
    ("true", KEPT): "self-model",
    ("true", "training"): "both",
}
"""Adapting parts, by the value of `SWEPT` and the phase."""
COLUMNS = 3
"""Maximum number of panels in a row of the figure."""
ONSET: dict[str, Any] = {"color": "black", "linewidth": 1.0, "linestyle": "-."}
"""Look of the line at which a failure begins."""
TRANSIENT: dict[str, Any] = {
    "facecolor": "none",
    "edgecolor": "#aaaaaa",
    "hatch": "////",
    "linewidth": 0.0,
}
"""Look of the area of a transient failure, which no band has."""
SMOOTHED = 3
"""Number of episodes in the running mean of curves."""


def measure(trial: Trial) -> TrialResult:
    """Train a team through a failure, and run a copy with fixed weights from its onset on.

    The copy runs first, because a checkpoint holds one team.
    """
    onset = trial.settings.onset
    assert onset is not None, "see check"
    session = Session.resumed(trial)
    session.train(max(onset - session.trained, 0), session.trained)
    if KEPT not in session.phases:
        kept = _keeping_weights(session)
        session.train(trial.episodes - onset, onset, phase=KEPT, team=kept)
    session.train(trial.episodes - session.trained, session.trained)
    return session.finish(_numbers_of(set(trial.settings.failure_spans)))


def check(spec: Spec) -> None:
    """Raise `SpecError` unless a wheel fails during training in every condition."""
    check_rule_bases(spec, "because a copy keeps its weights")
    for condition in spec.conditions():
        onset = condition.settings.onset
        if onset is None:
            raise SpecError(
                "scenario.failures = []: wheel-failure needs one, or agents that have left in "
                f"topology.failures (condition {condition.label!r})"
            )
        if spec.episodes < 2 * BLOCK:
            raise SpecError(
                f"episodes = {spec.episodes}: wheel-failure needs {2 * BLOCK} or more, {BLOCK} "
                f"before the failure and {BLOCK} with it"
            )
        onsets = [begin for begin, _ in condition.settings.failure_spans]
        for which, episode in (("first", onset), ("last", max(onsets))):
            if not BLOCK <= episode <= spec.episodes - BLOCK:
                raise SpecError(
                    f"scenario.failures: the {which} begins in episode {episode}, allowed {BLOCK} "
                    f"to {spec.episodes - BLOCK} of {spec.episodes} episodes "
                    f"(condition {condition.label!r})"
                )


def comparisons(spec: Spec) -> int:
    """Return the number of comparisons of success at the end, with the team that adapts least."""
    cases = [_fault_of(c.label, c.columns) for c in spec.conditions()]
    faults = {fault for fault, enabled in cases if enabled == "false"}
    adapting = [1 if enabled == "false" else 2 for fault, enabled in cases if fault in faults]
    return sum(adapting) or len(cases)


def _fault_of(condition: str, columns: SpecTable) -> tuple[str, str]:
    """Return the label of a condition without `SWEPT`, and the value of `SWEPT` if it is swept."""
    enabled = str(columns.get(SWEPT, ""))
    return (label_but(columns, [SWEPT]) or "the failure") if enabled else condition, enabled


def _keeping_weights(session: Session) -> Team:
    """Return a copy of the team with fixed weights that explores and updates its self-model."""
    settings = session.trial.settings
    shared = LearnerSettings.model_fields.keys() - {"kind"}
    common = {name: value for name, value in settings.learner if name in shared}
    frozen = settings.model_copy(update={"learner": FrozenSettings(**common)})
    team = arrange(frozen, session.trial.seed).team
    own = team.state_dict()
    arrays = session.team.state_dict()
    team.load_state_dict({name: arrays.get(name, own[name]) for name in own})
    return team


class Course(NamedTuple):
    """Course of success after a fault, for one case of adaptation."""

    fault: str
    """Label of the condition without `SWEPT`."""
    adapts: str
    """Adapting parts, see `ADAPTS`; the phase if self-models are not swept."""
    spans: tuple[FailureSpan, ...]
    """First episode of each failure and of the time after it, sorted."""
    measured: FailureCourse
    """Outcomes of the episodes."""
    longest: int | None
    """Maximum length of an episode [decisions]."""

    @property
    def end(self) -> int | None:
        """First episode without failures; None if failures last until training ends."""
        ends = [math.inf if end is None else end for _, end in self.spans]
        return int(max(ends)) if max(ends) < self.measured.success.shape[1] else None

    @property
    def summary(self) -> Summary:
        """Row of the table."""
        course = self.measured
        estimates = {
            "success before": rate(course.before),
            "success just after": rate(course.from_episode(course.onset)),
        }
        if self.end is not None:
            estimates["failure ends [episode]"] = exactly(self.end)
            if self.end <= course.success.shape[1] - BLOCK:
                estimates["success after its end"] = rate(course.from_episode(self.end))
        estimates[AT_END] = rate(course.end)
        if course.had_success.any():
            measured = {n: own[course.had_success] for n, own in course.measured.items()}
            for name, values in measured.items():
                measure = bounded(name, [course], self.longest)
                mean = mean_estimate(measure, pd.DataFrame(values))
                is_censored = name in TIMES and measured[RECOVERED.name] == 0.0
                estimates[measure.heading] = censored(mean, is_censored)
        return Summary(f"{self.fault}: {self.adapts}", len(course.success), estimates)


def analyse(results: Results) -> Analysis:
    """Estimate and compare with 95% intervals, with seeds as the unit of sampling.

    Success at the end is compared with the case without adaptation, or, if self-models are not
    swept, with weights kept; then recovery in training, too, with that of the first condition.
    """
    courses = courses_of(results)
    if not courses:
        return Analysis(())
    least = courses[0].adapts
    reference = least if least == KEPT else f"{least} adapting"
    differences, lines = judged({AT_END: _gains(courses, least)}, reference)
    notes = ["Rows: condition, then the parts that adapt to its failure."]
    if least == KEPT:
        notes = ["Rows: condition, then whether training continues or weights are kept."]
        pairs = {RECOVERED.heading: _recoveries(courses)}
        recovered, more = judged(pairs, courses[0].fault, RECOVERED)
        differences |= recovered
        lines += more
    if not all(course.measured.had_success.all() for course in courses):
        notes += _unmeasured(courses)
    if any(course.end is not None for course in courses):
        notes.append("Recovery after the end of a failure is not adaptation.")
    table = tuple(course.summary for course in courses)
    if has_lower_bounds(table):
        notes += wrapped(LOWER_BOUND)
    return Analysis(table, (*notes, *lines), courses, differences)


def _unmeasured(courses: Sequence[Course]) -> Iterator[str]:
    """Yield how many seeds had no success before the failure, a line for the rows with a number."""
    yield "Recovery and loss are not measured for seeds without success before the failure:"
    rows: dict[tuple[str, str], list[str]] = {}
    for course in courses:
        had = course.measured.had_success
        missing = f"{len(had) - had.sum()} of {len(had)} seeds"
        if not had.all():
            rows.setdefault((course.fault, missing), []).append(course.adapts)
    for (fault, missing), adapts in rows.items():
        yield from wrapped(f"{fault} ({', '.join(adapts)}): {missing}", "  ")


def courses_of(results: Results) -> list[Course]:
    """Return the courses of all conditions, sorted by fault."""
    courses = []
    for condition in results.of_phase(KEPT):
        fault, enabled = _fault_of(condition, results.columns.get(condition, {}))
        for phase in (KEPT, "training"):
            course = failure_course(results, condition, phase)
            adapts = ADAPTS.get((enabled, phase), phase)
            spans = _failure_spans(results.numbers(condition))
            courses.append(Course(fault, adapts, spans, course, results.step_limits[0]))
    order = {adapts: i for i, adapts in enumerate(ADAPTS.values())}
    faults = distinct(course.fault for course in courses)
    return sorted(courses, key=lambda c: (faults.index(c.fault), order.get(c.adapts, 0)))


def _numbers_of(spans: Iterable[FailureSpan]) -> dict[str, float]:
    """Return the begin and end of failures as numbers of a trial.

    >>> _numbers_of([(20, None), (5, 9)])
    {'onset': 5.0, 'failure_end': 9.0, 'onset.2': 20.0}
    """
    numbers = {}
    for k, (begin, end) in enumerate(sorted(spans, key=lambda span: span[0]), 1):
        suffix = "" if k == 1 else f".{k}"
        numbers[f"onset{suffix}"] = float(begin)
        if end is not None:
            numbers[f"failure_end{suffix}"] = float(end)
    return numbers


def _failure_spans(numbers: Mapping[str, Array]) -> tuple[FailureSpan, ...]:
    """Return begin and end [episodes] of every failure, the inverse of `_numbers_of`.

    Each array has a value for every seed. All seeds have the same failures.
    """
    spans = []
    for name, values in numbers.items():
        if name.startswith("onset"):
            end = numbers.get(name.replace("onset", "failure_end"))
            spans.append((int(values[0]), None if end is None else int(end[0])))
    return tuple(spans)


def _gains(courses: Sequence[Course], least: str) -> Iterator[Pair]:
    """Yield each case paired with that of the same fault in which `least` adapts."""
    ends = {
        (c.fault, c.adapts): pd.Series(c.measured.end.mean(axis=1), c.measured.seeds)
        for c in courses
    }
    for (fault, adapts), end in ends.items():
        if adapts != least and (fault, least) in ends:
            yield f"{fault}: {adapts}", AT_END, end, ends[fault, least]


def _recoveries(courses: Sequence[Course]) -> Iterator[Pair]:
    """Yield the recovery of each team that learns, paired with that of the first."""
    recovered = {
        c.fault: pd.Series(c.measured.measured[RECOVERED.name], c.measured.seeds).dropna()
        for c in courses
        if c.adapts == "training"
    }
    (_, first), *others = recovered.items()
    for fault, own in others:
        yield fault, RECOVERED.heading, own, first


def draw(analysis: Analysis) -> Figures:
    """Return the figure of success by episode with a panel for each fault.

    Lines are success rates over seeds and `SMOOTHED` episodes for each case of adaptation, with
    bands of 95% intervals. Black lines mark the onset of failures, hatched areas failures that end.
    """
    from matplotlib.patches import Patch  # matplotlib takes its time

    from ...presentation import figures as f

    courses = analysis.cases
    faults = distinct(course.fault for course in courses)
    cases = distinct(course.adapts for course in courses)
    figure, panels = f.grid(
        len(faults), COLUMNS, (2.6, 2.2), (1.0, 1.2), least=5.6, sharex=True, sharey=True
    )
    columns = panels.shape[1]
    for axes, fault in zip(panels.flat, faults, strict=False):
        own = [course for course in courses if course.fault == fault]
        for begin, end in own[0].spans:
            axes.axvline(begin - 0.5, **ONSET)
            if end is not None:
                axes.axvspan(begin - 0.5, end - 0.5, **TRANSIENT)
        for course in own:
            success = course.measured.success
            cuts = {episode for span in course.spans for episode in span if episode is not None}
            curve = _curve(success, sorted(cuts))
            episodes = range(len(curve.value))  # counted from 0, as in rows and specs
            f.draw_curve(axes, episodes, curve, cases.index(course.adapts), alpha=0.1)
        axes.set_title("\n".join(wrap(fault, round(60 / columns))), loc="left")
        f.as_rates(axes)
        f.as_episodes(axes)
        axes.grid(axis="y", alpha=0.25)
    for axes in panels[:, 0]:
        axes.set_ylabel("success")
    entries: list[Artist] = [f.handle(case, **f.look(i)) for i, case in enumerate(cases)]
    entries.append(f.handle("a failure begins", **ONSET))
    if any(course.end is not None for course in courses):
        entries.append(Patch(label="transient failure", **TRANSIENT))
    seeds = f.count_seeds(len(course.measured.success) for course in courses)
    title = f"what adapts; means over {seeds} seeds and {SMOOTHED} episodes, 95% bands"
    f.add_legend(figure, entries, title, max_columns=3)
    return {"wheel-failure": figure}


def _curve(success: Array, cuts: Sequence[int]) -> Estimate:
    """Return rates ``(n_episodes,)`` of the last `SMOOTHED` episodes that do not cross `cuts`."""
    starts = [max(cut for cut in (0, *cuts) if cut <= k) for k in range(success.shape[1])]
    windows = (success[:, max(start, k - SMOOTHED + 1) : k + 1] for k, start in enumerate(starts))
    return stack_estimates([rate(window) for window in windows])
