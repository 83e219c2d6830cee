"""What steering limits: success by where the goal lies at first: ``python -m research.steering``.

Reads the committed rows of the scaling studies, rebuilds the worlds of their evaluation episodes,
and counts the successful ones by the *initial heading error*: the angle between the normal of the
face that the team stands at and the direction from the box to the goal. A second table counts those
within what pushing from one side can make good, and beyond it. Below them stands how the others
ended: the box was pushed too far away, or decisions ran out. No trial is run.

With ``--scripted 64 128`` the scripted controller plays such worlds of teams of these sizes, in as
many decisions as the trained teams had.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise, product
from statistics import median
from time import process_time

import numpy as np
from rich.console import Console
from rich.table import Table

import nested_agents as na
from nested_agents import BoxPushingSettings, rate
from nested_agents.analysis import format_estimate, format_number
from nested_agents.boxes import STARTS, wrap
from nested_agents.study import EVALUATION_WORLDS, world_seed
from research import RESULTS

from . import FloatArray, IntArray
from .scripted.controller import decisions_to_goal
from .scripted.crowd import CONE, LEVER

EDGES = (0.0, 10.0, 15.0, 20.0, 30.0, 50.0)
"""Of the bins of the initial heading error [deg]; medium starts have at most 50."""
TEAMS = (
    ("8", 8, "scaling", "evaluation", "8"),
    ("16", 16, "scaling", "evaluation", "16"),
    ("32", 32, "crowds", "evaluation", "32"),
    ("64, sixteen first", 64, "sixty-four", "evaluation", "64, sixteen first"),
    ("64, trained with 8", 64, "from-eight", "evaluation:sixty-four", "default"),
    ("64, wide box first", 64, "wide", "evaluation:sixty-four", "8, wide box"),
    ("64, no leader", 64, "leaders", "evaluation:64, no leader", "default"),
    ("64, leader by rule", 64, "leaders", "evaluation:64, rule", "default"),
    ("64, learned leader", 64, "leaders", "evaluation:64, learned", "default"),
    ("64, random leader", 64, "leaders", "evaluation:64, random", "default"),
    ("128, no leader", 128, "leaders-128-none", "evaluation:128, no leader", "default"),
    ("128, leader by rule", 128, "leaders-128", "evaluation:128, rule", "default"),
    ("128, learned leader", 128, "leaders-128", "evaluation:128, learned", "default"),
    ("128, trained with 8", 128, "from-eight-128", "evaluation:128", "default"),
)
"""A row's name, the number of robots, published results, and their phase and condition."""
STEPS = 450
"""Most decisions of an episode of the scripted controller."""


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


def one_sided(robots: int) -> float:
    """Return the greatest heading error that pushing from one side can make good [deg].

    Robots push obliquely, within the friction cone, and half of them turn the box: per meter by
    their lever over the square of its friction radius, of which half counts on the way. Both
    constants are the scripted controller's.
    """
    box = BoxPushingSettings(robots=robots).build().box
    turned = LEVER * box.width[1] / box.friction_radius**2 * STARTS["medium"].distance
    return float(np.degrees(CONE + turned / 2))


def sides(robots: int, name: str, phase: str, condition: str) -> list[str]:
    """Return that angle, and how many of how many episodes succeeded within it and beyond."""
    angle = one_sided(robots)
    return [f"{angle:.0f}", *trained(robots, name, phase, condition, (angle,))]


def trained(
    robots: int, name: str, phase: str, condition: str, between: Sequence[float] = EDGES[1:-1]
) -> list[str]:
    """Return by bin how many of how many episodes of published results succeeded."""
    results = na.load(RESULTS / f"{name}.json").results
    return counts(robots, results.seeds(condition), results.success(condition, phase), between)


def failures(name: str, phase: str, condition: str) -> str:
    """Return in words how episodes of published results ended that did not succeed."""
    results = na.load(RESULTS / f"{name}.json").results
    steps = results.values(condition, "steps", phase)
    failed = results.success(condition, phase) == 0
    away = steps[failed & (steps < results.step_limits[1])]
    words = f"{failed.sum()} failures, {len(away)} with the box too far from the goal"
    if len(away):
        words += f" (after {median(away.tolist()):.0f} decisions in the median)"
    return f"{words}, {failed.sum() - len(away)} out of decisions"


def scripted(robots: int, seeds: int, episodes: int) -> tuple[list[str], str]:
    """Return by bin how often the scripted controller succeeds, and in words what that took."""
    scenario, begun, taken = BoxPushingSettings(robots=robots).build(), process_time(), []
    for seed, k in product(range(seeds), range(episodes)):
        world = world_seed(seed, EVALUATION_WORLDS + k)
        taken.append(decisions_to_goal(scenario, world, STEPS))
    seconds = (process_time() - begun) / len(taken)
    successes = np.array([[steps is not None] for steps in taken], dtype=int)
    success, solved = rate(successes), [steps for steps in taken if steps is not None]
    typical = ""
    if solved:
        typical = f", {median(solved):.0f} decisions in the median, {max(solved)} at most"
    words = f"{robots} robots, scripted: {format_estimate(success)}{typical}"
    words += f"; {format_number(seconds)} s an episode"
    return counts(robots, range(seeds), successes.reshape(seeds, episodes)), words


def counts(
    robots: int, seeds: Iterable[int], successes: IntArray, between: Sequence[float] = EDGES[1:-1]
) -> list[str]:
    """Return by bin how many of how many episodes succeeded, of ``(n_seeds, n_episodes)``.

    Bins lie below, between and above the angles `between` [deg].
    """
    errors = [heading_errors(robots, seed, successes.shape[1]) for seed in seeds]
    which = np.digitize(errors, between)
    bins = [which == k for k in range(len(between) + 1)]
    return [f"{successes[own].sum():.0f} of {own.sum()}" for own in bins]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m research.steering", description=__doc__)
    parser.add_argument("--scripted", type=int, nargs="+", default=(), metavar="N", help="robots")
    parser.add_argument("--seeds", type=int, default=3, help="of its worlds")
    parser.add_argument("--episodes", type=int, default=10, help="of each seed")
    options = parser.parse_args()
    bins = [f"{low:.0f}-{high:.0f}" for low, high in pairwise(EDGES)]
    table = Table("robots", *bins, title="Successes by initial heading error \\[deg]")
    console = Console(width=80)
    for robots in options.scripted:
        cells, words = scripted(robots, options.seeds, options.episodes)
        table.add_row(f"{robots}, scripted", *cells)
        console.print(words, highlight=False, soft_wrap=True)
    for title, *of_results in TEAMS:
        table.add_row(title, *trained(*of_results))
    console.print(table)
    table = Table("robots", "one side \\[deg]", "within", "beyond", title="Successes by side")
    for title, *of_results in TEAMS:
        table.add_row(title, *sides(*of_results))
    console.print(table)
    for title, _, *of_results in TEAMS:
        console.print(f"{title}: {failures(*of_results)}", highlight=False, soft_wrap=True)


if __name__ == "__main__":
    main()
