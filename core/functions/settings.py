"""The settings of agents that are functions, as they stand in the ``[learner]`` table of a spec."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from ..learners.learner import CORE, TeamSettings
from ..plugins.settings import Positive, unwritten

Unit = Annotated[str, Field(min_length=1)]
"""In words of the SI, or a currency; ``"1"`` for a pure number."""


class FunctionSettings(TeamSettings):
    """Agents that are a function of a user's; its own settings are keyword-only parameters."""

    uses_hierarchy = True
    kind_of_agents = f"{CORE}.functions.agents:FunctionAgents"

    hears: Literal["contents", "actions"] = "contents"
    """What an agent is told: actions with the contents that their senders add, or actions alone."""
    costs: Mapping[str, Unit] = {}
    """What the function says that an answer cost, with units: ``{tokens = "1", price = "EUR"}``."""
    timeout: Positive = 60.0
    """Longest time that an answer may take [s]."""
    calls_at_once: Annotated[int, Field(ge=1)] = 8
    """Most calls under way at a time, if the function is ``async``."""
    recorded: Annotated[bool, unwritten(False)] = False
    """Whether answers are kept with the study, so that nobody is asked the same again."""
