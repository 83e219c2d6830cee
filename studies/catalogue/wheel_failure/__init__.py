"""The wheel-failure study: what a failing wheel costs, and how a team comes back.

Agents that leave, ``kind = "left"`` of ``topology.failures``, are a failure of their own.

Training goes on through the failure. At its onset the team is also copied: the copy meets the same
worlds under the same exploration with its weights kept as they are. Conditions that are swept over
``learner.self_model.enabled`` give all four cases, by what adapts: nothing, the weights, the
self-model (by which predictions know the wheel has changed), or both.

Levels are success rates over `BLOCK` episodes: before the failure, just after it, and at the end
of training. A seed has recovered at the first episode from which on `BLOCK` episodes reach
`REGAINED` of the level before (its mean over seeds); seeds that never do count with the episodes
and steps that were run, so that those columns are lower bounds. The cumulative loss is the sum of
what the episodes after the onset fall short of the level before, in episodes.
"""

from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import NamedTuple

import numpy as np

from ....core.agents.team import Team
from ....core.learners.learner import LearnerSettings
from ....core.learners.td import FrozenSettings
from ....core.numerics import pd
from ...errors import SpecError
from ...results.analysis import Analysis, Figures, Pair, Summary, judged
from ...results.results import Results
from ...results.statistics import BLOCK, NOT_NEGATIVE, REGAINED, Array, bootstrap, rate, recovery
from ...spec.spec import Spec
from ...spec.tables import label_but
from ...trials.arrangement import arrange
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import check_rule_bases, distinct

NUMBERS = ("onset",)
"""What of whole trials the analysis rests on."""
PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
AT_END = "success at the end"
"""What is compared."""
KEPT = "weights kept"
"""The phase of the copied team."""
SWEPT = "learner.self_model.enabled"
"""What is swept to have every condition with a self-model and without."""
ADAPTS = {
    ("false", KEPT): "nothing",
    ("false", "training"): "weights",
    ("true", KEPT): "self-model",
    ("true", "training"): "both",
}
"""What adapts, by whether the self-model is enabled, and phase."""
COLUMNS = 3
"""Panels of the figure that stand beside each other."""
SMOOTHED = 3
"""Episodes that a point of a curve averages over."""


def measure(trial: Trial) -> TrialResult:
    """Train a team through a failure, and a copy that keeps its weights from there on."""
    onset = trial.settings.onset
    assert onset is not None, "see check"
    session = Session(trial)
    session.train(onset)
    kept = _keeping_weights(session)
    session.train(trial.episodes - onset, onset)
    session.train(trial.episodes - onset, onset, phase=KEPT, team=kept)
    begun = sorted(set(trial.settings.onsets) - {onset})
    later = {f"onset.{k}": float(episode) for k, episode in enumerate(begun, 2)}
    return session.finish({"onset": float(onset), **later})


def check(spec: Spec) -> None:
    """Raise `SpecError` unless a wheel fails in every condition, after and before some training."""
    check_rule_bases(spec, "of which a copy keeps its weights")
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
        if not BLOCK <= onset <= spec.episodes - BLOCK:
            raise SpecError(
                f"scenario.failures: the first begins in episode {onset}, allowed {BLOCK} to "
                f"{spec.episodes - BLOCK} of {spec.episodes} episodes "
                f"(condition {condition.label!r})"
            )


def _keeping_weights(session: Session) -> Team:
    """Return a copy of the session's team that explores and models itself but keeps its weights."""
    settings = session.trial.settings
    shared = LearnerSettings.model_fields.keys() - {"kind"}
    common = {name: value for name, value in settings.learner if name in shared}
    frozen = settings.model_copy(update={"learner": FrozenSettings(**common)})
    team = arrange(frozen, session.trial.seed).team
    own = team.arrays()
    arrays = session.team.arrays()
    team.restore({name: arrays.get(name, own[name]) for name in own})
    return team


