"""The scaling study: how the number of robots bears on success, time, memory and messages.

Conditions differ in the number of robots and in how joint actions are evaluated; those of a spec of
one's own may differ in anything. Of every trial it keeps, besides the episodes: numbers that are a
function of it, and what it took, which is not.

Messages of a step are counted as Section V has agents talk: every agent passes the action it has
decided to each agent below it, so there is one message for every edge of the hierarchy's transitive
closure; n (n - 1) / 2 in a chain of n agents.
"""

from __future__ import annotations

import re
import tracemalloc
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ....core.agents.team import of_fuzzy_agents
from ....core.interface.scenario import groups_of
from ...presentation.words import count
from ...results.results import Results
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate
from ...results.summary import Summary, evaluated
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..contact import ContactShares
from ..study import check_rule_bases

TIMES = {"deciding": "decide [ms]", "learning": "learn [ms]"}
"""Times whose growth with the number of agents is estimated, by what they are of."""
COLUMNS = (
    "success", "all touch", "decide [ms]", "learn [ms]", "team [MB]", "process [MB]",
)  # fmt: skip
"""What the table shows, and after the first of them the evaluations."""
MEMORY = Path("/proc/self/status")
CLEAR = Path("/proc/self/clear_refs")


def check(spec: Spec) -> None:
    """Raise `SpecError` unless all agents have rule bases."""
    check_rule_bases(spec, "whose weights and messages it counts")


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and note what it takes; imported by name in workers."""
    session = Session.compiled(trial)
    _forget_peak()
    session.train(trial.episodes)
    peak = _peak()
    team = of_fuzzy_agents(session.team)
    hierarchy = team.hierarchy
    tried = team.evaluator.counts.joint_actions if team.evaluator is not None else 0
    numbers = {
        "robots": float(len(groups_of(session.world))),
        "agents": float(len(hierarchy)),
        "messages": float(messages(hierarchy.below(i) for i in range(len(hierarchy)))),
        "joint_actions": tried / len(session.deciding),
        "team_bytes": float(sum(array.nbytes for array in team.arrays().values())),
        "weight_bytes": float(team.learner.theta.nbytes),
    }
    period = getattr(trial.settings.scenario, "period", None)
    if period is not None:
        numbers["period_s"] = period
    contact = ContactShares()
    session.evaluate(contact)
    session.evaluate_elsewhere()
    shares = contact.shares
    if len(shares):
        numbers["least_touching"] = float(shares.min(axis=1).mean())
        numbers["all_touching"] = float((shares.min(axis=1) >= 0.5).mean())
    usage = {
        "decision_median": float(np.median(session.deciding)),
        "decision_99": float(np.quantile(session.deciding, 0.99)),
        "step_bytes": float(_of_a_step(session)),
    }
    if peak is not None:
        usage["process_bytes"] = float(peak)
    return session.result(numbers, usage)


def messages(below: Iterable[tuple[int, ...]]) -> int:
    """Return how many decided actions are passed down in a step, given whom each agent sees.

    Examples
    --------
    A chain of four agents, and a leader with three subordinates:

    >>> messages([(1, 2, 3), (2, 3), (3,), ()]), messages([(1, 2, 3), (), (), ()])
    (6, 3)
    """
    return sum(map(len, below))


def _of_a_step(session: Session) -> int:
    """Return the most memory that one decision holds beside what is held already [bytes]."""
    prediction = session.team.predict(session.scenario)
    tracemalloc.start()
    try:
        session.team.act(prediction, explore=False)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _forget_peak() -> None:
    """Let the peak of this process's memory be counted from now on, where Linux allows."""
    if CLEAR.exists():
        CLEAR.write_text("5")


def _peak() -> int | None:
    """Return the peak of this process's resident memory [bytes], where Linux tells it."""
    found = re.search(r"VmHWM:\s+(\d+) kB", MEMORY.read_text()) if MEMORY.exists() else None
    return None if found is None else 1024 * int(found[1])


@dataclass(frozen=True)
class Point:
    """One condition.

    Attributes
    ----------
    evaluator
        Its label without the number of robots: the evaluator, and whatever else differs.
    robots, agents, messages
        Sizes.
    period
        What a decision may take to keep up with the robots [s]; none: the scenario has no hurry.
    values
        Estimates by name, see `analyse`.
    """

    evaluator: str
    robots: int
    agents: int
    messages: int
    period: float | None
    values: dict[str, Estimate]


