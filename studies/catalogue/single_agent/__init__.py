"""The single-agent study: nested agents and one agent over their joint state, on one small task.

Section VII compares the two by formula. Here both run, on the line-up task, whose joint state of
three agents still fits: the same learner (online TD lambda, full product of sigmoid rules, decision
by value), the same worlds. Step sizes are chosen for each contender apart, on seeds of their own,
so that neither is handicapped by the other's; the frozen control tells learning from luck.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ....core.agents.cost import Problem, below_counts
from ....core.agents.team import of_fuzzy_agents
from ...results.analysis import Analysis
from ...results.results import Results
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate, rates
from ...results.summary import EVALUATED, Summary
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..study import check_rule_bases

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLOCK = 20
"""Episodes at the end of training that the table averages over."""
SMOOTHED = 10
"""Episodes that a point of a curve averages over."""
COUNTS = {"weights": "weights", "formula": "formula", "counted": "rule_evaluations"}
"""Numbers of whole trials by their titles."""
NUMBERS = ("agents", *COUNTS.values())
"""What of whole trials the analysis rests on."""
NOTES = (
    "formula: operations of one iteration, Eq. 18, of which Eq. 23 is the case of one agent;",
    "counted: rule evaluations of a step; ms: of deciding and learning, per step.",
)


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
    session.run_other_evaluations()
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


def analyse(results: Results) -> Analysis:
    """Estimate; 95 % intervals, seeds as the unit of sampling."""
    table, contests = [], []
    for condition in results.of_phase("training"):
        numbers = results.numbers(condition)
        success = results.success(condition)
        steps = results.values(condition, "steps").sum(axis=1)
        spent = 1e3 * (numbers["seconds.decision"] + numbers["seconds.learning"]) / steps
        milliseconds = bootstrap(spent, bounds=NOT_NEGATIVE)
        estimates = {f"success last {BLOCK}": rate(success[:, -BLOCK:])}
        if results.has(condition, "evaluation"):
            estimates[EVALUATED] = rate(results.success(condition, "evaluation"))
        estimates |= {title: bootstrap(numbers[name]) for title, name in COUNTS.items()}
        estimates["ms"] = milliseconds
        table.append(Summary(condition, len(success), estimates))
        contender = str(results.columns.get(condition, {}).get("name", condition))
        contender = contender.partition(",")[0]  # "single agent, 2 carts" is the single agent
        agents = int(numbers["agents"][0])
        contests.append(Contest(contender, agents, rates(success), milliseconds))
    return Analysis(tuple(table), NOTES, contests)


def smoothed(curve: Estimate, episodes: int = SMOOTHED) -> np.ndarray:
    """Return means over so many episodes, one for each that has as many before it."""
    return np.convolve(curve.value, np.ones(episodes) / episodes, mode="valid")


def draw(analysis: Analysis) -> dict[str, Figure]:
    """Return the figure: a panel of curves for every number of agents, and one of times.

    Curves are means over seeds and `SMOOTHED` episodes.
    """
    from ...presentation import figures as f  # matplotlib takes its time

    contests = analysis.cases
    if not contests:
        return {}
    agents = sorted({c.agents for c in contests})
    contenders = list(dict.fromkeys(c.contender for c in contests))
    size = (2.4 * (len(agents) + 1) + 0.6, 3.2)
    figure, ((*panels, times),) = f.panels(1, len(agents) + 1, size)
    for axes, n in zip(panels, agents, strict=True):
        for c in (c for c in contests if c.agents == n):
            width = min(SMOOTHED, len(c.curve.value))
            curve = smoothed(c.curve, width)
            episodes = np.arange(len(curve)) + width - 1
            axes.plot(episodes, curve, **f.look(contenders.index(c.contender)))
        f.as_rates(axes)
        axes.set_title(f"success, n = {n}", loc="left")
        axes.set_xlabel("episode")
    for i, contender in enumerate(contenders):
        own = [c for c in contests if c.contender == contender]
        values = [float(c.milliseconds.value) for c in own]
        times.plot([c.agents for c in own], values, marker=f.marker(i), **f.look(i))
    f.log_axis(times)
    times.set_xticks(agents)
    times.set_xlabel("agents n")
    times.set_title("time of a step [ms]", loc="left")
    for axes in (*panels, times):
        axes.grid(alpha=0.25)
    handles = [f.handle(c, marker=f.marker(i), **f.look(i)) for i, c in enumerate(contenders)]
    f.add_legend(figure, handles, ncols=3)
    return {"single-agent": figure}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
