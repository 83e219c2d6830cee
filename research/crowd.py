"""Render an episode of 64 robots, 128 agents in a chain: ``python -m research.crowd FILE.png``.

The team learns online while it acts, deciding by best responses every 0.5 s; drawn is the last
moment with the trails of all robots. Prints what a control step took.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

from nested_agents.core.agents.loop import control_loop, policy_seed, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.decision.settings import DecisionSettings
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.recording import EpisodeRecorder
from nested_agents.core.learners.td import TDLambdaSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.pictures.rendering import snapshot
from nested_agents.studies.trials.session import Stopwatch


def main() -> None:
    """Run the episode and write the picture."""
    parser = argparse.ArgumentParser(prog="python -m research.crowd", description=__doc__)
    parser.add_argument("file", type=Path, metavar="FILE.png")
    parser.add_argument("--robots", type=int, default=64)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    settings = BoxPushingSettings(robots=options.robots)
    scenario = settings.build()
    hierarchy = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    learner = TDLambdaSettings(step_size=0.05, decision=DecisionSettings())
    team = Team(learner, scenario, hierarchy, policy_seed(options.seed))
    watch, steps = Stopwatch(), 0
    scenario.reset(world_seed(options.seed, 0), 0)
    recorder = EpisodeRecorder(scenario)
    for record in control_loop(scenario, team, episodes=1, steps=options.steps, seed=options.seed):
        recorder.add(record.transition)
        watch.add(record)
        steps += 1
    snapshot(recorder.recording(), steps, options.file)
    spent = ", ".join(f"{name} {1e3 * s / steps:.1f} ms" for name, s in watch.seconds.items())
    period = f"{1e3 * settings.period:.0f} ms"
    print(f"{len(scenario.agents)} agents, {steps} decisions of {period} each: {spent}")


if __name__ == "__main__":
    main()
