"""How far the evaluators are from exact enumeration: ``python -m research.errors``.

The states are those of episodes in which the team learns by sampling, one training run per seed;
the consequent weights are the learned ones. Errors are of the values of an agent's own actions
after taking off their common shift, in units of their spread under exact enumeration; agents whose
actions do not differ are left out. Regret is by how much the action taken is worse than the best,
in the same units.

Beyond `LARGEST_EXACT` agents the reference is the mean of `REPLICATES` large samples, drawn
independently of each other and of what is measured; its row gives its standard error in place of
an error (the greatest of the actions', common shift taken off).
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from benchmarks.situations import ADDITIVE, situation
from benchmarks.timing import paired
from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.decision.settings import DecisionSettings
from nested_agents.core.evaluators.enumeration import ExactEnumeration, Sampling, SamplingSettings
from nested_agents.core.evaluators.evaluator import (
    DecisionProblem,
    Deliberation,
    Evaluator,
    Teammates,
)
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings

FIRST_SEED = 10_000
TRAINING, EVERY = 3, 4
"""Episodes before the measured one, and of which steps of that one states are taken."""
NEGLIGIBLE_SPREAD = 1e-9
LARGEST_EXACT = 8
"""Agents up to which there is exact enumeration to compare with."""
REPLICATES, SAMPLES = 16, 1024
"""Samples that are taken for exact beyond, and the joint actions in each."""
TEAMMATES: tuple[Teammates, ...] = ("empirical", "best-response")
SCENARIOS: dict[str, dict[str, Any]] = {
    "default": {},
    "1 period": {"state_space": "paper", "action_repeat": 1, "prediction_horizon": 1},
}


def errors(
    teammates: Teammates, scenario_settings: dict[str, Any], steps: int, seeds: int
) -> dict[str, FloatArray]:
    """Return per evaluator ``(cases, 2)`` errors and regrets."""
    scenario = BoxPushingSettings(**scenario_settings).build()
    hierarchy = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    n, neutral = len(scenario.agents), scenario.action_set.neutral
    decision = DecisionSettings(evaluator=SamplingSettings(samples=8), teammates=teammates)
    samples: dict[str, list[tuple[float, float]]] = {}
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        team = Team(BatchTDSettings(decision=decision), scenario, hierarchy, policy_seed(seed))
        rules = team.only(FuzzyAgents).rules
        problem = DecisionProblem(
            rules, hierarchy, len(scenario.action_set), scenario.groups, "value", teammates, 0.95,
        )  # fmt: skip
        references = _references(problem)
        evaluator = Sampling(SamplingSettings(samples=64), problem)
        rng = np.random.default_rng(seed)
        frequencies = rng.dirichlet(np.full(4, 3.0), size=n)
        for record in control_loop(scenario, team, episodes=TRAINING + 1, steps=steps, seed=seed):
            if record.episode < TRAINING or record.step % EVERY or record.last:
                continue
            prediction = scenario.predict()
            for agent in range(n):
                known = np.full(n, neutral)
                known[:agent] = record.joint_action[:agent]
                deliberation = Deliberation(
                    agent, known, prediction, team.only(FuzzyAgents).learner.theta, frequencies, rng
                )
                drawn = np.array([reference.values(deliberation) for reference in references])
                exact = drawn.mean(axis=0)
                spread = np.ptp(exact)
                if spread < NEGLIGIBLE_SPREAD:
                    continue
                if len(drawn) > 1:
                    drawn -= drawn.mean(axis=1, keepdims=True)
                    off = drawn.std(axis=0, ddof=1).max() / np.sqrt(len(drawn))
                    samples.setdefault("reference", []).append((off / spread, 0.0))
                approximate = evaluator.values(deliberation)
                off = approximate - exact
                error = np.abs(off - off.mean()).max()
                regret = exact.max() - exact[approximate.argmax()]
                samples.setdefault("sampling", []).append((error / spread, regret / spread))
    return {name: np.array(rows) for name, rows in samples.items()}


def _references(problem: DecisionProblem) -> list[Evaluator]:
    """Return what is taken for exact."""
    if len(problem.hierarchy) <= LARGEST_EXACT:
        return [ExactEnumeration(problem)]
    return [Sampling(SamplingSettings(samples=SAMPLES), problem) for _ in range(REPLICATES)]


def times(n_agents: int, budget: float = 3.0) -> dict[str, float]:
    """Return what a decision takes with each evaluator [ms], prediction included; order 1."""
    names = ["sampling", "exact"] if n_agents <= LARGEST_EXACT else ["sampling"]
    deciding = {
        name: situation(n_agents, ADDITIVE, {"evaluator": name}).predict_and_act for name in names
    }
    taken = paired(deciding, budget=budget, clock=time.thread_time)
    return {name: 1e3 * taken.median(name) for name in deciding}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m research.errors", description=__doc__)
    parser.add_argument("--robots", type=int, nargs="*", default=[2, 3, 4, 6, 8, 32])
    parser.add_argument("--steps", type=int, default=80)
    parser.add_argument("--seeds", type=int, default=5, help="from 10000")
    parser.add_argument("--times", type=int, nargs="*", default=[8, 16, 64, 128], metavar="AGENTS")
    options = parser.parse_args()
    console = Console(width=80)
    heads = ("scenario", "n", "teammates", "evaluator", "median", "90%", "99%", "regret", "of")
    table = Table(*heads, box=SIMPLE, padding=(0, 1, 0, 0))
    for name, settings in SCENARIOS.items():
        for robots in options.robots:
            for teammates in TEAMMATES:
                if 2 * robots > LARGEST_EXACT and (settings or teammates == "best-response"):
                    continue
                own = {**settings, "robots": robots}
                rows_by_evaluator = errors(teammates, own, options.steps, options.seeds)
                for evaluator, rows in rows_by_evaluator.items():
                    quantiles = [f"{np.quantile(rows[:, 0], q):.1g}" for q in (0.5, 0.9, 0.99)]
                    table.add_row(
                        name, str(2 * robots), teammates, evaluator, *quantiles,
                        f"{rows[:, 1].mean():.1g}", str(len(rows)),
                    )  # fmt: skip
    console.print(table)
    if options.times:
        taken = {n: times(n) for n in options.times}
        heads = ("ms per decision", *(f"n = {n}" for n in taken))
        table = Table(*heads, box=SIMPLE)
        for name in dict.fromkeys(name for row in taken.values() for name in row):
            cells = [f"{row[name]:.3g}" if name in row else "" for row in taken.values()]
            table.add_row(name, *cells)
        console.print(table)


if __name__ == "__main__":
    main()
