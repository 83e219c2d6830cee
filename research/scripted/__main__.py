"""How often the scripted controller solves box pushing: ``python -m research.scripted``.

Episodes of at most 200 decisions with two e-Pucks, unless said otherwise, on the worlds of seeds
0, 1, 2, ...; the table gives how many of them end at the goal, and the median number of decisions
of those.
"""

from __future__ import annotations

import argparse
from statistics import median

from rich.console import Console
from rich.table import Table

from nested_agents import BoxPushingSettings
from nested_agents.boxes import BOXES

from .controller import decisions_to_goal

STARTS = ("easy", "medium", "hard")
STEPS = 200


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m research.scripted", description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--boxes", nargs="+", default=list(BOXES), choices=BOXES, metavar="BOX")
    parser.add_argument("--starts", nargs="+", default=list(STARTS), choices=STARTS)
    parser.add_argument("--robots", type=int, default=2)
    options = parser.parse_args()
    table = Table("box", *options.starts)
    for box in options.boxes:
        cells = []
        for start in options.starts:
            scenario = BoxPushingSettings(box=box, start=start, robots=options.robots).build()
            taken = [decisions_to_goal(scenario, seed, STEPS) for seed in range(options.seeds)]
            solved = [steps for steps in taken if steps is not None]
            cells.append(f"{len(solved)} ({median(solved):.0f})" if solved else "0")
        table.add_row(box, *cells)
    console = Console(width=80)
    console.print(f"solved of {options.seeds}, in brackets the median number of decisions")
    console.print(table)


if __name__ == "__main__":
    main()
