"""The cost of hierarchies as a table, by the paper's formulas and measured."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from ...core.agents.cost import Problem
from ..cost.cost import PAPER, CostRow, cost_rows
from ..cost.table import written

MOST_REPEATS = 1000
"""A repeat takes a third of a second or more."""


@dataclass(frozen=True)
class CostTable:
    """Costs, a row for every topology and number of agents; printed or shown by a notebook."""

    rows: tuple[CostRow, ...]
    """The costs as exact integers."""

    @property
    def csv(self) -> str:
        """The table as CSV, with every digit."""
        return written(self.rows, "csv")

    @property
    def latex(self) -> str:
        """The table for LaTeX, with the package booktabs."""
        return written(self.rows, "latex")

    def __str__(self) -> str:
        return written(self.rows, "table")

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def cost_table(
    topologies: Sequence[str] = ("chain",),
    agents: Iterable[int] = (4,),
    problem: Problem = PAPER,
    *,
    measured: bool = False,
    repeats: int = 1,
    network: bool = False,
) -> CostTable:
    """Return what hierarchies cost, by Eq. 18-23 and, if asked, measured.

    Parameters
    ----------
    topologies
        As in a spec, or ``label=topology`` with a label of one's own; ``single-agent``, or ways to
        decide: ``best-response``, ``max-plus``, ``fitted-q``, ``hierarchy-ppo``.
    agents
        Numbers of agents.
    problem
        Rules and actions of an agent, and steps of an episode; those of the paper unless given.
    measured
        Whether to count and time steps of the running system, too.
    repeats
        How often steps are timed, each with a new team; from two on the time has an interval.
    network
        Whether to count the messages of a decision, and how many of them follow one another.

    Raises
    ------
    ValueError
        If a topology or a number is refused; one line.
    """
    if not 1 <= repeats <= MOST_REPEATS:
        raise ValueError(f"repeats = {repeats}, allowed: 1 to {MOST_REPEATS}")
    times = repeats if measured else 0
    return CostTable(tuple(cost_rows(topologies, list(agents), problem, times, network)))
