"""``nested-agents cost``: what hierarchies cost, by the paper's formulas and measured."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from .options import CORES, Figure, Jobs

MOST_AGENTS = 10_000
"""Of one row: its integers have some fifty thousand digits."""


def command(
    agents: str = "4",
    topology: tuple[str, ...] = ("chain",),
    rules: int = 5**7,
    actions: int = 4,
    iterations: int = 450,
    measured: bool = False,
    learning: bool = False,
    jobs: Jobs = CORES,
    format: Literal["table", "json", "csv", "latex"] = "table",
    plot: Figure = None,
) -> int:
    """Print the cost of hierarchies, by formula (Eq. 18-23) and, if asked, measured.

    Parameters
    ----------
    agents
        Number of agents, or a range: 4, 1:16, 2:64:2.
    topology
        One or more topologies as in a spec: chain teams tree:2 ...
    rules
        |S|, rules of one agent.
    actions
        |A|, actions of one agent.
    iterations
        L.
    measured
        Also count and time steps of the running system.
    learning
        Instead, let a chain and the single agent learn the same small task, for 1 to 3 agents, and
        print what they learn beside what they cost. Takes some minutes.
    jobs
        Worker processes, for --learning.
    format
        How to print it.
    plot
        A figure to write: SVG, PNG or PDF by suffix.
    """
    from inspect import signature

    from ....core.cost import Problem
    from ...cost.cost import MOST_OPERATIONS, cost_rows
    from ...cost.table import written
    from ...spec.errors import SpecError
    from ...workers.workers import check_jobs
    from ..display import say

    check_jobs(jobs)
    if learning:
        fixed = {
            "agents": agents, "topology": topology, "rules": rules, "actions": actions,
            "iterations": iterations, "measured": measured,
        }  # fmt: skip
        for name, given in fixed.items():
            if given != signature(command).parameters[name].default:
                raise SpecError(f"--{name}: is not for --learning, which measures a fixed task")
        return _learning(jobs, format, plot)
    try:
        problem = Problem(rules, actions, iterations)
        rows = list(cost_rows(topology, numbers(agents), problem, measured=measured))
        if plot is not None:
            from ...cost.figure import draw

            draw(rows, plot)
    except ValueError as error:
        raise SpecError(str(error)) from None
    print(written(rows, format))
    if measured and all(row.measured is None for row in rows):
        say(
            f"nothing was measured: every step would take more than {MOST_OPERATIONS:,} rule "
            "evaluations, about a second"
        )
    return 0


def _learning(jobs: int, format: str, plot: Path | None) -> int:
    from ...cost.single_agent import compare
    from ...cost.single_agent_report import draw, table
    from ...presentation.figures import check_suffix
    from ...spec.errors import SpecError

    if format != "table":
        raise SpecError(f"--format {format}: with --learning, allowed: table")
    if plot is not None:
        try:
            check_suffix(plot)
        except ValueError as error:
            raise SpecError(str(error)) from None
    contests = compare(jobs=jobs)
    if plot is not None:
        draw(contests, plot)
    print(table(contests))
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
        found = range(first, last + 1, *parts[2:])
    except (ValueError, TypeError):
        found = range(0)
    if not found or found[0] < 1 or found[-1] > MOST_AGENTS:
        raise ValueError(
            f"agents = {text!r}, allowed: 4, 1:16 or 2:64:2, from 1 to {MOST_AGENTS:,}"
        )
    return found
