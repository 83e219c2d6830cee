"""Teams of several kinds of agents: settings of the parts and their members.

Every part of a team has settings of its own. An agent belongs to the first part that lists it: by
its name, its role, its body, its level in the hierarchy (``level1`` is the first), or a pattern of
these. Several patterns may match an agent, such as ``*`` for the rest, but only one part may list
it without a pattern. Agents do not know the weights of other parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import communication_levels
from ..interface.scenario import Scenario
from ..learners import LEARNERS
from ..learners.learner import MembersOf, TeamSettings
from ..plugins.models import Plugged
from ..plugins.settings import Names, Settings
from .joint import body_of


class PartOfTeam(Settings):
    """Agents of one kind in a team."""

    agents: Names
    """Agents by name, role, body or level (``level1``), or a pattern of these; one or a list."""
    learner: Annotated[TeamSettings, Plugged(LEARNERS)]
    """Settings of the agents, like those of a whole team."""
    team: str | None = None
    """File ``.npz`` of `Team.save` with the initial weights of the agents; of a team with several
    parts, those of the part in the same position. By default the agents are untrained."""


class MixedSettings(TeamSettings):
    """A team of several kinds of agents."""

    kind: Literal["mixed"] = "mixed"
    uses_hierarchy = True
    parts: Annotated[tuple[PartOfTeam, ...], Field(min_length=1)]
    """The parts. An agent belongs to the first part that lists it."""

    @property
    def needs_prediction(self) -> bool:
        """Whether some part requires a scenario with a predictor."""
        return any(part.learner.needs_prediction for part in self.parts)

    @property
    def needs_rewards(self) -> bool:
        """Whether some part decides by predicted rewards."""
        return any(part.learner.needs_rewards for part in self.parts)

    def members(self, scenario: Scenario, hierarchy: Hierarchy) -> list[MembersOf]:
        """Return the agents of every part.

        Raises
        ------
        ValueError
            If an agent belongs to no part or to two, or a part has no agents; one line.
        """
        names = _names_of(scenario, hierarchy)
        named = zip(scenario.agents, names, strict=True)
        part_of = [self._part_named(agent, own) for agent, own in named]
        if None in part_of:
            agent = scenario.agents[part_of.index(None)]
            raise ValueError(f"learner.parts: agent {agent!r} belongs to no part")
        known = ", ".join(dict.fromkeys(name for own in names for name in own))
        kinds: list[MembersOf] = []
        for k, part in enumerate(self.parts):
            own = np.flatnonzero([other == k for other in part_of])
            if not len(own):
                raise ValueError(
                    f"learner.parts[{k}].agents = {list(part.agents)}: lists no agent that is not "
                    f"in an earlier part, known: {known}"
                )
            kinds.append((own, part.learner, part.team))
        return kinds

    def _part_named(self, agent: str, names: Sequence[str]) -> int | None:
        """Return the part of an agent by its names, or None."""
        by_name = [k for k, part in enumerate(self.parts) if {*part.agents} & {*names}]
        if len(by_name) > 1:
            first, second = by_name[:2]
            raise ValueError(
                f"learner.parts[{second}].agents = {list(self.parts[second].agents)}: agent "
                f"{agent!r} belongs to learner.parts[{first}] already; a pattern such as '*' lists "
                "the remaining agents"
            )
        for k, part in enumerate(self.parts):
            if any(fnmatchcase(name, pattern) for name in names for pattern in part.agents):
                return k
        return None


def _names_of(scenario: Scenario, hierarchy: Hierarchy) -> list[list[str]]:
    """Return the names of every agent: its own, its role, its body and its level."""
    levels = communication_levels(hierarchy)
    return [
        [name, role, body_of(name), f"level{level + 1}"]
        for name, role, level in zip(scenario.agents, scenario.roles, levels, strict=True)
    ]
