"""The single-agent study: nested agents and one agent over their joint state, on one small task.

Section VII compares the two by formula. Here both run, on the line-up task, whose joint state of
three agents still fits: the same learner (online TD lambda, full product of sigmoid rules, decision
by value), the same worlds. Step sizes are chosen for each contender apart, on seeds of their own,
so that neither is handicapped by the other's; the frozen control tells learning from luck.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....core.agents.cost import Problem, below_counts
from ....core.agents.team import of_fuzzy_agents
from ...results.results import Results
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate, rates
from ...results.summary import Summary
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import check_rule_bases

BLOCK = 20
"""Episodes at the end of training that the table averages over."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless all agents have rule bases."""
    check_rule_bases(spec, "whose weights and rule evaluations it counts")


def measure(trial: Trial) -> TrialResult:
    """Train and evaluate a team, and count what a step costs; imported by name in workers."""
    session = Session(trial)
    session.train(trial.episodes)
    team = of_fuzzy_agents(session.team)
    evaluator = team.evaluator
    evaluations = 0 if evaluator is None else evaluator.counts.rule_evaluations
    steps = len(session.deciding)
    n_rules = team.learner.theta.shape[1]
    actions = len(session.scenario.action_set)
    problem = Problem(rules=n_rules, actions=actions, iterations=1)
    numbers = {
        "agents": float(len(session.world.agents)),
        "weights": float(team.learner.theta.size),
        "formula": float(problem.nested(below_counts(team.hierarchy))),
        "rule_evaluations": evaluations / steps,
    }
    session.evaluate()
    session.evaluate_elsewhere()
    return session.result(numbers)


@dataclass(frozen=True)
class Contest:
    """One condition: who learns, for how many agents.

    Attributes
    ----------
    contender
        Its label without the number of agents.
    agents
        Agents of the world, which the single agent is all of.
    curve
        Success from episode to episode.
    milliseconds
        Of deciding and learning, per step.
    """

    contender: str
    agents: int
    curve: Estimate
    milliseconds: Estimate


@dataclass(frozen=True)
class Contests:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    contests
        The same for figures.
    """

    table: tuple[Summary, ...]
    contests: tuple[Contest, ...]
    notes: ClassVar[tuple[str, ...]] = (
        "formula: operations of one iteration, Eq. 18, of which Eq. 23 is the case of one agent;",
        "counted: rule evaluations of a step; ms: of deciding and learning, per step.",
    )
    headline: ClassVar[str] = "evaluation success"


def analyse(results: Results) -> Contests:
    """Estimate; 95 % intervals, seeds as the unit of sampling."""
    table, contests = [], []
    for condition, training in results.training.items():
        numbers, usage = results.numbers[condition], results.usage[condition]
        success, steps = training["success"], training["steps"].sum(axis=1)
        milliseconds = bootstrap(
            1e3 * (usage["decision"] + usage["learning"]) / steps, bounds=NOT_NEGATIVE
        )
        estimates = {f"success last {BLOCK}": rate(success[:, -BLOCK:])}
        if condition in results.evaluation:
            estimates["evaluation success"] = rate(results.evaluation[condition]["success"])
        counted = {"weights": "weights", "formula": "formula", "counted": "rule_evaluations"}
        estimates |= {title: bootstrap(numbers[name]) for title, name in counted.items()}
        estimates["ms"] = milliseconds
        table.append(Summary(condition, len(success), estimates))
        agents = int(numbers["agents"][0])
        contender = str(results.columns.get(condition, {}).get("name", condition))
        contests.append(Contest(_without(contender), agents, rates(success), milliseconds))
    return Contests(tuple(table), tuple(contests))


def _without(name: str) -> str:
    """Return a contender's name without the number of its agents.

    >>> _without("single agent, 2 carts"), _without("frozen")
    ('single agent', 'frozen')
    """
    return name.partition(",")[0]


def smoothed(curve: Estimate, episodes: int = 10) -> np.ndarray:
    """Return means over so many episodes, one for each that has as many before it."""
    return np.convolve(curve.value, np.ones(episodes) / episodes, mode="valid")
