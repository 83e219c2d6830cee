"""Time PPO in a hierarchy, with edges and without: ``python -m benchmarks.peers``.

Agents are the joints of an arm. The processor's time of a decision is taken by size and topology;
that of an update as a paired ratio: the same number of steps with and without edges in turn.
"""

from __future__ import annotations

import argparse
from time import thread_time
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from nested_agents.core.interface.experience import Experience, Observation
from nested_agents.core.networks.agents import PPOAgents
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

SIZES = (4, 16, 64)
UPDATED = 8
"""Agents whose updates are timed."""
TOPOLOGIES = ("independent", "star", "tree", "chain")


def acting(joints: int, topology: str) -> tuple[Any, Any, Any]:
    """Return an arm, those who act in it, and what they see first."""
    table = {
        "seeds": 1, "scenario": {"kind": "kinematic-chain", "joints": joints},
        "topology": topology, "learner": {"kind": "hierarchy-ppo"},
    }  # fmt: skip
    session = Session(trials_of(Spec.of(table))[0])
    return session.scenario, session.team, session.scenario.reset(0)


def decisions(joints: int, topology: str, number: int) -> list[float]:
    """Return the processor's time [s] of so many decisions."""
    scenario, team, states = acting(joints, topology)
    seen = Observation(states, scenario)
    taken = []
    for _ in range(number):
        begun = thread_time()
        team.act(seen)
        taken.append(thread_time() - begun)
    return taken


def updates(rounds: int) -> dict[str, list[float]]:
    """Return the processor's time [s] of updates by topology, taken in turn."""
    teams, taken = {name: acting(UPDATED, name) for name in TOPOLOGIES}, {}
    for _ in range(rounds):
        for name, (scenario, team, states) in teams.items():
            rollout = team.only(PPOAgents).policies["all"].rollout
            last = False
            while not last:
                last = rollout.steps == len(rollout.rewards) - 1
                seen = Observation(states, scenario)
                decision = team.act(seen)
                transition = scenario.step(np.zeros(UPDATED, dtype=int))
                states = transition.states
                begun = thread_time()
                team.learn(Experience(seen, decision, transition, last))
            taken.setdefault(name, []).append(thread_time() - begun)
    return taken


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("--number", type=int, default=400, help="decisions timed of each")
    parser.add_argument("--rounds", type=int, default=12, help="updates timed of each topology")
    options = parser.parse_args()
    table = Table("agents", "topology", "least [ms]", "median [ms]", box=SIMPLE)
    for joints in SIZES:
        for topology in TOPOLOGIES:
            taken = decisions(joints, topology, options.number)
            numbers = (f"{1e3 * x:.3f}" for x in (min(taken), float(np.median(taken))))
            table.add_row(str(joints), topology, *numbers)
    Console().print(table)
    taken_by = updates(options.rounds)
    for name in TOPOLOGIES[1:]:
        ratios = np.array(taken_by[name]) / np.array(taken_by[TOPOLOGIES[0]])
        print(f"update of {UPDATED} agents, {name} / independent: {np.median(ratios):.2f}")


if __name__ == "__main__":
    main()
