"""The related study: what each way to coordinate agents achieves, and what it asks for.

The nested agents stand beside the systems that the paper measures itself against (Section X). A
system is an override; worlds are what is swept. Of every trained team it is measured how often
it succeeds when evaluated, and after how many decisions; and of a decision of all its agents

- its time;
- the memory of all that is learned;
- messages: the actions that agents tell one another. A superior tells each agent below it what it
  has decided. Neighbors tell each other what they have done, or in a coordination graph what would
  be best; max-plus does so in every round, of which one is counted;
- operations: joint actions tried times the rules that value each, by the formula of the topology
  (sum over agents of ``|A| ** (1 + |below|)``, times |S|) and as counted in the running system.
"""

from collections.abc import Mapping

import numpy as np

from nested_agents import Analysis, FuzzyAgents, Session, Spec, Study, Summary, bootstrap
from nested_agents.analysis import (
    EVALUATED,
    NOT_NEGATIVE,
    Case,
    Figures,
    Results,
    distinct,
    evaluated,
    system_of,
)
from nested_agents.study import Trial, TrialResult, check_evaluated, check_rule_bases

COUNTS = ("messages", "formula", "counted")
"""Numbers of whole trials that the table shows as they are."""
NUMBERS = ("agents", "memory", *COUNTS)
"""What of whole trials the analysis rests on."""
NOTES = (
    "decisions, time: of an evaluation episode, failures included; ms: of a decision of all",
    "agents in training; formula, counted: joint actions tried times rules, per decision.",
)
PANELS = {
    EVALUATED: "success",
    "ms": "decision time [ms]",
    "memory [kB]": "memory [kB]",
    "counted": "operations of a decision",
}
"""Titles of panels by title of estimate."""
LEAST = {"ms": 0.01, "memory [kB]": 0.01, "counted": 1.0}
"""Where logarithmic axes begin; below, they are linear and hold 0."""
MOST_TICKS = 5


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams of agents with rule bases are evaluated."""
    check_evaluated(spec)
    check_rule_bases(spec, "whose weights and messages it counts")


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and count what it takes; imported by name in workers."""
    session = Session(trial)
    session.train(trial.episodes)
    team = session.team.only(FuzzyAgents)
    hierarchy = session.team.hierarchy
    n_rules = team.learner.theta.shape[1]
    tried = 0 if team.evaluator is None else hierarchy.count_joint_actions(len(team.action_set))
    counted = team.counts.rule_evaluations
    numbers = {
        "agents": float(len(hierarchy)),
        "memory": 1e-3 * team.learner.theta.nbytes,
        "messages": float(hierarchy.n_messages),
        "formula": float(tried * n_rules),
        "counted": counted / len(session.decision_seconds),
    }
    period = trial.settings.scenario.period
    if period is not None:
        numbers["period"] = float(period)
    return session.finish(numbers, {"decision_median": float(np.median(session.decision_seconds))})


def analyse(results: Results) -> Analysis:
    """Estimate; 95% intervals, seeds as the unit of sampling."""
    table = []
    cases = []
    for condition in results.of_phase("evaluation"):
        numbers = results.numbers(condition)
        steps = results.values(condition, "steps", "evaluation").mean(axis=1)
        costs = {"decisions": steps}
        if "period" in numbers:
            costs["time [s]"] = steps * numbers["period"]
        costs["ms"] = 1e3 * numbers["decision_median"]
        costs |= {"memory [kB]": numbers["memory"]} | {name: numbers[name] for name in COUNTS}
        values = evaluated(results, condition)
        values |= {title: bootstrap(cost, bounds=NOT_NEGATIVE) for title, cost in costs.items()}
        system, swept = system_of(results, condition)
        cases.append(Case(system, name_world(swept), values))
        table.append(Summary(condition, len(steps), values))
    return Analysis(tuple(table), NOTES, cases)


def name_world(swept: Mapping[str, object]) -> str:
    """Return what a condition differs in beside its system.

    >>> name_world({"scenario.robots": 8, "scenario.box": "L"})
    '8 robots, L'
    """
    words = []
    for key, value in swept.items():
        unit = key.rpartition(".")[2]
        words.append(f"{value} {unit}" if isinstance(value, int) else str(value))
    return ", ".join(words)


def draw(analysis: Analysis) -> Figures:
    """Return the figure: the systems one below the other, a color for each world.

    Bars are 95% intervals.
    """
    from matplotlib.ticker import SymmetricalLogLocator  # matplotlib takes its time

    from nested_agents import figures as f

    cases = analysis.cases
    systems = distinct(case.system for case in cases)
    worlds = distinct(case.setting for case in cases)
    places = f.beside(len(worlds))
    size = (2.2 + 2.0 * len(PANELS), 1.1 + 0.26 * len(systems))
    figure, (panels,) = f.panels(1, len(PANELS), size, sharey=True)
    for axes, (name, title) in zip(panels, PANELS.items(), strict=True):
        for case in cases:
            which = worlds.index(case.setting)
            color = f.look(which)["color"]
            row = systems.index(case.system) + places[which]
            f.draw_row(axes, row, case.values[name], color=color, markersize=3)
        axes.set_title(title, loc="left")
        axes.grid(axis="x", alpha=0.25)
        if name in LEAST:
            axes.set_xscale("symlog", linthresh=LEAST[name])
            axes.set_xlim(left=0.0)
            locator = SymmetricalLogLocator(base=10.0, linthresh=LEAST[name])
            locator.set_params(numticks=MOST_TICKS)
            axes.xaxis.set_major_locator(locator)
    f.as_rates(panels[0], "x")
    f.name_rows(panels[0], systems)
    handles = [
        f.handle(world or "all", color=f.look(i)["color"], marker="o")
        for i, world in enumerate(worlds)
    ]
    f.add_legend(figure, handles, max_columns=5)
    return {"related": figure}


class RelatedStudy(Study):
    """Compares ways to coordinate agents, and their costs."""

    NUMBERS = NUMBERS
    check = staticmethod(check)
    measure = staticmethod(measure)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
