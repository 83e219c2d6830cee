"""How far the evaluators are from exact enumeration: ``python -m benchmarks.errors``.

The states are those of episodes in which the team learns by sampling, one training run per seed;
the consequent weights are the learned ones. Errors are of the values of an agent's own actions
after taking off their common shift, in units of their spread under exact enumeration; agents whose
actions do not differ are left out. Regret is by how much the action taken is worse than the best,
in the same units.

Beyond `LARGEST_EXACT` agents the reference is the mean of `REPLICATES` Latin hypercubes, drawn
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

from nested_agents.core.arrays import FloatArray
from nested_agents.core.decision import Decision
from nested_agents.core.evaluators import (
    Evaluator,
    ExactEnumeration,
    Extremes,
    LatinHypercube,
    Moments,
    Sampling,
)
from nested_agents.core.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.loop import control_loop, policy_seed
from nested_agents.core.team import Team
from nested_agents.scenarios import BoxPushingSettings

from .situations import ADDITIVE, situation
from .timing import paired

FIRST_SEED = 10_000
TRAINING, EVERY = 3, 4
"""Episodes before the measured one, and of which steps of that one states are taken."""
NEGLIGIBLE_SPREAD = 1e-9
LARGEST_EXACT = 8
"""Agents up to which there is exact enumeration to compare with."""
REPLICATES = 16
BUDGET, SMALL_BUDGET = Decision().budget, 8192
"""Of the Latin hypercubes: the default, and one too small for all that eight agents can do."""
SCENARIOS: dict[str, dict[str, Any]] = {
    "default": {},
    "1 period": {"state_space": "paper", "action_repeat": 1, "prediction_horizon": 1},
}


def errors(
    others: Any, scenario_settings: dict[str, Any], steps: int, seeds: int
) -> dict[str, FloatArray]:
    """Return per evaluator ``(cases, 2)`` errors and regrets."""
    scenario = BoxPushingSettings(**scenario_settings).build()
    hierarchy = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    n, neutral = len(scenario.agents), scenario.action_set.neutral
    decision = Decision(evaluator="sampling", samples=8, others=others)
    found: dict[str, list[tuple[float, float]]] = {}
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        team = Team.build(
            BatchTDSettings(decision=decision), scenario, hierarchy, policy_seed(seed)
        )
        rules = team.learner.rules  # type: ignore[attr-defined]
        common = (rules, hierarchy, len(scenario.action_set), "value", others, 0.95)
        references, evaluators = _evaluators(scenario.groups, n, others, common)
        rng = np.random.default_rng(seed)
        frequencies = rng.dirichlet(np.full(4, 3.0), size=n)
        for record in control_loop(scenario, team, episodes=TRAINING + 1, steps=steps, seed=seed):
            if record.episode < TRAINING or record.step % EVERY or record.last:
                continue
            prediction = team.predict(scenario)
            for agent in range(n):
                known = np.full(n, neutral)
                known[:agent] = record.joint_action[:agent]
                given = (agent, known, team.learner.theta[agent], prediction, frequencies, rng)
                drawn = np.array([reference.values(*given) for reference in references])
                exact = drawn.mean(axis=0)
                spread = np.ptp(exact)
                if spread < NEGLIGIBLE_SPREAD:
                    continue
                if len(drawn) > 1:
                    drawn -= drawn.mean(axis=1, keepdims=True)
                    off = drawn.std(axis=0, ddof=1).max() / np.sqrt(len(drawn))
                    found.setdefault("reference", []).append((off / spread, 0.0))
                for name, evaluator in evaluators.items():
                    approximate = evaluator.values(*given)
                    off = approximate - exact
                    error = np.abs(off - off.mean()).max()
                    regret = exact.max() - exact[approximate.argmax()]
                    found.setdefault(name, []).append((error / spread, regret / spread))
    return {name: np.array(rows) for name, rows in found.items()}


def _evaluators(
    groups: tuple[tuple[int, ...], ...], n: int, others: str, common: tuple[Any, ...]
) -> tuple[list[Evaluator], dict[str, Evaluator]]:
    """Return what is taken for exact, and what is measured."""
    references: list[Evaluator]
    if n <= LARGEST_EXACT:
        references = [ExactEnumeration(*common)]
    else:
        references = [LatinHypercube(groups, BUDGET, *common) for _ in range(REPLICATES)]
    summed = Extremes if others == "max" else Moments
    evaluators: dict[str, Evaluator] = {
        "sampling": Sampling(64, *common),
        summed.name: summed(groups, *common),
        "latin-hypercube": LatinHypercube(groups, BUDGET, *common),
    }
    if n >= LARGEST_EXACT:
        evaluators[f"budget {SMALL_BUDGET}"] = LatinHypercube(groups, SMALL_BUDGET, *common)
    return references, evaluators


def times(n_agents: int, budget: float = 3.0) -> dict[str, float]:
    """Return what a decision takes with each evaluator [ms], prediction included; order 1."""
    kinds = {name: {"evaluator": name} for name in ("sampling", "moments", "latin-hypercube")}
    kinds[f"budget {SMALL_BUDGET}"] = {"evaluator": "latin-hypercube", "budget": SMALL_BUDGET}
    if n_agents <= LARGEST_EXACT:
        kinds["exact"] = {"evaluator": "exact"}
    moments = {name: situation(n_agents, ADDITIVE, kind).foresee for name, kind in kinds.items()}
    taken = paired(moments, budget=budget, clock=time.thread_time)
    return {name: 1e3 * taken.median(name) for name in moments}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.errors", description=__doc__)
    parser.add_argument("--robots", type=int, nargs="*", default=[2, 3, 4, 6, 8, 32])
    parser.add_argument("--steps", type=int, default=80)
    parser.add_argument("--seeds", type=int, default=5, help="from 10000")
    parser.add_argument("--times", type=int, nargs="*", default=[8, 16, 64, 128], metavar="AGENTS")
    options = parser.parse_args()
    console = Console(width=80)
    heads = ("scenario", "n", "others", "evaluator", "median", "90 %", "99 %", "regret", "of")
    table = Table(*heads, box=SIMPLE, padding=(0, 1, 0, 0))
    for name, settings in SCENARIOS.items():
        for robots in options.robots:
            for others in ("observed", "max"):
                if 2 * robots > LARGEST_EXACT and (settings or others == "max"):
                    continue
                asked = {**settings, "robots": robots}
                found = errors(others, asked, options.steps, options.seeds)
                for evaluator, rows in found.items():
                    quantiles = [f"{np.quantile(rows[:, 0], q):.1g}" for q in (0.5, 0.9, 0.99)]
                    table.add_row(
                        name, str(2 * robots), others, evaluator, *quantiles,
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