@dataclass(frozen=True)
class Scaling:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    points
        The same for figures.
    exponents
        By evaluator, how decision and learning time grow with the number of agents: the slope of
        their logarithms over all sizes.
    notes
        Those, for printing.
    bodies
        What is counted: ``robots``, or what a spec sweeps in place of them.
    """

    table: tuple[Summary, ...]
    points: tuple[Point, ...]
    exponents: dict[str, dict[str, Estimate]]
    notes: tuple[str, ...]
    bodies: str

    @property
    def groups(self) -> dict[str, list[Summary]]:
        """The lines of the table by number of robots: a team is compared with those of its size."""
        found: dict[str, list[Summary]] = {}
        for point, line in zip(self.points, self.table, strict=True):
            named = f"{point.robots} robot{'s' * (point.robots != 1)}"
            found.setdefault(named, []).append(line)
        return found


def analyse(results: Results) -> Scaling:
    """Estimate; 95 % intervals, seeds as the unit of sampling. Times are per step."""
    points, table, times = [], [], []
    sizes = {c: int(results.numbers[c]["robots"][0]) for c in results.training}
    bodies = _counted(results.columns, sizes)
    for condition, training in results.training.items():
        numbers, usage = results.numbers[condition], results.usage[condition]
        steps = training["steps"].sum(axis=1)
        costs = {
            "decide [ms]": 1e3 * usage["decision_median"],
            "learn [ms]": 1e3 * usage["learning"] / steps,
            "world [ms]": 1e3 * (usage["physics"] + usage["sensors"]) / steps,
            "team [MB]": 1e-6 * numbers["team_bytes"],
            "step [MB]": 1e-6 * usage["step_bytes"],
        }
        seeds = results.seeds.get(condition, range(len(steps)))
        times.append([dict(zip(seeds, costs[title], strict=True)) for title in TIMES.values()])
        if "process_bytes" in usage:
            costs["process [MB]"] = 1e-6 * usage["process_bytes"]
        evaluations = evaluated(results, condition)
        values = {"success": rate(training["success"][:, -5:])} | evaluations
        values |= {title: bootstrap(cost, bounds=NOT_NEGATIVE) for title, cost in costs.items()}
        if "all_touching" in numbers:
            values["all touch"] = bootstrap(numbers["all_touching"], bounds=(0, 1))
        agents, passed = (int(numbers[n][0]) for n in ("agents", "messages"))
        evaluator = _without_size(condition, sizes, bodies)
        period = float(numbers["period_s"][0]) if "period_s" in numbers else None
        points.append(Point(evaluator, sizes[condition], agents, passed, period, values))
        shown = {n: values[n] for n in (*COLUMNS[:1], *evaluations, *COLUMNS[1:]) if n in values}
        named = _with_size(condition, sizes[condition], bodies)
        table.append(Summary(named, len(steps), shown))
    exponents = _exponents(points, times)
    notes = [
        f"\n{evaluator}, time with n agents: "
        + ", ".join(f"{what} n^{_told(power)}" for what, power in by_what.items())
        for evaluator, by_what in exponents.items()
    ]
    notes += _passed(points, bodies)
    return Scaling(tuple(table), tuple(points), exponents, tuple(notes), bodies)


def _counted(columns: Mapping[str, Mapping[str, Any]], sizes: Mapping[str, int]) -> str:
    """Return what a spec sweeps for the number of bodies; robots if it is not known.

    >>> _counted({"2": {"scenario.joints": 2}, "8": {"scenario.joints": 8}}, {"2": 2, "8": 8})
    'joints'
    """
    keys = dict.fromkeys(key for own in columns.values() for key in own)
    swept = (
        key.removeprefix("scenario.")
        for key in keys
        if key.startswith("scenario.")
        and all(columns.get(c, {}).get(key) == size for c, size in sizes.items())
    )
    return next(swept, "robots")


def _with_size(condition: str, size: int, bodies: str) -> str:
    """Return a condition's label, with what it counts if it is a number alone.

    >>> _with_size("8", 8, "robots"), _with_size("frozen, robots=1", 1, "robots")
    ('8 robots', 'frozen, robots=1')
    """
    return count(size, bodies.removesuffix("s")) if condition == str(size) else condition


def _without_size(condition: str, sizes: Mapping[str, int], bodies: str) -> str:
    """Return a condition's label without its number of bodies, which may be all it says."""
    if all(label == str(size) for label, size in sizes.items()):
        return "default"
    parts = condition.split(", ")
    return ", ".join(part for part in parts if part != f"{bodies}={sizes[condition]}")


def _passed(points: list[Point], bodies: str) -> list[str]:
    """Return lines that say how many messages are passed, one per number where all agree."""
    lines = []
    for robots in dict.fromkeys(p.robots for p in points):
        labels: dict[tuple[int, int], list[str]] = {}
        for p in points:
            if p.robots == robots:
                labels.setdefault((p.agents, p.messages), []).append(p.evaluator)
        for (agents, passed), own in labels.items():
            whose = f" ({'; '.join(own)})" if len(labels) > 1 else ""
            lines.append(
                f"{robots} {bodies}{whose}: {agents} agents, {count(passed, 'message')} a step"
            )
    return lines


def _told(estimate: Estimate) -> str:
    """Return an exponent with its interval, if there is one."""
    e = estimate
    return f"{e.value:.2f}" + (f" [{e.low:.2f}, {e.high:.2f}]" if np.isfinite(e.low) else "")


def _exponents(
    points: list[Point], times: list[list[dict[int, float]]]
) -> dict[str, dict[str, Estimate]]:
    """Return by evaluator the exponent of each of `TIMES` in the number of agents.

    A line through the logarithms is fitted for each seed that ran at all sizes; `times` has one
    entry for each point: by seed, for each of `TIMES`.
    """
    found: dict[str, dict[str, Estimate]] = {}
    for evaluator in dict.fromkeys(p.evaluator for p in points):
        own = [k for k, p in enumerate(points) if p.evaluator == evaluator]
        seeds = set.intersection(*(set(by_seed) for k in own for by_seed in times[k]))
        if len({points[k].agents for k in own}) < 2 or not seeds:
            continue
        sizes = np.log([points[k].agents for k in own])
        found[evaluator] = {}
        for i, what in enumerate(TIMES):
            logs = np.log([[times[k][i][seed] for seed in sorted(seeds)] for k in own])
            found[evaluator][what] = bootstrap(np.polyfit(sizes, logs, 1)[0])
    return found
