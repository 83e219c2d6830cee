"""``nested-agents cost``: what hierarchies cost, by the paper's formulas and measured."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import options

if TYPE_CHECKING:
    from ...cost.table import Form

MOST_AGENTS = 10_000
"""Of one row: its integers have some fifty thousand digits."""
RANGE = re.compile(r"(\d{1,6})(?::(\d{1,6})(?::(\*?)(\d{1,6}))?)?", re.ASCII)
"""From, to, and what is added or multiplied from one number to the next."""


@click.command()
@click.option(
    "--agents",
    metavar="N|RANGE,...",
    default="4",
    help="Numbers of agents and ranges: 4,8,16, 1:16, 2:64:2 (every second), 4:64:*2 (doubled).",
)
@click.option(
    "--topology",
    multiple=True,
    metavar="SPEC...",
    default=("chain",),
    help="One or more topologies as in a spec: chain teams tree:2 ..., or LABEL=SPEC with a label "
    "of your own; single-agent: Eq. 23; or ways to decide: best-response, max-plus, fitted-q, "
    "hierarchy-ppo.",
)
@options.number("--rules", "N", 5**7, "|S|, rules of one agent.")
@options.number("--actions", "N", 4, "|A|, actions of one agent.")
@options.number("--iterations", "N", 450, "L, iterations (steps) of an epoch.")
@click.option("--measured/--no-measured", help="Also count and time steps of the running system.")
@click.option(
    "--repeats",
    type=int,
    metavar="N",
    help="Measure so often, each time with a new team; from 2 on times have an interval.",
)
@click.option(
    "--network/--no-network",
    help="Also count messages, and how long a decision waits for them at 1 and 10 ms each.",
)
@options.formats("table", "json", "csv", "latex")
@options.plot
def command(
    agents: str,
    topology: tuple[str, ...],
    measured: bool,
    repeats: int | None,
    network: bool,
    form: Form,
    plot: Path | None,
    **quantities: int,
) -> int:
    """Print the cost of hierarchies, by formula (Eq. 18-23) and, if asked, measured."""
    from ....core.agents.cost import Problem
    from ...cost.table import cost_table, written
    from ...errors import refused
    from ...presentation.progress import say

    with refused():
        problem, sizes = Problem(**quantities), numbers(agents)
        if measured := measured or repeats is not None:
            say("measuring, first compiling what is not: no steps of more than a second or so")
        often = 1 if repeats is None else repeats
        rows = cost_table(
            topology, sizes, problem, measured=measured, repeats=often, network=network
        ).rows
        if plot is not None:
            from ...cost.figure import draw

            draw(rows, plot)
    print(written(rows, form))
    return 0


def numbers(text: str) -> list[int]:
    """Return the numbers that a list of numbers and ranges names, both ends of each included.

    Examples
    --------
    >>> numbers("4,8,16"), numbers("1:3"), numbers("2:6:2"), numbers("4:64:*2")
    ([4, 8, 16], [1, 2, 3], [2, 4, 6], [4, 8, 16, 32, 64])
    """
    chosen: list[int] = []
    for part in text.split(","):
        match = RANGE.fullmatch(part.strip())
        first, last, times, step = match.groups("") if match else ("0", "", "", "")
        number, end, by = int(first), int(last or first), int(step or 1)
        if not 1 <= number <= end <= MOST_AGENTS or by < (2 if times else 1):
            raise ValueError(
                f"agents = {text!r}, allowed: 4, 4,8,16, 1:16, 2:64:2 or 4:64:*2, from 1 to "
                f"{MOST_AGENTS:,}"
            )
        while number <= end:
            chosen.append(number)
            number = number * by if times else number + by
    return list(dict.fromkeys(chosen))
