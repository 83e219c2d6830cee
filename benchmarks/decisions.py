"""Time what a team of any size takes to decide: ``python -m benchmarks.decisions``.

Teams of a preset with drawn weights decide in an episode of box pushing, or as the joints of an
arm; the processor's time of each decision is taken, prediction included, and beside it that of the
step of the world: physics, sensing and measures. The least is what the arithmetic takes, the median
what a machine that others use makes of it. The memory is the greatest of the process so far: begin
with few. The exponent of the time in the number of agents is fitted to teams of at least eight.
"""

from __future__ import annotations

import argparse
import resource
from time import process_time, thread_time
from typing import Any, NamedTuple

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.loop import world_seed
from nested_agents.core.interface.experience import Observation
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

ROBOTS = (2, 4, 8, 16, 32, 64)
WARM = 3
"""Decisions that are not timed: kernels are compiled, memory is taken."""


class Timed(NamedTuple):
    """What a team took."""

    agents: int
    built: float
    """To make scenario and team [s]."""
    deciding: list[float]
    """Every decision, with its prediction [s]."""
    stepping: list[float]
    """Every step of the world [s]."""
    memory: float
    """The greatest of the process so far [MB]."""


def timed(settings: dict[str, Any], number: int) -> Timed:
    """Let a team decide so often."""
    begun = process_time()
    (trial,) = trials_of(Spec.of({"seeds": 1, **settings}))
    session = Session(trial)
    scenario = session.scenario
    team = session.team
    built = process_time() - begun
    theta = team.only(FuzzyAgents).learner.theta
    theta[:] = np.random.default_rng(0).normal(size=theta.shape)
    states = scenario.reset(world_seed(0, 0), 0)
    deciding, stepping = [], []
    for _ in range(WARM + number):
        begun = thread_time()
        actions = team.act(Observation(states, scenario)).joint_action
        decided = thread_time()
        states = scenario.step(actions).states
        deciding.append(decided - begun)
        stepping.append(thread_time() - decided)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Timed(len(scenario.agents), built, deciding[WARM:], stepping[WARM:], memory)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decisions", description=__doc__)
    parser.add_argument("--preset", default="default")
    parser.add_argument("--robots", type=int, nargs="+", default=ROBOTS, metavar="N")
    parser.add_argument("--joints", type=int, nargs="+", default=(), metavar="N", help="arms, too")
    parser.add_argument("--sweeps", type=int, metavar="N", help="of best responses, of robots")
    parser.add_argument("--number", type=int, default=30, help="decisions timed of each size")
    options = parser.parse_args()
    settings: dict[str, Any] = {"preset": options.preset}
    boxes = dict(settings)
    if options.sweeps is not None:
        evaluator = {"kind": "best-response", "sweeps": options.sweeps}
        boxes["learner"] = {"decision": {"evaluator": evaluator}}
    teams = [(f"{n} joints", settings, {"kind": "kinematic-chain", "joints": n})
             for n in options.joints]  # fmt: skip
    teams += [(f"{n} robots", boxes, {"robots": n}) for n in options.robots]
    headings = ("team", "agents", "least [ms]", "median [ms]", "world [ms]", "made [s]", "MB")
    table = Table(*headings, box=SIMPLE)
    least: dict[int, float] = {}
    for name, learner, scenario in teams:
        taken = timed({**learner, "scenario": scenario}, options.number)
        if "robots" in name:
            least[taken.agents] = min(taken.deciding)
        medians = (float(np.median(times)) for times in (taken.deciding, taken.stepping))
        numbers = (f"{1e3 * seconds:.2f}" for seconds in (min(taken.deciding), *medians))
        table.add_row(
            name, str(taken.agents), *numbers, f"{taken.built:.2f}", f"{taken.memory:.0f}"
        )
    console = Console(width=80)
    console.print(table)
    large = [n for n in least if n >= 8]
    if len(large) > 1:
        slope = np.polyfit(np.log(large), np.log([least[n] for n in large]), 1)[0]
        console.print(f"time ~ n^{slope:.2f} with {large[0]} to {large[-1]} agents (least)")


if __name__ == "__main__":
    main()
