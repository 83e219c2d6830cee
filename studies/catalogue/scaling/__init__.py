"""Scaling study: success, time, memory and messages as functions of the number of robots.

Conditions usually differ in the number of robots and in the evaluator. In addition to episodes, a
trial keeps reproducible numbers, and its usage of time and memory.

Messages of a step are counted as Section V has agents talk: every agent passes the action it has
decided to each agent below it, so there is one message for every edge of the hierarchy's transitive
closure; n (n - 1) / 2 in a chain of n agents.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....core.agents.loop import StepRecord
from ....core.numerics import FloatArray, pd
from ...results.analysis import EVALUATED, Analysis, Figures, Summary, estimate_of, evaluated
from ...results.differences import select_shared
from ...results.notation import format_estimate
from ...results.results import Results
from ...results.sizes import Sizes
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap, exactly
from ...spec.tables import label_but
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import distinct

NUMBERS = ("robots", "agents", "messages", "team_bytes", "decision_median")
"""Numbers of whole trials that the analysis needs."""
PUBLISHED = ("success",)
"""Measures in published results."""
TIMES = {"deciding": "decision [ms]", "learning": "learning [ms]"}
"""Titles of times for which the growth with the number of agents is estimated."""
PANELS = (
    ("decision [ms]", "deciding, per step [ms]", "log"),
    ("learning [ms]", "learning, per step [ms]", "log"),
    ("team [MB]", "arrays of the team [MB]", "log"),
    ("process [MB]", "process, peak [MB]", "linear"),
    ("messages", "messages passed down, per step", "symlog"),
)
"""Panels of the figure after that of evaluation: measure, title and scale of the axis."""
MEMORY = Path("/proc/self/status")
CLEAR = Path("/proc/self/clear_refs")


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and measure its time and memory."""
    session = Session.compiled(trial)
    if CLEAR.exists():  # reset the peak memory of the process in Linux
        CLEAR.write_text("5")
    session.train(trial.episodes)
    peak = _peak()
    team = session.team
    hierarchy = team.hierarchy
    tried = team.counts.joint_actions
    numbers = {
        "robots": float(len(session.world.groups)),
        "agents": float(len(hierarchy)),
        "messages": float(hierarchy.n_messages),
        "joint_actions": tried / len(session.decision_seconds),
        "team_bytes": float(sum(array.nbytes for array in team.state_dict().values())),
        "weight_bytes": float(team.weight_bytes),
    }
    period = trial.settings.scenario.period
    if period is not None:
        numbers["period_s"] = period
    touching: list[FloatArray] = []
    least: list[float] = []

    def note(record: StepRecord) -> None:
        """Record the minimum share of contact time of a robot in each episode."""
        if "contact_time" in record.transition.info:
            touching.append(record.transition.info["contact_time"])
            if record.last:
                pushing = max(float(np.max(touching, axis=1).sum()), 1e-12)
                least.append(float((np.sum(touching, axis=0) / pushing).min()))
                touching.clear()

    session.evaluate(note)
    session.run_other_evaluations()
    if least:
        numbers["least_touching"] = float(np.mean(least))
        numbers["all_touching"] = float((np.array(least) >= 0.5).mean())
    usage = {
        "decision_median": float(np.median(session.decision_seconds)),
        "decision_99": float(np.quantile(session.decision_seconds, 0.99)),
    }
    if peak is not None:
        usage["process_bytes"] = float(peak)
    return session.result(numbers, usage)


def _peak() -> int | None:
    """Return the peak resident memory of the process [bytes]; None except in Linux."""
    match = re.search(r"VmHWM:\s+(\d+) kB", MEMORY.read_text()) if MEMORY.exists() else None
    return None if match is None else 1024 * int(match[1])


class Point(NamedTuple):
    """Results of one condition."""

    evaluator: str
    """Label without the number of robots, usually the evaluator."""
    bodies: str
    """Name of the swept size, such as ``robots``."""
    robots: int
    """Number of robots."""
    agents: int
    """Number of agents."""
    period: float | None
    """Decision period of the scenario [s], if it has one."""
    values: dict[str, Estimate]
    """Estimates by title."""
    times: dict[str, pd.Series]
    """Times of single seeds by title."""


