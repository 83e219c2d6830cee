"""The scaling study: how the number of robots bears on success, time, memory and messages.

Conditions differ in the number of robots and in how joint actions are evaluated; those of a spec of
one's own may differ in anything, also in the kind of agents. Of every trial it keeps, besides the
episodes: numbers that are a function of it, and what it took, which is not.

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
"""What of whole trials the analysis rests on."""
PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
TIMES = {"deciding": "decision [ms]", "learning": "learning [ms]"}
"""Times whose growth with the number of agents is estimated, by what they are of."""
PANELS = (
    ("decision [ms]", "deciding, per step [ms]", "log"),
    ("learning [ms]", "learning, per step [ms]", "log"),
    ("team [MB]", "arrays of the team [MB]", "log"),
    ("process [MB]", "process, peak [MB]", "linear"),
    ("messages", "messages passed down, per step", "symlog"),
)
"""What the figure shows beside evaluation, its titles, and the scale of the axis; agents may pass
no messages."""
MEMORY = Path("/proc/self/status")
CLEAR = Path("/proc/self/clear_refs")


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and note what it takes; imported by name in workers."""
    session = Session.compiled(trial)
    if CLEAR.exists():  # the peak of the process's memory is counted from now on, in Linux
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
        "joint_actions": tried / len(session.deciding),
        "team_bytes": float(sum(array.nbytes for array in team.arrays().values())),
        "weight_bytes": float(team.weight_bytes),
    }
    period = trial.settings.scenario.period
    if period is not None:
        numbers["period_s"] = period
    touching: list[FloatArray] = []
    least: list[float] = []

    def note(record: StepRecord) -> None:
        """Note of an episode the least time that a robot is in contact, of that which any is."""
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
        "decision_median": float(np.median(session.deciding)),
        "decision_99": float(np.quantile(session.deciding, 0.99)),
    }
    if peak is not None:
        usage["process_bytes"] = float(peak)
    return session.result(numbers, usage)


def _peak() -> int | None:
    """Return the peak of this process's resident memory [bytes], where Linux tells it."""
    match = re.search(r"VmHWM:\s+(\d+) kB", MEMORY.read_text()) if MEMORY.exists() else None
    return None if match is None else 1024 * int(match[1])


class Point(NamedTuple):
    """One condition."""

    evaluator: str
    """Its label without the number of robots: the evaluator, and whatever else differs."""
    bodies: str
    """What is counted: ``robots``, or what a spec sweeps in place of them."""
    robots: int
    """Number of robots."""
    agents: int
    """Number of agents."""
    period: float | None
    """What a decision may take to keep up with the robots [s]; none: the scenario has no hurry."""
    values: dict[str, Estimate]
    """Estimates by title, see `analyse`."""
    times: dict[str, pd.Series]
    """By title, times of single seeds."""


def analyse(results: Results) -> Analysis:
    """Estimate; 95% intervals, seeds as the unit of sampling. Times are per step."""
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
    """Return by evaluator the exponent of each of `TIMES` in the number of agents.

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
    """Return the figure.

    Points are means over seeds, bars their 95% intervals; evaluators differ by colour and marker,
    and stand a little beside each other.
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
