"""Pictures of hierarchies with agents colored by the cost of their loss."""

from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from ...topologies.drawing import picture
from ..results.notation import format_number
from ..results.results import row_means
from .analysis import Resilience, TeamLosses

COLORS = "Reds"
"""Color map; white means that a loss costs nothing."""


def draw(analysis: Resilience) -> dict[str, Figure]:
    """Return a picture of the hierarchy of each condition.

    An agent with several units that can be lost has the color of the one that costs most.
    """
    return {own.condition: _picture(analysis, own) for own in analysis.teams}


def _picture(analysis: Resilience, own: TeamLosses) -> Figure:
    intact = row_means(own.intact)
    costs = [0.0] * len(own.hierarchy)
    for units in own.by_number[1]:
        agent = own.agents[units[0]]
        cost = float((intact - row_means(own.lost[units])).mean())
        costs[agent] = max(costs[agent], cost)
    shares = [min(1.0, cost / own.intact_mean) for cost in costs]
    return picture(
        own.hierarchy,
        title=own.condition,
        fills=[to_hex(colormaps[COLORS](share)) for share in shares],
        note=f"red: {analysis.title} that the loss of the agent costs, from 0 (white) to "
        f"{format_number(own.intact_mean)} (darkest)",
    )
