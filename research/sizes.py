"""At which sizes box pushing can be solved: ``python -m research.sizes``.

The scripted controller plays the worlds of seeds 0, 1, 2, ... with 2 to 64 e-Pucks and a square,
which grows with their number both ways or along its width, the task's distances being fixed or in
units of the box (``scaling``). The table gives the success rate with its Wilson interval, and the
median number of decisions of the episodes that end at the goal. An episode has at most 200
decisions, in units of the box 12 per robot if that is more, as the speed of robots does not grow.
"""

from __future__ import annotations

import argparse
from itertools import product
from statistics import median

from rich.console import Console
from rich.table import Table

from nested_agents import BoxPushingSettings, rate
from nested_agents.analysis import format_estimate
from nested_agents.boxes import BoxSettings

from .scripted.controller import decisions_to_goal

STARTS = ("easy", "medium")
SIZES = (2, 4, 8, 16, 32, 64)
SCALINGS = ("fixed", "similar")
SQUARE = ((0.0, 0.0), (0.2, 0.0), (0.2, 0.2), (0.0, 0.2))
BOXES = {"both ways": "square", "width": BoxSettings(vertices=SQUARE, grows="width")}
STEPS, STEPS_PER_ROBOT = 200, 12
"""Most decisions; in units of the box at least so many per robot."""


def solved(settings: BoxPushingSettings, seeds: int) -> str:
    """Return the success rate with its interval, and the median number of decisions."""
    scenario = settings.build()
    steps = STEPS
    if settings.scaling == "similar":
        steps = max(STEPS, STEPS_PER_ROBOT * settings.robots)
    taken = [decisions_to_goal(scenario, seed, steps) for seed in range(seeds)]
    success = rate([[steps is not None] for steps in taken])
    decisions = [steps for steps in taken if steps is not None]
    typical = f", {median(decisions):.0f}" if decisions else ""
    return f"{format_estimate(success)}{typical}"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m research.sizes", description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--robots", type=int, nargs="+", default=list(SIZES))
    parser.add_argument("--scalings", nargs="+", default=list(SCALINGS), choices=SCALINGS)
    parser.add_argument("--grows", nargs="+", default=list(BOXES), choices=BOXES)
    options = parser.parse_args()
    console = Console(width=100)
    for scaling, grows in product(options.scalings, options.grows):
        table = Table("robots", *STARTS, title=f"scaling {scaling}, box grows: {grows}")
        for robots in options.robots:
            cells = [
                solved(
                    BoxPushingSettings(
                        robots=robots, start=start, scaling=scaling, box=BOXES[grows]
                    ),
                    options.seeds,
                )
                for start in STARTS
            ]
            table.add_row(str(robots), *cells)
        console.print(table)


if __name__ == "__main__":
    main()
