"""Time what a team of any size takes to decide: ``python -m benchmarks.decisions``.

Teams of a preset with drawn weights decide in an episode of box pushing; the processor's time of
each decision is taken, prediction included, learning and physics not. The least is what the
arithmetic takes, the median what a machine that others use makes of it. The exponent of the time in
the number of agents is fitted to teams of at least four robots (eight agents).
"""

from __future__ import annotations

import argparse
from time import thread_time

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from nested_agents.core.agents.loop import world_seed
from nested_agents.core.agents.team import of_fuzzy_agents
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

SIZES = (2, 4, 8, 16, 32, 64)
WARM = 3
"""Decisions that are not timed: kernels are compiled, memory is taken."""


def decisions(preset: str, robots: int, number: int) -> list[float]:
    """Return the processor's time [s] of so many decisions."""
    settings = {"preset": preset, "seeds": 1, "scenario": {"robots": robots}}
    (trial,) = trials_of(Spec.of(settings))
    session = Session(trial)
    scenario, team = session.scenario, of_fuzzy_agents(session.team)
    theta = team.learner.theta
    theta[:] = np.random.default_rng(0).normal(size=theta.shape)
    scenario.reset(world_seed(0, 0), 0)
    taken = []
    for _ in range(WARM + number):
        begun = thread_time()
        actions = team.act(team.predict(scenario))
        taken.append(thread_time() - begun)
        scenario.step(actions)
    return taken[WARM:]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decisions", description=__doc__)
    parser.add_argument("--preset", default="default")
    parser.add_argument("--robots", type=int, nargs="+", default=SIZES, metavar="N")
    parser.add_argument("--number", type=int, default=30, help="decisions timed of each size")
    options = parser.parse_args()
    table = Table("robots", "agents", "least [ms]", "median [ms]", box=SIMPLE)
    least: dict[int, float] = {}
    for robots in options.robots:
        taken = decisions(options.preset, robots, options.number)
        least[2 * robots] = min(taken)
        numbers = (f"{1e3 * seconds:.2f}" for seconds in (min(taken), float(np.median(taken))))
        table.add_row(str(robots), str(2 * robots), *numbers)
    console = Console(width=80)
    console.print(table)
    large = [n for n in least if n >= 8]
    if len(large) > 1:
        slope = np.polyfit(np.log(large), np.log([least[n] for n in large]), 1)[0]
        console.print(f"time ~ n^{slope:.2f} with {large[0]} to {large[-1]} agents (least)")


if __name__ == "__main__":
    main()
