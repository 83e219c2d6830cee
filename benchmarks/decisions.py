"""Time what a team of any size takes to decide: ``python -m benchmarks.decisions``.

Teams of a preset with drawn weights decide in an episode of box pushing, or as the joints of an
arm; the processor's time of each decision is taken, prediction included, and beside it that of the
step of the world: physics, sensing and measures. The least is what the arithmetic takes, the median
what a machine that others use makes of it. With ``--training`` a team learns as in a study, and its
last episode is timed. A fixed load, the loop of `benchmarks.machine`, is timed after every
decision: the ratio of the medians compares machines, and hours of one that others use. The memory
is the greatest of the process so far: begin with few. The exponent of the time in the number of
agents is fitted to teams of at least eight.
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
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.experience import Experience
from nested_agents.core.interface.scenario import Scenario
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

from .machine import loop

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
    load: list[float]
    """The fixed load, after every decision [s]."""
    memory: float
    """The greatest of the process so far [MB]."""


def timed(settings: dict[str, Any], number: int, training: int) -> Timed:
    """Let a team decide so often: with drawn weights, or after so many episodes of training."""
    begun = process_time()
    (trial,) = trials_of(Spec.of({"seeds": 1, **settings}))
    session = Session(trial)
    scenario = session.scenario
    team = session.team
    built = process_time() - begun
    if not training:
        theta = team.only(FuzzyAgents).learner.theta
        theta[:] = np.random.default_rng(0).normal(size=theta.shape)
    for episode in range(training):
        _episode(scenario, team, episode, number, learn=True)
    learn = training > 0
    taken = _episode(scenario, team, training, WARM + number, learn=learn)[WARM:]
    deciding, stepping, load = (list(times) for times in zip(*taken, strict=True))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Timed(len(scenario.agents), built, deciding, stepping, load, memory)


def _episode(
    scenario: Scenario, team: Team, episode: int, steps: int, *, learn: bool
) -> list[tuple[float, float, float]]:
    """Return what every decision, step and fixed load took [s]; episodes do not end early."""
    seed = world_seed(0, episode)
    states = scenario.reset(seed, episode)
    previous = None
    team.reset(seed, episode, learn=learn)
    taken = []
    for step in range(steps):
        begun = thread_time()
        seen = team.observe(scenario, states, previous)
        decision = team.act(seen)
        decided = thread_time()
        transition = scenario.step(decision.joint_action)
        stepped = thread_time()
        loop()
        taken.append((decided - begun, stepped - decided, thread_time() - stepped))
        if learn:
            team.learn(Experience(seen, decision, transition, step == steps - 1))
        states = transition.states
        previous = decision.joint_action
    return taken


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.decisions", description=__doc__)
    parser.add_argument("--preset", default="default")
    parser.add_argument("--robots", type=int, nargs="+", default=ROBOTS, metavar="N")
    parser.add_argument("--joints", type=int, nargs="+", default=(), metavar="N", help="arms, too")
    parser.add_argument("--sweeps", type=int, metavar="N", help="of best responses, of robots")
    parser.add_argument("--number", type=int, default=30, help="decisions timed of each size")
    parser.add_argument("--training", type=int, default=0, metavar="N", help="episodes before")
    options = parser.parse_args()
    settings: dict[str, Any] = {"preset": options.preset}
    boxes = dict(settings)
    if options.sweeps is not None:
        evaluator = {"kind": "best-response", "sweeps": options.sweeps}
        boxes["learner"] = {"decision": {"evaluator": evaluator}}
    teams = [(f"{n} joints", settings, {"kind": "kinematic-chain", "joints": n})
             for n in options.joints]  # fmt: skip
    teams += [(f"{n} robots", boxes, {"robots": n}) for n in options.robots]
    headings = (
        "team",
        "agents",
        "least [ms]",
        "median [ms]",
        "of load",
        "world [ms]",
        "made [s]",
        "MB",
    )
    table = Table(*headings, box=SIMPLE)
    least: dict[int, float] = {}
    for name, learner, scenario in teams:
        taken = timed({**learner, "scenario": scenario}, options.number, options.training)
        if "robots" in name:
            least[taken.agents] = min(taken.deciding)
        median = float(np.median(taken.deciding))
        table.add_row(
            name,
            str(taken.agents),
            f"{1e3 * min(taken.deciding):.2f}",
            f"{1e3 * median:.2f}",
            f"{median / np.median(taken.load):.3f}",
            f"{1e3 * np.median(taken.stepping):.2f}",
            f"{taken.built:.2f}",
            f"{taken.memory:.0f}",
        )
    console = Console(width=80)
    console.print(table)
    large = [n for n in least if n >= 8]
    if len(large) > 1:
        slope = np.polyfit(np.log(large), np.log([least[n] for n in large]), 1)[0]
        console.print(f"time ~ n^{slope:.2f} with {large[0]} to {large[-1]} agents (least)")


if __name__ == "__main__":
    main()
