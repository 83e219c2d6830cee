"""The related study: what each way to coordinate agents achieves, and what it asks for.

A system is an override; worlds are what is swept. Of every trained team it is measured how often
it succeeds when evaluated, and after how many decisions; and of a decision of all its agents

- its time;
- the memory of all that is learned;
- messages: the actions that agents tell one another. A superior tells each agent below it what it
  has decided. Neighbours tell each other what they have done, or in a coordination graph what would
  be best; max-plus does so in every round, of which one is counted;
- operations: joint actions tried times the rules that value each, by the formula of the topology
  (sum over agents of ``|A| ** (1 + |below|)``, times |S|) and as counted in the running system.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ....core.agents.team import of_fuzzy_agents
from ...results.results import Results
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap
from ...results.summary import EVALUATED, Summary, evaluated
from ...spec.errors import SpecError
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..scaling.analysis import messages
from ..study import check_rule_bases

TITLES = {
    "memory": "memory [kB]",
    "messages": "messages",
    "formula": "formula",
    "counted": "counted",
}
"""Titles of the numbers of whole trials."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams of agents with rule bases are evaluated."""
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: related compares evaluation success, needs 1 or more")
    check_rule_bases(spec, "whose weights and messages it counts")


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and count what it takes; imported by name in workers."""
    session = Session.compiled(trial)
    session.train(trial.episodes)
    team = of_fuzzy_agents(session.team)
    hierarchy, n_rules = team.hierarchy, team.learner.theta.shape[1]
    tried = 0 if team.evaluator is None else hierarchy.joint_actions(len(team.action_set))
    counted = 0 if team.evaluator is None else team.evaluator.counts.rule_evaluations
    numbers = {
        "agents": float(len(hierarchy)),
        "memory": 1e-3 * team.learner.theta.nbytes,
        "messages": float(messages(hierarchy.below(i) for i in range(len(hierarchy)))),
        "formula": float(tried * n_rules),
        "counted": counted / len(session.deciding),
    }
    period = getattr(trial.settings.scenario, "period", None)
    if period is not None:
        numbers["period"] = float(period)
    session.evaluate()
    session.evaluate_elsewhere()
    return session.result(numbers, {"decision_median": float(np.median(session.deciding))})


@dataclass(frozen=True)
class Case:
    """One condition.

    Attributes
    ----------
    system
        Name of its override: how agents coordinate.
    world
        What else it differs in, such as the number of robots.
    values
        Estimates by title, see `analyse`.
    """

    system: str
    world: str
    values: Mapping[str, Estimate]


@dataclass(frozen=True)
class Related:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    cases
        The same for figures.
    """

    table: tuple[Summary, ...]
    cases: tuple[Case, ...]
    headline: ClassVar[str] = EVALUATED
    notes: ClassVar[tuple[str, ...]] = (
        "decisions, time: of an evaluation episode, failures included; ms: of a decision of all",
        "agents in training; formula, counted: joint actions tried times rules, per decision.",
    )


def analyse(results: Results) -> Related:
    """Estimate; 95 % intervals, seeds as the unit of sampling."""
    table, cases = [], []
    for condition, evaluation in results.evaluation.items():
        numbers, usage = results.numbers[condition], results.usage[condition]
        steps = evaluation["steps"].mean(axis=1)
        costs = {"decisions": steps}
        if "period" in numbers:
            costs["time [s]"] = steps * numbers["period"]
        costs["ms"] = 1e3 * usage["decision_median"]
        costs |= {title: numbers[name] for name, title in TITLES.items()}
        values = evaluated(results, condition)
        values |= {title: bootstrap(cost, bounds=NOT_NEGATIVE) for title, cost in costs.items()}
        columns = results.columns.get(condition, {})
        cases.append(Case(str(columns.get("name", condition)), _world(columns), values))
        table.append(Summary(condition, len(steps), values))
    return Related(tuple(table), tuple(cases))


def _world(columns: Mapping[str, Any]) -> str:
    """Return what a condition differs in beside its system.

    >>> _world({"name": "nested", "scenario.robots": 8, "scenario.start": ""})
    '8 robots'
    """
    swept = {k.rpartition(".")[2]: v for k, v in columns.items() if k != "name" and v != ""}
    return ", ".join(f"{v} {k}" if isinstance(v, int) else str(v) for k, v in swept.items())
