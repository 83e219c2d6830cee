"""``nested-agents cost``: what hierarchies cost, by the paper's formulas and measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import options

if TYPE_CHECKING:
    from ...cost.table import Form

MOST_AGENTS = 10_000
"""Of one row: its integers have some fifty thousand digits."""


@click.command()
@click.option(
    "--agents",
    metavar="N|RANGE",
    default="4",
    help="Number of agents, or a range: 4, 1:16, 2:64:2.",
)
@click.option(
    "--topology",
    multiple=True,
    metavar="SPEC...",
    default=("chain",),
    help="One or more topologies as in a spec: chain teams tree:2 ...; single-agent: Eq. 23.",
)
@click.option("--rules", type=int, metavar="N", default=5**7, help="|S|, rules of one agent.")
@click.option("--actions", type=int, metavar="N", default=4, help="|A|, actions of one agent.")
@click.option(
    "--iterations",
    type=int,
    metavar="N",
    default=450,
    help="L, iterations (steps) of an epoch.",
)
@click.option("--measured/--no-measured", help="Also count and time steps of the running system.")
@options.formats("table", "json", "csv", "latex")
@options.plot
def command(
    agents: str,
    topology: tuple[str, ...],
    rules: int,
    actions: int,
    iterations: int,
    measured: bool,
    form: Form,
    plot: Path | None,
) -> int:
    """Print the cost of hierarchies, by formula (Eq. 18-23) and, if asked, measured."""
    from ....core.agents.cost import Problem
    from ...api.costs import cost_table
    from ...cost.cost import MOST_OPERATIONS
    from ...cost.table import written
    from ...errors import SpecError
    from ...presentation.progress import say

    try:
        problem = Problem(rules, actions, iterations)
        rows = cost_table(topology, numbers(agents), problem, measured=measured).rows
        if plot is not None:
            from ...cost.figure import draw

            draw(rows, plot)
    except ValueError as error:
        raise SpecError(str(error)) from None
    print(written(rows, form))
    if measured and all(row.measured is None for row in rows):
        say(
            f"nothing was measured: every step would take more than {MOST_OPERATIONS:,} rule "
            "evaluations, about a second"
        )
    return 0


def numbers(text: str) -> range:
    """Return the numbers that ``"4"``, ``"1:16"`` (both ends included) or ``"2:64:2"`` name.

    Examples
    --------
    >>> list(numbers("4")), list(numbers("1:3")), list(numbers("2:6:2"))
    ([4], [1, 2, 3], [2, 4, 6])
    """
    try:
        parts = [int(part) for part in text.split(":")]
        first, last = parts[0], parts[min(1, len(parts) - 1)]
        chosen = range(first, last + 1, *parts[2:])
    except (ValueError, TypeError):
        chosen = range(0)
    if not chosen or chosen[0] < 1 or chosen[-1] > MOST_AGENTS:
        raise ValueError(
            f"agents = {text!r}, allowed: 4, 1:16 or 2:64:2, from 1 to {MOST_AGENTS:,}"
        )
    return chosen
