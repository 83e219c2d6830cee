"""Settings of agents that are functions: the ``[learner]`` table of a spec."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from ..learners.learner import CORE, TeamSettings

Unit = Annotated[str, Field(min_length=1)]
"""SI unit or currency; ``"1"`` for a pure number."""


class FunctionSettings(TeamSettings):
    """Agents that decide by a function; its keyword-only parameters are further keys."""

    uses_hierarchy = True
    kind_of_agents = f"{CORE}.functions.agents:FunctionAgents"

    hears: Literal["contents", "actions"] = "contents"
    """Whether agents receive actions with the contents that senders add, or actions only."""
    costs: Mapping[str, Unit] = {}
    """Costs that the function reports, with their units: ``{tokens = "1", price = "EUR"}``."""
