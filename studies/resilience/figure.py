"""Pictures of hierarchies with agents colored by the cost of their loss."""

from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from ...topologies.drawing import picture
from ..results.notation import format_number
from .analysis import Resilience, TeamLosses

COLORS = "Reds"
"""Color map; white means that a loss costs nothing."""
DARKEST = 0.75
"""Share of the color map that is used, so that names stay legible."""


def draw(analysis: Resilience) -> dict[str, Figure]:
    """Return a picture of the hierarchy of each condition.

    An agent with several units that can be lost has the color of the one that costs most.
    """
    return {own.condition.replace("/", "-"): _picture(analysis, own) for own in analysis.teams}


def _picture(analysis: Resilience, own: TeamLosses) -> Figure:
    costs = [0.0] * len(own.team.hierarchy)
    units = own.team.units
    for difference in analysis.single[own.condition]:
        agent = own.team.agents[units.index(difference.condition)]
        costs[agent] = max(costs[agent], -float(difference.estimate.value))
    shares = [DARKEST * min(1.0, cost / own.intact_mean) for cost in costs]
    scale = format_number(own.intact_mean)
    return picture(
        own.team.hierarchy,
        title=own.condition,
        fills=[to_hex(colormaps[COLORS](share)) for share in shares],
        note=f"red: cost of the loss in {analysis.title}, white 0, darkest {scale}",
    )
