"""What steering limits: success by where the goal lies at first: ``python -m benchmarks.steering``.

Reads the committed rows of the scaling studies, rebuilds the worlds of their evaluation episodes,
and counts the successful ones by the *initial heading error*: the angle between the normal of the
face that the team stands at and the direction from the box to the goal. No trial is run.
"""

from __future__ import annotations

import argparse
from functools import cache
from itertools import pairwise

import numpy as np
from rich.console import Console
from rich.table import Table

from nested_agents.core.agents.loop import world_seed
from nested_agents.core.numerics import FloatArray, wrap
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.studies.claims import claims
from nested_agents.studies.results import published
from nested_agents.studies.trials.session import EVALUATION_WORLDS

EDGES = (0.0, 10.0, 15.0, 20.0, 30.0, 50.0)
"""Of the bins of the initial heading error [deg]; medium starts have at most 50."""
TEAMS = (
    ("8", 8, "scaling", "evaluation", "8"),
    ("16", 16, "scaling", "evaluation", "16"),
    ("32", 32, "crowds", "evaluation", "32"),
    ("64, sixteen first", 64, "sixty-four", "evaluation", "64, sixteen first"),
    ("64, trained with 8", 64, "from-eight", "evaluation:sixty-four", "default"),
    ("64, wide box first", 64, "wide", "evaluation:sixty-four", "8, wide box"),
)
"""A row's name, the number of robots, published results, and their phase and condition."""


@cache
def heading_errors(robots: int, seed: int, episodes: int) -> FloatArray:
    """Return the absolute initial heading errors ``(episodes,)`` of evaluation worlds [deg]."""
    scenario = BoxPushingSettings(robots=robots).build()
    errors = []
    for episode in range(episodes):
        scenario.reset(world_seed(seed, EVALUATION_WORLDS + episode))
        situation = scenario.measure()
        box, goal = situation["box_pose"], situation["goal_pose"]
        course = np.arctan2(goal[1] - box[1], goal[0] - box[0])
        errors.append(abs(wrap(course - box[2])))
    return np.degrees(errors)


def counts(robots: int, name: str, phase: str, condition: str) -> list[str]:
    """Return by bin how many of how many episodes succeeded."""
    results = published.load(claims.PUBLISHED / f"{name}.json").results
    successes = results.success(condition, phase)
    errors = [heading_errors(robots, seed, successes.shape[1]) for seed in results.seeds(condition)]
    which = np.digitize(errors, EDGES[1:-1])
    return [
        f"{successes[which == k].sum():.0f} of {(which == k).sum()}" for k in range(len(EDGES) - 1)
    ]


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(prog="python -m benchmarks.steering", description=__doc__).parse_args()
    bins = [f"{low:.0f}-{high:.0f}" for low, high in pairwise(EDGES)]
    table = Table("robots", *bins, title="Successes by initial heading error [deg]")
    for title, robots, name, phase, condition in TEAMS:
        table.add_row(title, *counts(robots, name, phase, condition))
    Console(width=80).print(table)


if __name__ == "__main__":
    main()