def analyse(results: Results) -> Analysis:
    """Estimate with 95% intervals, with seeds as the unit of sampling; times are per step."""
    conditions = results.of_phase("training")
    sizes = Sizes.of(results, conditions)
    points = [_point(results, c, sizes) for c in conditions]
    table: list[Summary] = []
    for condition, point in zip(conditions, points, strict=True):
        is_size = condition == str(point.robots)
        label = sizes.shown(point.robots) if is_size else condition
        table.append(Summary(label, len(results.seeds(condition)), point.values))
    notes = [
        f"\n{evaluator}, time with n agents:\n  "
        + "\n  ".join(f"{what} n^{format_estimate(e)}" for what, e in by_what.items())
        for evaluator, by_what in exponents_of(points).items()
    ]
    return Analysis(tuple(table), tuple(notes), points)


def _point(results: Results, condition: str, sizes: Sizes) -> Point:
    numbers = results.numbers(condition)
    steps = results.values(condition, "steps").sum(axis=1)
    costs = {
        "decision [ms]": 1e3 * numbers["decision_median"],
        "learning [ms]": 1e3 * numbers["seconds.learning"] / steps,
        "team [MB]": 1e-6 * numbers["team_bytes"],
    }
    if "process_bytes" in numbers:
        costs["process [MB]"] = 1e-6 * numbers["process_bytes"]
    main = results.main
    last = estimate_of(results, condition, "training", main, slice(-5, None))
    values = {f"{main.heading} last 5": last}
    values |= evaluated(results, condition)
    if "all_touching" in numbers:
        values["all touch"] = bootstrap(numbers["all_touching"], bounds=(0, 1))
    values |= {title: bootstrap(cost, bounds=NOT_NEGATIVE) for title, cost in costs.items()}
    values["messages"] = exactly(numbers["messages"][0])
    evaluator = label_but(results.columns.get(condition, {}), sizes.keys) or "default"
    return Point(
        evaluator,
        sizes.word,
        sizes.counts[condition],
        int(numbers["agents"][0]),
        float(numbers["period_s"][0]) if "period_s" in numbers else None,
        values,
        {title: pd.Series(costs[title], results.seeds(condition)) for title in TIMES.values()},
    )


def exponents_of(points: Sequence[Point]) -> dict[str, dict[str, Estimate]]:
    """Return the exponents of `TIMES` in the number of agents, by evaluator.

    A line through the logarithms is fitted for each seed that ran at all sizes.
    """
    exponents: dict[str, dict[str, Estimate]] = {}
    for evaluator in distinct(p.evaluator for p in points):
        own = [p for p in points if p.evaluator == evaluator]
        sizes = np.log([p.agents for p in own])
        for what, title in TIMES.items():
            times = np.stack(select_shared([p.times[title] for p in own]))
            if len({*sizes}) > 1 and times.size:
                estimate = bootstrap(np.polyfit(sizes, np.log(times), 1)[0])
                exponents.setdefault(evaluator, {})[what] = estimate
    return exponents


def draw(analysis: Analysis) -> Figures:
    """Return the figure: means over seeds with 95% intervals against the number of robots.

    Evaluators differ by color and marker and are slightly offset.
    """
    from ...presentation import figures  # matplotlib takes its time

    points = analysis.cases
    evaluators = distinct(p.evaluator for p in points)
    figure, panels = figures.panels(2, 3, (8.4, 5.2), sharex=True)
    main = next((t for t in points[0].values if t.startswith("evaluation ")), EVALUATED)
    first = (main, main, "linear")
    for axes, (name, title, scale) in zip(panels.flat, (first, *PANELS), strict=True):
        for index, evaluator in enumerate(evaluators):
            own = [p for p in points if p.evaluator == evaluator and name in p.values]
            if own:
                robots = [p.robots for p in own]
                values = [p.values[name] for p in own]
                figures.draw_line(axes, robots, values, index, len(evaluators))
        axes.set_title(title, loc="left")
        if scale == "log":
            figures.log_axis(axes)
        else:
            axes.set_yscale(scale, **({"linthresh": 1.0} if scale == "symlog" else {}))
            axes.yaxis.set_major_formatter("{x:,.10g}")
            if axes.get_ylim()[1] > 0.0:
                axes.set_ylim(0.0, 1.1 * axes.get_ylim()[1])
    if main == EVALUATED:
        figures.as_rates(panels[0, 0])
    for period in {p.period for p in points if p.period is not None}:
        panels[0, 1].axhline(1e3 * period, color="#888888", linewidth=0.8, ls=":")
    for axes in panels.flat:
        figures.scale_axis(axes, sorted({p.robots for p in points}))
    for axes in panels[-1]:
        axes.set_xlabel(points[0].bodies)
    title = "means over seeds, bars: 95% intervals; dotted: the decision period"
    figures.name_lines(figure, evaluators, title)
    return {"scaling": figure}
