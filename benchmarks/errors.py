"""How far the evaluators are from exact enumeration: ``python -m benchmarks.errors``.

The states are those of episodes in which the team learns by sampling; the consequent weights are
the learned ones. Errors are of the values of an agent's own actions after taking off their common
shift, in units of their spread under exact enumeration; agents whose actions do not differ are left
out. Regret is by how much the action taken is worse than the best, in the same units.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from nested_agents.core.arrays import FloatArray
from nested_agents.core.config import BatchTDSettings, Decision
from nested_agents.core.evaluators import Evaluator, ExactEnumeration, Extremes, Moments, Sampling
from nested_agents.core.hierarchy import Hierarchy
from nested_agents.core.loop import control_loop, policy_seed
from nested_agents.core.team import Team
from nested_agents.scenarios import ScenarioSettings, build

TRAINING, EVERY = 3, 4
"""Episodes before the measured one, and of which steps of that one states are taken."""
NEGLIGIBLE_SPREAD = 1e-9


def errors(others: Any, scenario_settings: dict[str, Any], steps: int) -> dict[str, FloatArray]:
    """Return per evaluator ``(cases, 2)`` errors and regrets."""
    scenario = build(ScenarioSettings(**scenario_settings))
    hierarchy = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    decision = Decision(evaluator="sampling", samples=8, others=others)
    team = Team.build(BatchTDSettings(decision=decision), scenario, hierarchy, policy_seed(1))
    rules, n = team.learner.rules, len(scenario.agents)  # type: ignore[attr-defined]
    common = (rules, hierarchy, len(scenario.action_set), "value", others, 0.95)
    summed = Extremes if others == "max" else Moments
    evaluators: dict[str, Evaluator] = {
        "exact": ExactEnumeration(*common),
        "sampling": Sampling(64, *common),
        summed.name: summed(scenario.groups, *common),
    }
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in evaluators}
    rng = np.random.default_rng(0)
    frequencies = rng.dirichlet(np.full(4, 3.0), size=n)
    for record in control_loop(scenario, team, episodes=TRAINING + 1, steps=steps, seed=1):
        if record.episode < TRAINING or record.step % EVERY or record.last:
            continue
        prediction = team.predict(scenario)
        for agent in range(n):
            known = np.full(n, scenario.action_set.neutral)
            known[:agent] = record.joint_action[:agent]
            values = {
                name: evaluator.values(
                    agent, known, team.learner.theta[agent], prediction, frequencies, rng
                )
                for name, evaluator in evaluators.items()
            }
            exact = values["exact"]
            if np.ptp(exact) < NEGLIGIBLE_SPREAD:
                continue
            for name, approximate in values.items():
                off = approximate - exact
                regret = exact.max() - exact[approximate.argmax()]
                error = np.abs(off - off.mean()).max()
                found[name].append((error / np.ptp(exact), regret / np.ptp(exact)))
    return {name: np.array(rows) for name, rows in found.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.errors", description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 3, 4])
    parser.add_argument("--steps", type=int, default=80)
    options = parser.parse_args()
    table = Table("scenario", "n", "others", "evaluator", "median", "90 %", "99 %", "regret")
    scenarios: dict[str, dict[str, Any]] = {
        "default": {},
        "1 period": {"state_space": "paper", "hold": 1, "lookahead": 1},
    }
    for name, settings in scenarios.items():
        for robots in options.robots:
            for others in ("observed", "max"):
                found = errors(others, {**settings, "robots": robots}, options.steps)
                for evaluator, rows in found.items():
                    if evaluator != "exact" and len(rows):
                        quantiles = [f"{np.quantile(rows[:, 0], q):.1g}" for q in (0.5, 0.9, 0.99)]
                        table.add_row(
                            name, str(2 * robots), others, evaluator, *quantiles,
                            f"{rows[:, 1].mean():.1g}",
                        )  # fmt: skip
    Console(width=80).print(table)


if __name__ == "__main__":
    main()
