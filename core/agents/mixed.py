"""Teams of several kinds of agents: who is of which, as settings of a learner.

Every part of a team has settings of its own. An agent is of the first part that names it, by its
name, its role, its body, or its level in the hierarchy (``level1`` is the first), or by a pattern
of these. Two parts may reach for an agent by a pattern, ``*`` for the rest, but only one may name
it. Values decide of agents of one part only: nobody knows the weights of another kind.
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
from ..plugins.registry import Plugged
from ..plugins.settings import Names, Settings
from .joint import body_of


class PartOfTeam(Settings):
    """Agents of a team that are of one kind."""

    agents: Names
    """Their names or patterns of these, roles, bodies, or levels (``level1``); one or a list."""
    learner: Annotated[TeamSettings, Plugged(LEARNERS)]
    """How they decide and learn: a table as that of a whole team."""
    team: str | None = None
    """A file ``.npz`` that `Team.save` wrote, whose weights they begin with; of a team of several
    kinds, those of the part in the same place. None: they have learned nothing."""


class MixedSettings(TeamSettings):
    """A team of several kinds of agents."""

    kind: Literal["mixed"] = "mixed"
    uses_hierarchy = True
    parts: Annotated[tuple[PartOfTeam, ...], Field(min_length=1)]
    """The parts; an agent is of the first one that names it."""

    @property
    def needs_prediction(self) -> bool:
        """Whether agents of a part act only in scenarios that predict."""
        return any(part.learner.needs_prediction for part in self.parts)

    @property
    def needs_rewards(self) -> bool:
        """Whether agents of a part decide by predicted rewards."""
        return any(part.learner.needs_rewards for part in self.parts)

    def members(self, scenario: Scenario, hierarchy: Hierarchy) -> list[MembersOf]:
        """Return the agents of every part.

        Raises
        ------
        ValueError
            If an agent is of no part or of two, or a part has no agents; one line.
        """
        names = _names_of(scenario, hierarchy)
        named = zip(scenario.agents, names, strict=True)
        part_of = [self._part_named(agent, own) for agent, own in named]
        if None in part_of:
            nobody = scenario.agents[part_of.index(None)]
            raise ValueError(f"learner.parts: nobody decides for agent {nobody!r}")
        known = ", ".join(dict.fromkeys(name for own in names for name in own))
        kinds = []
        for k, part in enumerate(self.parts):
            own = np.flatnonzero([other == k for other in part_of])
            if not len(own):
                raise ValueError(
                    f"learner.parts[{k}].agents = {list(part.agents)}: nobody is called so who is "
                    f"not of a part before, known: {known}"
                )
            kinds.append(MembersOf(own, part.learner, part.team))
        return kinds

    def _part_named(self, agent: str, names: Sequence[str]) -> int | None:
        """Return the part of an agent that is called by any of some names."""
        by_name = [k for k, part in enumerate(self.parts) if {*part.agents} & {*names}]
        if len(by_name) > 1:
            first, second = by_name[:2]
            raise ValueError(
                f"learner.parts[{second}].agents = {list(self.parts[second].agents)}: agent "
                f"{agent!r} is of learner.parts[{first}] already; a pattern such as '*' names "
                "those that are left"
            )
        for k, part in enumerate(self.parts):
            if any(fnmatchcase(name, pattern) for name in names for pattern in part.agents):
                return k
        return None


def _names_of(scenario: Scenario, hierarchy: Hierarchy) -> list[list[str]]:
    """Return by what every agent can be named: name, role, body, level."""
    levels = communication_levels(hierarchy)
    return [
        [name, role, body_of(name), f"level{level + 1}"]
        for name, role, level in zip(scenario.agents, scenario.roles, levels, strict=True)
    ]