class Course(NamedTuple):
    """One case: the course of a fault, given what adapts."""

    fault: str
    """Label of the condition but for `SWEPT`."""
    adapts: str
    """What does, see `ADAPTS`; `training` or `weights kept` if self-models were not swept."""
    onset: int
    """Episode in which the first wheel fails."""
    onsets: tuple[int, ...]
    """Episodes in which any does."""
    success: Array
    """``(n_seeds, n_episodes)`` from the start of training."""
    steps: Array
    seeds: tuple[int, ...]
    """The seeds, in that order."""

    @property
    def before(self) -> Array:
        """Outcomes ``(n_seeds, BLOCK)`` of the last episodes before the failure."""
        return self.success[:, self.onset - BLOCK : self.onset]

    @property
    def end(self) -> Array:
        """Outcomes of the last episodes."""
        return self.success[:, -BLOCK:]

    @property
    def short(self) -> Array:
        """What the episodes from the failure on fall short of the level before."""
        return np.asarray(self.before.mean() - self.success[:, self.onset :])

    @property
    def possible_loss(self) -> tuple[float, float]:
        """The least and the greatest cumulative loss that there can be."""
        before = float(self.before.mean())
        episodes = self.short.shape[1]
        return (before - 1.0) * episodes, before * episodes

    def recovery(self) -> tuple[Array, Array, Array]:
        """Return per seed whether it recovered, after how many episodes and steps."""
        recovered, episodes = recovery(self.short, (1.0 - REGAINED) * self.before.mean())
        steps = [
            run[self.onset : self.onset + int(count)].sum()
            for run, count in zip(self.steps, episodes, strict=True)
        ]
        return recovered, episodes, np.array(steps, dtype=float)


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling.

    Differences are success at the end of every case over that of the same fault when nothing
    adapts.
    """
    courses = courses_of(results)
    gains, lines = judged({AT_END: _gains(courses)}, "nothing adapting")
    notes = ["Named after the colon is what adapts to the failure."] if courses else []
    if not all(course.before.any() for course in courses):
        notes += ["No recovery is measured where no episode before the failure succeeded."]
    return Analysis(tuple(map(_summary, courses)), (*notes, *lines), courses, gains)


def courses_of(results: Results) -> list[Course]:
    """Return the cases of all conditions, fault by fault."""
    courses = []
    for condition in results.of_phase(KEPT):
        numbers = results.numbers(condition)
        onset = int(numbers["onset"][0])
        onsets = tuple(int(v[0]) for name, v in numbers.items() if name.startswith("onset"))
        columns = results.columns.get(condition, {})
        enabled = str(columns.get(SWEPT, ""))
        fault = (label_but(columns, [SWEPT]) or "the failure") if enabled else condition
        for phase in (KEPT, "training"):
            values = {}
            for measured in ("success", "steps"):
                values[measured] = results.values(condition, measured).astype(float)
                if phase == KEPT:
                    values[measured][:, onset:] = results.values(condition, measured, KEPT)
            adapts = ADAPTS.get((enabled, phase), phase)
            seeds = results.seeds(condition)
            courses.append(Course(fault, adapts, onset, onsets, seeds=seeds, **values))
    order = {adapts: i for i, adapts in enumerate(ADAPTS.values())}
    faults = distinct(course.fault for course in courses)
    return sorted(courses, key=lambda c: (faults.index(c.fault), order.get(c.adapts, 0)))


def _summary(course: Course) -> Summary:
    recovered, episodes, steps = course.recovery()
    estimates = {
        "before": rate(course.before),
        "just after": rate(course.success[:, course.onset : course.onset + BLOCK]),
        "end": rate(course.end),
    }
    if course.before.any():  # else there is nothing to lose or to come back to
        estimates |= {
            "recovered": rate(recovered[:, None]),
            "episodes": bootstrap(episodes, bounds=(0.0, course.short.shape[1])),
            "steps": bootstrap(steps, bounds=NOT_NEGATIVE),
            "cumulative loss": bootstrap(course.short.sum(axis=1), bounds=course.possible_loss),
        }
    return Summary(f"{course.fault}: {course.adapts}", len(course.success), estimates)


def _gains(courses: Sequence[Course]) -> Iterator[Pair]:
    """Yield every case with that of the same fault in which nothing adapts."""
    ends = {(c.fault, c.adapts): pd.Series(c.end.mean(axis=1), c.seeds) for c in courses}
    for (fault, adapts), end in ends.items():
        if adapts != "nothing" and (fault, "nothing") in ends:
            yield f"{fault}, {adapts}", AT_END, end, ends[fault, "nothing"]


def draw(analysis: Analysis) -> Figures:
    """Return the figure: success from episode to episode, fault by fault.

    A panel for every fault, a line for what adapts; running means over seeds and episodes, bands
    their 95% intervals. Wheels fail at grey lines.
    """
    from ...presentation import figures as f  # matplotlib takes its time

    courses = analysis.cases
    faults = distinct(course.fault for course in courses)
    cases = distinct(course.adapts for course in courses)
    figure, panels = f.grid(
        len(faults), COLUMNS, (2.6, 2.1), (1.0, 1.2), least=5.6, sharex=True, sharey=True
    )
    columns = panels.shape[1]
    for axes, fault in zip(panels.flat, faults, strict=False):
        for course in (c for c in courses if c.fault == fault):
            for onset in course.onsets:
                axes.axvline(onset - 0.5, color="#888888", linewidth=0.8)
            curve = bootstrap(_smoothed(course.success, course.onset), bounds=(0, 1))
            episodes = range(len(curve.value))  # counted from 0, as in rows and specs
            f.draw_curve(axes, episodes, curve, cases.index(course.adapts), alpha=0.1)
        axes.set_title("\n".join(wrap(fault, round(60 / columns))), loc="left")
        f.as_rates(axes)
        axes.grid(axis="y", alpha=0.25)
    for axes in panels[:, 0]:
        axes.set_ylabel("success")
    for axes in list(panels.flat)[max(0, len(faults) - columns) : len(faults)]:
        f.as_episodes(axes)
    handles = [f.handle(case, **f.look(i)) for i, case in enumerate(cases)]
    seeds = f.count_seeds(len(course.success) for course in courses)
    title = f"what adapts\nmeans over {seeds} seeds and {SMOOTHED} episodes, 95% bands"
    f.add_legend(figure, handles, title, ncols=len(cases))
    return {"wheel-failure": figure}


def _smoothed(success: np.ndarray, onset: int) -> np.ndarray:
    """Return means over the episode and those before it, but not across the onset."""
    means = [
        success[:, max(0 if e < onset else onset, e - SMOOTHED + 1) : e + 1].mean(axis=1)
        for e in range(success.shape[1])
    ]
    return np.stack(means, axis=1)
